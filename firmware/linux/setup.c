#include "setup.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "taper/stations.h"

/** A tick that stands for so much time has room for a whole solve; shorter ones work in slices. */
#define LONG_TICK_ms     10000U
#define SLICE_ITERATIONS 50

taper_setup_t taper_setup_default(unsigned station) {
    return (taper_setup_t){.station = station, .limit_kw = -1.0, .failsafe_kw = -1.0, .time_scale = 1};
}

uint16_t taper_setup_iterations(uint32_t tick_ms) {
    return tick_ms >= LONG_TICK_ms ? TAPER_MAX_ITERATIONS : SLICE_ITERATIONS;
}

unsigned taper_setup_buses(const taper_station_config_t *station) {
    unsigned buses = 0;
    for (unsigned i = 0; i < station->connector_count; i++) {
        buses = station->connectors[i].bus >= buses ? station->connectors[i].bus + 1U : buses;
    }
    return buses;
}

/** Lower `*limit_W` to `kw`, if that was given. @return false: it would be raised. */
static bool lower(int32_t *limit_W, double kw) {
    const double own_kw = *limit_W / 1000.0;
    if (kw > own_kw) {
        return false;
    }
    if (kw >= 0.0) {
        *limit_W = (int32_t)lround(kw * 1000.0);
    }
    return true;
}

static bool set_limits(const taper_setup_t *setup, taper_made_t *made, char *reason, size_t reason_size) {
    const taper_station_config_t *station = taper_stations[setup->station];
    if (!lower(&made->groups[0].limit_W, setup->limit_kw)) {
        (void)snprintf(reason, reason_size, "--limit-kw: above the own limit of station %s, %g kW",
                       station->name, station->groups[0].limit_W / 1000.0);
        return false;
    }
    if (!lower(&made->config.failsafe_W, setup->failsafe_kw)) {
        (void)snprintf(reason, reason_size,
                       "--failsafe-kw: above the own failsafe limit of station %s, %g kW", station->name,
                       station->failsafe_W / 1000.0);
        return false;
    }
    made->config.failsafe_W = taper_min_i32(made->config.failsafe_W, made->groups[0].limit_W);
    return true;
}

bool taper_setup_make(const taper_setup_t *setup, taper_made_t *made, char *reason, size_t reason_size) {
    const taper_station_config_t *station = taper_stations[setup->station];
    memset(made, 0, sizeof *made);
    made->config = *station;
    memcpy(made->groups, station->groups, station->group_count * sizeof made->groups[0]);
    made->config.groups = made->groups;
    made->tick_ms = setup->tick_ms > 0 ? setup->tick_ms : station->tick_ms;
    made->config.tick_ms = made->tick_ms * setup->time_scale;
    made->options.config = &made->config;
    made->options.solver = setup->no_planner ? NULL : taper_setup_solver(setup->station);
    made->options.time_scale = setup->time_scale;
    made->options.iterations_per_tick =
        setup->iterations > 0 ? setup->iterations : taper_setup_iterations(made->config.tick_ms);
    return set_limits(setup, made, reason, reason_size);
}

uint64_t taper_setup_next_ms(uint64_t time_ms, uint32_t tick_ms) {
    const uint64_t tick = (time_ms / tick_ms + 1) * tick_ms;
    const uint64_t began = time_ms / tick_ms * tick_ms;
    const uint64_t poll = began + ((time_ms - began) / TAPER_SETUP_POLL_ms + 1) * TAPER_SETUP_POLL_ms;
    return poll < tick ? poll : tick;
}
