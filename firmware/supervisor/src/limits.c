#include "taper/limits.h"

#include <string.h>

/** SITE_LIMIT says its limit in steps of this [W]: less than the curve by up to a step is still the curve's limit. */
#define WIRE_STEP_W 100

void taper_limits_init(taper_limits_t *limits, const taper_station_config_t *config) {
    memset(limits, 0, sizeof *limits);
    limits->config = config;
    limits->failsafe_W = config->failsafe_W;
}

void taper_limits_apply(taper_limits_t *limits, const taper_site_limit_t *message, uint32_t now_ms) {
    if (message->failsafe_W != TAPER_ABSENT) {
        limits->failsafe_W = taper_clamp_i32(message->failsafe_W, 0, limits->config->groups[0].limit_W);
    }
    if (message->active && message->limit_W == TAPER_ABSENT) {
        return;
    }
    if (message->active && message->limit_W < 0) {
        taper_count(&limits->negative);
    }
    limits->heard = true;
    limits->alive = true;
    limits->heard_ms = now_ms;
    limits->gateway_W = message->active ? taper_max_i32(message->limit_W, 0) : INT32_MAX;
    const bool shorter =
        message->validity_s != TAPER_ABSENT && message->validity_s * 1000 < TAPER_SITE_LIMIT_TIMEOUT_ms;
    limits->holds_ms = shorter ? (uint32_t)message->validity_s * 1000 : TAPER_SITE_LIMIT_TIMEOUT_ms;
}

taper_status_t taper_limits_set_curve(taper_limits_t *limits, const taper_limit_curve_t *curve) {
    if (curve->count > TAPER_MAX_LIMIT_POINTS) {
        return TAPER_ERR_ARGUMENT;
    }
    for (uint16_t k = 0; k < curve->count; k++) {
        const bool ascending =
            k == 0 || !taper_time_reached(curve->point[k - 1].time_ms, curve->point[k].time_ms);
        const uint32_t span_ms = taper_elapsed_ms(curve->point[k].time_ms, curve->point[0].time_ms);
        if (curve->point[k].limit_W < 0 || !ascending || span_ms > TAPER_CURVE_SPAN_ms) {
            return TAPER_ERR_ARGUMENT;
        }
    }
    limits->curve = *curve;
    return TAPER_OK;
}

bool taper_limits_gateway_alive(const taper_limits_t *limits, uint32_t now_ms) {
    return limits->alive && taper_elapsed_ms(now_ms, limits->heard_ms) <= limits->holds_ms;
}

/** Index of the point in force at `time_ms`, or -1 before the first. */
static int32_t point_at(const taper_limit_curve_t *curve, uint32_t time_ms) {
    int32_t at = -1;
    while (at + 1 < curve->count && taper_time_reached(time_ms, curve->point[at + 1].time_ms)) {
        at++;
    }
    return at;
}

void taper_limits_update(taper_limits_t *limits, uint32_t now_ms) {
    taper_limit_curve_t *curve = &limits->curve;
    limits->alive = taper_limits_gateway_alive(limits, now_ms);
    const int32_t at = point_at(curve, now_ms);
    if (at < 0) {
        return;
    }
    curve->count = (uint16_t)(curve->count - at);
    memmove(curve->point, curve->point + at, curve->count * sizeof curve->point[0]);
    curve->point[0].time_ms = now_ms; /* in force since long ago is in force since now */
}

static int32_t curve_W(const taper_limits_t *limits, int32_t point) {
    const int32_t built_W = limits->config->groups[0].limit_W;
    return point < 0 ? built_W : taper_min_i32(built_W, limits->curve.point[point].limit_W);
}

taper_limit_now_t taper_limits_now(const taper_limits_t *limits, uint32_t now_ms) {
    const int32_t built_W = limits->config->groups[0].limit_W;
    const int32_t known_W = curve_W(limits, point_at(&limits->curve, now_ms));
    if (!taper_limits_gateway_alive(limits, now_ms)) {
        return (taper_limit_now_t){taper_min_i32(known_W, limits->failsafe_W), TAPER_LIMIT_FAILSAFE};
    }
    if (limits->gateway_W < known_W) {
        return (taper_limit_now_t){limits->gateway_W, TAPER_LIMIT_GATEWAY};
    }
    return (taper_limit_now_t){known_W, known_W < built_W ? TAPER_LIMIT_CURVE : TAPER_LIMIT_STATION};
}

/** Mean of the curve over [from_ms, from_ms + length_ms), starting the search at `*point`, which moves along. */
static int32_t mean_W(const taper_limits_t *limits, uint32_t from_ms, uint32_t length_ms, int32_t *point) {
    const taper_limit_curve_t *curve = &limits->curve;
    if (length_ms == 0) { /* no checked station has such a step; a division by zero must not depend on that */
        return curve_W(limits, *point);
    }
    int64_t sum = 0;
    uint32_t done_ms = 0;
    while (done_ms < length_ms) {
        uint32_t until_ms = length_ms;
        const uint32_t next = (uint32_t)(*point + 1);
        const bool changes =
            next < curve->count && !taper_time_reached(curve->point[next].time_ms, from_ms + length_ms);
        if (changes) {
            until_ms = curve->point[next].time_ms - from_ms;
        }
        sum += (int64_t)curve_W(limits, *point) * (until_ms - done_ms);
        done_ms = until_ms;
        *point += changes ? 1 : 0;
    }
    return taper_saturate_i32(sum / length_ms);
}

void taper_limits_course(const taper_limits_t *limits, uint32_t now_ms, int32_t *course_W) {
    const taper_station_config_t *config = limits->config;
    const uint32_t step_ms = config->step_s * UINT32_C(1000);
    const int32_t present_W = taper_limits_now(limits, now_ms).site_W;
    int32_t point = point_at(&limits->curve, now_ms);
    const bool explained = present_W + WIRE_STEP_W > curve_W(limits, point);
    for (uint8_t t = 0; t < config->steps; t++) {
        const int32_t known_W = mean_W(limits, now_ms + t * step_ms, step_ms, &point);
        course_W[t] = !explained ? taper_min_i32(known_W, present_W) : known_W;
    }
    course_W[0] = present_W;
}
