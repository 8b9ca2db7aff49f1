/**
 * The station: the whole pipeline behind two calls.
 *
 *     static taper_station_t station;                       // the caller owns the memory, all of it
 *     taper_station_init(&station, &options);
 *     for (;;) {
 *         taper_station_step(&station, now_ms());           // once per control tick
 *         taper_station_poll(&station, now_ms());           // between ticks, at least every 50 ms
 *     }
 *
 * A step drains the receive queue, takes a snapshot, lets the planner work one slice, chooses a proposal, bounds it by
 * every hard limit and by what connectors may still draw, and sends a setpoint to every connector. A poll does what
 * cannot wait for the next tick. Neither ever blocks or allocates. What the station does depends on the frames with
 * their times and on the times of the calls, and on nothing else: a recorded bus can be replayed to the bit.
 */
#ifndef TAPER_STATION_H
#define TAPER_STATION_H

#include "taper/allocator.h"
#include "taper/draw.h"
#include "taper/e2e.h"
#include "taper/event.h"
#include "taper/fallback.h"
#include "taper/fleet.h"
#include "taper/learn.h"
#include "taper/ledger.h"
#include "taper/limits.h"
#include "taper/planner.h"
#include "taper/port.h"
#include "taper/rows.h"
#include "taper/session.h"
#include "taper/settings.h"
#include "taper/shape.h"
#include "taper/supervisor.h"
#include "taper/transfers.h"
#include "taper/types.h"

/** All protected frames that a connector, or the gateway, can send: the number of end-to-end receivers. */
#define TAPER_CONNECTOR_RECEIVERS 10
#define TAPER_GATEWAY_RECEIVERS   4
/** Steps ahead that PLAN tells. */
#define TAPER_PLAN_STEPS 3
/** Alarms that EMCY can repeat at once. */
#define TAPER_ALARMS 8

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
    uint16_t iterations_per_tick; /**< solver iterations in a control tick, >= 1; fewer than TAPER_MIN_SLICE
                                       bound the work of a tick: see taper_planner_run(). From TAPER_MAX_ITERATIONS on, a
                                       tick works until its plan is ready: by log utility, many times as many */
    /** Simulation: so many times faster than the bus run batteries, departures, the wall clock and the planning steps,
        while periods and timeouts of the bus stay as they are. `tick_ms` of the configuration counts in their time.
        0 is 1, a real station. At most TAPER_MAX_TIME_SCALE, and `tick_ms`. */
    uint16_t time_scale;
    taper_stored_t settings_found; /**< by taper_settings_load(), for the event log; 0 if there are none */
} taper_station_options_t;

#define TAPER_MAX_TIME_SCALE 1000

/** What went wrong outside, and how much was done, by taper_counter_t. Saturating; they never fall. */
typedef struct {
    uint32_t count[TAPER_COUNTERS];
} taper_station_counters_t;

/** Trouble that may come with every frame: when it was last noted in the log. */
typedef struct {
    bool noted;
    uint32_t at_ms;
} taper_trouble_t;

/** Codes of a node's EMCY that are told apart in the log; more of them in a minute are not noted. */
#define TAPER_EMCYS_OF_NODE 4

/** An EMCY that was noted in the log. */
typedef struct {
    bool noted;
    uint16_t code;
    uint32_t at_ms;
} taper_emcy_note_t;

/** The listener's state for one node. */
typedef struct {
    uint32_t tokens_x1000; /**< frames that it may still send, in thousandths */
    uint32_t refilled_ms;
    uint32_t excess_ms;       /**< last frame above the rate */
    uint32_t excess_since_ms; /**< first one of this excess */
    bool in_excess, babbling;
    bool known; /**< heard before: the tokens count */
    taper_emcy_note_t emcy[TAPER_EMCYS_OF_NODE];
    taper_trouble_t bad_field, bad_frames;
} taper_node_guard_t;

/** One CAN bus of the station, as a sender sees it. */
typedef struct {
    bool silent;     /**< nothing is sent until `retry_ms` */
    bool in_trouble; /**< nothing was taken since it was first left alone */
    bool refusing;   /**< since `refusing_since_ms` nothing was taken */
    uint32_t refusing_since_ms;
    uint32_t retry_ms;
    uint32_t back_ms;  /**< when it was last taken into use again */
    uint8_t backoff_s; /**< of the next pause */
} taper_bus_guard_t;

/** A lasting condition that EMCY tells. */
typedef struct {
    uint8_t code; /**< taper_event_code_t; 0: free */
    uint8_t bus, node;
    uint8_t sent;       /**< times, saturating */
    uint32_t raised_ms; /**< last time that it was seen */
    uint32_t next_ms;   /**< of the next EMCY */
} taper_alarm_t;

/** Connectors on the bus that the station has no place for, and that are noted (docs/protocol.md, fault 31). */
#define TAPER_STRANGERS 8

/** One of them; `node` 0: free. In the order of arrival. */
typedef struct {
    uint8_t bus, node;
    uint8_t setpoint_counter, outlook_counter;
    uint8_t session; /**< that it told; 0: none yet */
    uint32_t heard_ms;
} taper_stranger_t;

/** Conductors that one connector's setpoints allow; 0: none was sent to its vehicle. */
typedef struct {
    uint8_t allowed;  /**< by those of now */
    uint8_t most;     /**< by some with a current that may be in force */
    uint32_t most_ms; /**< when the last of these was sent */
    bool waits;       /**< more are wanted, since `waits_ms` */
    uint32_t waits_ms;
} taper_conductors_t;

/** How much energy a vehicle still gets, by the plan or else by its present power. */
typedef struct {
    uint32_t made_ms;   /**< time of the plan, in the world's */
    int32_t planned_Wh; /**< within the horizon */
    int32_t need_Wh;    /**< what it wanted then */
} taper_prospect_t;

/** The taper that is being learned from one vehicle (learning.c). A restart begins it anew. */
typedef struct {
    taper_learn_t line;
    uint8_t session;    /**< whose it is; 0: nobody's yet */
    uint8_t doublings;  /**< of the margin: offers above the line were taken whole so many times in a row */
    bool shown;         /**< it has limited itself since it is offered more */
    bool rests;         /**< it is offered no more than the line */
    int32_t looked_Wh;  /**< energy charged at the last look: what it has drawn since began there */
    int32_t settled_mA; /**< of what it is offered, what it had time to rise to */
    bool counted;       /**< among the fleet */
    uint32_t since_ms;  /**< `rests`, or else `shown` holds, in the world's time */
} taper_learning_t;

/** What is in the port's store to survive a restart (record.c), written whole, two copies in turn. */
typedef struct {
    uint32_t sequence;   /**< of the newest record */
    uint8_t next_copy;   /**< to be written next */
    bool is_due;         /**< it is written between this tick and the next */
    bool has_sessions;   /**< as it was written last, and so the following: */
    int32_t failsafe_W;  /**< the gateway's last word on it, or absent: the description's holds */
    uint32_t changes;    /**< of the session table */
    uint32_t switches;   /**< of the allocator */
    uint32_t written_ms; /**< when that was, or was tried */
    uint32_t starts;
} taper_station_record_t;

typedef struct {
    taper_station_options_t options;
    taper_session_table_t sessions;
    taper_limits_t limits;
    taper_supervisor_t supervisor;
    taper_planner_t planner;
    taper_allocator_t allocator;
    taper_ledger_t ledger;
    taper_shape_t shape;
    taper_draw_t draw[TAPER_MAX_CONNECTORS];
    taper_conductors_t conductors[TAPER_MAX_CONNECTORS];
    taper_learning_t
        learning[TAPER_MAX_CONNECTORS]; /**< where the configuration says that tapers are learned */
    taper_fleet_t fleet;                /**< and what they have in common */
    uint32_t learned_ms;                /**< when the planner was last told that a line has moved; 0: never */
    taper_health_t health;              /**< of the planner */
    taper_self_t self;                  /**< of this controller */
    taper_stranger_t stranger[TAPER_STRANGERS];
    taper_transfers_t transfers;
    union {
        taper_transfer_content_t incoming;      /**< being taken over from a transfer */
        uint8_t record[TAPER_STORE_RECORD_MAX]; /**< being read or written */
    } scratch;                                  /**< nothing of it outlives a call */
    taper_trouble_t refused_transfers;
    taper_event_log_t events;
    taper_e2e_receiver_t connector_e2e[TAPER_MAX_CONNECTORS][TAPER_CONNECTOR_RECEIVERS];
    taper_e2e_receiver_t gateway_e2e[TAPER_GATEWAY_RECEIVERS];
    taper_node_guard_t connector_guard[TAPER_MAX_CONNECTORS];
    taper_node_guard_t gateway_guard;
    taper_bus_guard_t bus[TAPER_MAX_BUSES];
    taper_alarm_t alarm[TAPER_ALARMS];
    taper_station_record_t record;
    bool identifier_kept[TAPER_MAX_CONNECTORS]; /**< told before a restart, and not since */
    bool turn_awaits[TAPER_MAX_CONNECTORS];     /**< for its session: the turn that was kept */
    taper_turn_kept_t turn_kept[TAPER_MAX_CONNECTORS];
    bool rival_heard;  /**< a second controller speaks */
    uint32_t rival_ms; /**< when it was last heard */
    bool started;      /**< there was a step or a poll: the ledger has begun */
    bool stopped;
    uint8_t setpoint_counter[TAPER_MAX_CONNECTORS];
    uint8_t plan_counter[TAPER_MAX_CONNECTORS];
    uint8_t outlook_counter[TAPER_MAX_CONNECTORS];
    uint8_t setpoint_session[TAPER_MAX_CONNECTORS]; /**< whom the setpoints were decided for */
    int32_t sent_mA[TAPER_MAX_CONNECTORS];          /**< what was last sent; negative: nothing that counts */
    int32_t sent_fallback_mA[TAPER_MAX_CONNECTORS];
    uint8_t sent_command[TAPER_MAX_CONNECTORS];
    uint8_t sent_phases[TAPER_MAX_CONNECTORS];
    uint8_t sent_session[TAPER_MAX_CONNECTORS]; /**< and for whom */
    uint32_t sent_ms[TAPER_MAX_CONNECTORS];     /**< and when */
    bool status_due[TAPER_MAX_BUSES];           /**< the CTRL_STATUS of this tick is not out yet */
    uint8_t status_counter[TAPER_MAX_BUSES];
    uint8_t diag_counter[TAPER_MAX_BUSES];
    uint8_t emcy_counter[TAPER_MAX_BUSES];
    uint32_t second_ms; /**< when PLAN and CTRL_DIAG last went out */
    uint8_t next_plan, next_diag;
    int32_t plan_W[TAPER_MAX_STEPS][TAPER_MAX_CONNECTORS]; /**< the last finished plan */
    uint8_t plan_session[TAPER_MAX_CONNECTORS];            /**< whom it was made for */
    bool plan_waits[TAPER_MAX_CONNECTORS];                 /**< he waits for a lower price */
    uint32_t plan_made_ms;
    bool plan_usable;
    int32_t planned_limit_W; /**< site limit and table revision of the last problem */
    uint32_t planned_revision;
    uint32_t planned_curves;     /**< and of the known courses */
    uint32_t solve_us;           /**< spent on the present problem */
    taper_limit_now_t limit_now; /**< of the last step */
    taper_snapshot_t snapshot;   /**< of the last step */
    taper_rows_t rows;           /**< of these two: all limits of this step, and what counts against them */
    taper_proposal_t proposal;   /**< of the last step */
    taper_setpoints_t target;    /**< of the last step: what holds every limit once all have followed */
    taper_setpoints_t shaped;    /**< of that, what may be told by now (shape.h) */
    taper_setpoints_t setpoints; /**< what is sent: of that, what is paid for */
    taper_setpoints_t fallback;  /**< fallback currents that go with them */
    taper_setpoints_t inverse, fallback_inverse;        /**< of these two, bit by bit: fault 48 */
    int64_t row_sum[TAPER_MAX_GROUPS][TAPER_ROW_KINDS]; /**< [rows.count] of the targets: mW, uA */
    taper_prospect_t prospect[TAPER_MAX_CONNECTORS];
    uint32_t stepped_ms; /**< time of the last step */
    bool stepped;
    uint32_t last_solve_us; /**< wall time of the last finished solve, by the port's clock_us */
    taper_station_counters_t counters;
} taper_station_t;

/**
 * Bring the station up in mode INIT, with what the port's store has kept. Sessions from before count, and get current,
 * once their connectors have confirmed them.
 * @return TAPER_ERR_ARGUMENT for a NULL or out-of-range option, TAPER_ERR_CONFIG for a station description that
 *         contradicts itself or is larger than this image's sizes. The station must then not be stepped.
 */
taper_status_t taper_station_init(taper_station_t *station, const taper_station_options_t *options);

/** Run one control tick at `now_ms`. The clock may wrap. Worst case: one planner slice plus O(connectors x depth). */
void taper_station_step(taper_station_t *station, uint32_t now_ms);

/**
 * What is due between two control ticks: frames are taken in, a current that waited for another to drop is given, every
 * setpoint is repeated each half second, and transfers go on. Call it when frames have come, and at least every 50 ms.
 * A station that is only ever stepped works too; it then sends each setpoint once per tick. Cost: O(connectors x depth).
 */
void taper_station_poll(taper_station_t *station, uint32_t now_ms);

/**
 * Do what can be done ahead of a tick: take in the frames that have come, and write the record of what survives a restart, if
 * it is due. Nothing is sent. A board that calls it as frames come has them out of the way when the tick is due; the frames that
 * the station sends are the same. A step and a poll do all of it themselves. Cost: constant for each frame; every 10 s at
 * most O(connectors).
 */
void taper_station_hear(taper_station_t *station, uint32_t now_ms);

/**
 * Going down for good: every connector is told to use its fallback current. Call it two or three times, some 50 ms apart,
 * so that a lost frame does no harm; then do not step the station again.
 */
void taper_station_stop(taper_station_t *station, uint32_t now_ms);

/**
 * Replace the site's own known course of its limit, beside that of the gateway; the least counts. Times are on the world's
 * clock (`now_ms` times the time scale), within 24 days; the curve is copied. It can only lower the site limit that the
 * configuration and the gateway give.
 * @return TAPER_ERR_ARGUMENT for too many points, times not ascending, or a negative limit; the old curve stays then.
 */
taper_status_t taper_station_set_limit_curve(taper_station_t *station, const taper_limit_curve_t *curve);

/**
 * Replace the known course of the price of energy; times as above. It counts as far as `price_weight_permille` of the
 * configuration says.
 * @return TAPER_ERR_ARGUMENT for too many points, or times not ascending; the old one stays then.
 */
taper_status_t taper_station_set_price_curve(taper_station_t *station, const taper_price_curve_t *curve);

/** The event log. `count` only grows: a reader remembers how far it has read. */
const taper_event_log_t *taper_station_events(const taper_station_t *station);

/** Why a connector has the current that it has, by the last step. */
taper_reason_t taper_station_reason(const taper_station_t *station, uint8_t connector);

/** What to tell the driver of a connector's vehicle, by the last step. Cost: O(connectors). */
taper_outlook_t taper_station_outlook(const taper_station_t *station, uint8_t connector);

/** Whether some connector waits for what another has yet to give up: the next poll may have more for it. */
bool taper_station_hands_over(const taper_station_t *station);

/** Whether every connector was told its target: nothing waits for others, for time, or for a ramp. */
bool taper_station_is_settled(const taper_station_t *station);

/** Mode of the last step. */
taper_mode_t taper_station_mode(const taper_station_t *station);

/** Site limit of the last step [W], for charging; 0 in mode INIT. */
int32_t taper_station_site_limit_W(const taper_station_t *station);

/** One of the counters. */
uint32_t taper_station_counter(const taper_station_t *station, taper_counter_t counter);

#endif
