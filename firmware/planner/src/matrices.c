#include "matrices.h"

#include <string.h>

void taper_writer_put(taper_writer_t *writer, OSQPFloat value) {
    const OSQPInt at = writer->written.count++;
    if (at < writer->room && memcmp(&writer->values[at], &value, sizeof value) != 0) {
        writer->values[at] = value;
        writer->written.changed = true;
    }
}

taper_written_t taper_write_hessian(const taper_solver_t *solver) {
    taper_writer_t writer = {.values = solver->p_values, .room = solver->p_count};
    for (uint8_t i = 0; i < solver->connectors; i++) {
        for (uint8_t t = 0; t < solver->steps; t++) {
            if (t > 0) {
                taper_writer_put(&writer, taper_horizon_hessian_neighbour(t));
            }
            taper_writer_put(&writer, taper_horizon_hessian_diagonal(solver->steps, t));
        }
    }
    return writer.written;
}

/** Weights of the sums that connector i is in, ascending; a weight of 0 at present is one too. @return how many. */
static uint16_t weights_of(taper_real_t *weights, const taper_horizon_t *horizon, uint8_t i) {
    uint16_t count = 0;
    for (uint16_t r = 0; r < horizon->sum_count; r++) {
        const taper_sum_t *sum = &horizon->sum[r];
        if (taper_row_plans(horizon->config, sum->group, (taper_row_kind_t)sum->kind, i)) {
            weights[count++] = horizon->weight[r][i];
        }
    }
    return count;
}

/** Column v(i,t) up to its sums. Its rows, ascending: rate t, rate t+1, taper t, taper t+1, target. */
static void put_chain(taper_writer_t *writer, const taper_horizon_t *horizon, uint8_t i, uint8_t t,
                      bool last_step) {
    taper_writer_put(writer, 1);
    if (!last_step) {
        taper_writer_put(writer, -1);
    }
    if (t > 0) {
        taper_writer_put(writer, horizon->taper_scale);
    }
    taper_writer_put(writer,
                     last_step ? horizon->target_scale : -horizon->taper_keep[i] * horizon->taper_scale);
}

/** Sum rows of one column: the weight in step t, minus it in step t+1. */
static void put_sums(taper_writer_t *writer, bool last_step, const taper_real_t *weights, uint16_t count) {
    for (uint16_t k = 0; k < count; k++) {
        taper_writer_put(writer, weights[k]);
        if (!last_step) {
            taper_writer_put(writer, -weights[k]);
        }
    }
}

taper_written_t taper_write_constraints(const taper_solver_t *solver, const taper_horizon_t *horizon) {
    taper_writer_t writer = {.values = solver->a_values, .room = solver->a_count};
    taper_real_t weights[TAPER_MAX_PLAN_ROWS];
    for (uint8_t i = 0; i < solver->connectors; i++) {
        const uint16_t count = weights_of(weights, horizon, i);
        for (uint8_t t = 0; t < solver->steps; t++) {
            const bool last_step = t + 1 == solver->steps;
            put_chain(&writer, horizon, i, t, last_step);
            put_sums(&writer, last_step, weights, count);
        }
    }
    return writer.written;
}
