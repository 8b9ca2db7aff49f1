/**
 * Snapshot and site limits -> the numbers of the planning problem. Knows no solver.
 *
 * The problem (docs/design.md, "The planning problem"), per unit: power in units of the station's strongest connector
 * `base_W`, energy in units of base_W for one step. Variables are v(i,t), the energy that connector i has received
 * from now to the end of step t = 0..T-1, so that its power is u(i,t) = v(i,t) - v(i,t-1), v(i,-1) = 0.
 *
 *     minimise  sum_t sum_i [ g^(t+1) q/2 u(i,t)^2 - (h^(t+1) w_i - p_t) u(i,t) ]
 *               g = TAPER_DISCOUNT, q = TAPER_CURVATURE, h = g and p_t = 0 unless a price counts
 *               w_i = 1 + m_i (8 / max(s_i, 1) + 3 / (laxity in steps + 16))
 *     rate      0 <= u(i,t) <= rate limit, 0 outside the stay            (paper, eq. 1 and 3)
 *     taper     u(i,t) + a_i v(i,t-1) <= limit at the present SOC        (paper, eq. 5; at t = 0 part of rate)
 *     target    v(i,T-1) <= need
 *     sum       sum of c_ri u(i,t) over the connectors of row r <= P_r(t)  (paper, eq. 2)
 *
 * With the log utility (config->planning) the cost is the paper's (eq. 4 and 7), lambda per squared energy missing:
 *
 *     minimise  - sum_i sum_t log u(i,t) + lambda sum_i (need_i - v(i,T-1))^2
 *
 * over the (i,t) in which the rate limit is above TAPER_LEAST_POWER; the others are 0. Its rate limits are also bounded by
 * the limit at the present SOC, which says nothing new. The planner makes quadratic programmes of it (planner/src/utility.h)
 * and writes their linear cost.
 *
 * With fewer planned steps than the station has, the rate limits of the others are 0.
 *
 * s_i is the stay in steps, each counted by its share of the greatest limit of the course, and whole beyond the horizon.
 * Laxity is s_i less the steps that the need takes at the present limit, at least 0; m_i, where that is more than s_i, is
 * the fourth root of their ratio, else 1. A price counts if the course is priced, with `price_weight_permille`, and less
 * or not at all where the vehicles want about as much as there will be: h then approaches 0.99, and p_t rises from 0 in
 * the cheapest step to 0.75 in the dearest, so that no energy is worth less than nothing.
 *
 * The sum rows are the planned ones of the feeder tree (taper/rows.h), by ascending group and kind: power, currents of
 * lines; differences of phases are bounded on both sides. c_ri is the supply's power, or its current times the site's
 * voltage, per power of the vehicle. A connector is in a row if its description says so; what the snapshot says changes
 * its c_ri, to 0 too, but puts it into no other row.
 *
 * The variable (i,t) has index i*T + t. Rows stand in the order rate [N*T], taper [N*(T-1)], target [N], sum [R*T].
 * What does not apply is masked by bounds (l = u, or unbounded), never by the cost: that converges 2-5 times faster.
 * A rate is also limited by the site's limits, which says nothing new but lets a limit of 0 converge at once.
 * Target and sum rows are scaled as below, which saves about a third of the iterations.
 */
#ifndef TAPER_HORIZON_H
#define TAPER_HORIZON_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "taper/real.h"
#include "taper/rows.h"
#include "taper/types.h"

/** Discount per step: charging early is worth more, so power is used when it is there. */
#define TAPER_DISCOUNT ((taper_real_t)0.95)
/** Curvature of the cost of power: small, for a unique answer that shares between equals. */
#define TAPER_CURVATURE ((taper_real_t)0.1)
/** With the log utility: least rate limit that a power is planned for, per unit. */
#define TAPER_LEAST_POWER ((taper_real_t)1e-3)
/** Factors of the taper and target rows, by objective. */
#define TAPER_TAPER_SCALE      ((taper_real_t)1)
#define TAPER_TARGET_SCALE     ((taper_real_t)0.58)
#define TAPER_LOG_TAPER_SCALE  ((taper_real_t)2)
#define TAPER_LOG_TARGET_SCALE ((taper_real_t)1)
/** Factor of the rows of currents besides: there are several for one of power, which bind together. */
#define TAPER_CURRENT_SCALE ((taper_real_t)0.4)

#define TAPER_MAX_VARIABLES (TAPER_MAX_CONNECTORS * TAPER_MAX_STEPS)
#define TAPER_MAX_ROWS      (2 * TAPER_MAX_VARIABLES + TAPER_MAX_PLAN_ROWS * TAPER_MAX_STEPS)

/** One limit, in every step: T sum rows. */
typedef struct {
    uint8_t group;
    uint8_t kind;       /**< taper_row_kind_t */
    taper_real_t scale; /**< factor of its rows, which makes them alike in size (codegen/qp.py) */
} taper_sum_t;

typedef struct {
    const taper_station_config_t *config;
    taper_real_t base_W; /**< power unit */
    taper_real_t
        unit[TAPER_MAX_CONNECTORS]; /**< of a connector's powers and energies, on top of base_W: 1 as built */
    taper_real_t taper_scale, target_scale;   /**< factors of these rows */
    bool log_utility;                         /**< objective of the paper, else throughput */
    taper_real_t missing_weight;              /**< lambda, of the log utility */
    taper_real_t linear[TAPER_MAX_VARIABLES]; /**< linear cost; of the log utility the planner's to write */
    taper_real_t lower[TAPER_MAX_ROWS];       /**< row bounds; +-TAPER_REAL_UNBOUNDED: none */
    taper_real_t upper[TAPER_MAX_ROWS];
    taper_real_t taper_keep[TAPER_MAX_CONNECTORS]; /**< 1 - a_i: taper row (i,t) is v(i,t) - keep v(i,t-1) */
    bool waits
        [TAPER_MAX_CONNECTORS]; /**< for a lower price, with time to spare: more than planned is of no use */
    uint16_t sum_count;
    taper_sum_t sum[TAPER_MAX_PLAN_ROWS];
    taper_real_t weight[TAPER_MAX_PLAN_ROWS]
                       [TAPER_MAX_CONNECTORS]; /**< of u(i,t) in the sum rows: c_ri, scaled; 0: not in it */
} taper_horizon_t;

/**
 * What of the problem follows from the station's description alone: `config`, `base_W`, the list of the sums, their
 * weights with all conductors in use, and no taper. Cost: O(groups x connectors x depth of the tree).
 */
void taper_horizon_shape(taper_horizon_t *horizon, const taper_station_config_t *config);

/**
 * State the problem for `snapshot` and what is known of the coming steps.
 * Cost: O(connectors x steps + sums x (steps + connectors x depth of the tree)). `horizon->config` is `config` afterwards.
 */
void taper_horizon_build(taper_horizon_t *horizon, const taper_station_config_t *config,
                         const taper_snapshot_t *snapshot, const taper_course_t *course);

/** Quadratic cost on v(i,t)^2 (diagonal of the Hessian), the same for all connectors. */
taper_real_t taper_horizon_hessian_diagonal(uint8_t steps, uint8_t t);

/** Quadratic cost on v(i,t-1) v(i,t) (off the diagonal of the Hessian), t >= 1. */
taper_real_t taper_horizon_hessian_neighbour(uint8_t t);

/** First of the taper, target and sum rows; the rate rows begin at 0. */
static inline size_t taper_first_taper_row(const taper_station_config_t *config) {
    return (size_t)config->connector_count * config->steps;
}
static inline size_t taper_first_target_row(const taper_station_config_t *config) {
    return (size_t)config->connector_count * (2U * config->steps - 1U);
}
static inline size_t taper_first_sum_row(const taper_station_config_t *config) {
    return (size_t)config->connector_count * 2U * config->steps;
}

#endif
