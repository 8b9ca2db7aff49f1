/** Private to the layer: the room that is left in every group of the feeder tree. */
#ifndef TAPER_ROOMS_H
#define TAPER_ROOMS_H

#include "taper/types.h"

typedef struct {
    int64_t room_mW[TAPER_MAX_GROUPS];
} taper_rooms_t;

/** All rooms at their limits; `site_limit_W` (negative counts as 0) bounds group 0 besides its own. */
void taper_rooms_open(taper_rooms_t *rooms, const taper_station_config_t *config, int32_t site_limit_W);

/** Least room of the groups above connector `i`. */
int64_t taper_rooms_least(const taper_rooms_t *rooms, const taper_station_config_t *config, uint8_t i);

/** Take `power_mW` from all of them. */
void taper_rooms_take(taper_rooms_t *rooms, const taper_station_config_t *config, uint8_t i,
                      int64_t power_mW);

/** What 1 A of connector `i` counts: as its demand says, or by its description while there is none. */
int32_t taper_rooms_W_per_A(const taper_station_config_t *config, const taper_snapshot_t *snapshot,
                            uint8_t i);

#endif
