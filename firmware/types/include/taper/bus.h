/**
 * The station bus in numbers: functions, periods, timeouts and named values.
 */
#ifndef TAPER_BUS_H
#define TAPER_BUS_H

/** Version of the station bus, told by connectors in EVSE_INFO. */
#define TAPER_PROTOCOL_VERSION 1

/** Function codes: `id = function << 6 | node`. */
typedef enum {
    TAPER_MESSAGE_EMCY = 0x01,
    TAPER_MESSAGE_SITE_LIMIT = 0x02,
    TAPER_MESSAGE_SETPOINT = 0x03,
    TAPER_MESSAGE_EVSE_STATUS = 0x04,
    TAPER_MESSAGE_EV_STATUS = 0x05,
    TAPER_MESSAGE_EVSE_ELEC = 0x06,
    TAPER_MESSAGE_SITE_METER = 0x07,
    TAPER_MESSAGE_TIME_SYNC = 0x08,
    TAPER_MESSAGE_CTRL_STATUS = 0x09,
    TAPER_MESSAGE_EV_PARAM_A = 0x0A,
    TAPER_MESSAGE_EV_PARAM_B = 0x0B,
    TAPER_MESSAGE_EV_PARAM_C = 0x0C,
    TAPER_MESSAGE_EVSE_INFO = 0x0D,
    TAPER_MESSAGE_PLAN = 0x0E,
    TAPER_MESSAGE_CTRL_DIAG = 0x0F,
    TAPER_MESSAGE_EV_PARAM_D = 0x10,
    TAPER_MESSAGE_ISOTP_TO = 0x18,   /**< ISO-TP to a node; not end-to-end protected */
    TAPER_MESSAGE_ISOTP_FROM = 0x19, /**< ISO-TP from a node */
} taper_message_kind_t;

#define TAPER_NODE_CONTROLLER 0
#define TAPER_NODE_GATEWAY    62
#define TAPER_NODE_TOOL       63

/** Nominal periods [ms]. */
#define TAPER_SITE_LIMIT_CYCLE_ms  1000
#define TAPER_SETPOINT_CYCLE_ms    500
#define TAPER_EVSE_STATUS_CYCLE_ms 200
#define TAPER_EV_STATUS_CYCLE_ms   500
#define TAPER_EVSE_ELEC_CYCLE_ms   1000
#define TAPER_SITE_METER_CYCLE_ms  1000
#define TAPER_TIME_SYNC_CYCLE_ms   1000
#define TAPER_CTRL_STATUS_CYCLE_ms 1000
#define TAPER_EV_PARAM_A_CYCLE_ms  2000
#define TAPER_EV_PARAM_B_CYCLE_ms  2000
#define TAPER_EV_PARAM_C_CYCLE_ms  2000
#define TAPER_EV_PARAM_D_CYCLE_ms  2000
#define TAPER_EVSE_INFO_CYCLE_ms   5000
#define TAPER_PLAN_CYCLE_ms        1000
#define TAPER_CTRL_DIAG_CYCLE_ms   1000

/** Age after which a report counts as absent [ms]. */
#define TAPER_SITE_LIMIT_TIMEOUT_ms  5000
#define TAPER_EVSE_STATUS_TIMEOUT_ms 1000
#define TAPER_EV_STATUS_TIMEOUT_ms   2500
#define TAPER_EVSE_ELEC_TIMEOUT_ms   5000
#define TAPER_SITE_METER_TIMEOUT_ms  3000
#define TAPER_TIME_SYNC_TIMEOUT_ms   5000
#define TAPER_CTRL_STATUS_TIMEOUT_ms 3000
#define TAPER_EVSE_INFO_TIMEOUT_ms   15000
#define TAPER_ISOTP_TO_TIMEOUT_ms    1000
#define TAPER_ISOTP_FROM_TIMEOUT_ms  1000

/** SETPOINT.command */
typedef enum {
    TAPER_COMMAND_PAUSE = 0,
    TAPER_COMMAND_CHARGE = 1,
    TAPER_COMMAND_STOP = 2,
    TAPER_COMMAND_EMERGENCY = 15,
} taper_command_t;

/** EVSE_STATUS.pilot_state: control-pilot states of IEC 61851-1. */
typedef enum {
    TAPER_PILOT_A = 0, /**< no vehicle */
    TAPER_PILOT_B = 1, /**< vehicle, not ready */
    TAPER_PILOT_C = 2, /**< vehicle, ready */
    TAPER_PILOT_D = 3, /**< vehicle, ready, ventilation required */
    TAPER_PILOT_E = 4, /**< no supply */
    TAPER_PILOT_F = 5, /**< fault */
} taper_pilot_t;

/** CTRL_STATUS.mode: modes of the station. */
typedef enum {
    TAPER_MODE_INIT = 0,     /**< no limit heard yet: nothing charges */
    TAPER_MODE_PLAN = 1,     /**< the configured policy is followed */
    TAPER_MODE_FALLBACK = 2, /**< earliest deadline first, because there is no good plan */
    TAPER_MODE_FAILSAFE = 3, /**< the gateway is silent: failsafe limit, earliest deadline first */
} taper_mode_t;

/** CTRL_STATUS.limit_source: whose limit it is. */
typedef enum {
    TAPER_LIMIT_STATION = 0,
    TAPER_LIMIT_GATEWAY = 1,
    TAPER_LIMIT_CURVE = 2,
    TAPER_LIMIT_FAILSAFE = 3,
} taper_limit_source_t;

/** EVSE_INFO.kind */
typedef enum {
    TAPER_KIND_UNKNOWN = 0,
    TAPER_KIND_AC1 = 1,
    TAPER_KIND_AC3 = 2,
    TAPER_KIND_DC = 3,
} taper_kind_t;

/** EVSE_INFO.rotation: which supply phases the connector's L1, L2, L3 are wired to. */
typedef enum {
    TAPER_ROTATION_UNKNOWN = 0,
    TAPER_ROTATION_123 = 1,
    TAPER_ROTATION_231 = 2,
    TAPER_ROTATION_312 = 3,
    TAPER_ROTATION_132 = 4,
    TAPER_ROTATION_213 = 5,
    TAPER_ROTATION_321 = 6,
} taper_rotation_t;

/** PLAN.reason: why a connector has the current that it has. */
typedef enum {
    TAPER_REASON_NO_VEHICLE = 0,
    TAPER_REASON_PLANNED = 1,       /**< it has what the policy wished for it */
    TAPER_REASON_VEHICLE_LIMIT = 2, /**< all that vehicle or battery take */
    TAPER_REASON_CONNECTOR_LIMIT = 3,
    TAPER_REASON_SITE_LIMIT = 4,   /**< the site's limit leaves no more */
    TAPER_REASON_FEEDER_LIMIT = 5, /**< a group of the feeder tree leaves no more */
    TAPER_REASON_WAITING = 6,      /**< no room for its minimum current, or kept off for a while */
    TAPER_REASON_HAND_OVER = 7,    /**< waits until others have provably dropped */
    TAPER_REASON_COMPLETE = 8,
    TAPER_REASON_VEHICLE_PAUSE = 9, /**< the vehicle asks for a pause or a stop */
    TAPER_REASON_NO_PARAMETERS = 10,
    TAPER_REASON_OFFLINE = 11, /**< the connector is silent, or not to be trusted */
    TAPER_REASON_FAULT = 12,   /**< of the connector or the vehicle */
    TAPER_REASON_VERSION = 13, /**< the connector speaks another version of the bus */
    TAPER_REASON_STATION = 14, /**< the station gives nobody current: starting, stopping, second controller, bus-off */
} taper_reason_t;

/** EMCY.severity */
typedef enum {
    TAPER_SEVERITY_INFO = 0,
    TAPER_SEVERITY_WARNING = 1,
    TAPER_SEVERITY_FAULT = 2,
} taper_severity_t;

/** EMCY.code, and codes of the station's event log. */
typedef enum {
    TAPER_EVENT_STARTED = 1,
    TAPER_EVENT_STOPPED = 2,
    TAPER_EVENT_MODE = 3,            /**< data: the new mode */
    TAPER_EVENT_CONNECTOR_LOST = 4,  /**< row 11 */
    TAPER_EVENT_CONNECTOR_BACK = 5,
    TAPER_EVENT_BAD_FRAMES = 6,      /**< rows 6 and 9: more than two bad frames in five; wiring? */
    TAPER_EVENT_BABBLING = 7,        /**< row 16 */
    TAPER_EVENT_TWO_CONTROLLERS = 8, /**< row 20 */
    TAPER_EVENT_BUS_OFF = 9,         /**< row 17; data: the bus */
    TAPER_EVENT_BUS_BACK = 10,
    TAPER_EVENT_SEND_BLOCKED = 11, /**< row 18: nothing could be sent for a second */
    TAPER_EVENT_GATEWAY_LOST = 12, /**< row 13 */
    TAPER_EVENT_GATEWAY_BACK = 13,
    TAPER_EVENT_METER_LOST = 14, /**< row 15 */
    TAPER_EVENT_METER_BACK = 15,
    TAPER_EVENT_CLOCK_SET = 16,  /**< rows 26, 27: the wall clock jumped, or was set; data: seconds, saturated */
    TAPER_EVENT_VERSION = 17,    /**< row 21; data: the version told */
    TAPER_EVENT_REPAIRED = 18,   /**< row 35: parameters contradicted each other */
    TAPER_EVENT_ROTATION = 19,   /**< row 46: phase rotation unknown */
    TAPER_EVENT_BAD_FIELD = 20,  /**< rows 4, 5: a value out of range; data: function code */
    TAPER_EVENT_SOC_JUMP = 21,   /**< row 3; data: permille told */
    TAPER_EVENT_SESSION_BEGUN = 22, /**< data: session */
    TAPER_EVENT_SESSION_ENDED = 23,
    TAPER_EVENT_CURVE_SET = 24,        /**< data: points */
    TAPER_EVENT_TRANSFER_REFUSED = 25, /**< an ISO-TP transfer was not whole or not valid */
    TAPER_EVENT_STORE_OLD_COPY = 26,   /**< row 30 */
    TAPER_EVENT_STORE_RESET = 27,      /**< row 30 */
    TAPER_EVENT_EMCY_HEARD = 28,       /**< a connector or the gateway reports; data: its code */
    TAPER_EVENT_LIMIT_NEGATIVE = 29,
    TAPER_EVENT_GUARD = 30, /**< the guard found a violation: our bug */
} taper_event_code_t;

/** CTRL_DIAG.index: the station's counters. */
typedef enum {
    TAPER_COUNTER_FRAMES_RECEIVED = 0,
    TAPER_COUNTER_FRAMES_SENT = 1,
    TAPER_COUNTER_FRAMES_UNKNOWN = 2,
    TAPER_COUNTER_CRC_ERRORS = 3,
    TAPER_COUNTER_FRAMES_REPEATED = 4,
    TAPER_COUNTER_FRAMES_LOST = 5,
    TAPER_COUNTER_FRAMES_UNTRUSTED = 6,
    TAPER_COUNTER_FRAMES_BABBLED = 7,
    TAPER_COUNTER_BAD_FIELDS = 8,
    TAPER_COUNTER_RECEIVE_OVERFLOWS = 9,
    TAPER_COUNTER_SEND_REFUSED = 10,
    TAPER_COUNTER_BUS_OFF = 11,
    TAPER_COUNTER_PLANS = 12,
    TAPER_COUNTER_PLANS_REJECTED = 13,
    TAPER_COUNTER_FALLBACK_TICKS = 14,
    TAPER_COUNTER_GUARD_VIOLATIONS = 15,
    TAPER_COUNTER_CLOCK_JUMPS = 16,
    TAPER_COUNTER_SOC_JUMPS = 17,
    TAPER_COUNTER_PARAMETERS_REPAIRED = 18,
    TAPER_COUNTER_TRANSFERS = 19,
    TAPER_COUNTER_TRANSFERS_REFUSED = 20,
    TAPER_COUNTERS = 21,
} taper_counter_t;

#endif
