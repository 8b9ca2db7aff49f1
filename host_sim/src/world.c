#include "world.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "curve.h"
#include "fleet.h"
#include "gateway.h"
#include "memory.h"
#include "problems.h"
#include "progress.h"
#include "queue.h"
#include "setup.h"
#include "taper/membus.h"
#include "tracker.h"

/** A decrease pays for an increase in the next round; more than a few are not needed. */
#define HAND_OVER_ROUNDS 6
/** The longest curve takes some 1000. */
#define CURVE_ROUNDS 5000

typedef struct {
    const sim_case_t *run;
    sim_results_t *results;
    int64_t tick_s;
    taper_membus_t bus;
    taper_port_t port;       /**< the station's end of the bus */
    taper_port_t world_port; /**< the other end */
    uint32_t tick_ms;        /**< context of the policy */
    taper_policy_t policy;
    taper_station_t station;
    sim_fleet_t fleet;
    sim_gateway_t gateway;
    sim_curve_t curve;
    uint32_t curve_ms; /**< its clock, which counts rounds */
    sim_queue_t queue;
    uint64_t random;                        /**< state of next_random() */
    uint8_t turn[TAPER_MAX_CONNECTORS + 1]; /**< nodes in the order of sending; the last is the gateway */
    double group_kw[TAPER_MAX_GROUPS];
    uint32_t plans; /**< of the station, seen so far */
} world_t;

/** The splitmix64 generator. */
static uint64_t next_random(world_t *world) {
    world->random += UINT64_C(0x9E3779B97F4A7C15);
    uint64_t z = world->random;
    z = (z ^ (z >> 30)) * UINT64_C(0xBF58476D1CE4E5B9);
    z = (z ^ (z >> 27)) * UINT64_C(0x94D049BB133111EB);
    return z ^ (z >> 31);
}

static uint32_t clock_us(void *context) {
    (void)context;
    return (uint32_t)sim_now_us();
}

/** @return whether the station takes its description and options. */
static bool init_station(world_t *world) {
    const sim_case_t *run = world->run;
    world->port = taper_membus_station_port(&world->bus);
    world->port.clock_us = clock_us;
    world->tick_ms = run->station->tick_ms;
    world->policy = (taper_policy_t){.propose = run->policy->propose, .context = &world->tick_ms};
    const bool plans = run->policy->propose == NULL;
    const taper_station_options_t options = {
        .config = run->station,
        .port = &world->port,
        .solver = plans ? run->solver : NULL,
        .policy = plans ? NULL : &world->policy,
        .iterations_per_tick = taper_setup_iterations(run->station->tick_ms),
    };
    return taper_station_init(&world->station, &options) == TAPER_OK;
}

/** Every node sends what it has to say, in an order that the seed decides anew for each tick. */
static bool send_reports(world_t *world, int64_t now_s) {
    const unsigned connectors = world->run->station->connector_count;
    bool sent = true;
    for (unsigned left = connectors + 1; left > 0; left--) {
        const unsigned pick = (unsigned)(next_random(world) % left);
        const uint8_t node = world->turn[pick];
        world->turn[pick] = world->turn[left - 1];
        world->turn[left - 1] = node;
        const bool ok = node == connectors ? sim_gateway_report(&world->gateway, now_s)
                                           : sim_fleet_report(&world->fleet, node);
        sent = sent && ok;
    }
    return sent && world->bus.to_station.overflows == 0;
}

/** The vehicles take what they may, and it is all written down. */
static void draw_power(world_t *world, int64_t now_s) {
    sim_results_t *results = world->results;
    double connector_kw[TAPER_MAX_CONNECTORS];
    unsigned active = 0;
    for (unsigned i = 0; i < world->run->station->connector_count; i++) {
        const sim_evse_t *evse = &world->fleet.evse[i];
        sim_fleet_draw(&world->fleet, i, (double)now_s);
        connector_kw[i] = evse->power_kw;
        if (evse->vehicle != NULL) {
            active += sim_evse_wants(evse) ? 1 : 0;
            sim_results_connector(results, now_s, i, evse);
        }
    }
    const double limit_kw = sim_gateway_limit_kw(&world->gateway, now_s);
    const double excess_kw =
        sim_groups_excess_kw(world->run->station, connector_kw, limit_kw, world->group_kw);
    results->violation_ticks += excess_kw > 0.0 ? 1 : 0;
    sim_results_step(results, now_s, limit_kw, world->group_kw[0], active,
                     taper_station_mode(&world->station));
    for (unsigned i = 0; i < world->run->station->connector_count; i++) {
        sim_fleet_charge(&world->fleet, i, (double)now_s);
    }
}

/** Take note of a solve that the station finished in this tick. */
static void note_solve(world_t *world) {
    const taper_station_t *station = &world->station;
    const uint32_t plans = taper_station_counter(station, TAPER_COUNTER_PLANS);
    if (plans == world->plans) {
        return;
    }
    world->plans = plans;
    sim_samples_add(&world->results->iterations, taper_planner_iterations(&station->planner));
    sim_samples_add(&world->results->solve_ms, station->last_solve_us / 1000.0);
    if (world->run->problems != NULL &&
        station->plan_made_ms == station->snapshot.now_ms) { // else: older snapshot
        sim_problems_add(world->run->problems, station);
    }
}

/**
 * What one connector gives up reaches another: setpoints out, echoes in, until nobody waits any more. On a real bus that
 * takes less than a second; here no time passes.
 */
static bool hand_over(world_t *world, uint32_t now_ms) {
    bool sent = true;
    for (unsigned round = 0; round < HAND_OVER_ROUNDS && taper_station_hands_over(&world->station); round++) {
        for (unsigned i = 0; i < world->run->station->connector_count; i++) {
            sent = sim_fleet_echo(&world->fleet, i) && sent;
        }
        taper_station_poll(&world->station, now_ms);
        sim_fleet_hear(&world->fleet);
    }
    return sent;
}

/** Frames go to the gateway, or to their connectors. */
static void pass_on_frames(world_t *world) {
    taper_frame_t frame;
    while (taper_membus_world_receive(&world->bus, &frame)) {
        if (!sim_curve_take(&world->curve, &frame, world->curve_ms)) {
            sim_fleet_take(&world->fleet, &frame);
        }
    }
}

/**
 * The gateway tells the course of the limit, if it is due. For the station no time passes; the gateway takes a round for a
 * millisecond, and so keeps the gap between frames that the station asks for.
 * @return whether the station knows it now.
 */
static bool tell_curve(world_t *world, int64_t now_s, uint32_t now_ms) {
    taper_frame_t frame;
    for (unsigned round = 0; round < CURVE_ROUNDS && !sim_curve_is_settled(&world->curve, (double)now_s);
         round++) {
        world->curve_ms++;
        if (sim_curve_next(&world->curve, (double)now_s, world->curve_ms, &frame) &&
            taper_membus_world_send(&world->bus, &frame)) {
            sim_curve_sent(&world->curve, world->curve_ms);
            taper_station_poll(&world->station, now_ms); // it never speaks unless it is spoken to
            pass_on_frames(world);
        }
    }
    return sim_curve_is_settled(&world->curve, (double)now_s);
}

static bool run_tick(world_t *world, int64_t now_s) {
    const uint32_t now_ms = (uint32_t)((uint64_t)now_s * 1000U);
    taper_membus_set_time(&world->bus, now_ms);
    sim_queue_advance(&world->queue, now_s);
    const bool reported = send_reports(world, now_s);
    sim_fleet_begin(&world->fleet);
    if (!reported || !tell_curve(world, now_s, now_ms)) {
        fprintf(stderr,
                "taper-sim: internal error at %lld s: the station or the bus refused what it was sent\n",
                (long long)now_s);
        return false;
    }
    taper_station_step(&world->station, now_ms);
    note_solve(world);
    sim_fleet_hear(&world->fleet);
    if (!hand_over(world, now_ms)) {
        return false;
    }
    draw_power(world, now_s);
    return true;
}

static bool run_ticks(world_t *world) {
    const sim_sessions_t *sessions = world->run->sessions;
    double first_s = INFINITY;
    double end_s = 0.0;
    for (size_t i = 0; i < sessions->count; i++) {
        first_s = fmin(first_s, sessions->session[i].arrival_s);
        end_s = fmax(end_s, sessions->session[i].departure_s);
    }
    const int64_t start_s = sessions->count == 0 ? 0 : (int64_t)first_s / world->tick_s * world->tick_s;
    const int64_t duration_s = (int64_t)ceil(end_s) - start_s;
    sim_progress_t progress;
    sim_progress_init(&progress);
    bool good = true;
    for (int64_t now_s = start_s; good && (double)now_s < end_s; now_s += world->tick_s) {
        sim_progress_show(&progress, now_s - start_s, duration_s);
        good = run_tick(world, now_s);
    }
    sim_progress_end(&progress);
    return good;
}

bool sim_world_run(const sim_case_t *run, sim_results_t *results) {
    world_t *world = sim_allocate(1, sizeof *world);
    world->run = run;
    world->results = results;
    world->tick_s = run->station->tick_ms / 1000;
    world->random = run->seed;
    for (unsigned i = 0; i <= run->station->connector_count; i++) {
        world->turn[i] = (uint8_t)i;
    }
    taper_membus_init(&world->bus);
    world->world_port = taper_membus_world_port(&world->bus);
    sim_fleet_init(&world->fleet, run->station, &world->world_port, run->policy->tells_taper, run->seed);
    sim_gateway_init(&world->gateway, run->limits, &world->world_port, world->tick_s, run->seed);
    sim_curve_init(&world->curve, run->limits);
    sim_queue_init(&world->queue, run->sessions, world->fleet.evse, run->station->connector_count,
                   results->outcome);
    bool good = init_station(world);
    if (good) {
        if (run->problems != NULL) {
            sim_problems_begin(run->problems, &world->station);
        }
        good = run_ticks(world);
    } else {
        fprintf(stderr, "taper-sim: the firmware refuses station %s with these options\n",
                run->station->name);
    }
    sim_queue_finish(&world->queue);
    results->solves = taper_station_counter(&world->station, TAPER_COUNTER_PLANS);
    results->fallback_ticks = taper_station_counter(&world->station, TAPER_COUNTER_FALLBACK_TICKS);
    results->guard_violations = taper_station_counter(&world->station, TAPER_COUNTER_GUARD_VIOLATIONS);
    sim_queue_free(&world->queue);
    free(world);
    return good;
}
