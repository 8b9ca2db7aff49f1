/**
 * The simulated field in milliseconds: connector controllers with their vehicles, and the energy gateway, as bus nodes
 * with the periods of the protocol. Each can fail at any time.
 *
 * Two times. Periods, timeouts and validities run in the time of the bus. Arrivals, departures, batteries, limits and the
 * clock that TIME_SYNC tells run in the world's time, which is `time_scale` times as fast:
 *
 *     world_s = world_start_s + time_scale * (now_ms - start_ms) / 1000
 *
 * Between two polls power is constant. A setpoint counts from the poll that received it. The poll step is therefore the
 * error of everything here; it should be 20 ms or less. Vehicles come and go at the first poll of a second of the world.
 */
#ifndef SIM_FIELD_H
#define SIM_FIELD_H

#include <stdbool.h>
#include <stdint.h>

#include "curve.h"
#include "evse.h"
#include "gateway.h"
#include "limits_csv.h"
#include "queue.h"
#include "results.h"
#include "schedule.h"
#include "sessions.h"
#include "taper/port.h"
#include "tracker.h"
#include "watch.h"

/** Node number of the gateway; connectors are 0.. */
#define SIM_GATEWAY ((unsigned)TAPER_MAX_CONNECTORS)
/** Usual time from a fall of the limit to the last connector's lower setpoint: a control tick, and the transfer. */
#define SIM_GRACE_ms 2500

/** All pointers are borrowed, and must outlive the field. */
typedef struct {
    const taper_station_config_t *station;
    const taper_port_t
        *port; /**< the field's end of the bus: `receive` and `send` are called, nothing else */
    const sim_sessions_t *sessions;
    sim_outcome_t *outcome;     /**< [sessions->count] */
    const sim_course_t *limits; /**< NULL: the gateway sets no limit */
    const sim_course_t *prices; /**< NULL: the gateway tells none */
    const bool *closed;         /**< [connector_count] these connectors are not played; NULL: all are */
    double world_start_s;
    uint32_t time_scale; /**< 0 is 1 */
    uint32_t
        vehicle_delay_ms; /**< on the bus's clock: from a change of the offer until the vehicle follows */
    uint32_t grace_ms;    /**< for sim_tracker_init(); 0: SIM_GRACE_ms */
    bool tells_taper;     /**< EV_PARAM_D and E are sent */
    bool no_gateway;      /**< not played here: only the station's own limits can be held against then */
    uint64_t seed;        /**< bits of it begin the end-to-end counters */
} sim_field_options_t;

/** What a connector controller has beside sim_evse_t. */
typedef struct {
    bool dead;
    uint8_t session; /**< whose offer `followed_mA` is */
    int64_t accepted_ms;
    int32_t followed_mA; /**< offer that the vehicle draws by */
    bool changing;       /**< the offer is another, since `follow_ms` less the delay */
    int64_t follow_ms;
    sim_slot_t slot[SIM_EVSE_FRAMES];
} sim_node_t;

typedef struct {
    sim_field_options_t options;
    uint32_t last_ms; /**< of the caller's clock, at the last poll */
    int64_t now_ms;   /**< since the start; does not wrap */
    int64_t queue_s;  /**< second of the world that the queue was brought to */
    sim_evse_t evse[TAPER_MAX_CONNECTORS];
    sim_node_t node[TAPER_MAX_CONNECTORS];
    sim_queue_t queue;
    sim_gateway_t gateway;
    sim_curve_t curve;
    bool gateway_dead;
    sim_slot_t time_slot, limit_slot;
    bool limit_told; /**< a limit was ever sent, at `limit_told_ms` */
    int64_t limit_told_ms;
    double limit_told_kw;
    sim_tracker_t tracker;
    sim_watch_t watch;
    uint32_t send_refused; /**< the bus was full; the frame is tried again at the next poll */
} sim_field_t;

/** All nodes start at `now_ms`, the caller's clock, which may wrap. Free with sim_field_free(). */
void sim_field_init(sim_field_t *field, const sim_field_options_t *options, uint32_t now_ms);

/** Bring everything to `now_ms`: batteries charge, vehicles come and go, frames are taken and sent. */
void sim_field_poll(sim_field_t *field, uint32_t now_ms);

/** Time of the world at the last poll [s]. */
double sim_field_world_s(const sim_field_t *field);

/** Whether everybody has left and nobody is to come. */
bool sim_field_is_over(const sim_field_t *field);

/** The end: everybody leaves, outcomes are complete. */
void sim_field_finish(sim_field_t *field);

void sim_field_free(sim_field_t *field);

/** The bus cable of a node breaks: it says and hears nothing, but goes on by what it knows. */
void sim_field_kill(sim_field_t *field, unsigned node);

/** A node loses its power, and forgets: no current, counters from 0, and a new session for the vehicle that it will find. */
void sim_field_power_off(sim_field_t *field, unsigned node);

/** A node is back. */
void sim_field_revive(sim_field_t *field, unsigned node);

/** Limit that a station must hold now by what the gateway told, or did not tell [kW]; INFINITY: only its own. Without
    news for the timeout of SITE_LIMIT, and before the first, it is the failsafe limit. */
double sim_field_limit_kw(const sim_field_t *field);

#endif
