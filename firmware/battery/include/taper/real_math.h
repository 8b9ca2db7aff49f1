/** Least and greatest of two reals. Apart from `taper/real.h`, whose readers may be compiled without floating point. */
#ifndef TAPER_REAL_MATH_H
#define TAPER_REAL_MATH_H

#include "taper/real.h"

static inline taper_real_t taper_real_min(taper_real_t a, taper_real_t b) {
    return a < b ? a : b;
}

static inline taper_real_t taper_real_max(taper_real_t a, taper_real_t b) {
    return a > b ? a : b;
}

#endif
