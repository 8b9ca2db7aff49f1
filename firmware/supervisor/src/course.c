/* What is known of the coming planning steps. */
#include <string.h>

#include "limits_internal.h"

/** SITE_LIMIT says its limit in steps of this [W]: less than the curve by up to a step is still the curve's limit. */
#define WIRE_STEP_W 100

/** What bounds every step alike. */
typedef struct {
    taper_bound_t lasting; /**< the present limit, if the curves do not explain it */
    int32_t other_W;
} constant_t;

/** The least of lasting and known limits at a place. */
static taper_bound_t bound_at(const taper_limits_t *limits, const taper_curves_place_t *place,
                              const constant_t *constant) {
    return taper_bound_least(constant->lasting, taper_curves_bound(limits, place));
}

static int32_t for_charging_W(taper_bound_t bound, const constant_t *constant) {
    return taper_max_i32(bound.limit_W - constant->other_W, 0);
}

/** Mean over [from_ms, from_ms + length_ms), for charging. `*place` is that of `from_ms`, and moves along to the end. */
static taper_bound_t mean(const taper_limits_t *limits, uint32_t from_ms, uint32_t length_ms,
                          const constant_t *constant, taper_curves_place_t *place) {
    taper_bound_t lowest = bound_at(limits, place, constant);
    int64_t sum = 0;
    uint32_t done_ms = 0;
    while (done_ms < length_ms) {
        const taper_bound_t bound = bound_at(limits, place, constant);
        const uint32_t until_ms = taper_curves_next_change_ms(limits, place, from_ms, length_ms);
        lowest = taper_bound_least(lowest, bound);
        sum += (int64_t)for_charging_W(bound, constant) * (until_ms - done_ms);
        done_ms = until_ms;
        taper_curves_advance(limits, from_ms + done_ms, place);
    }
    /* No checked station has steps of no length; a division by zero must not depend on that. */
    const int32_t mean_W = length_ms == 0 ? for_charging_W(lowest, constant) : (int32_t)(sum / length_ms);
    return (taper_bound_t){mean_W, lowest.source};
}

void taper_limits_course(const taper_limits_t *limits, uint32_t now_ms, taper_course_t *course) {
    const uint32_t step_ms = limits->config->step_s * UINT32_C(1000);
    const uint32_t world_ms = taper_limits_world_ms(limits, now_ms);
    const taper_bound_t present = taper_limits_bound(limits, now_ms);
    taper_curves_place_t place = taper_curves_find(limits, world_ms);
    const bool explained = taper_curves_bound(limits, &place).limit_W - present.limit_W < WIRE_STEP_W;
    const taper_bound_t none = {INT32_MAX, TAPER_LIMIT_STATION};
    const constant_t constant = {.lasting = explained ? none : present,
                                 .other_W = taper_limits_other_W(limits, now_ms)};
    memset(course, 0, sizeof *course);
    for (uint8_t t = 0; t < limits->config->steps; t++) {
        const taper_bound_t step = mean(limits, world_ms + t * step_ms, step_ms, &constant, &place);
        course->limit_W[t] = step.limit_W;
        course->source[t] = (uint8_t)step.source;
    }
    course->limit_W[0] = for_charging_W(present, &constant);
    course->source[0] = (uint8_t)present.source;
    taper_meter_supply(limits, now_ms, course->phase_mA);
    taper_price_course(limits, world_ms, course);
}
