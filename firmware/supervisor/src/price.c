/* The known course of the price. */
#include <string.h>

#include "limits_internal.h"

static bool curve_is_good(const taper_price_curve_t *curve) {
    if (curve->count > TAPER_MAX_PRICE_POINTS) {
        return false;
    }
    for (uint16_t k = 0; k < curve->count; k++) {
        const bool ascending =
            k == 0 || !taper_time_reached(curve->point[k - 1].time_ms, curve->point[k].time_ms);
        const uint32_t span_ms = taper_elapsed_ms(curve->point[k].time_ms, curve->point[0].time_ms);
        if (curve->point[k].milli_per_kWh == TAPER_ABSENT || !ascending || span_ms > TAPER_CURVE_SPAN_ms) {
            return false;
        }
    }
    return true;
}

taper_status_t taper_limits_set_price(taper_limits_t *limits, const taper_price_curve_t *curve) {
    if (!curve_is_good(curve)) {
        return TAPER_ERR_ARGUMENT;
    }
    limits->price = *curve;
    limits->revision++;
    return TAPER_OK;
}

/** When the price of point `k` ends. */
static uint32_t end_ms(const taper_price_curve_t *curve, uint16_t k) {
    return k + 1 < curve->count ? curve->point[k + 1].time_ms
                                : curve->point[k].time_ms + TAPER_PRICE_HOLDS_ms;
}

/** The first point from `k` on whose price has not ended at `world_ms`. */
static uint16_t not_ended(const taper_price_curve_t *curve, uint16_t k, uint32_t world_ms) {
    while (k < curve->count && taper_time_reached(world_ms, end_ms(curve, k))) {
        k++;
    }
    return k;
}

/** Mean of what is known of [from_ms, from_ms + length_ms), by the points from `k` on. @return false: nothing is. */
static bool mean(const taper_price_curve_t *curve, uint16_t k, uint32_t from_ms, uint32_t length_ms,
                 int32_t *milli_per_kWh) {
    int64_t sum = 0;
    uint32_t known_ms = 0;
    for (bool beyond = false; k < curve->count && !beyond; k++) {
        const uint32_t point_ms = curve->point[k].time_ms;
        const uint32_t begin_ms = taper_time_reached(from_ms, point_ms) ? 0 : point_ms - from_ms;
        const uint32_t until_ms = end_ms(curve, k) - from_ms;
        beyond = until_ms >= length_ms;
        if (begin_ms < length_ms) {
            const uint32_t part_ms = (beyond ? length_ms : until_ms) - begin_ms;
            sum += (int64_t)curve->point[k].milli_per_kWh * part_ms;
            known_ms += part_ms;
        }
    }
    *milli_per_kWh = known_ms == 0 ? 0 : (int32_t)(sum / known_ms);
    return known_ms > 0;
}

/** Steps of which nothing is known get the mean of the others, if these are at least half of all. */
static void fill_gaps(taper_course_t *course, const bool *known, uint8_t steps) {
    int64_t sum = 0;
    int32_t known_steps = 0;
    for (uint8_t t = 0; t < steps; t++) {
        sum += course->milli_per_kWh[t]; /* 0 where nothing is known */
        known_steps += known[t] ? 1 : 0;
    }
    course->priced = 2 * known_steps >= steps;
    for (uint8_t t = 0; t < steps; t++) {
        if (!course->priced) {
            course->milli_per_kWh[t] = 0;
        } else if (!known[t]) {
            course->milli_per_kWh[t] = (int32_t)(sum / known_steps);
        }
    }
}

void taper_price_course(const taper_limits_t *limits, uint32_t world_ms, taper_course_t *course) {
    const uint32_t step_ms = limits->config->step_s * UINT32_C(1000);
    bool known[TAPER_MAX_STEPS] = {false};
    uint16_t k = 0;
    for (uint8_t t = 0; t < limits->config->steps; t++) {
        const uint32_t from_ms = world_ms + t * step_ms;
        k = not_ended(&limits->price, k, from_ms);
        known[t] = mean(&limits->price, k, from_ms, step_ms, &course->milli_per_kWh[t]);
    }
    fill_gaps(course, known, limits->config->steps);
}

void taper_price_forget(taper_limits_t *limits, uint32_t world_ms) {
    taper_price_curve_t *curve = &limits->price;
    const uint16_t past = not_ended(curve, 0, world_ms);
    curve->count = (uint16_t)(curve->count - past);
    memmove(curve->point, curve->point + past, curve->count * sizeof curve->point[0]);
    if (curve->count > 1 && taper_time_reached(world_ms, curve->point[0].time_ms)) {
        curve->point[0].time_ms = world_ms; /* only the time of the last point says when its price ends */
    }
}
