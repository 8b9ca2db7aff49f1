#include "taper/limits.h"

#include <string.h>

#include "limits_internal.h"

void taper_limits_init(taper_limits_t *limits, const taper_station_config_t *config) {
    memset(limits, 0, sizeof *limits);
    limits->config = config;
    limits->time_scale = 1;
    limits->failsafe_W = config->failsafe_W;
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
    if (limits->heard && limit_W != limits->gateway_W) {
        taper_flap_changed(limits, limits->gateway_W, at_ms);
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

bool taper_limits_gateway_alive(const taper_limits_t *limits, uint32_t now_ms) {
    return limits->alive && taper_elapsed_ms(now_ms, limits->heard_ms) <= limits->holds_ms;
}

void taper_limits_update(taper_limits_t *limits, uint32_t now_ms) {
    const uint32_t world_ms = taper_limits_world_ms(limits, now_ms);
    const bool was_alive = limits->alive;
    limits->beating = beats(limits, now_ms);
    limits->alive = taper_limits_gateway_alive(limits, now_ms);
    if (was_alive && !limits->alive) {
        taper_event_note(limits->log, TAPER_EVENT_GATEWAY_LOST, 0, TAPER_NODE_GATEWAY, limits->failsafe_W);
    }
    taper_meter_expire(limits, now_ms);
    taper_flap_forget(limits, now_ms);
    taper_curves_forget(limits, world_ms);
    taper_price_forget(limits, world_ms);
}

taper_bound_t taper_limits_bound(const taper_limits_t *limits, uint32_t now_ms) {
    const taper_curves_place_t place = taper_curves_find(limits, taper_limits_world_ms(limits, now_ms));
    const taper_bound_t known = taper_curves_bound(limits, &place);
    if (taper_limits_gateway_alive(limits, now_ms)) {
        return taper_bound_least(known, taper_flap_bound(limits, now_ms));
    }
    const taper_bound_t failsafe = {limits->failsafe_W, TAPER_LIMIT_FAILSAFE};
    return taper_bound_least(failsafe, known);
}

taper_limit_now_t taper_limits_now(const taper_limits_t *limits, uint32_t now_ms) {
    const taper_bound_t bound = taper_limits_bound(limits, now_ms);
    const int32_t other_W = taper_limits_other_W(limits, now_ms);
    taper_limit_now_t now = {.supply = taper_supply_of_W(taper_max_i32(bound.limit_W - other_W, 0)),
                             .other_W = other_W,
                             .source = bound.source};
    taper_meter_supply(limits, now_ms, now.supply.phase_mA);
    return now;
}
