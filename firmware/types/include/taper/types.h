/**
 * Words that every layer shares: status codes, time, the station's description, demands, proposals and setpoints.
 *
 * Units stand in the names. Everything here is an integer; floating point lives in battery, horizon and planner only.
 * The array bounds (TAPER_MAX_...) come from the stations that the image is built for (`taper/sizes.h`, generated).
 */
#ifndef TAPER_TYPES_H
#define TAPER_TYPES_H

#include <limits.h>
#include <stdbool.h>
#include <stdint.h>

#include "taper/bus.h"
#include "taper/sizes.h"

/** What a call answers: 0 or one of these. Never mixed with counters (the world) or verdicts (the solver). */
typedef enum {
    TAPER_OK = 0,
    TAPER_ERR_ARGUMENT = -1, /**< an argument outside its documented range */
    TAPER_ERR_CONFIG = -2,   /**< the station's description contradicts itself or this image's sizes */
} taper_status_t;

/** Connectors on one CAN bus: nodes 1..60 (the id has six bits, 0 is the controller, 62 and 63 are taken). */
#define TAPER_NODES_PER_BUS 60
/** CAN buses that this image's stations use. */
#define TAPER_MAX_BUSES ((TAPER_MAX_CONNECTORS + TAPER_NODES_PER_BUS - 1) / TAPER_NODES_PER_BUS)
/** Parent of the root group. */
#define TAPER_NO_GROUP UINT8_MAX
/** A quantity that a sender did not give. Never a legal value of any field. */
#define TAPER_ABSENT INT32_MIN
/** A bound that is not there, among those worked out at run time. */
#define TAPER_NO_LIMIT INT32_MAX
/** Step of every setpoint on the wire [mA] (SETPOINT, 0.1 A). */
#define TAPER_CURRENT_STEP_mA 100
/** Steps of the known site limit that a station keeps. */
#define TAPER_MAX_LIMIT_POINTS 384

_Static_assert(TAPER_MAX_CONNECTORS >= 1 && TAPER_MAX_CONNECTORS <= 240, "a connector index is one byte");
_Static_assert(TAPER_MAX_GROUPS >= 1 && TAPER_MAX_GROUPS < TAPER_NO_GROUP, "a group index is one byte");

/**
 * Whether `a` is at or after `b` on the wrapping millisecond clock.
 * Right while the two are less than 2^31 ms (24.8 days) apart.
 */
static inline bool taper_time_reached(uint32_t a_ms, uint32_t b_ms) {
    return (uint32_t)(a_ms - b_ms) < UINT32_C(0x80000000);
}

/** @return the time from `since_ms` to `now_ms`, for a `since_ms` that is not in the future. */
static inline uint32_t taper_elapsed_ms(uint32_t now_ms, uint32_t since_ms) {
    return now_ms - since_ms;
}

static inline int32_t taper_min_i32(int32_t a, int32_t b) {
    return a < b ? a : b;
}

static inline int32_t taper_max_i32(int32_t a, int32_t b) {
    return a > b ? a : b;
}

/** @return `value` limited to [low, high]. */
static inline int32_t taper_clamp_i32(int32_t value, int32_t low, int32_t high) {
    return taper_min_i32(taper_max_i32(value, low), high);
}

/** @return `value` limited to what an int32_t holds, without reaching TAPER_ABSENT. */
static inline int32_t taper_saturate_i32(int64_t value) {
    if (value > INT32_MAX) {
        return INT32_MAX;
    }
    return value < -INT32_MAX ? -INT32_MAX : (int32_t)value;
}

/** @return `dividend / divisor`, rounded towards 0; divisor > 0. By the 32-bit instruction where that can do it: a core of 32
 *  bits divides 64 by a call of some 60 instructions. */
static inline int64_t taper_quotient(int64_t dividend, int32_t divisor) {
    if (dividend >= 0 && dividend <= UINT32_MAX) {
        return (uint32_t)dividend / (uint32_t)divisor;
    }
    return dividend / divisor;
}

/** Add one to a counter that never falls and never wraps. */
static inline void taper_count(uint32_t *counter) {
    if (*counter != UINT32_MAX) {
        (*counter)++;
    }
}

/** One connector as the station file describes it. Constant. */
typedef struct {
    int32_t min_mA; /**< least current that can be offered (IEC 61851-1: 6 A on AC); 0: continuous */
    int32_t max_mA; /**< hardware and cable limit, per phase */
    int32_t
        fallback_mA; /**< what it may draw without a controller, if the failsafe limit has room for it; 0, or at
                              least min_mA */
    int32_t voltage_mV; /**< nominal voltage: phase to neutral on AC, line to line where `line_to_line` */
    uint32_t
        reaction_ms; /**< longest time in which its vehicle follows a lower setpoint (IEC 61851-1: 5 s) */
    uint16_t efficiency_permille; /**< of the DC converter, 1..1000; 1000 on AC */
    uint8_t phases;               /**< 1 or 3 on AC, 1 on DC */
    uint8_t
        rotation; /**< taper_rotation_t: supply phases of its conductors L1, L2, L3; with one phase the first, line to
                             line the first two count; never unknown */
    bool line_to_line; /**< one phase between two lines (North America) */
    uint8_t group;     /**< innermost group of the feeder tree */
    uint8_t bus;       /**< CAN bus, from 0 */
    uint8_t node;      /**< node on that bus, 1..TAPER_NODES_PER_BUS */
    bool is_dc;        /**< draws from all three phases, through its converter */
} taper_connector_config_t;

/**
 * One node of the feeder tree. Group 0 is the site; a parent always stands before its children. A limit of 0 is
 * none; the site has one in W. The others bound the current of each phase (rows.h).
 */
typedef struct {
    int32_t limit_W;
    int32_t limit_mA; /**< on each phase */
    int32_t
        delta_mA; /**< on each line of the delta side of a transformer that feeds it, times its ratio of windings */
    int32_t imbalance_mA; /**< most that the sums of the setpoints of two phases may differ */
    uint8_t parent;       /**< TAPER_NO_GROUP for group 0 */
} taper_group_config_t;

/** What the planner is after. Defined by their numbers, which stand in the tables. */
typedef enum {
    TAPER_OBJECTIVE_THROUGHPUT = 0,  /**< energy, soon, and first to whom the time presses */
    TAPER_OBJECTIVE_LOG_UTILITY = 1, /**< the paper's: proportional fairness (eq. 4 and 7) */
} taper_objective_t;

/** Most outer iterations of the log utility, and how many there are at most if a description does not say. */
#define TAPER_MAX_OUTER_ITERATIONS     20
#define TAPER_DEFAULT_OUTER_ITERATIONS 12

/** How the planner plans. All 0: throughput over all steps, once a step and at every event. */
typedef struct {
    uint8_t objective;        /**< taper_objective_t */
    uint8_t horizon_steps;    /**< that are planned, 2..steps; 0: all of the station's */
    uint8_t outer_iterations; /**< of the log utility, 1..TAPER_MAX_OUTER_ITERATIONS; 0: the default */
    bool
        on_events; /**< the paper's rule: plan anew only when a vehicle comes, leaves or reaches its target, or a limit
                            changes, and follow the plan in between */
    uint8_t
        taper_lines; /**< of a vehicle that are planned with, 1 or 2; 0: 1. The solver is generated for as many */
    bool learns_taper; /**< from what vehicles accept; what they tell is a first guess */
    bool
        ignores_draw; /**< plans as if vehicles took all that they are offered, as the paper's SOC-blind planner does */
    int32_t lambda_milli_per_kWh2; /**< of the log utility: weight of the squared energy missing, >= 0 */
} taper_planning_t;

/** A station: what codegen makes of `codegen/stations/NAME.toml`. Constant, in flash. */
typedef struct {
    const char *name;
    const taper_connector_config_t *connectors; /**< [connector_count] */
    const taper_group_config_t *groups;         /**< [group_count] */
    int32_t failsafe_W;                         /**< site limit while the gateway is silent */
    int32_t other_load_W;    /**< most that the site draws besides: assumed while its meter is silent */
    int32_t other_load_mA;   /**< and the most of it on one phase */
    int32_t site_voltage_mV; /**< phase to neutral, turns the meter's currents into power */
    uint32_t tick_ms;        /**< control tick */
    uint32_t min_on_ms;      /**< a connector that was switched on stays on this long */
    uint32_t min_off_ms;     /**< and off this long, for the contactor's and vehicle's sake */
    uint32_t turn_ms;        /**< where the minimum currents do not all fit: longest turn while others wait */
    uint32_t change_ms;      /**< least time from one change of a setpoint to an increase */
    int32_t ramp_mA_per_s;   /**< steepest increase; 0: at once */
    int32_t deadband_mA;     /**< smaller increases wait; 0: none */
    int32_t price_weight_permille; /**< of the price against having energy early, 0 (none)..1000 */
    taper_planning_t planning;
    bool line_to_line; /**< some connector is */
    uint16_t step_s;   /**< length of a planning step */
    uint8_t steps;     /**< planning steps, the horizon */
    uint8_t connector_count;
    uint8_t group_count;
} taper_station_config_t;

/** How the current of a connector shows in its supply: what counts against limits. */
typedef struct {
    int32_t W_per_A;   /**< power of 1 A of setpoint, with the converter's losses; 0: by the description */
    int32_t permille;  /**< current on each of `phases` for 1 A of setpoint */
    uint8_t phases;    /**< of the supply: bit 0 L1 .. bit 2 L3; 0: by the description */
    uint8_t idle;      /**< those of `phases` that the setpoint is not on, but older ones in force may be */
    uint8_t unsure;    /**< those that balance nobody: idle, or else the wiring is not sure to lead there */
    bool line_to_line; /**< it flows between the two `phases` */
} taper_booking_t;

/** What the site may draw for charging at one instant. */
typedef struct {
    int32_t site_W; /**< >= 0 */
    int32_t
        phase_mA[3]; /**< of the limits of group 0, what other load leaves; TAPER_NO_LIMIT: as described */
} taper_supply_t;

/** A supply that is bounded by nothing but `site_W` and the station's description. */
static inline taper_supply_t taper_supply_of_W(int32_t site_W) {
    return (taper_supply_t){.site_W = site_W, .phase_mA = {TAPER_NO_LIMIT, TAPER_NO_LIMIT, TAPER_NO_LIMIT}};
}

/** One vehicle's demand at the instant of a snapshot. Meaningless unless `active`, but for `booking`, which holds always. */
typedef struct {
    bool active;         /**< a vehicle is there, is sound, and still wants energy */
    bool soc_estimated;  /**< `stored_Wh` rests on measured energy because the reported SOC is stale */
    uint8_t session;     /**< wire number of the session on this connector */
    uint8_t conductors;  /**< phases of the connector that the vehicle may use: 1..3 */
    int32_t stored_Wh;   /**< energy in the battery, >= 0; 0 if SOC or capacity is unknown */
    int32_t capacity_Wh; /**< > 0, or 0: unknown (no taper then) */
    int32_t need_Wh;     /**< energy still wanted, > 0 */
    int32_t peak_W;      /**< line of the taper, at SOC 0, >= 0; may be above what `max_mA` allows */
    int32_t taper_W; /**< fall of that from SOC 0 to SOC 1, 0..peak_W; a learned one may reach 0 earlier */
    int32_t second_peak_W;   /**< another such line, of which the lower one counts; 0: there is none */
    int32_t second_taper_W;  /**< 0..second_peak_W */
    int32_t max_mA;          /**< least of connector and vehicle limit, per phase */
    int32_t min_mA;          /**< greatest of connector and vehicle minimum */
    int32_t W_per_A;         /**< power of 1 A on each phase in use, > 0 */
    int32_t departs_in_s;    /**< time to the departure that the vehicle told; <= 0: it has passed */
    taper_booking_t booking; /**< counts against limits; more than it draws while its phases are not known */
} taper_demand_t;

/** What connector and vehicle allow, whatever the battery takes [W]. */
static inline int32_t taper_demand_allowed_W(const taper_demand_t *demand) {
    return taper_saturate_i32(taper_quotient((int64_t)demand->max_mA * demand->W_per_A, 1000));
}

/** A line of the taper at the present charge, >= 0 and rounded up [W]. */
static inline int32_t taper_demand_line_W(const taper_demand_t *demand, int32_t peak_W, int32_t taper_W) {
    const int64_t fall_W = taper_quotient((int64_t)taper_W * demand->stored_Wh, demand->capacity_Wh);
    return fall_W >= peak_W ? 0 : taper_saturate_i32(peak_W - fall_W);
}

/** What the battery takes at its present charge (taper/battery.h has the model), >= 0 and rounded up [W]. */
static inline int32_t taper_demand_battery_W(const taper_demand_t *demand) {
    if (demand->capacity_Wh <= 0) {
        return demand->peak_W;
    }
    const int32_t first_W = taper_demand_line_W(demand, demand->peak_W, demand->taper_W);
    return demand->second_peak_W <= 0
               ? first_W
               : taper_min_i32(first_W,
                               taper_demand_line_W(demand, demand->second_peak_W, demand->second_taper_W));
}

/** All demands at one instant: the only thing that horizon and fallback see of the world. */
typedef struct {
    uint32_t now_ms; /**< of the world: the bus's time times `time_scale` */
    uint8_t count;   /**< connectors of the station */
    taper_demand_t demand[TAPER_MAX_CONNECTORS];
} taper_snapshot_t;

/** From `time_ms` on, until the next point, the site may draw `limit_W`. */
typedef struct {
    uint32_t time_ms;
    int32_t limit_W;
} taper_limit_point_t;

/** Known course of the site limit, times ascending. Before its first point it says nothing. */
typedef struct {
    uint16_t count;
    taper_limit_point_t point[TAPER_MAX_LIMIT_POINTS];
} taper_limit_curve_t;

/** Longest known course of the price of energy. */
#define TAPER_MAX_PRICE_POINTS 200

/** From `time_ms` on, until the next point, a kWh costs `milli_per_kWh` thousandths of the currency's unit. May be < 0. */
typedef struct {
    uint32_t time_ms;
    int32_t milli_per_kWh;
} taper_price_point_t;

/** Known course of the price, times ascending. Before its first point, and an hour after its last, it says nothing. */
typedef struct {
    uint16_t count;
    taper_price_point_t point[TAPER_MAX_PRICE_POINTS];
} taper_price_curve_t;

/** What is known of the coming planning steps, [config->steps]. */
typedef struct {
    int32_t limit_W[TAPER_MAX_STEPS]; /**< of the site, for charging, >= 0 */
    uint8_t source[TAPER_MAX_STEPS];  /**< taper_limit_source_t: whose limit it is */
    int32_t phase_mA[3]; /**< as in taper_supply_t: what other load leaves now is taken to last */
    bool priced; /**< the prices of enough steps are known; those of others are their mean (limits.h) */
    int32_t milli_per_kWh[TAPER_MAX_STEPS]; /**< 0 unless `priced` */
} taper_course_t;

/**
 * What a planner or a fallback asks for. It binds nobody: any bit pattern is safe, the allocator bounds it.
 * Connectors are served in the order of `rank`; each gets its wish if there is room, and what is left over then goes,
 * in the same order, up to the ceilings, and last to the steps that rounding down left out of them.
 */
typedef struct {
    int32_t wish_W[TAPER_MAX_CONNECTORS];
    int32_t ceiling_W[TAPER_MAX_CONNECTORS]; /**< most that is of use; below the wish it counts as the wish */
    uint8_t rank[TAPER_MAX_CONNECTORS];      /**< a permutation of 0..count-1, first served first */
} taper_proposal_t;

/** The allocator's answer: current per phase for each connector, a multiple of TAPER_CURRENT_STEP_mA. */
typedef struct {
    int32_t current_mA[TAPER_MAX_CONNECTORS];
} taper_setpoints_t;

#endif
