#include "matrices.h"

OSQPInt taper_write_hessian(const taper_solver_t *solver) {
    OSQPInt at = 0;
    for (uint8_t i = 0; i < solver->connectors; i++) {
        for (uint8_t t = 0; t < solver->steps; t++) {
            if (t > 0) {
                solver->p_values[at++] = taper_horizon_hessian_neighbour(t);
            }
            solver->p_values[at++] = taper_horizon_hessian_diagonal(solver->steps, t);
        }
    }
    return at;
}

/** Sum-row entries of one column: +scale in step t, -scale in step t+1, for each group above connector i. */
static OSQPInt write_sums(OSQPFloat *values, OSQPInt at, uint8_t i, bool last_step,
                          const taper_station_config_t *config, const taper_real_t *scale) {
    for (uint8_t k = 0; k < config->group_count; k++) {
        if (!taper_group_contains(config, k, i)) {
            continue;
        }
        values[at++] = scale[k];
        if (!last_step) {
            values[at++] = -scale[k];
        }
    }
    return at;
}

/** Column v(i,t). Its rows, ascending: rate t, rate t+1, taper t, taper t+1, target, sums. */
static OSQPInt write_column(OSQPFloat *values, OSQPInt at, uint8_t t, uint8_t steps, taper_real_t keep) {
    const bool last_step = t + 1 == steps;
    values[at++] = 1;
    if (!last_step) {
        values[at++] = -1;
    }
    if (t > 0) {
        values[at++] = 1;
    }
    if (!last_step) {
        values[at++] = -keep;
    }
    if (last_step) {
        values[at++] = TAPER_TARGET_SCALE;
    }
    return at;
}

OSQPInt taper_write_constraints(const taper_solver_t *solver, const taper_station_config_t *config,
                                const taper_real_t *taper_keep) {
    taper_real_t scale[TAPER_MAX_GROUPS];
    for (uint8_t k = 0; k < config->group_count; k++) {
        scale[k] = taper_horizon_sum_scale(config, k);
    }
    OSQPInt at = 0;
    for (uint8_t i = 0; i < solver->connectors; i++) {
        for (uint8_t t = 0; t < solver->steps; t++) {
            at = write_column(solver->a_values, at, t, solver->steps, taper_keep[i]);
            at = write_sums(solver->a_values, at, i, t + 1 == solver->steps, config, scale);
        }
    }
    return at;
}
