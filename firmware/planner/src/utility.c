#include "utility.h"

#include <string.h>
#include <tgmath.h>

#include "project.h"
#include "taper/real_math.h"

/** A step changes no power by more than this factor: the expansion says little about the logarithm further away. */
#define STEP_FACTOR 3
/** Lower powers are expanded as if they were this, per unit: the Hessian stays within the reach of the real type. */
#define LEAST_EXPANDED ((taper_real_t)(TAPER_REAL_IS_DOUBLE ? 1e-4 : 1e-3))
/** Part of the need that a starting point gives at most: with all of it, the last powers would be 0. */
#define START_SHARE ((taper_real_t)0.99)
/** Each round of water filling settles those whose limit is below the level. */
#define FILL_ROUNDS 8

/** One vehicle's part of the problem. */
typedef struct {
    const taper_real_t *rate; /* [steps] limits of its powers */
    taper_real_t *energy;     /* [steps] of the iterate, to the end of each step */
    taper_real_t taper, slope, need;
    uint8_t steps;
} chain_t;

static chain_t chain_of(const taper_planner_t *planner, uint8_t i) {
    const taper_horizon_t *horizon = &planner->horizon;
    const uint8_t steps = horizon->config->steps;
    const size_t first = (size_t)i * steps;
    return (chain_t){
        .rate = planner->rate + first,
        .energy = planner->solver->osqp->solution->x + first,
        .taper = horizon->upper[taper_first_taper_row(horizon->config) + (size_t)i * (steps - 1U)] /
                 horizon->taper_scale,
        .slope = 1 - horizon->taper_keep[i],
        .need = horizon->upper[taper_first_target_row(horizon->config) + i] / horizon->target_scale,
        .steps = steps,
    };
}

static taper_real_t power_at(const chain_t *chain, uint8_t t) {
    return t > 0 ? chain->energy[t] - chain->energy[t - 1] : chain->energy[0];
}

/** Equal share of the site's power in step t, for whom it is not above his own limit. */
static taper_real_t level_of(const taper_planner_t *planner, uint8_t t) {
    const taper_horizon_t *horizon = &planner->horizon;
    const taper_station_config_t *config = horizon->config;
    taper_real_t level = 0;
    for (unsigned round = 0; round < FILL_ROUNDS; round++) {
        taper_real_t left = horizon->upper[taper_first_sum_row(config) + t]; /* of the site's power */
        taper_real_t weight = 0;
        for (uint8_t i = 0; i < config->connector_count; i++) {
            const taper_real_t rate = planner->rate[(size_t)i * config->steps + t];
            left -= rate <= level ? horizon->weight[0][i] * rate : 0;
            weight += rate > level ? horizon->weight[0][i] : 0;
        }
        if (!(weight > 0) || !(left > 0)) {
            break;
        }
        level = left / weight;
    }
    return level;
}

/** Powers for a vehicle, forward in time: those of the last plan, else the level; at least something, within its limits. */
static void fill_chain(const chain_t *chain, const taper_real_t *level) {
    taper_real_t before = 0, charged = 0;
    for (uint8_t t = 0; t < chain->steps; t++) {
        const taper_real_t planned = chain->energy[t] - before;
        before = chain->energy[t];
        const taper_real_t most =
            taper_real_min(chain->rate[t], taper_real_max(chain->taper - chain->slope * charged, 0));
        charged += taper_real_min(planned > LEAST_EXPANDED ? planned : level[t], most);
        chain->energy[t] = charged;
    }
    const taper_real_t room = START_SHARE * chain->need;
    for (uint8_t t = 0; charged > room && t < chain->steps; t++) {
        chain->energy[t] *= room / charged;
    }
}

/** Change the unit of a vehicle's part of the iterate, and the scale of the cost: multipliers are cost per row. */
static void rescale_iterate(const taper_planner_t *planner, uint8_t i, taper_real_t unit, taper_real_t cost) {
    const taper_station_config_t *config = planner->horizon.config;
    const uint8_t steps = config->steps;
    const OSQPSolution *solution = planner->solver->osqp->solution;
    OSQPFloat *rate_y = solution->y + (size_t)i * steps;
    OSQPFloat *taper_y = solution->y + taper_first_taper_row(config) + (size_t)i * (steps - 1U);
    for (uint8_t t = 0; t < steps; t++) {
        solution->x[(size_t)i * steps + t] /= unit;
        rate_y[t] *= unit * cost;
    }
    for (uint8_t t = 0; t + 1 < steps; t++) {
        taper_y[t] *= unit * cost;
    }
    solution->y[taper_first_target_row(config) + i] *= unit * cost;
}

static void rescale_sums(const taper_planner_t *planner, taper_real_t cost) {
    const taper_horizon_t *horizon = &planner->horizon;
    const size_t count = (size_t)horizon->sum_count * horizon->config->steps;
    OSQPFloat *y = planner->solver->osqp->solution->y + taper_first_sum_row(horizon->config);
    for (size_t k = 0; k < count; k++) {
        y[k] *= cost;
    }
}

void taper_utility_end(taper_planner_t *planner) {
    for (uint8_t i = 0; i < planner->solver->connectors; i++) {
        rescale_iterate(planner, i, 1 / planner->horizon.unit[i], 1 / planner->cost_scale);
        planner->horizon.unit[i] = 1;
    }
    rescale_sums(planner, 1 / planner->cost_scale);
    planner->cost_scale = 1;
}

/** Mean power of a vehicle's starting point over the steps in which it may have some; 0 without any. */
static taper_real_t mean_power(const chain_t *chain) {
    uint8_t count = 0;
    for (uint8_t t = 0; t < chain->steps; t++) {
        count = (uint8_t)(count + (chain->rate[t] > 0 ? 1 : 0));
    }
    return count > 0 ? taper_real_max(chain->energy[chain->steps - 1] / (taper_real_t)count, LEAST_EXPANDED)
                     : 0;
}

/** Put a vehicle's rows and its part of the iterate into its own unit. */
static void set_unit(taper_planner_t *planner, uint8_t i, taper_real_t unit) {
    taper_horizon_t *horizon = &planner->horizon;
    const taper_station_config_t *config = horizon->config;
    const uint8_t steps = config->steps;
    taper_real_t *taper = horizon->upper + taper_first_taper_row(config) + (size_t)i * (steps - 1U);
    for (uint8_t t = 0; t < steps; t++) {
        horizon->upper[(size_t)i * steps + t] /= unit;
    }
    for (uint8_t t = 0; t + 1 < steps; t++) {
        taper[t] /= taper[t] < TAPER_REAL_UNBOUNDED ? unit : 1;
    }
    horizon->upper[taper_first_target_row(config) + i] /= unit;
    for (uint16_t r = 0; r < horizon->sum_count; r++) {
        horizon->weight[r][i] *= unit;
    }
    horizon->unit[i] = unit;
    rescale_iterate(planner, i, unit, planner->cost_scale);
}

/**
 * Every vehicle's powers in a unit of about their size, so that all terms of the cost are alike, and the sums keep theirs:
 * the units' mean square is 1.
 */
static void choose_units(taper_planner_t *planner) {
    taper_real_t mean[TAPER_MAX_CONNECTORS];
    taper_real_t squares = 0;
    unsigned count = 0;
    for (uint8_t i = 0; i < planner->solver->connectors; i++) {
        const chain_t chain = chain_of(planner, i);
        mean[i] = mean_power(&chain);
        squares += mean[i] * mean[i];
        count += mean[i] > 0 ? 1U : 0U;
    }
    const taper_real_t size = count > 0 ? sqrt(squares / (taper_real_t)count) : 1;
    planner->cost_scale = size * size;
    for (uint8_t i = 0; i < planner->solver->connectors; i++) {
        set_unit(planner, i, mean[i] > 0 ? mean[i] / size : 1);
    }
    rescale_sums(planner, planner->cost_scale);
}

static void keep_rates(taper_planner_t *planner) {
    const taper_station_config_t *config = planner->horizon.config;
    memcpy(planner->rate, planner->horizon.upper,
           (size_t)config->connector_count * config->steps * sizeof planner->rate[0]);
}

void taper_utility_begin(taper_planner_t *planner) {
    const taper_station_config_t *config = planner->horizon.config;
    taper_real_t level[TAPER_MAX_STEPS];
    keep_rates(planner);
    for (uint8_t t = 0; t < config->steps; t++) {
        level[t] = level_of(planner, t);
    }
    for (uint8_t i = 0; i < config->connector_count; i++) {
        const chain_t chain = chain_of(planner, i);
        fill_chain(&chain, level);
    }
    choose_units(planner);
    keep_rates(planner);
}

/** Rate rows of one vehicle: no further from its powers than a step, and its expansion points in `point` [steps]. */
static void bound_steps(taper_horizon_t *horizon, uint8_t i, const chain_t *chain, taper_real_t *point) {
    const size_t first = (size_t)i * chain->steps;
    for (uint8_t t = 0; t < chain->steps; t++) {
        const taper_real_t power = taper_real_max(power_at(chain, t), 0);
        point[t] = taper_real_max(power, LEAST_EXPANDED);
        horizon->lower[first + t] = chain->rate[t] > 0 ? power / STEP_FACTOR : 0;
        horizon->upper[first + t] = taper_real_min(chain->rate[t], point[t] * STEP_FACTOR);
    }
}

/** Curvature of the cost of a power. */
static taper_real_t curvature(const chain_t *chain, const taper_real_t *point, taper_real_t scale,
                              uint8_t t) {
    return chain->rate[t] > 0 ? scale / (point[t] * point[t]) : 1;
}

/** Slope of the cost at a power of 0. */
static taper_real_t slope_at_0(const chain_t *chain, const taper_real_t *point, taper_real_t scale,
                               uint8_t t) {
    return chain->rate[t] > 0 ? -2 * scale / point[t] : 0;
}

/** Hessian and linear cost of one vehicle, over its energies. */
static void write_cost(taper_planner_t *planner, taper_writer_t *hessian, uint8_t i, const chain_t *chain,
                       const taper_real_t *point) {
    taper_real_t *linear = planner->horizon.linear + (size_t)i * chain->steps;
    const bool wants = chain->need < TAPER_REAL_UNBOUNDED / 2;
    const taper_real_t unit = planner->horizon.unit[i];
    const taper_real_t scale = planner->cost_scale;
    const taper_real_t missing = wants ? 2 * scale * planner->horizon.missing_weight * unit * unit : 0;
    for (uint8_t t = 0; t < chain->steps; t++) {
        const bool last = t + 1 == chain->steps;
        const taper_real_t own = curvature(chain, point, scale, t);
        if (t > 0) {
            taper_writer_put(hessian, -own);
        }
        taper_writer_put(hessian, own + (last ? missing : curvature(chain, point, scale, (uint8_t)(t + 1))));
        linear[t] =
            slope_at_0(chain, point, scale, t) -
            (last ? (wants ? missing * chain->need : 0) : slope_at_0(chain, point, scale, (uint8_t)(t + 1)));
    }
}

taper_written_t taper_utility_expand(taper_planner_t *planner) {
    const taper_solver_t *solver = planner->solver;
    taper_writer_t hessian = {.values = solver->p_values, .room = solver->p_count};
    taper_real_t point[TAPER_MAX_STEPS];
    taper_project(&planner->horizon, solver->osqp->solution->x);
    for (uint8_t i = 0; i < solver->connectors; i++) {
        const chain_t chain = chain_of(planner, i);
        bound_steps(&planner->horizon, i, &chain, point);
        write_cost(planner, &hessian, i, &chain, point);
    }
    return hessian.written;
}
