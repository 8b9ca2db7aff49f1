#include "live_bench.h"

#include <string.h>

#include "scene.h"
#include "taper/stations.h"
#include "unity.h"

#define DAY_S 86400.0

live_bench_t live;

static const taper_station_config_t *find_station(const char *name) {
    for (unsigned k = 0; k < taper_station_count; k++) {
        if (strcmp(taper_stations[k]->name, name) == 0) {
            return taper_stations[k];
        }
    }
    TEST_FAIL_MESSAGE("no such station");
    return NULL;
}

live_options_t live_options(double limit_kw) {
    return (live_options_t){.limit_kw = limit_kw};
}

sim_session_t live_vehicle(double after_s) {
    const double arrival_s = LIVE_START_S + after_s;
    return (sim_session_t){.id = "live",
                           .arrival_s = arrival_s,
                           .departure_s = arrival_s + DAY_S,
                           .told_s = arrival_s + DAY_S,
                           .battery_kwh = 80.0,
                           .soc_arrival = 0.2,
                           .soc_target = 0.9,
                           .max_kw = 11.0,
                           .taper_kw = 0.0};
}

static void start_station(void) {
    TEST_ASSERT_EQUAL(TAPER_OK, taper_station_init(&live.station, &live.station_options));
    live.next_tick_ms = live.now_ms;
    live.station_dead = false;
}

static const sim_course_t *choose_limits(const live_options_t *options) {
    if (options->limits != NULL) {
        return options->limits;
    }
    if (options->limit_kw < 0.0) {
        return NULL;
    }
    sim_course_constant(&live.constant_limit, options->limit_kw);
    return &live.constant_limit;
}

void live_bench_start(const live_options_t *options, const sim_session_t *sessions, size_t count) {
    TEST_ASSERT_LESS_OR_EQUAL_UINT32(LIVE_SESSIONS, (uint32_t)count);
    live_bench_end();
    memset(&live, 0, sizeof live);
    const uint32_t scale = options->time_scale == 0 ? 1 : options->time_scale;
    const taper_station_config_t *described =
        find_station(options->station == NULL ? "hub" : options->station);
    live.config = *(options->as_described ? described : scene_free_moving(described));
    live.config.tick_ms *= scale;
    live.now_ms = 1000;
    memcpy(live.session, sessions, count * sizeof sessions[0]);
    live.sessions = (sim_sessions_t){.session = live.session, .count = count};
    taper_membus_init(&live.bus);
    live.station_port = taper_membus_station_port(&live.bus);
    live.world_port = taper_membus_world_port(&live.bus);
    live.station_options = (taper_station_options_t){.config = &live.config,
                                                     .port = &live.station_port,
                                                     .solver = options->solver,
                                                     .policy = options->policy,
                                                     .iterations_per_tick = 50,
                                                     .time_scale = (uint16_t)scale};
    start_station();
    const sim_field_options_t field = {.station = &live.config,
                                       .port = &live.world_port,
                                       .sessions = &live.sessions,
                                       .outcome = live.outcome,
                                       .limits = choose_limits(options),
                                       .world_start_s = LIVE_START_S,
                                       .time_scale = scale,
                                       .vehicle_delay_ms = options->vehicle_delay_ms,
                                       .grace_ms = options->grace_ms,
                                       .tells_taper = true,
                                       .no_gateway = options->no_gateway,
                                       .seed = options->seed};
    sim_field_init(&live.field, &field, live.now_ms);
}

void live_bench_end(void) {
    sim_field_free(&live.field);
    sim_course_free(&live.constant_limit);
}

/** Frames to a station that is not there reach nobody. */
static void drop_frames(void) {
    taper_frame_t frame;
    while (live.station_port.receive(live.station_port.context, &frame)) {
    }
}

static void tend_station(void) {
    if (live.station_dead) {
        drop_frames();
    } else if (taper_time_reached(live.now_ms, live.next_tick_ms)) {
        taper_station_step(&live.station, live.now_ms);
        live.next_tick_ms += live.config.tick_ms / live.field.options.time_scale;
    } else {
        taper_station_poll(&live.station, live.now_ms);
    }
}

static double power_kw(void) {
    double sum_kw = 0.0;
    for (unsigned i = 0; i < live.config.connector_count; i++) {
        sum_kw += live.field.evse[i].power_kw;
    }
    return sum_kw;
}

void live_bench_run_ms(uint32_t ms) {
    for (uint32_t passed = 0; passed < ms; passed += LIVE_POLL_ms) {
        taper_membus_set_time(&live.bus, live.now_ms);
        tend_station();
        sim_field_poll(&live.field, live.now_ms);
        live.drawn_kwh += power_kw() * live.field.options.time_scale * LIVE_POLL_ms / 3.6e6;
        live.now_ms += LIVE_POLL_ms;
    }
}

void live_bench_kill_station(void) {
    live.station_dead = true;
}

void live_bench_revive_station(void) {
    start_station();
}
