/**
 * The station: the whole pipeline behind one call.
 *
 *     static taper_station_t station;                       // the caller owns the memory, all of it
 *     taper_station_init(&station, &options);
 *     for (;;) taper_station_step(&station, now_ms());      // once per control tick
 *
 * A step drains the receive queue, takes a snapshot, lets the planner work one slice, chooses a proposal, bounds it by
 * every hard limit, and sends one setpoint to every connector. It never blocks and never allocates.
 */
#ifndef TAPER_STATION_H
#define TAPER_STATION_H

#include "taper/allocator.h"
#include "taper/e2e.h"
#include "taper/event.h"
#include "taper/fallback.h"
#include "taper/limits.h"
#include "taper/planner.h"
#include "taper/port.h"
#include "taper/session.h"
#include "taper/supervisor.h"
#include "taper/types.h"

/** Protected frames a connector sends: EVSE_STATUS, EV_STATUS, EVSE_ELEC, EV_PARAM_A..D. */
#define TAPER_FRAMES_PER_CONNECTOR 7

/** A policy that takes the planner's place: what the allocator gets in mode PLAN. */
typedef struct {
    void (*propose)(void *context, const taper_snapshot_t *snapshot, int32_t site_limit_W,
                    taper_proposal_t *proposal);
    void *context;
} taper_policy_t;

typedef struct {
    const taper_station_config_t *config;
    const taper_port_t *port;
    const taper_solver_t *solver; /**< generated for this station; NULL: no planner, charge by fallback */
    const taper_policy_t *policy; /**< NULL: the planner */
    uint16_t iterations_per_tick; /**< solver iterations in a control tick, >= TAPER_MIN_SLICE */
    /** Simulation: so many times faster than the bus run batteries, departures, the wall clock and the planning steps, while
        periods and timeouts of the bus stay as they are. `tick_ms` of the configuration counts in their time. 0 is 1. */
    uint16_t time_scale;
} taper_station_options_t;

/** What went wrong outside, and how much was done. Saturating; they never fall. */
typedef struct {
    uint32_t frames_received, frames_sent, frames_unknown, crc_errors, frames_repeated, frames_lost,
        bad_fields;
    uint32_t frames_untrusted; /**< sound, from a sender with more than two errors in its last five */
    uint32_t send_refused;     /**< the port's queue was full */
    uint32_t plans;            /**< solves finished, whatever the verdict */
    uint32_t plans_rejected;   /**< of these, not used */
    uint32_t fallback_ticks;   /**< ticks in mode FALLBACK or FAILSAFE */
    uint32_t guard_violations; /**< must stay 0 */
} taper_station_counters_t;

typedef struct {
    taper_station_options_t options;
    taper_session_table_t sessions;
    taper_limits_t limits;
    taper_supervisor_t supervisor;
    taper_planner_t planner;
    taper_allocator_t allocator;
    taper_e2e_receiver_t connector_e2e[TAPER_MAX_CONNECTORS][TAPER_FRAMES_PER_CONNECTOR];
    taper_e2e_receiver_t gateway_e2e[2]; /**< SITE_LIMIT, TIME_SYNC */
    uint8_t setpoint_counter[TAPER_MAX_CONNECTORS];
    uint8_t status_counter[TAPER_MAX_BUSES];
    int32_t plan_W[TAPER_MAX_CONNECTORS];       /**< first step of the last finished plan */
    uint8_t plan_session[TAPER_MAX_CONNECTORS]; /**< whom it was made for */
    uint32_t plan_made_ms;
    bool plan_usable;
    int32_t planned_limit_W; /**< site limit and table revision of the last problem */
    uint32_t planned_revision;
    uint32_t solve_us;           /**< spent on the present problem */
    taper_limit_now_t limit_now; /**< of the last step */
    taper_snapshot_t snapshot;   /**< of the last step */
    taper_proposal_t proposal;   /**< of the last step */
    taper_setpoints_t setpoints; /**< of the last step */
    uint32_t last_solve_us;      /**< wall time of the last finished solve, by the port's clock_us */
    taper_station_counters_t counters;
} taper_station_t;

/**
 * Bring the station up in mode INIT.
 * @return TAPER_ERR_ARGUMENT for a NULL or out-of-range option, TAPER_ERR_CONFIG for a station description that
 *         contradicts itself or is larger than this image's sizes. The station must then not be stepped.
 */
taper_status_t taper_station_init(taper_station_t *station, const taper_station_options_t *options);

/** Run one control tick at `now_ms`. The clock may wrap. Worst case: one planner slice plus O(connectors x depth). */
void taper_station_step(taper_station_t *station, uint32_t now_ms);

/**
 * Replace the known course of the site limit. Times are on the station's clock, within 24 days; the curve is copied.
 * It can only lower the site limit that the configuration and the gateway give.
 * @return TAPER_ERR_ARGUMENT for too many points, times not ascending, or a negative limit; the old curve stays then.
 */
taper_status_t taper_station_set_limit_curve(taper_station_t *station, const taper_limit_curve_t *curve);

/**
 * What is due between two control ticks: frames are taken in, a current that waited for another to drop is given, every
 * setpoint is repeated each half second, and transfers go on. Call it when frames have come, and at least every 50 ms.
 * A station that is only ever stepped works too; it then sends each setpoint once per tick.
 */
void taper_station_poll(taper_station_t *station, uint32_t now_ms);

/**
 * Going down for good: every connector is told to use its fallback current. Call it two or three times, some 50 ms apart,
 * so that a lost frame does no harm; then do not step the station again.
 */
void taper_station_stop(taper_station_t *station, uint32_t now_ms);

/** The event log. `count` only grows: a reader remembers how far it has read. */
const taper_event_log_t *taper_station_events(const taper_station_t *station);

/** Mode of the last step. */
taper_mode_t taper_station_mode(const taper_station_t *station);

/** Site limit of the last step [W]; 0 in mode INIT. */
int32_t taper_station_site_limit_W(const taper_station_t *station);

#endif
