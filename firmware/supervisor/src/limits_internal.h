/** Private to the supervisor layer: the parts of limits.h, each with its file. */
#ifndef TAPER_LIMITS_INTERNAL_H
#define TAPER_LIMITS_INTERNAL_H

#include "taper/limits.h"

/** A limit of the site, and whose it is. */
typedef struct {
    int32_t limit_W;
    taper_limit_source_t source;
} taper_bound_t;

/** Of equal ones the first. */
static inline taper_bound_t taper_bound_least(taper_bound_t a, taper_bound_t b) {
    return b.limit_W < a.limit_W ? b : a;
}

static inline uint32_t taper_limits_world_ms(const taper_limits_t *limits, uint32_t now_ms) {
    return now_ms * limits->time_scale; /* both clocks wrap, and so does their product */
}

/* curves.c */

/** A place in time: of each curve the point in force, or -1 before the first. */
typedef struct {
    int32_t at[TAPER_CURVE_OWNERS];
} taper_curves_place_t;

taper_curves_place_t taper_curves_find(const taper_limits_t *limits, uint32_t world_ms);

/** Go on to `world_ms`, which is not before `place`. */
void taper_curves_advance(const taper_limits_t *limits, uint32_t world_ms, taper_curves_place_t *place);

/** Time from `from_ms`, which is not after `place`, to the first change after `place`; at most `length_ms`. */
uint32_t taper_curves_next_change_ms(const taper_limits_t *limits, const taper_curves_place_t *place,
                                     uint32_t from_ms, uint32_t length_ms);

/** The least of what the station was built for and the curves. */
taper_bound_t taper_curves_bound(const taper_limits_t *limits, const taper_curves_place_t *place);

/** Forget the points that are past, but for the one in force: it is from now on. */
void taper_curves_forget(taper_limits_t *limits, uint32_t world_ms);

/* price.c */

/** Fill in the prices of a course. */
void taper_price_course(const taper_limits_t *limits, uint32_t world_ms, taper_course_t *course);
void taper_price_forget(taper_limits_t *limits, uint32_t world_ms);

/* flap.c */

/** The gateway's limit, until now `old_W`, is another one from `at_ms` on. */
void taper_flap_changed(taper_limits_t *limits, int32_t old_W, uint32_t at_ms);

/** The gateway's limit, or the lower one that is held in its place. */
taper_bound_t taper_flap_bound(const taper_limits_t *limits, uint32_t now_ms);
void taper_flap_forget(taper_limits_t *limits, uint32_t now_ms);

/* meter.c */

void taper_meter_expire(taper_limits_t *limits, uint32_t now_ms);

/** What other load leaves of the site's limit of each phase. */
void taper_meter_supply(const taper_limits_t *limits, uint32_t now_ms, int32_t phase_mA[3]);

/* limits.c */

/** The limit in force, before anything is taken off. */
taper_bound_t taper_limits_bound(const taper_limits_t *limits, uint32_t now_ms);

#endif
