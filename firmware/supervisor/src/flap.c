/* A limit of the gateway that flaps (docs/protocol.md, fault 39). */
#include <string.h>

#include "limits_internal.h"

/** Whether less than `span_ms` of the world have gone by. */
static bool within(const taper_limits_t *limits, uint32_t since_ms, uint32_t now_ms, uint32_t span_ms) {
    return (uint64_t)taper_elapsed_ms(now_ms, since_ms) * limits->time_scale < span_ms;
}

static bool still_counts(const taper_limits_t *limits, unsigned k, uint32_t now_ms) {
    return within(limits, limits->flap.lower[k].until_ms, now_ms, TAPER_FLAP_HOLD_ms);
}

/** Keep a limit that was in force until `at_ms`. What was not lower before it does not matter any more. */
static void keep(taper_flap_t *flap, int32_t limit_W, uint32_t at_ms) {
    while (flap->count > 0 && flap->lower[flap->count - 1u].limit_W >= limit_W) {
        flap->count--;
    }
    if (flap->count == TAPER_FLAP_LIMITS) { /* no room: the last one, which is lower, counts for longer */
        flap->lower[TAPER_FLAP_LIMITS - 1].until_ms = at_ms;
        return;
    }
    flap->lower[flap->count].limit_W = limit_W;
    flap->lower[flap->count].until_ms = at_ms;
    flap->count++;
}

void taper_flap_changed(taper_limits_t *limits, int32_t old_W, uint32_t at_ms) {
    taper_flap_t *flap = &limits->flap;
    taper_flap_forget(limits, at_ms);
    const bool again = flap->changed && within(limits, flap->changed_ms, at_ms, TAPER_FLAP_ms);
    if (again && !flap->flapping) {
        flap->flapping = true;
        taper_count(&limits->flaps);
        taper_event_note(limits->log, TAPER_EVENT_LIMIT_FLAPS, 0, TAPER_NODE_GATEWAY, old_W);
    }
    if (flap->flapping) {
        keep(flap, old_W, at_ms);
    }
    flap->changed = true;
    flap->changed_ms = at_ms;
}

taper_bound_t taper_flap_bound(const taper_limits_t *limits, uint32_t now_ms) {
    taper_bound_t bound = {limits->gateway_W, TAPER_LIMIT_GATEWAY};
    for (unsigned k = 0; k < limits->flap.count; k++) {
        if (still_counts(limits, k, now_ms)) {
            const taper_bound_t held = {limits->flap.lower[k].limit_W, TAPER_LIMIT_HELD};
            bound = taper_bound_least(bound, held);
        }
    }
    return bound;
}

void taper_flap_forget(taper_limits_t *limits, uint32_t now_ms) {
    taper_flap_t *flap = &limits->flap;
    unsigned past = 0;
    while (past < flap->count && !still_counts(limits, past, now_ms)) {
        past++;
    }
    flap->count = (uint8_t)(flap->count - past);
    memmove(flap->lower, flap->lower + past, flap->count * sizeof flap->lower[0]);
    flap->changed = flap->changed && within(limits, flap->changed_ms, now_ms, TAPER_FLAP_HOLD_ms);
    flap->flapping = flap->flapping && flap->changed;
}
