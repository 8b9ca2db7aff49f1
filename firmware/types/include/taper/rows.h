/**
 * Limits as rows: every limit of the feeder tree says that a weighted sum of connector currents stays below a bound.
 * Allocator, ledger and planner share this one list of rows; the guard has its own arithmetic.
 *
 * A group has up to 16 rows, by kind. A row's unit is W (power) or mA (current). Its weight for a connector is what 1 A of
 * setpoint adds to it: W per A, or permille of the current.
 *
 * Currents of three phases are phasors; the rows bound their length from above by sums, and are exact where it matters:
 *
 * - Phase to neutral, and three-phase: the current of the line is at most the sum of the currents.
 * - Line to line (North America): line L1 carries x from the pair L1-L2 and y from L3-L1, which differ by 60 degrees:
 *   |I| = sqrt(x^2 + x y + y^2) <= max(x, y) + (sqrt(3) - 1) min(x, y). Exact for x = 0, y = 0 and x = y. One row for each of
 *   the two linear parts: the second one is `..._B`.
 * - The delta side of a delta-wye transformer, referred to the wye side: line a carries |AB + BC - 2 CA| <=
 *   max(AB, BC) + 2 CA. Exact for each alone, for AB = BC and for balanced load. Again two rows. A current to neutral
 *   counts once on each of the two lines that its winding is between, a three-phase one sqrt(3) times on all.
 *
 * Both bounds follow from convexity: the left side is sublinear, the right side is linear between rays where they agree.
 */
#ifndef TAPER_ROWS_H
#define TAPER_ROWS_H

#include "taper/types.h"

typedef enum {
    TAPER_ROW_POWER, /**< W */
    TAPER_ROW_L1,    /**< mA; so are all below */
    TAPER_ROW_L2,
    TAPER_ROW_L3,
    TAPER_ROW_L1_B,
    TAPER_ROW_L2_B,
    TAPER_ROW_L3_B,
    TAPER_ROW_DELTA_L1,
    TAPER_ROW_DELTA_L2,
    TAPER_ROW_DELTA_L3,
    TAPER_ROW_DELTA_L1_B,
    TAPER_ROW_DELTA_L2_B,
    TAPER_ROW_DELTA_L3_B,
    TAPER_ROW_L1_L2, /**< differences of phases: bounded on both sides */
    TAPER_ROW_L2_L3,
    TAPER_ROW_L3_L1,
    TAPER_ROW_KINDS,
} taper_row_kind_t;

/** Kinds below this have no negative weight: what one connector adds, no other takes away. */
#define TAPER_ROW_SUMS TAPER_ROW_L1_L2

/** Bound of a row by the station's description, or TAPER_NO_LIMIT: there is no such row. Cost: constant. */
int32_t taper_row_limit(const taper_station_config_t *config, uint8_t group, taper_row_kind_t kind);

/** The same with what the site may have now: `supply` bounds the rows of group 0 besides. >= 0. Cost: constant. */
int32_t taper_row_limit_now(const taper_station_config_t *config, const taper_supply_t *supply, uint8_t group,
                            taper_row_kind_t kind);

/**
 * What 1 A of setpoint adds to a row: W, or permille of an ampere, rounded up. Negative in differences only.
 * Cost: constant.
 */
int32_t taper_row_weight(const taper_booking_t *booking, taper_row_kind_t kind);

/**
 * How connector `i` shows in the supply at most, by its description alone: all its conductors in use, at nominal voltage.
 * A converter's losses count.
 */
taper_booking_t taper_booking_nominal(const taper_station_config_t *config, uint8_t i);

/** The same by the snapshot; what that leaves open is by the description. Cost: constant. */
taper_booking_t taper_booking_now(const taper_station_config_t *config, const taper_snapshot_t *snapshot,
                                  uint8_t i);

/**
 * The rows of a station at one instant, worked out once for all that look at them: the allocator, what the ledger grants, and
 * the reasons. The guards do not. Kinds that no group limits are left out; the others stand in their order.
 */
typedef struct {
    uint8_t count;                                         /**< kinds */
    uint8_t sums;                                          /**< the first of them: below TAPER_ROW_SUMS */
    uint8_t kind[TAPER_ROW_KINDS];                         /**< [count] taper_row_kind_t */
    int32_t limit[TAPER_MAX_GROUPS][TAPER_ROW_KINDS];      /**< [count] taper_row_limit_now() by group */
    int32_t weight[TAPER_MAX_CONNECTORS][TAPER_ROW_KINDS]; /**< [count] taper_row_weight() by connector */
    taper_booking_t booking[TAPER_MAX_CONNECTORS];         /**< taper_booking_now(), which that is of */
} taper_rows_t;

/** List them. Cost: O((connectors + groups) x kinds). */
void taper_rows_now(taper_rows_t *rows, const taper_station_config_t *config,
                    const taper_snapshot_t *snapshot, const taper_supply_t *supply);

/** Supply phases of the first `conductors` (1..3) of a connector that is wired like `rotation`: bit 0 L1 .. bit 2 L3. */
uint8_t taper_rotation_phases(taper_rotation_t rotation, uint8_t conductors);

/** Whether connector `i` is in this row of the planner: below `group`, with a weight by its description. Cost: O(depth). */
bool taper_row_plans(const taper_station_config_t *config, uint8_t group, taper_row_kind_t kind, uint8_t i);

/**
 * Whether the planner has this row: it is limited, some connector below `group` has a weight in it by its description, and,
 * but for the site, no other line of the group weighs at least as much for each of them. Rows that say nothing new make the
 * solver slow. Cost: O(connectors x (depth + kinds)).
 */
bool taper_row_is_planned(const taper_station_config_t *config, uint8_t group, taper_row_kind_t kind);

/** Whether connector `i` hangs below group `k` of the feeder tree. Cost: O(depth). */
bool taper_group_contains(const taper_station_config_t *config, uint8_t k, uint8_t i);

#endif
