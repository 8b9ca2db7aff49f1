#include "residual.h"

#include <math.h>

#include "taper/real_math.h"

/** The greater one; once NaN, always NaN. */
static taper_real_t worse(taper_real_t worst, taper_real_t violation) {
    return violation <= worst || isnan(worst) ? worst : violation;
}

static void count_row(taper_residual_t *residual, const taper_horizon_t *horizon, size_t row,
                      taper_real_t value) {
    const taper_real_t low = horizon->lower[row], high = horizon->upper[row];
    const taper_real_t allowed = taper_real_min(taper_real_max(value, low), high);
    residual->worst = worse(worse(residual->worst, low - value), value - high);
    residual->size = taper_real_max(residual->size, allowed < 0 ? -allowed : allowed);
}

static taper_real_t power_of(const OSQPFloat *x, uint8_t steps, uint8_t i, uint8_t t) {
    const OSQPFloat *chain = x + (size_t)i * steps;
    return t > 0 ? chain[t] - chain[t - 1] : chain[0];
}

static void count_chain(taper_residual_t *residual, const taper_horizon_t *horizon, const OSQPFloat *x,
                        uint8_t i) {
    const uint8_t steps = horizon->config->steps;
    const OSQPFloat *chain = x + (size_t)i * steps;
    const size_t taper_row = taper_first_taper_row(horizon->config) + (size_t)i * (steps - 1U);
    for (uint8_t t = 0; t < steps; t++) {
        count_row(residual, horizon, (size_t)i * steps + t, power_of(x, steps, i, t));
        if (t > 0) {
            count_row(residual, horizon, taper_row + t - 1,
                      horizon->taper_scale * (chain[t] - horizon->taper_keep[i] * chain[t - 1]));
        }
    }
    count_row(residual, horizon, taper_first_target_row(horizon->config) + i,
              horizon->target_scale * chain[steps - 1]);
}

static void count_sum(taper_residual_t *residual, const taper_horizon_t *horizon, const OSQPFloat *x,
                      uint16_t r) {
    const uint8_t steps = horizon->config->steps;
    for (uint8_t t = 0; t < steps; t++) {
        taper_real_t sum = 0;
        for (uint8_t i = 0; i < horizon->config->connector_count; i++) {
            sum += horizon->weight[r][i] * power_of(x, steps, i, t);
        }
        count_row(residual, horizon, taper_first_sum_row(horizon->config) + (size_t)r * steps + t, sum);
    }
}

taper_residual_t taper_residual(const taper_horizon_t *horizon, const OSQPFloat *x) {
    taper_residual_t residual = {0};
    for (uint8_t i = 0; i < horizon->config->connector_count; i++) {
        count_chain(&residual, horizon, x, i);
    }
    for (uint16_t r = 0; r < horizon->sum_count; r++) {
        count_sum(&residual, horizon, x, r);
    }
    return residual;
}
