#include "taper/real.h"

int32_t taper_real_to_W(taper_real_t value, int32_t most_W) {
    if (!(value > 0)) { /* also NaN */
        return 0;
    }
    return value < (taper_real_t)most_W ? (int32_t)(value + (taper_real_t)0.5) : most_W;
}
