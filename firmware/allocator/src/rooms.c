#include "rooms.h"

/** Set the room of one kind in all groups. @return whether any group has such a row. */
static bool open_kind(taper_rooms_t *rooms, const taper_station_config_t *config,
                      const taper_supply_t *supply, taper_row_kind_t kind) {
    bool limited = false;
    for (uint8_t k = 0; k < config->group_count; k++) {
        const int32_t limit = taper_row_limit_now(config, supply, k, kind);
        rooms->room[k][kind] = limit == TAPER_NO_LIMIT ? INT64_MAX : (int64_t)limit * 1000;
        limited = limited || limit != TAPER_NO_LIMIT;
    }
    return limited;
}

void taper_rooms_open(taper_rooms_t *rooms, const taper_station_config_t *config,
                      const taper_supply_t *supply) {
    *rooms = (taper_rooms_t){.kinds = 0};
    for (int kind = 0; kind < TAPER_ROW_SUMS; kind++) {
        if (open_kind(rooms, config, supply, (taper_row_kind_t)kind)) {
            rooms->kind[rooms->kinds++] = (uint8_t)kind;
        }
    }
}

taper_weights_t taper_rooms_weigh(const taper_rooms_t *rooms, const taper_booking_t *booking) {
    taper_weights_t weights;
    for (unsigned at = 0; at < rooms->kinds; at++) {
        weights.of[rooms->kind[at]] = taper_row_weight(booking, (taper_row_kind_t)rooms->kind[at]);
    }
    return weights;
}

int32_t taper_rooms_fit_mA(const taper_rooms_t *rooms, const taper_station_config_t *config, uint8_t i,
                           const taper_weights_t *weights, int32_t wanted_mA) {
    int64_t least_mA = wanted_mA;
    for (uint8_t k = config->connectors[i].group; k != TAPER_NO_GROUP; k = config->groups[k].parent) {
        const int64_t *room = rooms->room[k];
        for (unsigned at = 0; at < rooms->kinds; at++) {
            const unsigned kind = rooms->kind[at];
            const int64_t weight = weights->of[kind];
            if (weight * least_mA > room[kind] && weight > 0) { /* never so where there is no row */
                least_mA = room[kind] < 0 ? -1 : room[kind] / weight;
            }
        }
    }
    return (int32_t)least_mA;
}

void taper_rooms_draw(taper_rooms_t *rooms, const taper_station_config_t *config, uint8_t i,
                      const taper_weights_t *weights, int32_t current_mA) {
    for (uint8_t k = config->connectors[i].group; k != TAPER_NO_GROUP; k = config->groups[k].parent) {
        int64_t *room = rooms->room[k];
        for (unsigned at = 0; at < rooms->kinds; at++) {
            const unsigned kind = rooms->kind[at];
            if (room[kind] != INT64_MAX) {
                room[kind] -= (int64_t)weights->of[kind] * current_mA;
            }
        }
    }
}

int32_t taper_rooms_left_mA(const taper_rooms_t *rooms, const taper_station_config_t *config, uint8_t i,
                            const taper_booking_t *booking) {
    const taper_weights_t weights = taper_rooms_weigh(rooms, booking);
    return taper_rooms_fit_mA(rooms, config, i, &weights, INT32_MAX);
}

void taper_rooms_take(taper_rooms_t *rooms, const taper_station_config_t *config, uint8_t i,
                      const taper_booking_t *booking, int32_t current_mA) {
    const taper_weights_t weights = taper_rooms_weigh(rooms, booking);
    taper_rooms_draw(rooms, config, i, &weights, current_mA);
}
