#include "rooms.h"

void taper_rooms_open(taper_rooms_t *rooms, const taper_station_config_t *config, const taper_rows_t *rows) {
    for (uint8_t k = 0; k < config->group_count; k++) {
        for (unsigned row = 0; row < rows->sums; row++) {
            const int32_t limit = rows->limit[k][row];
            rooms->left[k][row] = limit == TAPER_NO_LIMIT ? TAPER_NO_ROW : (int64_t)limit * 1000;
        }
    }
}

int32_t taper_rooms_fit_mA(const taper_rooms_t *rooms, const taper_station_config_t *config,
                           const taper_rows_t *rows, uint8_t i, int32_t wanted_mA) {
    const int32_t *weight = rows->weight[i];
    int32_t least_mA = wanted_mA;
    for (uint8_t k = config->connectors[i].group; k != TAPER_NO_GROUP; k = config->groups[k].parent) {
        const int64_t *left = rooms->left[k];
        for (unsigned row = 0; row < rows->sums; row++) {
            if ((int64_t)weight[row] * least_mA > left[row] && weight[row] > 0) {
                least_mA = left[row] < 0 ? -1 : (int32_t)taper_quotient(left[row], weight[row]);
            }
        }
    }
    return least_mA;
}

void taper_rooms_draw(taper_rooms_t *rooms, const taper_station_config_t *config, const taper_rows_t *rows,
                      uint8_t i, int32_t current_mA) {
    const int32_t *weight = rows->weight[i];
    for (uint8_t k = config->connectors[i].group; k != TAPER_NO_GROUP; k = config->groups[k].parent) {
        int64_t *left = rooms->left[k];
        for (unsigned row = 0; row < rows->sums; row++) {
            left[row] -= (int64_t)weight[row] * current_mA;
        }
    }
}
