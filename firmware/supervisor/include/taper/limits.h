/**
 * The site limit over time: the least of what the station was built for, what the gateway says now, and the known
 * course. While the gateway is silent, the failsafe limit.
 */
#ifndef TAPER_LIMITS_H
#define TAPER_LIMITS_H

#include <stdbool.h>
#include <stdint.h>

#include "taper/message.h"
#include "taper/types.h"

/** Longest curve [ms]: beyond half a turn of the clock, before and after cannot be told apart. */
#define TAPER_CURVE_SPAN_ms (UINT32_C(24) * 24 * 3600 * 1000)

typedef struct {
    const taper_station_config_t *config;
    taper_limit_curve_t curve;
    bool heard;         /**< any SITE_LIMIT with a limit, ever */
    bool alive;         /**< the last one still holds, by the last update */
    uint32_t heard_ms;  /**< when the last one came */
    uint32_t holds_ms;  /**< how long it holds */
    int32_t gateway_W;  /**< what it said, >= 0; INT32_MAX: no limit in force */
    int32_t failsafe_W; /**< >= 0 */
    uint32_t negative;  /**< limits below zero, taken as zero */
} taper_limits_t;

typedef struct {
    int32_t site_W; /**< >= 0 */
    taper_limit_source_t source;
} taper_limit_now_t;

/** No gateway heard, no curve known. `config` must outlive it. */
void taper_limits_init(taper_limits_t *limits, const taper_station_config_t *config);

/**
 * Take in a SITE_LIMIT. It holds for its validity, but no longer than TAPER_SITE_LIMIT_TIMEOUT_ms. One without a limit
 * (absent) is a heartbeat only and changes nothing.
 */
void taper_limits_apply(taper_limits_t *limits, const taper_site_limit_t *message, uint32_t now_ms);

/**
 * Replace the known course. Times are within 24 days of now, on either side.
 * @return TAPER_ERR_ARGUMENT, and nothing changed, for a curve that is out of order, has a negative limit, too many
 *         points, or points more than TAPER_CURVE_SPAN_ms apart.
 */
taper_status_t taper_limits_set_curve(taper_limits_t *limits, const taper_limit_curve_t *curve);

/**
 * Forget a limit of the gateway that ran out, and the points of the curve that are past. Call it once per control tick,
 * after the frames: old times must not come round again with the clock. Cost: O(points).
 */
void taper_limits_update(taper_limits_t *limits, uint32_t now_ms);

/** Whether a limit of the gateway is in force at `now_ms`. */
bool taper_limits_gateway_alive(const taper_limits_t *limits, uint32_t now_ms);

/** The limit at `now_ms`. Cost: O(points). */
taper_limit_now_t taper_limits_now(const taper_limits_t *limits, uint32_t now_ms);

/**
 * What is known of the limit for planning: `course_W[t]` for steps of `config->step_s` from `now_ms` on,
 * [config->steps]. The running step has the limit of now; later ones the mean over the step. A present limit that the
 * curve does not explain is taken to last. Cost: O(steps + points).
 */
void taper_limits_course(const taper_limits_t *limits, uint32_t now_ms, int32_t *course_W);

#endif
