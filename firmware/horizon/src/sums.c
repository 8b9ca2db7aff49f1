#include "sums.h"

#include <tgmath.h>

static unsigned members_of(const taper_station_config_t *config, uint8_t group, taper_row_kind_t kind) {
    unsigned members = 0;
    for (uint8_t i = 0; i < config->connector_count; i++) {
        members += taper_row_plans(config, group, kind, i) ? 1u : 0u;
    }
    return members;
}

void taper_sums_list(taper_horizon_t *horizon) {
    const taper_station_config_t *config = horizon->config;
    horizon->sum_count = 0;
    for (uint8_t group = 0; group < config->group_count; group++) {
        for (uint8_t kind = 0; kind < TAPER_ROW_KINDS; kind++) {
            if (horizon->sum_count < TAPER_MAX_PLAN_ROWS &&
                taper_row_is_planned(config, group, (taper_row_kind_t)kind)) {
                const unsigned members = members_of(config, group, (taper_row_kind_t)kind);
                horizon->sum[horizon->sum_count++] =
                    (taper_sum_t){.group = group,
                                  .kind = kind,
                                  .scale = (taper_real_t)sqrt((taper_real_t)5 / (taper_real_t)members)};
            }
        }
    }
}

/** What makes the unit of a sum, W or mA, one of power: per W, or in V per thousand. */
static taper_real_t power_per_unit(const taper_station_config_t *config, const taper_sum_t *sum) {
    return sum->kind == TAPER_ROW_POWER ? 1 : (taper_real_t)config->site_voltage_mV / 1000000;
}

/** Power that a connector's vehicle draws by its description for 1 A of setpoint: without losses on the way. */
static int32_t described_W_per_A(const taper_connector_config_t *connector) {
    return (connector->voltage_mV + 999) / 1000 * connector->phases;
}

void taper_sums_weigh(taper_horizon_t *horizon, uint8_t i, const taper_snapshot_t *snapshot) {
    const taper_station_config_t *config = horizon->config;
    const taper_booking_t booking =
        snapshot == NULL ? taper_booking_nominal(config, i) : taper_booking_now(config, snapshot, i);
    const int32_t drawn_W_per_A =
        snapshot == NULL ? described_W_per_A(&config->connectors[i]) : snapshot->demand[i].W_per_A;
    for (uint16_t r = 0; r < horizon->sum_count; r++) {
        const taper_sum_t *sum = &horizon->sum[r];
        horizon->weight[r][i] = 0;
        if (taper_row_plans(config, sum->group, (taper_row_kind_t)sum->kind, i)) {
            const int32_t counted = taper_row_weight(&booking, (taper_row_kind_t)sum->kind);
            horizon->weight[r][i] = sum->scale * ((taper_real_t)counted * power_per_unit(config, sum) /
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
        const taper_real_t per_unit = sum->scale * power_per_unit(config, sum) / horizon->base_W;
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
