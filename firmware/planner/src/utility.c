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
/** A programme that changes no power by more than this share was the last that is of use: Newton's error is its square. */
#define SETTLED ((taper_real_t)0.003)
/** Each round of water filling settles those whose limit is below the level. */
#define FILL_ROUNDS 8

/** One vehicle's part of the problem. */
typedef struct {
    const taper_real_t *rate; /* [steps] limits of its powers */
    taper_real_t *energy;     /* [steps] of the iterate, to the end of each step */
    taper_real_t taper[TAPER_MAX_TAPER_LINES], slope[TAPER_MAX_TAPER_LINES], need;
    uint8_t steps, lines;
} chain_t;

static chain_t chain_of(const taper_planner_t *planner, uint8_t i) {
    const taper_horizon_t *horizon = &planner->horizon;
    const uint8_t steps = horizon->config->steps;
    const size_t first = (size_t)i * steps;
    chain_t chain = {
        .rate = planner->rate + first,
        .energy = planner->solver->osqp->solution->x + first,
        .need = planner->need[i],
        .steps = steps,
        .lines = taper_lines_planned(horizon->config),
    };
    for (uint8_t line = 0; line < chain.lines; line++) {
        chain.taper[line] =
            horizon->upper[taper_first_taper_row(horizon->config, line, i)] / horizon->taper_scale;
        chain.slope[line] = 1 - horizon->taper_keep[line][i];
    }
    return chain;
}

/** What rate and taper allow in step t, after `charged` energy. */
static taper_real_t allowed_at(const chain_t *chain, uint8_t t, taper_real_t charged) {
    taper_real_t most = chain->rate[t];
    for (uint8_t line = 0; line < chain->lines; line++) {
        most = taper_real_min(most, taper_real_max(chain->taper[line] - chain->slope[line] * charged, 0));
    }
    return most;
}

/** Steps in which it may charge. */
static uint8_t steps_of(const chain_t *chain) {
    uint8_t count = 0;
    for (uint8_t t = 0; t < chain->steps; t++) {
        count = (uint8_t)(count + (chain->rate[t] > 0 ? 1 : 0));
    }
    return count;
}

/** Greatest power that its taper lets a fresh vehicle keep in all its steps. */
static taper_real_t even_power(const chain_t *chain) {
    const taper_real_t steps = steps_of(chain);
    taper_real_t even = TAPER_REAL_UNBOUNDED;
    for (uint8_t line = 0; line < chain->lines; line++) {
        even = taper_real_min(even,
                              chain->taper[line] / (1 + chain->slope[line] * taper_real_max(steps - 1, 0)));
    }
    return even;
}

/** Most energy that rate and taper let it have. */
static taper_real_t reachable(const chain_t *chain) {
    taper_real_t charged = 0;
    for (uint8_t t = 0; t < chain->steps; t++) {
        charged += allowed_at(chain, t, charged);
    }
    return charged;
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
    const taper_real_t even = even_power(chain);
    taper_real_t before = 0, charged = 0;
    for (uint8_t t = 0; t < chain->steps; t++) {
        const taper_real_t planned = chain->energy[t] - before;
        before = chain->energy[t];
        const taper_real_t wanted = planned > LEAST_EXPANDED ? planned : taper_real_min(level[t], even);
        charged += taper_real_min(wanted, allowed_at(chain, t, charged));
        chain->energy[t] = charged;
    }
    const taper_real_t room = START_SHARE * chain->need;
    for (uint8_t t = 0; charged > room && t < chain->steps; t++) {
        chain->energy[t] *= room / charged;
    }
}

/** What the site's power costs a vehicle by the multipliers of the last plan, in the mean of its steps. */
static taper_real_t price_for(const taper_planner_t *planner, uint8_t i, const chain_t *chain) {
    const taper_horizon_t *horizon = &planner->horizon;
    const OSQPFloat *site = planner->solver->osqp->solution->y + taper_first_sum_row(horizon->config);
    taper_real_t price = 0;
    for (uint8_t t = 0; t < chain->steps; t++) {
        price += chain->rate[t] > 0 ? site[t] : 0;
    }
    return price * horizon->weight[0][i] / (taper_real_t)steps_of(chain);
}

/**
 * The multiplier to begin with for the energy of a vehicle that the last plan did not know: what more of it would be worth at
 * the most that it can have, above its price. Built up by iterations it would take hundreds: lambda makes it large.
 */
static void value_energy(const taper_planner_t *planner, uint8_t i, const chain_t *chain) {
    const taper_horizon_t *horizon = &planner->horizon;
    const size_t row = taper_first_target_row(horizon->config) + i;
    const uint8_t steps = steps_of(chain);
    const taper_real_t most = horizon->upper[row] / horizon->target_scale;
    if (steps == 0 || !(most > 0) || chain->need >= TAPER_REAL_UNBOUNDED / 2) {
        return;
    }
    const taper_real_t worth = 2 * horizon->missing_weight * (chain->need - most) +
                               (taper_real_t)steps / taper_real_max(most, LEAST_EXPANDED);
    planner->solver->osqp->solution->y[row] =
        taper_real_max(worth - price_for(planner, i, chain), 0) / horizon->target_scale;
}

/** Change the unit of a vehicle's part of the iterate, and the scale of the cost: multipliers are cost per row. */
static void rescale_iterate(const taper_planner_t *planner, uint8_t i, taper_real_t unit, taper_real_t cost) {
    const taper_station_config_t *config = planner->horizon.config;
    const uint8_t steps = config->steps;
    const OSQPSolution *solution = planner->solver->osqp->solution;
    OSQPFloat *rate_y = solution->y + (size_t)i * steps;
    for (uint8_t t = 0; t < steps; t++) {
        solution->x[(size_t)i * steps + t] /= unit;
        rate_y[t] *= unit * cost;
    }
    for (uint8_t line = 0; line < taper_lines_planned(config); line++) {
        OSQPFloat *taper_y = solution->y + taper_first_taper_row(config, line, i);
        for (uint8_t t = 0; t + 1 < steps; t++) {
            taper_y[t] *= unit * cost;
        }
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
    const uint8_t count = steps_of(chain);
    return count > 0 ? taper_real_max(chain->energy[chain->steps - 1] / (taper_real_t)count, LEAST_EXPANDED)
                     : 0;
}

/** Put a vehicle's rows and its part of the iterate into its own unit. */
static void set_unit(taper_planner_t *planner, uint8_t i, taper_real_t unit) {
    taper_horizon_t *horizon = &planner->horizon;
    const taper_station_config_t *config = horizon->config;
    const uint8_t steps = config->steps;
    for (uint8_t t = 0; t < steps; t++) {
        horizon->upper[(size_t)i * steps + t] /= unit;
    }
    for (uint8_t line = 0; line < taper_lines_planned(config); line++) {
        taper_real_t *taper = horizon->upper + taper_first_taper_row(config, line, i);
        for (uint8_t t = 0; t + 1 < steps; t++) {
            taper[t] /= taper[t] < TAPER_REAL_UNBOUNDED ? unit : 1;
        }
    }
    horizon->upper[taper_first_target_row(config) + i] /= unit;
    planner->need[i] /= unit;
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

/**
 * Keep what every vehicle needs, and bound its energy by what it can reach, if that is less. This says nothing new, but one
 * multiplier then carries what rate or taper rows of all steps have in common: lambda makes that large.
 */
static void bound_energies(taper_planner_t *planner) {
    taper_horizon_t *horizon = &planner->horizon;
    taper_real_t *target = horizon->upper + taper_first_target_row(horizon->config);
    for (uint8_t i = 0; i < horizon->config->connector_count; i++) {
        planner->need[i] = target[i] / horizon->target_scale;
        const chain_t chain = chain_of(planner, i);
        target[i] = target[i] < TAPER_REAL_UNBOUNDED / 2
                        ? taper_real_min(target[i], reachable(&chain) * horizon->target_scale)
                        : target[i];
    }
}

void taper_utility_begin(taper_planner_t *planner) {
    const taper_station_config_t *config = planner->horizon.config;
    taper_real_t level[TAPER_MAX_STEPS];
    keep_rates(planner);
    bound_energies(planner);
    for (uint8_t t = 0; t < config->steps; t++) {
        level[t] = level_of(planner, t);
    }
    for (uint8_t i = 0; i < config->connector_count; i++) {
        const chain_t chain = chain_of(planner, i);
        const bool is_new = !(chain.energy[config->steps - 1] > 0);
        fill_chain(&chain, level);
        if (is_new) {
            value_energy(planner, i, &chain);
        }
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
    const taper_real_t charged = chain->energy[chain->steps - 1];
    const taper_real_t missing = wants ? 2 * scale * planner->horizon.missing_weight * unit * unit : 0;
    planner->steepest = taper_real_max(planner->steepest, wants ? missing * (chain->need - charged) : 0);
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
    planner->steepest = 0;
    for (uint8_t i = 0; i < solver->connectors; i++) {
        const chain_t chain = chain_of(planner, i);
        bound_steps(&planner->horizon, i, &chain, point);
        write_cost(planner, &hessian, i, &chain, point);
    }
    return hessian.written;
}

bool taper_utility_has_settled(const taper_planner_t *planner) {
    const taper_real_t *lower = planner->horizon.lower;
    for (uint8_t i = 0; i < planner->solver->connectors; i++) {
        const chain_t chain = chain_of(planner, i);
        for (uint8_t t = 0; t < chain.steps; t++) {
            const taper_real_t before = lower[(size_t)i * chain.steps + t] * STEP_FACTOR;
            const taper_real_t change = fabs(power_at(&chain, t) - before);
            if (chain.rate[t] > 0 && change > SETTLED * before + LEAST_EXPANDED) {
                return false;
            }
        }
    }
    return true;
}
