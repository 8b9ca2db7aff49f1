/** Private to the layer: the room that is left in every row of the feeder tree (taper/rows.h). */
#ifndef TAPER_ROOMS_H
#define TAPER_ROOMS_H

#include "taper/rows.h"

/** Rows of sums by group and kind. Only kinds that some group has are looked at: others cost nothing. */
typedef struct {
    uint8_t kinds;
    uint8_t kind[TAPER_ROW_SUMS];                   /**< [kinds] taper_row_kind_t */
    int64_t room[TAPER_MAX_GROUPS][TAPER_ROW_SUMS]; /**< by kind, in thousandths of the row's unit: mW, or uA.
                                                         INT64_MAX: the group has no such row */
} taper_rooms_t;

/** Weights of one connector in the rows above it, by kind; >= 0. Those of kinds that no group has are not set. */
typedef struct {
    int32_t of[TAPER_ROW_SUMS];
} taper_weights_t;

/** All rooms at their limits. */
void taper_rooms_open(taper_rooms_t *rooms, const taper_station_config_t *config,
                      const taper_supply_t *supply);

/** What 1 A of a connector takes from each row. */
taper_weights_t taper_rooms_weigh(const taper_rooms_t *rooms, const taper_booking_t *booking);

/** How much of `wanted_mA` (>= 0) connector `i` can be raised by [mA]; negative: some row above it is overdrawn. */
int32_t taper_rooms_fit_mA(const taper_rooms_t *rooms, const taper_station_config_t *config, uint8_t i,
                           const taper_weights_t *weights, int32_t wanted_mA);

/** Take `current_mA` of connector `i` from all rows above it. */
void taper_rooms_draw(taper_rooms_t *rooms, const taper_station_config_t *config, uint8_t i,
                      const taper_weights_t *weights, int32_t current_mA);

/** The same two for who asks once: the most that fits, and taking it. */
int32_t taper_rooms_left_mA(const taper_rooms_t *rooms, const taper_station_config_t *config, uint8_t i,
                            const taper_booking_t *booking);
void taper_rooms_take(taper_rooms_t *rooms, const taper_station_config_t *config, uint8_t i,
                      const taper_booking_t *booking, int32_t current_mA);

#endif
