#include "rooms.h"

void taper_rooms_open(taper_rooms_t *rooms, const taper_station_config_t *config, int32_t site_limit_W) {
    for (uint8_t k = 0; k < config->group_count; k++) {
        int32_t limit_W = config->groups[k].limit_W;
        if (k == 0) {
            limit_W = taper_min_i32(limit_W, site_limit_W);
        }
        rooms->room_mW[k] = (int64_t)taper_max_i32(limit_W, 0) * 1000;
    }
}

int64_t taper_rooms_least(const taper_rooms_t *rooms, const taper_station_config_t *config, uint8_t i) {
    int64_t least = INT64_MAX;
    for (uint8_t k = config->connectors[i].group; k != TAPER_NO_GROUP; k = config->groups[k].parent) {
        least = rooms->room_mW[k] < least ? rooms->room_mW[k] : least;
    }
    return least;
}

void taper_rooms_take(taper_rooms_t *rooms, const taper_station_config_t *config, uint8_t i,
                      int64_t power_mW) {
    for (uint8_t k = config->connectors[i].group; k != TAPER_NO_GROUP; k = config->groups[k].parent) {
        rooms->room_mW[k] -= power_mW;
    }
}

int32_t taper_rooms_W_per_A(const taper_station_config_t *config, const taper_snapshot_t *snapshot,
                            uint8_t i) {
    const taper_connector_config_t *connector = &config->connectors[i];
    if (snapshot->demand[i].active) {
        return taper_demand_booked_W_per_A(&snapshot->demand[i]);
    }
    return taper_max_i32((connector->voltage_mV + 999) / 1000 * connector->phases,
                         snapshot->demand[i].booked_W_per_A);
}
