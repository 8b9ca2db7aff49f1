/**
 * The taper: how much power a battery takes at a given state of charge (SOC).
 *
 * Model (paper, eq. 5): a line that falls from `peak_W` at SOC 0 by `taper_W` until SOC 1,
 *
 *     limit(x) = peak - taper * x / capacity,  never below 0
 *
 * with x the energy in the battery; the lower one, where there is a second line (`second_peak_W`, `second_taper_W`). With the
 * flat limit of connector and vehicle (`max_mA`), above which a line may begin, this is a concave limit of two or three
 * pieces: flat, then tapered. A vehicle of unknown capacity has no taper.
 */
#ifndef TAPER_BATTERY_H
#define TAPER_BATTERY_H

#include <stdint.h>

#include "taper/types.h"

/** Most that the vehicle takes at its present SOC [W], >= 0, rounded up. Integer arithmetic. */
int32_t taper_battery_limit_W(const taper_demand_t *demand);

/**
 * Most that is of any use over the next `tick_ms` [W], >= 0: the least of what connector and vehicle allow, what the
 * battery takes, and what completes the need within the tick, rounded up. 0 for an inactive demand.
 */
int32_t taper_battery_useful_W(const taper_demand_t *demand, uint32_t tick_ms);

#endif
