/**
 * The log utility as a sequence of quadratic programmes. Private.
 *
 * Around powers z(i,t) > 0 that hold every row, log u is replaced by its expansion of second order, so that the cost is
 *
 *     sum over i, t of [ u^2 / (2 z^2) - 2 u / z ] + lambda sum over i of (need_i - v(i,T-1))^2
 *
 * with z/3 <= u <= 3 z besides the rows: this is Newton's method with bounded steps, and converges in a few of them. The
 * answer, made feasible, is the next z. Powers that the horizon forbids stay 0; the cost of these is u^2 / 2.
 */
#ifndef TAPER_UTILITY_H
#define TAPER_UTILITY_H

#include "matrices.h"
#include "solver.h"

/**
 * Begin a problem that stands in `planner->horizon`: keep its rate limits in `planner->rate`, and make `solution->x` a
 * starting point that holds every row and gives something wherever something may be given. A vehicle that the last plan
 * knows keeps its powers; another one has an equal share of the site's power in every step, as far as its own limits allow
 * (water filling), and its energy row begins with a multiplier that fits. Cost: O(connectors x steps x sums).
 */
void taper_utility_begin(taper_planner_t *planner);

/** Bring the iterate back from the units of its problem, for the next warm start. Cost: O(rows). */
void taper_utility_end(taper_planner_t *planner);

/**
 * State the quadratic programme around `solution->x`, which is made feasible first: Hessian, linear cost, rate rows.
 * Cost: O(connectors x steps x sums).
 */
taper_written_t taper_utility_expand(taper_planner_t *planner);

/** Whether the answer in `solution->x` differs so little from what it was expanded around that another would change nothing. */
bool taper_utility_has_settled(const taper_planner_t *planner);

#endif
