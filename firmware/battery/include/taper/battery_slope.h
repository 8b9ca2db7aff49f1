/** The taper as the horizon needs it, in floating point; the rest of it is integers (`taper/battery.h`). */
#ifndef TAPER_BATTERY_SLOPE_H
#define TAPER_BATTERY_SLOPE_H

#include "taper/real.h"
#include "taper/types.h"

/** Fall of line 0 or 1 of the limit per energy charged: `a` in `u + a x <= p` [1/h], >= 0. */
taper_real_t taper_battery_slope_per_h(const taper_demand_t *demand, uint8_t line);

/**
 * The limit of line 0 or 1 at the present SOC [W], >= 0; TAPER_REAL_UNBOUNDED where the vehicle has no such line. Not in whole
 * watts: of a battery that is nearly full they are a percent.
 */
taper_real_t taper_battery_line_now_W(const taper_demand_t *demand, uint8_t line);

#endif
