/**
 * A station and the simulated field on a bus in memory, in virtual milliseconds: control ticks of the station's own period,
 * and a poll of everything each 20 ms. Any node can be killed and brought back.
 */
#ifndef TAPER_TEST_LIVE_BENCH_H
#define TAPER_TEST_LIVE_BENCH_H

#include "field.h"
#include "taper/membus.h"
#include "taper/station.h"

#define LIVE_POLL_ms  20u
#define LIVE_SESSIONS 64u
/** World time at the start [s]: a multiple of a minute. */
#define LIVE_START_S 600000.0

typedef struct {
    const char *station;                 /**< NULL: hub */
    const taper_solver_t *solver;        /**< NULL: none, earliest deadline first */
    const taper_policy_t *policy;        /**< NULL: the solver's plan */
    double limit_kw;                     /**< told by the gateway; negative: none. Not used with `limits` */
    const sim_course_t *limits;          /**< NULL: `limit_kw` always */
    uint32_t time_scale;                 /**< of station and field; 0 is 1 */
    uint32_t vehicle_delay_ms, grace_ms; /**< as in sim_field_options_t */
    bool no_gateway;
    bool
        as_described; /**< setpoints move, vehicles react and fall back as the station describes; else freely */
    uint64_t seed;
} live_options_t;

typedef struct {
    taper_station_config_t config; /**< its tick counts in the world's time */
    taper_station_options_t station_options;
    taper_station_t station;
    bool station_dead;
    taper_membus_t bus;
    taper_port_t station_port, world_port;
    sim_field_t field;
    sim_session_t session[LIVE_SESSIONS];
    sim_sessions_t sessions;
    sim_outcome_t outcome[LIVE_SESSIONS];
    sim_course_t constant_limit;
    uint32_t now_ms;
    uint32_t
        next_tick_ms; /**< of the station: a second of the bus for the stations here, whatever the time scale */
    double drawn_kwh; /**< integral of the power of all connectors, in the world's time */
} live_bench_t;

extern live_bench_t live;

/** Options for the hub under `limit_kw`, without a solver. */
live_options_t live_options(double limit_kw);

/** A vehicle that comes `after_s` from the start and stays a day: 80 kWh, from 20 % to 90 %, 11 kW, no taper. */
sim_session_t live_vehicle(double after_s);

/** A fresh station, field and bus. The sessions are copied. What an earlier start took is freed. */
void live_bench_start(const live_options_t *options, const sim_session_t *sessions, size_t count);

/** Let time pass, a multiple of LIVE_POLL_ms. */
void live_bench_run_ms(uint32_t ms);

/** The station is gone: it hears and says nothing. Then a fresh one takes its place, with the store of the old one. */
void live_bench_kill_station(void);
void live_bench_revive_station(void);

/** Free what the last start took. */
void live_bench_end(void);

#endif
