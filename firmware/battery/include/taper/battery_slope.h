/** The taper as the horizon needs it, in floating point; the rest of it is integers (`taper/battery.h`). */
#ifndef TAPER_BATTERY_SLOPE_H
#define TAPER_BATTERY_SLOPE_H

#include "taper/real.h"
#include "taper/types.h"

/** Fall of the limit per energy charged: `a` in `u + a x <= p` [1/h], >= 0. */
taper_real_t taper_battery_slope_per_h(const taper_demand_t *demand);

/** The limit at the present SOC [W], >= 0. Not in whole watts: of a battery that is nearly full they are a percent. */
taper_real_t taper_battery_limit_now_W(const taper_demand_t *demand);

#endif
