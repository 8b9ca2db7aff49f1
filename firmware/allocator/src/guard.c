/* The last gate. It shares no code with the allocator on purpose: one mistake must not blind both. */
#include "taper/allocator.h"

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
