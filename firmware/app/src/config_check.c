#include "taper/config_check.h"

static bool sizes_fit(const taper_station_config_t *config) {
    return config->connector_count >= 1 && config->connector_count <= TAPER_MAX_CONNECTORS &&
           config->group_count >= 1 && config->group_count <= TAPER_MAX_GROUPS && config->steps >= 2 &&
           config->steps <= TAPER_MAX_STEPS;
}

/** Times in the range that their use was thought through for (codegen/station.py has the same). */
static bool times_are_sound(const taper_station_config_t *config) {
    return config->step_s >= 60 && config->step_s <= 3600 && config->tick_ms >= 1 &&
           config->tick_ms <= 3600000;
}

/** A parent before its children: one look at each parent shows that there is no cycle. */
static bool tree_is_sound(const taper_station_config_t *config) {
    for (uint8_t k = 0; k < config->group_count; k++) {
        const taper_group_config_t *group = &config->groups[k];
        const bool rooted = k == 0 ? group->parent == TAPER_NO_GROUP : group->parent < k;
        if (!rooted || group->limit_W <= 0) {
            return false;
        }
    }
    return true;
}

static bool connector_is_sound(const taper_station_config_t *config, uint8_t i) {
    const taper_connector_config_t *connector = &config->connectors[i];
    return connector->group < config->group_count && connector->min_mA >= 0 &&
           connector->max_mA >= TAPER_CURRENT_STEP_mA && connector->min_mA <= connector->max_mA &&
           connector->max_mA <= 1000000 && connector->voltage_mV > 0 && connector->voltage_mV <= 2000000 &&
           (connector->phases == 1 || connector->phases == 3) && connector->bus < TAPER_MAX_BUSES &&
           connector->node >= 1 && connector->node <= TAPER_NODES_PER_BUS;
}

static bool address_is_unique(const taper_station_config_t *config, uint8_t i) {
    for (uint8_t other = 0; other < i; other++) {
        if (config->connectors[other].bus == config->connectors[i].bus &&
            config->connectors[other].node == config->connectors[i].node) {
            return false;
        }
    }
    return true;
}

taper_status_t taper_config_check(const taper_station_config_t *config) {
    if (!sizes_fit(config) || !times_are_sound(config) || !tree_is_sound(config) || config->failsafe_W < 0 ||
        config->failsafe_W > config->groups[0].limit_W) {
        return TAPER_ERR_CONFIG;
    }
    for (uint8_t i = 0; i < config->connector_count; i++) {
        if (!connector_is_sound(config, i) || !address_is_unique(config, i)) {
            return TAPER_ERR_CONFIG;
        }
    }
    return TAPER_OK;
}
