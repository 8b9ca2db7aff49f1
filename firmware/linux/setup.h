/**
 * From what a user asks for to what the station is given. Daemon and replay share it, so that both run the same station.
 */
#ifndef TAPER_LINUX_SETUP_H
#define TAPER_LINUX_SETUP_H

#include <stddef.h>

#include "taper/station.h"

/** Range of the control tick on the bus [ms]: connectors give the station up after 3 s without CTRL_STATUS. */
#define TAPER_SETUP_TICK_MIN_ms 20
#define TAPER_SETUP_TICK_MAX_ms 1000
/** Polls between two ticks are this far apart [ms]. */
#define TAPER_SETUP_POLL_ms 20
/** taper_station_stop() is called so often, so far apart. */
#define TAPER_SETUP_STOPS   3
#define TAPER_SETUP_STOP_ms 50

/** What was asked for. */
typedef struct {
    unsigned station;    /**< index in taper_stations[] */
    double limit_kw;     /**< negative: the station's own */
    double failsafe_kw;  /**< negative: the station's own */
    uint32_t tick_ms;    /**< control tick on the bus; 0: the station's own */
    uint16_t time_scale; /**< 1: real time */
    uint16_t iterations; /**< solver iterations in a tick; 0: taper_setup_iterations() */
    bool no_planner;
} taper_setup_t;

/** What the station is made of. `options.config` points into it: it must stay where it is; `options.port` is left open. */
typedef struct {
    taper_station_config_t config;
    taper_group_config_t groups[TAPER_MAX_GROUPS];
    taper_station_options_t options;
    uint32_t tick_ms; /**< of the bus */
} taper_made_t;

/** Nothing but the station: all its own values, in real time. */
taper_setup_t taper_setup_default(unsigned station);

/** @return false, with the offending option and why in `reason`, if the setup contradicts the station. */
bool taper_setup_make(const taper_setup_t *setup, taper_made_t *made, char *reason, size_t reason_size);

/** Solver iterations in a tick that stands for `tick_ms` of the planner's time: long ticks have room for a whole solve. */
uint16_t taper_setup_iterations(uint32_t tick_ms);

/** CAN buses of a station. */
unsigned taper_setup_buses(const taper_station_config_t *station);

/** The generated solver of taper_stations[station]; NULL in a build without the planner. */
const taper_solver_t *taper_setup_solver(unsigned station);

/** The poll or tick after that at `time_ms`, on the grid of `tick_ms` that begins at 0. */
uint64_t taper_setup_next_ms(uint64_t time_ms, uint32_t tick_ms);

#endif
