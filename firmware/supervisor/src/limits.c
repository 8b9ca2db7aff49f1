#include "taper/limits.h"

#include <string.h>

/** SITE_LIMIT says its limit in steps of this [W]: less than the curve by up to a step is still the curve's limit. */
#define WIRE_STEP_W 100

void taper_limits_init(taper_limits_t *limits, const taper_station_config_t *config) {
    memset(limits, 0, sizeof *limits);
    limits->config = config;
    limits->time_scale = 1;
    limits->failsafe_W = config->failsafe_W;
}

static uint32_t world_ms(const taper_limits_t *limits, uint32_t now_ms) {
    return now_ms * limits->time_scale; /* both clocks wrap, and so does their product */
}

static bool beats(const taper_limits_t *limits, uint32_t now_ms) {
    return limits->beating && taper_elapsed_ms(now_ms, limits->beat_ms) <= TAPER_SITE_LIMIT_TIMEOUT_ms;
}

static void beat(taper_limits_t *limits, uint32_t at_ms) {
    if (!beats(limits, at_ms)) {
        limits->beating_since_ms = at_ms;
    }
    limits->beating = true;
    limits->beat_ms = at_ms;
}

static void set_gateway_limit(taper_limits_t *limits, int32_t limit_W, uint32_t holds_ms, uint32_t at_ms) {
    if (limits->heard && !limits->alive) {
        taper_event_note(limits->log, TAPER_EVENT_GATEWAY_BACK, 0, TAPER_NODE_GATEWAY, 0);
    }
    limits->heard = true;
    limits->alive = true;
    limits->heard_ms = at_ms;
    limits->gateway_W = limit_W;
    limits->holds_ms = holds_ms;
}

/** A heartbeat without a limit. */
static void apply_heartbeat(taper_limits_t *limits, uint32_t at_ms) {
    const bool unlimited = limits->alive && limits->gateway_W == INT32_MAX;
    const bool silent_for_long = taper_elapsed_ms(at_ms, limits->beating_since_ms) >= TAPER_HEARTBEAT_ONLY_ms;
    if (unlimited || silent_for_long) {
        set_gateway_limit(limits, INT32_MAX, TAPER_SITE_LIMIT_TIMEOUT_ms, at_ms);
    }
}

/** Every negative limit counts; the log has the first in a row. */
static void note_sign(taper_limits_t *limits, int32_t limit_W) {
    const bool negative = limit_W < 0;
    if (negative) {
        taper_count(&limits->negative);
    }
    if (negative && !limits->is_negative) {
        taper_event_note(limits->log, TAPER_EVENT_LIMIT_NEGATIVE, 0, TAPER_NODE_GATEWAY, limit_W);
    }
    limits->is_negative = negative;
}

void taper_limits_apply(taper_limits_t *limits, const taper_site_limit_t *message, uint32_t at_ms) {
    beat(limits, at_ms);
    if (message->failsafe_W != TAPER_ABSENT) {
        limits->failsafe_W = taper_clamp_i32(message->failsafe_W, 0, limits->config->groups[0].limit_W);
        limits->failsafe_told = true;
    }
    if (message->active && message->limit_W == TAPER_ABSENT) {
        apply_heartbeat(limits, at_ms);
        return;
    }
    limits->beating_since_ms = at_ms;
    note_sign(limits, message->active ? message->limit_W : 0);
    const bool shorter =
        message->validity_s != TAPER_ABSENT && message->validity_s * 1000 < TAPER_SITE_LIMIT_TIMEOUT_ms;
    set_gateway_limit(limits, message->active ? taper_max_i32(message->limit_W, 0) : INT32_MAX,
                      shorter ? (uint32_t)message->validity_s * 1000 : TAPER_SITE_LIMIT_TIMEOUT_ms, at_ms);
}

void taper_limits_apply_meter(taper_limits_t *limits, const taper_site_meter_t *message, uint32_t at_ms) {
    int64_t sum_W = 0;
    for (unsigned phase = 0; phase < 3; phase++) {
        const int32_t current_mA = message->other_mA[phase];
        sum_W += current_mA == TAPER_ABSENT ? limits->config->other_load_W / 3
                                            : (int64_t)current_mA * limits->config->site_voltage_mV / 1000000;
    }
    if (limits->meter_heard && !limits->meter_alive) {
        taper_event_note(limits->log, TAPER_EVENT_METER_BACK, 0, TAPER_NODE_GATEWAY, 0);
    }
    limits->meter_heard = true;
    limits->meter_alive = true;
    limits->meter_ms = at_ms;
    limits->metered_W = taper_max_i32(taper_saturate_i32(sum_W), 0); /* what is fed in is not ours to draw */
}

static bool meter_speaks(const taper_limits_t *limits, uint32_t now_ms) {
    return limits->meter_alive && taper_elapsed_ms(now_ms, limits->meter_ms) <= TAPER_SITE_METER_TIMEOUT_ms;
}

int32_t taper_limits_other_W(const taper_limits_t *limits, uint32_t now_ms) {
    return meter_speaks(limits, now_ms) ? limits->metered_W
                                        : taper_max_i32(limits->metered_W, limits->config->other_load_W);
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

/** What has ended since the last look. */
static void expire(taper_limits_t *limits, uint32_t now_ms) {
    const bool gateway_was_alive = limits->alive;
    const bool meter_was_alive = limits->meter_alive;
    limits->beating = beats(limits, now_ms);
    limits->alive = taper_limits_gateway_alive(limits, now_ms);
    limits->meter_alive = meter_speaks(limits, now_ms);
    if (gateway_was_alive && !limits->alive) {
        taper_event_note(limits->log, TAPER_EVENT_GATEWAY_LOST, 0, TAPER_NODE_GATEWAY, limits->failsafe_W);
    }
    if (meter_was_alive && !limits->meter_alive) {
        taper_event_note(limits->log, TAPER_EVENT_METER_LOST, 0, TAPER_NODE_GATEWAY,
                         limits->config->other_load_W);
    }
}

void taper_limits_update(taper_limits_t *limits, uint32_t now_ms) {
    taper_limit_curve_t *curve = &limits->curve;
    expire(limits, now_ms);
    const int32_t at = point_at(curve, world_ms(limits, now_ms));
    if (at < 0) {
        return;
    }
    curve->count = (uint16_t)(curve->count - at);
    memmove(curve->point, curve->point + at, curve->count * sizeof curve->point[0]);
    curve->point[0].time_ms = world_ms(limits, now_ms); /* in force since long ago is in force since now */
}

static int32_t curve_W(const taper_limits_t *limits, int32_t point) {
    const int32_t built_W = limits->config->groups[0].limit_W;
    return point < 0 ? built_W : taper_min_i32(built_W, limits->curve.point[point].limit_W);
}

/** What site, gateway and curve allow, before anything is taken off. */
static taper_limit_now_t supply_of(const taper_limits_t *limits, uint32_t now_ms) {
    const int32_t built_W = limits->config->groups[0].limit_W;
    const int32_t known_W = curve_W(limits, point_at(&limits->curve, world_ms(limits, now_ms)));
    if (!taper_limits_gateway_alive(limits, now_ms)) {
        return (taper_limit_now_t){.supply = taper_supply_of_W(taper_min_i32(known_W, limits->failsafe_W)),
                                   .source = TAPER_LIMIT_FAILSAFE};
    }
    if (limits->gateway_W < known_W) {
        return (taper_limit_now_t){.supply = taper_supply_of_W(limits->gateway_W),
                                   .source = TAPER_LIMIT_GATEWAY};
    }
    return (taper_limit_now_t){.supply = taper_supply_of_W(known_W),
                               .source = known_W < built_W ? TAPER_LIMIT_CURVE : TAPER_LIMIT_STATION};
}

taper_limit_now_t taper_limits_now(const taper_limits_t *limits, uint32_t now_ms) {
    taper_limit_now_t now = supply_of(limits, now_ms);
    now.other_W = taper_limits_other_W(limits, now_ms);
    now.supply.site_W = taper_max_i32(now.supply.site_W - now.other_W, 0);
    return now;
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

void taper_limits_course(const taper_limits_t *limits, uint32_t now_ms, taper_course_t *course) {
    const taper_station_config_t *config = limits->config;
    const uint32_t step_ms = config->step_s * UINT32_C(1000);
    const uint32_t from_ms = world_ms(limits, now_ms);
    const int32_t other_W = taper_limits_other_W(limits, now_ms);
    const int32_t present_W = supply_of(limits, now_ms).supply.site_W;
    int32_t point = point_at(&limits->curve, from_ms);
    const bool explained = present_W + WIRE_STEP_W > curve_W(limits, point);
    memset(course, 0, sizeof *course);
    for (unsigned phase = 0; phase < 3; phase++) {
        course->phase_mA[phase] = TAPER_NO_LIMIT;
    }
    for (uint8_t t = 0; t < config->steps; t++) {
        const int32_t known_W = mean_W(limits, from_ms + t * step_ms, step_ms, &point);
        course->limit_W[t] =
            taper_max_i32((explained ? known_W : taper_min_i32(known_W, present_W)) - other_W, 0);
    }
    course->limit_W[0] = taper_max_i32(present_W - other_W, 0);
}
