/**
 * The site limit over time: the least of what the station was built for, what the gateway says now, and the known
 * course. While the gateway is silent, the failsafe limit. What the site draws besides goes off it: measured, or the
 * configured maximum while the meter is silent.
 *
 * Frames are timed on the clock of the bus. The known course runs on the world's clock, `time_scale` times as fast.
 */
#ifndef TAPER_LIMITS_H
#define TAPER_LIMITS_H

#include <stdbool.h>
#include <stdint.h>

#include "taper/event.h"
#include "taper/message.h"
#include "taper/types.h"

/** A gateway that is back, and sets no limit for so long, has none to set [ms] (docs/protocol.md, fault 14). */
#define TAPER_HEARTBEAT_ONLY_ms UINT32_C(120000)

/** Longest curve [ms]: beyond half a turn of the clock, before and after cannot be told apart. */
#define TAPER_CURVE_SPAN_ms (UINT32_C(24) * 24 * 3600 * 1000)

typedef struct {
    const taper_station_config_t *config;
    taper_event_log_t *log; /**< NULL: none */
    uint32_t time_scale;    /**< world seconds per second of the bus; 1 on a real station */
    taper_limit_curve_t curve;
    bool heard;                /**< any SITE_LIMIT with a limit, ever */
    bool alive;                /**< the last one still holds, by the last update */
    uint32_t heard_ms;         /**< when the last one came */
    uint32_t holds_ms;         /**< how long it holds */
    bool beating;              /**< a heartbeat of any kind is fresh, by the last update */
    uint32_t beat_ms;          /**< the last one */
    uint32_t beating_since_ms; /**< without a pause, and without a limit */
    int32_t gateway_W;         /**< what it said, >= 0; INT32_MAX: no limit in force */
    int32_t failsafe_W;        /**< >= 0 */
    bool failsafe_told;        /**< that is the gateway's word, and not the description's */
    bool meter_heard, meter_alive;
    uint32_t meter_ms; /**< when the last SITE_METER came */
    int32_t metered_W; /**< what it said, >= 0 */
    uint32_t negative; /**< limits below zero, taken as zero */
    bool is_negative;  /**< the last one was */
} taper_limits_t;

typedef struct {
    taper_supply_t supply; /**< for charging */
    int32_t other_W;       /**< taken off for what else the site draws */
    taper_limit_source_t source;
} taper_limit_now_t;

/** No gateway heard, no curve known, no log, time scale 1. `config` must outlive it. */
void taper_limits_init(taper_limits_t *limits, const taper_station_config_t *config);

/**
 * Take in a SITE_LIMIT received at `at_ms`. It holds for its validity, but no longer than TAPER_SITE_LIMIT_TIMEOUT_ms. One
 * without a limit (absent) is a heartbeat only: a limit that ran out stays so until the next one is set, or until the
 * gateway has set none for TAPER_HEARTBEAT_ONLY_ms without a pause.
 */
void taper_limits_apply(taper_limits_t *limits, const taper_site_limit_t *message, uint32_t at_ms);

/** Take in a SITE_METER received at `at_ms`. A phase without a value counts as a third of the configured maximum. */
void taper_limits_apply_meter(taper_limits_t *limits, const taper_site_meter_t *message, uint32_t at_ms);

/**
 * Replace the known course. Times are on the world's clock, within 24 days of now, on either side.
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

/** What the site draws besides, or has to be assumed to draw [W]: the meter's word for TAPER_SITE_METER_TIMEOUT_ms, then
    the greater of that and the configured maximum. */
int32_t taper_limits_other_W(const taper_limits_t *limits, uint32_t now_ms);

/** The limit at `now_ms`. Cost: O(points). */
taper_limit_now_t taper_limits_now(const taper_limits_t *limits, uint32_t now_ms);

/**
 * What is known for planning, in steps of `config->step_s` from `now_ms` on, [config->steps]. The running step has the limit of now; later ones the mean over the step. A present limit that the
 * curve does not explain is taken to last. Cost: O(steps + points).
 */
void taper_limits_course(const taper_limits_t *limits, uint32_t now_ms, taper_course_t *course);

#endif
