#include "sums.h"

#include <tgmath.h>

#include "taper/real_math.h"

/** What makes the unit of a sum, W or mA, one of power: per W, or in V per thousand. */
static taper_real_t power_per_unit(const taper_station_config_t *config, taper_row_kind_t kind) {
    return kind == TAPER_ROW_POWER ? 1 : (taper_real_t)config->site_voltage_mV / 1000000;
}

/** Power that a connector's vehicle draws by its description for 1 A of setpoint: without losses on the way. */
static int32_t described_W_per_A(const taper_connector_config_t *connector) {
    return (connector->voltage_mV + 999) / 1000 * connector->phases;
}

/** c_ri of a connector with all conductors in use; 0: it is not in the row. */
static taper_real_t described_weight(const taper_station_config_t *config, uint8_t group,
                                     taper_row_kind_t kind, uint8_t i) {
    if (!taper_row_plans(config, group, kind, i)) {
        return 0;
    }
    const taper_booking_t booking = taper_booking_nominal(config, i);
    return (taper_real_t)taper_row_weight(&booking, kind) * power_per_unit(config, kind) /
           (taper_real_t)described_W_per_A(&config->connectors[i]);
}

/** Factor of the rows of a sum: one of power or a difference by its number of connectors, one of currents by its norm. */
static taper_real_t scale_of(const taper_station_config_t *config, uint8_t group, taper_row_kind_t kind) {
    const bool is_current = kind != TAPER_ROW_POWER && kind < TAPER_ROW_SUMS;
    taper_real_t squares = 0;
    for (uint8_t i = 0; i < config->connector_count; i++) {
        const taper_real_t weight = described_weight(config, group, kind, i);
        squares +=
            is_current ? weight * weight : (taper_real_t)(taper_row_plans(config, group, kind, i) ? 1 : 0);
    }
    const taper_real_t scale = (taper_real_t)sqrt((taper_real_t)5 / squares);
    return is_current ? scale * TAPER_CURRENT_SCALE : scale;
}

void taper_sums_list(taper_horizon_t *horizon) {
    const taper_station_config_t *config = horizon->config;
    horizon->sum_count = 0;
    for (uint8_t group = 0; group < config->group_count; group++) {
        for (uint8_t k = 0; k < TAPER_ROW_KINDS; k++) {
            const taper_row_kind_t kind = (taper_row_kind_t)k;
            if (horizon->sum_count < TAPER_MAX_PLAN_ROWS && taper_row_is_planned(config, group, kind)) {
                horizon->sum[horizon->sum_count++] =
                    (taper_sum_t){.group = group, .kind = k, .scale = scale_of(config, group, kind)};
            }
        }
    }
}

void taper_sums_weigh(taper_horizon_t *horizon, uint8_t i, const taper_snapshot_t *snapshot) {
    const taper_station_config_t *config = horizon->config;
    const taper_booking_t booking =
        snapshot == NULL ? taper_booking_nominal(config, i) : taper_booking_now(config, snapshot, i);
    const int32_t drawn_W_per_A =
        snapshot == NULL ? described_W_per_A(&config->connectors[i]) : snapshot->demand[i].W_per_A;
    for (uint16_t r = 0; r < horizon->sum_count; r++) {
        const taper_sum_t *sum = &horizon->sum[r];
        const taper_row_kind_t kind = (taper_row_kind_t)sum->kind;
        horizon->weight[r][i] = 0;
        if (taper_row_plans(config, sum->group, kind, i)) {
            const int32_t counted = taper_row_weight(&booking, kind);
            horizon->weight[r][i] = sum->scale * ((taper_real_t)counted * power_per_unit(config, kind) /
                                                  (taper_real_t)drawn_W_per_A);
        }
    }
}

void taper_sums_bound(taper_horizon_t *horizon, const taper_course_t *course) {
    const taper_station_config_t *config = horizon->config;
    size_t row = taper_first_sum_row(config);
    for (uint16_t r = 0; r < horizon->sum_count; r++) {
        const taper_sum_t *sum = &horizon->sum[r];
        const taper_row_kind_t kind = (taper_row_kind_t)sum->kind;
        const taper_real_t per_unit = sum->scale * power_per_unit(config, kind) / horizon->base_W;
        taper_supply_t supply = {.phase_mA = {course->phase_mA[0], course->phase_mA[1], course->phase_mA[2]}};
        for (uint8_t t = 0; t < config->steps; t++, row++) {
            supply.site_W = course->limit_W[t];
            const int32_t limit = taper_row_limit_now(config, &supply, sum->group, kind);
            horizon->upper[row] = (taper_real_t)limit * per_unit;
            horizon->lower[row] = kind < TAPER_ROW_SUMS ? -TAPER_REAL_UNBOUNDED : -horizon->upper[row];
        }
    }
}

taper_real_t taper_sums_most(const taper_horizon_t *horizon, uint8_t i) {
    const taper_real_t *upper = horizon->upper + taper_first_sum_row(horizon->config);
    taper_real_t most = TAPER_REAL_UNBOUNDED;
    for (uint16_t r = 0; r < horizon->sum_count && horizon->sum[r].group == 0; r++) {
        const bool is_line = horizon->sum[r].kind >= TAPER_ROW_L1 && horizon->sum[r].kind <= TAPER_ROW_L3_B;
        if (is_line && horizon->weight[r][i] > 0) {
            most = taper_real_min(most, upper[(size_t)r * horizon->config->steps] / horizon->weight[r][i]);
        }
    }
    return most;
}
