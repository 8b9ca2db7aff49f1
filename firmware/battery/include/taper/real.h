/** The floating-point type of battery, horizon and planner: chosen once per build, no other layer uses one. */
#ifndef TAPER_REAL_H
#define TAPER_REAL_H

#include <stdint.h>

#include "taper/sizes.h"

#if TAPER_REAL_IS_DOUBLE
typedef double taper_real_t;
#else
typedef float taper_real_t;
#endif

/** "No bound". What every solver of the family takes for infinite. */
#define TAPER_REAL_UNBOUNDED ((taper_real_t)1e30)

/** Whole watts of a real of any value, rounded: NaN and what is not positive gives 0, what is too large `most_W`. */
int32_t taper_real_to_W(taper_real_t value, int32_t most_W);

#endif
