/**
 * The session table: what each connector and its vehicle last said, and what follows from it for planning.
 *
 * Reports go in with the time they were received; a snapshot comes out. A report that is too old counts as not made.
 * The state of charge between and beyond reports is carried on by the measured energy, so a vehicle without SOC, or
 * with a stale one, keeps being planned for.
 *
 * `at_ms` of a report is when it was received, on the clock of the bus. The wall clock and departures run `time_scale`
 * times faster than that in a simulation, and like it on a real station.
 *
 * A session begins when a connector reports a vehicle (control pilot B, C or D) and EV_PARAM A, B and C agree on their
 * revision, A and B on the session number. It ends when the connector reports no vehicle; another session number on the
 * same connector begins a new one. A new revision of the parameters is used once it is whole; until then the old one.
 *
 * Over a restart the caller keeps what the bus does not tell again, or not soon (taper_session_kept_t). A session from before
 * counts only when its connector confirms its number: by its parameters, or by accepting a setpoint for that session. If it
 * has another number, a battery or a SOC at plug-in that differs, or a meter that shows less, it was another vehicle's.
 */
#ifndef TAPER_SESSION_H
#define TAPER_SESSION_H

#include <stdbool.h>
#include <stdint.h>

#include "taper/event.h"
#include "taper/message.h"
#include "taper/types.h"

/** A reported SOC older than this is not used to correct the estimate [s]. So is one of unknown age. */
#define TAPER_SOC_STALE_s 60
/** Half the step of SOC on the wire (EV_STATUS): the estimate is kept this close to a fresh report [1/10 permille]. */
#define TAPER_SOC_QUANTUM_tenth_permille 25
/** A fresh SOC this much further than that from the estimate is a jump, not believed until it was repeated [permille]. */
#define TAPER_SOC_JUMP_permille 20
/** Consistent reports after which a jump is believed. */
#define TAPER_SOC_JUMP_REPORTS 3
/** Usable capacities outside this range are absurd and count as unknown [Wh]. */
#define TAPER_CAPACITY_MIN_Wh 1000
#define TAPER_CAPACITY_MAX_Wh 2000000
/** Need assumed for a vehicle that told neither targets nor capacity: it takes until it says complete [Wh]. */
#define TAPER_OPEN_NEED_Wh 100000
/** What such a vehicle is offered at least, however full it is by our account [Wh]. */
#define TAPER_OPEN_NEED_LEAST_Wh 1000
/** Stay assumed for a vehicle that told no departure, or while the clock was never set [s]. */
#define TAPER_DEFAULT_STAY_s 28800
/** A wall clock this far from where our own has got to was set: a jump, not drift [s]. */
#define TAPER_CLOCK_JUMP_s 5

/** One report and when it came. */
typedef struct {
    bool heard;
    uint32_t at_ms;
} taper_heard_t;

/** A whole set of EV_PARAM frames. */
typedef struct {
    taper_ev_param_a_t a;
    taper_ev_param_b_t b;
    taper_ev_param_c_t c;
    taper_ev_param_d_t d;
    taper_ev_param_e_t e;
} taper_ev_params_t;

/** One connector. Private to the layer; in the header because the caller owns the memory. */
typedef struct {
    taper_heard_t status_heard, ev_heard, elec_heard;
    taper_evse_status_t status;
    taper_ev_status_t ev;
    taper_evse_elec_t elec;
    taper_evse_info_t info; /**< of the connector, whichever vehicle is there */
    bool info_known;
    taper_ev_params_t received; /**< newest of each frame; they may disagree */
    taper_ev_params_t used; /**< last set that agreed; absent unless D or E agreed as well: what they say */
    uint8_t param_seen;     /**< bit 0: A .. bit 4: E received since the vehicle came */
    bool vehicle_there;     /**< by the last EVSE_STATUS */
    bool in_session;        /**< `used` is set */
    bool lost;              /**< its heartbeat was there and is gone */
    bool wants_energy;      /**< `active` of its demand at the last update */
    uint32_t plugged_in_ms; /**< when the vehicle, or else the session, was first seen */
    int32_t session_Wh;     /**< last energy measured in this session, or absent */
    int32_t stored_Wh;      /**< estimate, absent until SOC and capacity are known */
    int32_t stored_of_Wh;   /**< capacity that the estimate was made for */
    int32_t anchor_Wh;      /**< session energy at which `stored_Wh` was right, absent until measured */
    int32_t jump_permille;  /**< last SOC that was not believed */
    uint8_t jump_count;     /**< reports that agreed on it, in a row */
    bool soc_is_new;        /**< an EV_STATUS came since the last update */
    bool kept;              /**< it began before a restart, and so the following: */
    bool awaited;    /**< kept from before a restart, and not confirmed yet: `used`, but nobody's demand */
    bool unproved;   /**< kept from before a restart, and its parameters were not told since */
    bool meter_open; /**< and its meter was not heard since */
    bool stay_open;  /**< and how long the restart took is not known: `plugged_in_ms` is too late by that */
} taper_session_t;

/** What of a session has to outlive a restart. */
typedef struct {
    taper_ev_params_t
        used;      /**< revision and session of A stand for those of the others; not E, see restoring */
    uint8_t error; /**< of the last EV_STATUS, and what it asked for: a vehicle that is done falls asleep */
    bool complete, pause_requested, stop_requested;
    int32_t session_Wh; /**< as in taper_session_t */
    int32_t stored_Wh;
    int32_t anchor_Wh;
    uint32_t stay_s; /**< since it was plugged in, in the world's time */
} taper_session_kept_t;

typedef struct {
    const taper_station_config_t *config;
    taper_session_t session[TAPER_MAX_CONNECTORS];
    taper_event_log_t *log;    /**< NULL: none */
    uint32_t time_scale;       /**< world seconds per second of the bus; 1 on a real station */
    uint32_t clock_jumps;      /**< counters; they never fall */
    uint32_t soc_jumps;        /**< SOC reports that were not believed */
    uint32_t repaired;         /**< parameter sets that contradicted themselves */
    uint32_t unix_s;           /**< at `clock_heard.at_ms` */
    taper_heard_t clock_heard; /**< the last TIME_SYNC with quality above 0; held over for ever */
    uint32_t revision;         /**< changes with whatever should make the planner think again */
    uint32_t
        changes; /**< changes with whatever of taper_session_kept_t should be kept soon: all but energy and time */
    uint32_t kept_unix_s; /**< wall clock at `kept_at_ms`, had the restart taken no time; 0: not known */
    uint32_t kept_at_ms;
} taper_session_table_t;

/** Empty the table, without a log, time scale 1. `config` must outlive it. */
void taper_session_init(taper_session_table_t *table, const taper_station_config_t *config);

/**
 * Take in one decoded message received at `at_ms`. Messages that do not concern sessions, or come from a node that
 * the station does not have, are ignored. Cost: constant where connectors are numbered in the order of their nodes,
 * else a scan for the index.
 * @return whether the message was for this table.
 */
bool taper_session_apply(taper_session_table_t *table, const taper_message_t *message, uint32_t at_ms);

/** The same for a message of connector `connector`, whatever its node. Cost: constant. */
bool taper_session_apply_to(taper_session_table_t *table, uint8_t connector, const taper_message_t *message,
                            uint32_t at_ms);

/**
 * Draw the conclusions from what came in: forget reports past their timeout, bring the estimates of stored energy up to
 * date, note in `revision` who starts or stops to want energy (sessions and parameters are noted as they come), and
 * carry the clock on.
 * Call it once per control tick, after the frames and before the snapshot; at least once a day. Cost: O(connectors).
 */
void taper_session_update(taper_session_table_t *table, uint32_t now_ms);

/**
 * What every vehicle wants at `now_ms`, that of the last update; `snapshot->now_ms` is in the world's time. Reports past their timeout do not count; what a
 * vehicle asked for (complete, pause, stop) and its error hold until it says otherwise, since vehicles that are done
 * fall asleep. Demands that are not active are all zero, but
 * for what their connector is booked by while it may still draw. Cost: O(connectors).
 */
void taper_session_snapshot(const taper_session_table_t *table, uint32_t now_ms, taper_snapshot_t *snapshot);

/**
 * What 1 A of a connector counts with up to its first `most` conductors (1..3) in use, whatever it says of these, where the
 * setpoint is on its first `allowed` only. Cost: constant.
 */
taper_booking_t taper_session_booking(const taper_session_table_t *table, uint8_t connector, uint32_t now_ms,
                                      uint8_t allowed, uint8_t most);

/** Why a connector without an active demand has none: TAPER_REASON_PLANNED for one that has. Cost: constant. */
taper_reason_t taper_session_idle_reason(const taper_session_table_t *table, uint8_t connector,
                                         uint32_t now_ms);

/** Whether the heartbeat of a connector is there. */
bool taper_session_is_online(const taper_session_table_t *table, uint8_t connector, uint32_t now_ms);

/** Wall clock at `now_ms` [Unix s]; 0: never set. */
uint32_t taper_session_unix_s(const taper_session_table_t *table, uint32_t now_ms);

/** Index of the connector at (`bus`, `node`), or -1. */
int taper_session_connector(const taper_station_config_t *config, uint8_t bus, uint8_t node);

/** Wire number of the session on a connector, for SETPOINT; 0 if there is none. Also of one that is awaited. */
uint8_t taper_session_number(const taper_session_table_t *table, uint8_t connector);

/** What has to outlive a restart. @return false: there is no session, nor one awaited. Cost: constant. */
bool taper_session_keep(const taper_session_table_t *table, uint8_t connector, uint32_t now_ms,
                        taper_session_kept_t *kept);

/**
 * Await a session that was kept, on a table that has heard nothing yet; its time is 0. Quantities out of the range of their
 * messages are not believed. A second line of the taper is not restored: it is told again within 2 s, until when the first one
 * counts. @return false: nothing of it is used. Cost: constant.
 */
bool taper_session_restore(taper_session_table_t *table, uint8_t connector, const taper_session_kept_t *kept);

/**
 * The clock starts: it is `now_ms`, and the sessions were kept at `unix_s` (0: not known). How long the restart took becomes
 * known with the first TIME_SYNC; until then, and if either clock is not known, it counts as no time. Cost: O(connectors).
 */
void taper_session_start_clock(taper_session_table_t *table, uint32_t unix_s, uint32_t now_ms);

/** World's time since the sessions were kept; since the start, as long as either wall clock is not known [s]. */
uint32_t taper_session_since_kept_s(const taper_session_table_t *table, uint32_t now_ms);

/** The wall clock as far as it is known [Unix s]: had the restart taken no time, until it was set. 0: not known. */
uint32_t taper_session_kept_unix_s(const taper_session_table_t *table, uint32_t now_ms);

/** The connector has accepted a setpoint for the number of its session: one that is awaited is there. Cost: constant. */
void taper_session_confirm(taper_session_table_t *table, uint8_t connector);

/** Whether the vehicle's session began before a restart, or is awaited from there. */
bool taper_session_is_kept(const taper_session_table_t *table, uint8_t connector);

/** Whether the connector was not heard since the start, or its vehicle may be one that is awaited. */
bool taper_session_may_be_there(const taper_session_table_t *table, uint8_t connector);

#endif
