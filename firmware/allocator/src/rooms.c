#include "rooms.h"

void taper_rooms_open(taper_rooms_t *rooms, const taper_station_config_t *config,
                      const taper_supply_t *supply) {
    for (uint8_t k = 0; k < config->group_count; k++) {
        for (int kind = 0; kind < TAPER_ROW_SUMS; kind++) {
            const int32_t limit = taper_row_limit_now(config, supply, k, (taper_row_kind_t)kind);
            rooms->room[k][kind] = limit == TAPER_NO_LIMIT ? INT64_MAX : (int64_t)limit * 1000;
        }
    }
}

int32_t taper_rooms_left_mA(const taper_rooms_t *rooms, const taper_station_config_t *config, uint8_t i,
                            const taper_booking_t *booking) {
    int64_t least_mA = INT32_MAX;
    for (uint8_t k = config->connectors[i].group; k != TAPER_NO_GROUP; k = config->groups[k].parent) {
        for (int kind = 0; kind < TAPER_ROW_SUMS; kind++) {
            const int32_t weight = taper_row_weight(booking, (taper_row_kind_t)kind);
            const int64_t room = rooms->room[k][kind];
            if (weight > 0 && room != INT64_MAX) {
                const int64_t fits_mA = room < 0 ? -1 : room / weight;
                least_mA = fits_mA < least_mA ? fits_mA : least_mA;
            }
        }
    }
    return (int32_t)least_mA;
}

void taper_rooms_take(taper_rooms_t *rooms, const taper_station_config_t *config, uint8_t i,
                      const taper_booking_t *booking, int32_t current_mA) {
    for (uint8_t k = config->connectors[i].group; k != TAPER_NO_GROUP; k = config->groups[k].parent) {
        for (int kind = 0; kind < TAPER_ROW_SUMS; kind++) {
            if (rooms->room[k][kind] != INT64_MAX) {
                rooms->room[k][kind] -=
                    (int64_t)taper_row_weight(booking, (taper_row_kind_t)kind) * current_mA;
            }
        }
    }
}
