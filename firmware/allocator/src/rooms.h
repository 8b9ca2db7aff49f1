/** Private to the layer: the room that is left in every row of sums of the feeder tree (taper/rows.h). */
#ifndef TAPER_ROOMS_H
#define TAPER_ROOMS_H

#include "taper/rows.h"

/** By group, and in the order of the listed rows, in thousandths of a row's unit: mW, or uA. */
typedef struct {
    int64_t left[TAPER_MAX_GROUPS][TAPER_ROW_SUMS];
} taper_rooms_t;

/** What is left where a group has no row: more than all connectors together can take. */
#define TAPER_NO_ROW (INT64_MAX / 2)

/** All rooms at their limits. */
void taper_rooms_open(taper_rooms_t *rooms, const taper_station_config_t *config, const taper_rows_t *rows);

/** How much of `wanted_mA` (>= 0) connector `i` can be raised by [mA]; negative: some row above it is overdrawn. */
int32_t taper_rooms_fit_mA(const taper_rooms_t *rooms, const taper_station_config_t *config,
                           const taper_rows_t *rows, uint8_t i, int32_t wanted_mA);

/** Take `current_mA` of connector `i` from all rows above it. */
void taper_rooms_draw(taper_rooms_t *rooms, const taper_station_config_t *config, const taper_rows_t *rows,
                      uint8_t i, int32_t current_mA);

#endif
