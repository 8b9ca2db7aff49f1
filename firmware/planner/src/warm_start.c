#include "warm_start.h"

#include <string.h>

/** Move one connector's part of a row block by `shift` steps; what comes in at the end repeats the last value. */
static void shift_block(OSQPFloat *values, uint8_t count, uint8_t shift, OSQPFloat factor) {
    for (uint8_t t = 0; t < count; t++) {
        const uint8_t from = (uint8_t)(t + shift < count ? t + shift : count - 1);
        values[t] = values[from] * factor;
    }
}

static void clear_block(OSQPFloat *values, uint8_t count) {
    memset(values, 0, count * sizeof values[0]);
}

/** One vehicle's energies and multipliers, `shift` steps later. */
static void shift_vehicle(const taper_planner_t *planner, uint8_t i, uint8_t shift, OSQPFloat growth) {
    const taper_station_config_t *config = planner->horizon.config;
    const uint8_t steps = config->steps;
    OSQPFloat *chain = planner->solver->osqp->solution->x + (size_t)i * steps;
    OSQPFloat *y = planner->solver->osqp->solution->y;
    const OSQPFloat charged = shift > 0 ? chain[shift - 1] : 0;
    shift_block(chain, steps, shift, 1);
    for (uint8_t t = 0; t < steps; t++) {
        chain[t] -= charged;
    }
    shift_block(y + (size_t)i * steps, steps, shift, growth);
    shift_block(y + taper_first_taper_row(config) + (size_t)i * (steps - 1U), (uint8_t)(steps - 1), shift,
                growth);
    y[taper_first_target_row(config) + i] *= growth;
}

/** Nothing is known of this connector's vehicle. */
static void clear_vehicle(const taper_planner_t *planner, uint8_t i) {
    const taper_station_config_t *config = planner->horizon.config;
    const uint8_t steps = config->steps;
    OSQPFloat *y = planner->solver->osqp->solution->y;
    clear_block(planner->solver->osqp->solution->x + (size_t)i * steps, steps);
    clear_block(y + (size_t)i * steps, steps);
    clear_block(y + taper_first_taper_row(config) + (size_t)i * (steps - 1U), (uint8_t)(steps - 1));
    y[taper_first_target_row(config) + i] = 0;
}

void taper_warm_start(taper_planner_t *planner, const taper_snapshot_t *snapshot, uint8_t shift) {
    const taper_station_config_t *config = planner->horizon.config;
    OSQPSolver *osqp = planner->solver->osqp;
    OSQPFloat growth = 1; /* the cost of a step is TAPER_DISCOUNT of the one before: so are the multipliers */
    for (uint8_t k = 0; k < shift && !planner->horizon.log_utility; k++) {
        growth /= TAPER_DISCOUNT;
    }
    for (uint8_t i = 0; i < config->connector_count; i++) {
        const uint8_t session = snapshot->demand[i].active ? snapshot->demand[i].session : 0;
        if (session == 0 || session != planner->session[i]) {
            clear_vehicle(planner, i);
        } else {
            shift_vehicle(planner, i, shift, growth);
        }
        planner->session[i] = session;
    }
    for (uint16_t r = 0; r < planner->horizon.sum_count; r++) {
        OSQPFloat *sums = osqp->solution->y + taper_first_sum_row(config) + (size_t)r * config->steps;
        shift_block(sums, config->steps, shift, growth);
    }
}
