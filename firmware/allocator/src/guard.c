/* The last gate. It shares no code with the allocator on purpose: one mistake must not blind both. */
#include "taper/allocator.h"
#include "taper/ledger.h"

static bool connector_passes(const taper_connector_config_t *connector, const taper_demand_t *demand,
                             int32_t current_mA) {
    if (current_mA == 0) {
        return true;
    }
    return demand->active && current_mA > 0 && current_mA <= connector->max_mA &&
           current_mA <= demand->max_mA && current_mA >= demand->min_mA &&
           current_mA % TAPER_CURRENT_STEP_mA == 0;
}

bool taper_guard_passes(const taper_station_config_t *config, const taper_snapshot_t *snapshot,
                        const taper_supply_t *supply, const taper_setpoints_t *setpoints) {
    int64_t sum_mW[TAPER_MAX_GROUPS] = {0};
    for (uint8_t i = 0; i < config->connector_count; i++) {
        const int32_t current_mA = setpoints->current_mA[i];
        if (!connector_passes(&config->connectors[i], &snapshot->demand[i], current_mA)) {
            return false;
        }
        if (current_mA > 0) {
            sum_mW[config->connectors[i].group] +=
                (int64_t)current_mA *
                taper_max_i32(snapshot->demand[i].booking.W_per_A, snapshot->demand[i].W_per_A);
        }
    }
    for (uint8_t k = config->group_count; k-- > 0;) { /* children stand behind their parents */
        const int64_t limit_mW = (int64_t)config->groups[k].limit_W * 1000;
        if (sum_mW[k] > limit_mW ||
            (k == 0 && sum_mW[k] > (int64_t)taper_max_i32(supply->site_W, 0) * 1000)) {
            return false;
        }
        if (k > 0) {
            sum_mW[config->groups[k].parent] += sum_mW[k];
        }
    }
    return true;
}

/** Sums per group of `current_mA`, a child's in its parent's. */
static void sum_groups(const taper_station_config_t *config, const taper_snapshot_t *snapshot,
                       const int32_t *current_mA, int64_t *sum_mW) {
    for (uint8_t i = 0; i < config->connector_count; i++) {
        const taper_connector_config_t *connector = &config->connectors[i];
        const int32_t nominal_W_per_A = (connector->voltage_mV + 999) / 1000 * connector->phases;
        const taper_demand_t *demand = &snapshot->demand[i];
        const int32_t W_per_A = demand->active ? taper_max_i32(demand->booking.W_per_A, demand->W_per_A)
                                               : taper_max_i32(demand->booking.W_per_A, nominal_W_per_A);
        sum_mW[connector->group] += (int64_t)current_mA[i] * W_per_A;
    }
    for (uint8_t k = config->group_count; k-- > 1;) {
        sum_mW[config->groups[k].parent] += sum_mW[k];
    }
}

bool taper_guard_hand_over_passes(const taper_ledger_t *ledger, const taper_station_config_t *config,
                                  const taper_snapshot_t *snapshot, const taper_supply_t *supply,
                                  const taper_setpoints_t *granted) {
    int32_t before_mA[TAPER_MAX_CONNECTORS];
    int32_t after_mA[TAPER_MAX_CONNECTORS];
    int64_t before_mW[TAPER_MAX_GROUPS] = {0};
    int64_t after_mW[TAPER_MAX_GROUPS] = {0};
    for (uint8_t i = 0; i < config->connector_count; i++) {
        before_mA[i] = taper_ledger_may_mA(ledger, i);
        after_mA[i] = taper_max_i32(before_mA[i], granted->current_mA[i]);
    }
    sum_groups(config, snapshot, before_mA, before_mW);
    sum_groups(config, snapshot, after_mA, after_mW);
    for (uint8_t k = 0; k < config->group_count; k++) {
        const int32_t limit_W =
            k == 0 ? taper_min_i32(config->groups[0].limit_W, supply->site_W) : config->groups[k].limit_W;
        if (after_mW[k] > (int64_t)taper_max_i32(limit_W, 0) * 1000 && after_mW[k] > before_mW[k]) {
            return false;
        }
    }
    return true;
}
