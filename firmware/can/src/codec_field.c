#include "codec_internal.h"

/* C divides towards zero; "down" must hold for negative limits too. */
static int32_t divide_down(int32_t value, int32_t step) {
    const int32_t quotient = value / step;
    return value % step < 0 ? quotient - 1 : quotient;
}

static int32_t divide(int32_t value, int32_t step, taper_rounding_t rounding) {
    const int32_t down = divide_down(value, step);
    const int64_t rest = value - (int64_t)down * step;
    if (rounding == TAPER_ROUND_UP && rest > 0) {
        return down + 1;
    }
    if (rounding == TAPER_ROUND_NEAREST && 2 * rest >= step) {
        return down + 1;
    }
    return down;
}

int32_t taper_field_encode(const taper_field_t *field, int32_t value) {
    if (value == TAPER_ABSENT && field->absent != TAPER_FIELD_ALWAYS) {
        return field->absent;
    }
    /* Limited first, so that the greatest value cannot run over when it is rounded up. */
    const int32_t limited = taper_clamp_i32(value, field->low * field->step, field->high * field->step);
    return divide(limited, field->step, field->rounding);
}
