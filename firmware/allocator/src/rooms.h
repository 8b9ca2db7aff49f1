/** Private to the layer: the room that is left in every row of the feeder tree (taper/rows.h). */
#ifndef TAPER_ROOMS_H
#define TAPER_ROOMS_H

#include "taper/rows.h"

/** Rows of sums by group and kind, in thousandths of the row's unit: mW, or uA. INT64_MAX: there is no such row. */
typedef struct {
    int64_t room[TAPER_MAX_GROUPS][TAPER_ROW_SUMS];
} taper_rooms_t;

/** All rooms at their limits. */
void taper_rooms_open(taper_rooms_t *rooms, const taper_station_config_t *config,
                      const taper_supply_t *supply);

/** Most that connector `i` can be raised by [mA]; negative: some row above it is overdrawn. */
int32_t taper_rooms_left_mA(const taper_rooms_t *rooms, const taper_station_config_t *config, uint8_t i,
                            const taper_booking_t *booking);

/** Take `current_mA` of connector `i` from all rows above it. */
void taper_rooms_take(taper_rooms_t *rooms, const taper_station_config_t *config, uint8_t i,
                      const taper_booking_t *booking, int32_t current_mA);

#endif
