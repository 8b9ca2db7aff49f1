/* The two known courses of the limit. */
#include <string.h>

#include "limits_internal.h"

static bool curve_is_good(const taper_limit_curve_t *curve) {
    if (curve->count > TAPER_MAX_LIMIT_POINTS) {
        return false;
    }
    for (uint16_t k = 0; k < curve->count; k++) {
        const bool ascending =
            k == 0 || !taper_time_reached(curve->point[k - 1].time_ms, curve->point[k].time_ms);
        const uint32_t span_ms = taper_elapsed_ms(curve->point[k].time_ms, curve->point[0].time_ms);
        if (curve->point[k].limit_W < 0 || !ascending || span_ms > TAPER_CURVE_SPAN_ms) {
            return false;
        }
    }
    return true;
}

taper_status_t taper_limits_set_curve(taper_limits_t *limits, taper_curve_owner_t owner,
                                      const taper_limit_curve_t *curve) {
    if ((unsigned)owner >= TAPER_CURVE_OWNERS || !curve_is_good(curve)) {
        return TAPER_ERR_ARGUMENT;
    }
    limits->curve[owner] = *curve;
    limits->revision++;
    return TAPER_OK;
}

/** The last point that is in force at `world_ms`, from point `at` on. */
static int32_t point_from(const taper_limit_curve_t *curve, int32_t at, uint32_t world_ms) {
    while (at + 1 < curve->count && taper_time_reached(world_ms, curve->point[at + 1].time_ms)) {
        at++;
    }
    return at;
}

void taper_curves_advance(const taper_limits_t *limits, uint32_t world_ms, taper_curves_place_t *place) {
    for (unsigned k = 0; k < TAPER_CURVE_OWNERS; k++) {
        place->at[k] = point_from(&limits->curve[k], place->at[k], world_ms);
    }
}

taper_curves_place_t taper_curves_find(const taper_limits_t *limits, uint32_t world_ms) {
    taper_curves_place_t place = {{-1, -1}};
    taper_curves_advance(limits, world_ms, &place);
    return place;
}

uint32_t taper_curves_next_change_ms(const taper_limits_t *limits, const taper_curves_place_t *place,
                                     uint32_t from_ms, uint32_t length_ms) {
    uint32_t next_ms = length_ms;
    for (unsigned k = 0; k < TAPER_CURVE_OWNERS; k++) {
        const int32_t next = place->at[k] + 1;
        if (next < limits->curve[k].count) {
            const uint32_t after_ms = taper_elapsed_ms(limits->curve[k].point[next].time_ms, from_ms);
            next_ms = after_ms < next_ms ? after_ms : next_ms;
        }
    }
    return next_ms;
}

taper_bound_t taper_curves_bound(const taper_limits_t *limits, const taper_curves_place_t *place) {
    static const taper_limit_source_t sources[TAPER_CURVE_OWNERS] = {
        [TAPER_CURVE_OF_GATEWAY] = TAPER_LIMIT_CURVE, [TAPER_CURVE_OF_FILE] = TAPER_LIMIT_FILE};
    taper_bound_t least = {limits->config->groups[0].limit_W, TAPER_LIMIT_STATION};
    for (unsigned k = 0; k < TAPER_CURVE_OWNERS; k++) {
        if (place->at[k] >= 0) {
            const taper_bound_t known = {limits->curve[k].point[place->at[k]].limit_W, sources[k]};
            least = taper_bound_least(least, known);
        }
    }
    return least;
}

void taper_curves_forget(taper_limits_t *limits, uint32_t world_ms) {
    for (unsigned k = 0; k < TAPER_CURVE_OWNERS; k++) {
        taper_limit_curve_t *curve = &limits->curve[k];
        const int32_t at = point_from(curve, -1, world_ms);
        if (at >= 0) {
            curve->count = (uint16_t)(curve->count - at);
            memmove(curve->point, curve->point + at, curve->count * sizeof curve->point[0]);
            curve->point[0].time_ms = world_ms; /* in force since long ago is in force since now */
        }
    }
}
