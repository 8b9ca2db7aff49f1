#include "station_local.h"

#include <stdio.h>
#include <stdlib.h>

#include "memory.h"
#include "progress.h"
#include "taper/membus.h"

typedef struct {
    sim_link_t link;
    taper_membus_t bus;
    taper_port_t port; /**< the station's end of the bus */
    uint32_t tick_ms;  /**< context of the policy */
    taper_policy_t policy;
    taper_station_t station;
} local_t;

static uint32_t clock_us(void *context) {
    (void)context;
    return (uint32_t)sim_now_us();
}

static bool start(sim_link_t *link, const sim_station_setup_t *setup) {
    local_t *local = (local_t *)link;
    const bool plans = setup->policy->propose == NULL;
    local->tick_ms = setup->config->tick_ms;
    local->policy = (taper_policy_t){.propose = setup->policy->propose, .context = &local->tick_ms};
    const taper_station_options_t options = {
        .config = setup->config,
        .port = &local->port,
        .solver = plans ? setup->solver : NULL,
        .policy = plans ? NULL : &local->policy,
        .iterations_per_tick = setup->iterations_per_tick,
    };
    if (taper_station_init(&local->station, &options) != TAPER_OK) {
        fprintf(stderr, "taper-sim: the firmware refuses station %s with these options\n",
                setup->config->name);
        return false;
    }
    return true;
}

static void set_time(sim_link_t *link, uint32_t now_ms) {
    taper_membus_set_time(&((local_t *)link)->bus, now_ms);
}

static bool note_state(local_t *local) {
    sim_station_state_t *state = &local->link.state;
    state->is_settled = taper_station_is_settled(&local->station);
    state->mode = taper_station_mode(&local->station);
    state->plans = taper_station_counter(&local->station, TAPER_COUNTER_PLANS);
    return true;
}

static bool step(sim_link_t *link, uint32_t now_ms) {
    taper_station_step(&((local_t *)link)->station, now_ms);
    return note_state((local_t *)link);
}

static bool poll(sim_link_t *link, uint32_t now_ms) {
    taper_station_poll(&((local_t *)link)->station, now_ms);
    return note_state((local_t *)link);
}

static bool solve(sim_link_t *link, sim_solve_t *finished) {
    const taper_station_t *station = &((local_t *)link)->station;
    finished->iterations = taper_planner_iterations(&station->planner);
    finished->solve_ms = station->last_solve_us / 1000.0;
    return true;
}

static bool look(sim_link_t *link, const bool wanted[TAPER_MAX_CONNECTORS],
                 taper_outlook_t outlook[TAPER_MAX_CONNECTORS]) {
    const taper_station_t *station = &((local_t *)link)->station;
    for (unsigned i = 0; i < station->options.config->connector_count; i++) {
        if (wanted[i]) {
            outlook[i] = taper_station_outlook(station, (uint8_t)i);
        }
    }
    return true;
}

static bool counter(sim_link_t *link, taper_counter_t which, uint32_t *value) {
    *value = taper_station_counter(&((local_t *)link)->station, which);
    return true;
}

static bool hardware(sim_link_t *link, sim_hardware_t *none) {
    (void)link;
    *none = (sim_hardware_t){.known = false};
    return true;
}

static bool is_overrun(const sim_link_t *link) {
    return ((const local_t *)link)->bus.to_station.overflows != 0;
}

static void close_link(sim_link_t *link) {
    free(link);
}

sim_link_t *sim_station_local(void) {
    static const sim_link_calls_t calls = {.start = start,
                                           .set_time = set_time,
                                           .step = step,
                                           .poll = poll,
                                           .solve = solve,
                                           .look = look,
                                           .counter = counter,
                                           .hardware = hardware,
                                           .is_overrun = is_overrun,
                                           .close = close_link};
    local_t *local = sim_allocate(1, sizeof *local);
    taper_membus_init(&local->bus);
    local->port = taper_membus_station_port(&local->bus);
    local->port.clock_us = clock_us;
    local->link = (sim_link_t){
        .calls = &calls, .port = taper_membus_world_port(&local->bus), .station = &local->station};
    return &local->link;
}
