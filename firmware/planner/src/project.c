#include "project.h"

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
        allowed = taper_real_min(allowed,
                                 projection->taper_upper[(size_t)i * (steps - 1U) + t - 1] - slope * charged);
    }
    allowed = taper_real_min(allowed, projection->target_upper[i] / TAPER_TARGET_SCALE - charged);
    return taper_real_max(allowed, 0);
}

/** Shrink the powers of a group so that their sum keeps its limit in step t. */
static void shrink_group(projection_t *projection, uint8_t k, uint8_t t) {
    const taper_station_config_t *config = projection->horizon->config;
    const taper_real_t scale = taper_horizon_sum_scale(config, k);
    taper_real_t sum = 0;
    for (uint8_t i = 0; i < config->connector_count; i++) {
        sum += taper_group_contains(config, k, i) ? projection->power[i] : 0;
    }
    const taper_real_t limit = scale > 0 ? projection->sum_upper[(size_t)k * config->steps + t] / scale : 0;
    if (sum <= limit) {
        return;
    }
    for (uint8_t i = 0; i < config->connector_count; i++) {
        if (taper_group_contains(config, k, i)) {
            projection->power[i] *= limit / sum;
        }
    }
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
        for (uint8_t k = 0; k < config->group_count; k++) {
            shrink_group(&projection, k, t);
        }
        for (uint8_t i = 0; i < config->connector_count; i++) {
            charged[i] += projection.power[i];
            x[(size_t)i * steps + t] = charged[i];
        }
    }
}
