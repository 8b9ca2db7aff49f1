#include "project.h"

#include "taper/real_math.h"

/** Rounds of lowering the stronger phase. Two settle one group of connectors on single phases. */
#define BALANCE_ROUNDS 4

/** Where the row blocks of one problem begin. */
typedef struct {
    const taper_horizon_t *horizon;
    const taper_real_t *taper_upper, *target_upper, *sum_upper;
    taper_real_t power[TAPER_MAX_CONNECTORS]; /* u(i,t) of the step in work */
} projection_t;

static projection_t projection_of(const taper_horizon_t *horizon) {
    return (projection_t){
        .horizon = horizon,
        .taper_upper = horizon->upper + taper_first_taper_row(horizon->config),
        .target_upper = horizon->upper + taper_first_target_row(horizon->config),
        .sum_upper = horizon->upper + taper_first_sum_row(horizon->config),
    };
}

/** Power that connector i may have in step t after `charged` energy. */
static taper_real_t allowed_power(const projection_t *projection, uint8_t i, uint8_t t,
                                  taper_real_t charged) {
    const taper_horizon_t *horizon = projection->horizon;
    const uint8_t steps = horizon->config->steps;
    taper_real_t allowed = horizon->upper[(size_t)i * steps + t];
    if (t > 0) {
        const taper_real_t slope = 1 - horizon->taper_keep[i];
        const taper_real_t now = projection->taper_upper[(size_t)i * (steps - 1U) + t - 1];
        allowed = taper_real_min(allowed, now / horizon->taper_scale - slope * charged);
    }
    allowed = taper_real_min(allowed, projection->target_upper[i] / horizon->target_scale - charged);
    return taper_real_max(allowed, 0);
}

/** Bound and weights of one sum row. */
typedef struct {
    const taper_real_t *weight;
    taper_real_t upper;
    bool is_difference;
} sum_t;

static sum_t sum_of(const projection_t *projection, uint16_t r, uint8_t t) {
    const taper_horizon_t *horizon = projection->horizon;
    return (sum_t){.weight = horizon->weight[r],
                   .upper = projection->sum_upper[(size_t)r * horizon->config->steps + t],
                   .is_difference = horizon->sum[r].kind >= TAPER_ROW_SUMS};
}

static taper_real_t value_of(const projection_t *projection, const sum_t *sum) {
    taper_real_t value = 0;
    for (uint8_t i = 0; i < projection->horizon->config->connector_count; i++) {
        value += sum->weight[i] * projection->power[i];
    }
    return value;
}

/** Shrink the powers of a sum so that it keeps its limit. */
static void shrink_sum(projection_t *projection, const sum_t *sum) {
    const taper_real_t value = value_of(projection, sum);
    if (value <= sum->upper) {
        return;
    }
    for (uint8_t i = 0; i < projection->horizon->config->connector_count; i++) {
        if (sum->weight[i] > 0) {
            projection->power[i] *= sum->upper / value;
        }
    }
}

/** Take `excess` from what one side of a difference has by connectors of one wiring. @return what is left to take. */
static taper_real_t lower_side(projection_t *projection, const sum_t *sum, taper_real_t side,
                               bool line_to_line, taper_real_t excess) {
    const taper_station_config_t *config = projection->horizon->config;
    taper_real_t held = 0;
    for (uint8_t i = 0; i < config->connector_count; i++) {
        const bool counts = config->connectors[i].line_to_line == line_to_line && side * sum->weight[i] > 0;
        held += counts ? side * sum->weight[i] * projection->power[i] : 0;
    }
    const taper_real_t keep = held > excess ? (held - excess) / held : 0;
    for (uint8_t i = 0; i < config->connector_count; i++) {
        const bool counts = config->connectors[i].line_to_line == line_to_line && side * sum->weight[i] > 0;
        projection->power[i] *= counts ? keep : 1;
    }
    return taper_real_max(excess - held, 0);
}

/** Lower the stronger side of a difference. One between lines would weaken another phase too: those come last. */
static void lower_difference(projection_t *projection, const sum_t *sum) {
    const taper_real_t value = value_of(projection, sum);
    const taper_real_t side = value < 0 ? -1 : 1;
    if (side * value <= sum->upper) {
        return;
    }
    const taper_real_t left = lower_side(projection, sum, side, false, side * value - sum->upper);
    if (left > 0) {
        (void)lower_side(projection, sum, side, true, left);
    }
}

/** Factor that all differences allow in step t: scaled by it, each of them holds. */
static taper_real_t common_factor(const projection_t *projection, uint8_t t) {
    taper_real_t factor = 1;
    for (uint16_t r = 0; r < projection->horizon->sum_count; r++) {
        const sum_t sum = sum_of(projection, r, t);
        const taper_real_t value = sum.is_difference ? value_of(projection, &sum) : 0;
        const taper_real_t size = value < 0 ? -value : value;
        factor = size > sum.upper ? taper_real_min(factor, sum.upper / size) : factor;
    }
    return factor;
}

static bool is_in_a_difference(const taper_horizon_t *horizon, uint8_t i) {
    for (uint16_t r = 0; r < horizon->sum_count; r++) {
        if (horizon->sum[r].kind >= TAPER_ROW_SUMS &&
            (horizon->weight[r][i] < 0 || horizon->weight[r][i] > 0)) {
            return true;
        }
    }
    return false;
}

/**
 * Bring phases together in step t. Lowering one can part it from the next, so a few rounds; what they leave is shrunk by
 * one factor, which brings every difference within its bound and raises no sum.
 */
static void balance(projection_t *projection, uint8_t t) {
    const taper_horizon_t *horizon = projection->horizon;
    for (int round = 0; round < BALANCE_ROUNDS; round++) {
        for (uint16_t r = 0; r < horizon->sum_count; r++) {
            const sum_t sum = sum_of(projection, r, t);
            if (sum.is_difference) {
                lower_difference(projection, &sum);
            }
        }
    }
    const taper_real_t factor = common_factor(projection, t);
    for (uint8_t i = 0; factor < 1 && i < horizon->config->connector_count; i++) {
        projection->power[i] *= is_in_a_difference(horizon, i) ? factor : 1;
    }
}

static void keep_sums(projection_t *projection, uint8_t t) {
    for (uint16_t r = 0; r < projection->horizon->sum_count; r++) {
        const sum_t sum = sum_of(projection, r, t);
        if (!sum.is_difference) {
            shrink_sum(projection, &sum);
        }
    }
    balance(projection, t);
}

void taper_project(const taper_horizon_t *horizon, OSQPFloat *x) {
    projection_t projection = projection_of(horizon);
    const taper_station_config_t *config = horizon->config;
    const uint8_t steps = config->steps;
    taper_real_t charged[TAPER_MAX_CONNECTORS] = {0}; /* up to the last projected step */
    for (uint8_t t = 0; t < steps; t++) {
        for (uint8_t i = 0; i < config->connector_count; i++) {
            const taper_real_t wanted =
                x[(size_t)i * steps + t] - charged[i]; /* makes up for what was cut off */
            projection.power[i] =
                taper_real_min(taper_real_max(wanted, 0), allowed_power(&projection, i, t, charged[i]));
        }
        keep_sums(&projection, t);
        for (uint8_t i = 0; i < config->connector_count; i++) {
            charged[i] += projection.power[i];
            x[(size_t)i * steps + t] = charged[i];
        }
    }
}
