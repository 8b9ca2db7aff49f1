#include "rooms.h"

/** Open the column of `kind`, if any group has such a row. */
static void open_column(taper_rooms_t *rooms, const taper_station_config_t *config,
                        const taper_supply_t *supply, taper_row_kind_t kind) {
    const uint8_t column = rooms->columns;
    bool limited = false;
    for (uint8_t k = 0; k < config->group_count; k++) {
        const int32_t limit = taper_row_limit_now(config, supply, k, kind);
        rooms->room[k][column] = limit == TAPER_NO_LIMIT ? INT64_MAX : (int64_t)limit * 1000;
        limited = limited || limit != TAPER_NO_LIMIT;
    }
    if (limited) {
        rooms->kind[column] = (uint8_t)kind;
        rooms->columns++;
    }
}

void taper_rooms_open(taper_rooms_t *rooms, const taper_station_config_t *config,
                      const taper_supply_t *supply) {
    rooms->columns = 0;
    for (int kind = 0; kind < TAPER_ROW_SUMS; kind++) {
        open_column(rooms, config, supply, (taper_row_kind_t)kind);
    }
}

taper_weights_t taper_rooms_weigh(const taper_rooms_t *rooms, const taper_booking_t *booking) {
    taper_weights_t weights = {{0}};
    for (uint8_t column = 0; column < rooms->columns; column++) {
        weights.of[column] = taper_row_weight(booking, (taper_row_kind_t)rooms->kind[column]);
    }
    return weights;
}

/** How much of `wanted_mA` fits into one room; a room that is not there (INT64_MAX) is never too small. */
static int32_t fit_one_mA(int64_t room, int32_t weight, int32_t wanted_mA) {
    if (weight == 0 || room >= (int64_t)weight * wanted_mA) {
        return wanted_mA;
    }
    return room < 0 ? -1 : (int32_t)(room / weight);
}

int32_t taper_rooms_fit_mA(const taper_rooms_t *rooms, const taper_station_config_t *config, uint8_t i,
                           const taper_weights_t *weights, int32_t wanted_mA) {
    int32_t least_mA = wanted_mA;
    for (uint8_t k = config->connectors[i].group; k != TAPER_NO_GROUP; k = config->groups[k].parent) {
        for (uint8_t column = 0; column < rooms->columns && least_mA >= 0; column++) {
            least_mA = fit_one_mA(rooms->room[k][column], weights->of[column], least_mA);
        }
    }
    return least_mA;
}

void taper_rooms_draw(taper_rooms_t *rooms, const taper_station_config_t *config, uint8_t i,
                      const taper_weights_t *weights, int32_t current_mA) {
    for (uint8_t k = config->connectors[i].group; k != TAPER_NO_GROUP; k = config->groups[k].parent) {
        for (uint8_t column = 0; column < rooms->columns; column++) {
            if (rooms->room[k][column] != INT64_MAX) {
                rooms->room[k][column] -= (int64_t)weights->of[column] * current_mA;
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
