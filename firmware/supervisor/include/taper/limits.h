/**
 * The site limit over time: the least of what the station was built for, what the gateway says now, and two known courses.
 * While the gateway is silent, the failsafe limit stands in the gateway's place. What the site draws besides goes off it:
 * measured, or the configured maximum while the meter is silent. And the price of energy, as far as it is known.
 *
 * Frames are timed on the clock of the bus. The known courses run on the world's clock, `time_scale` times as fast, and so
 * does the judgement of a limit that flaps.
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

/** The last price of a curve holds for so long [ms], an interval of a day-ahead market; later ones are not known. */
#define TAPER_PRICE_HOLDS_ms UINT32_C(3600000)

/** The gateway's limit flaps when it changes again in less than this [ms of the world] (docs/protocol.md, fault 39). */
#define TAPER_FLAP_ms UINT32_C(5000)
/** It then counts as the least that it was within so long [ms of the world]. */
#define TAPER_FLAP_HOLD_ms UINT32_C(30000)
/** Lower limits of that time that are told apart; where there are more, some count for longer. */
#define TAPER_FLAP_LIMITS 8

/** Who knows a course of the limit. The least of them counts. */
typedef enum {
    TAPER_CURVE_OF_GATEWAY, /**< over ISO-TP: TAPER_LIMIT_CURVE */
    TAPER_CURVE_OF_FILE,    /**< the site's own: TAPER_LIMIT_FILE */
    TAPER_CURVE_OWNERS,
} taper_curve_owner_t;

/** What a limit that flaps was lately. Private to flap.c. */
typedef struct {
    bool changed;  /**< within TAPER_FLAP_HOLD_ms, at `changed_ms` */
    bool flapping; /**< until TAPER_FLAP_HOLD_ms after the last change */
    uint8_t count;
    uint32_t changed_ms;
    struct {
        int32_t limit_W;
        uint32_t until_ms;      /**< when it was last in force */
    } lower[TAPER_FLAP_LIMITS]; /**< each more than the one before, and in force after it */
} taper_flap_t;

/** About 8 KB: two curves of 3 KB, and 1.6 KB of prices. Private to this layer, but for config, log, time scale, failsafe
    limit and counters. */
typedef struct {
    const taper_station_config_t *config;
    taper_event_log_t *log; /**< NULL: none */
    uint32_t time_scale;    /**< world seconds per second of the bus; 1 on a real station */
    taper_limit_curve_t curve[TAPER_CURVE_OWNERS];
    taper_price_curve_t price;
    bool heard;                /**< any SITE_LIMIT with a limit, ever */
    bool alive;                /**< the last one still holds, by the last update */
    uint32_t heard_ms;         /**< when the last one came */
    uint32_t holds_ms;         /**< how long it holds */
    bool beating;              /**< a heartbeat of any kind is fresh, by the last update */
    uint32_t beat_ms;          /**< the last one */
    uint32_t beating_since_ms; /**< without a pause, and without a limit */
    int32_t gateway_W;         /**< what it said last, >= 0; INT32_MAX: it sets none */
    taper_flap_t flap;
    int32_t failsafe_W; /**< >= 0 */
    bool failsafe_told; /**< that is the gateway's word, and not the description's */
    bool meter_heard, meter_alive;
    uint32_t meter_ms;     /**< when the last SITE_METER came */
    int32_t metered_W;     /**< what it said, >= 0 */
    int32_t metered_mA[3]; /**< and of each phase, >= 0 */
    uint32_t negative;     /**< limits below zero, taken as zero; never falls */
    bool is_negative;      /**< the last one was */
    uint32_t flaps;        /**< times that the limit began to flap; never falls */
    uint32_t revision;     /**< changes with every new curve: the planner is to think again */
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
 * gateway has set none for TAPER_HEARTBEAT_ONLY_ms without a pause. A limit below zero is one of zero.
 *
 * A change counts at once, up or down, unless it flaps: if it comes less than TAPER_FLAP_ms after the one before, then until
 * TAPER_FLAP_HOLD_ms after the last change the least that the limit was counts, from the first of these changes on and for
 * TAPER_FLAP_HOLD_ms each. So decreases act at once and increases wait. "No limit" is the greatest limit. Cost: constant.
 */
void taper_limits_apply(taper_limits_t *limits, const taper_site_limit_t *message, uint32_t at_ms);

/** Take in a SITE_METER received at `at_ms`. A phase without a value counts as the configured maximum: of its current, and a
    third of its power. What is fed in on one phase counts against the power of the others, not against their currents. */
void taper_limits_apply_meter(taper_limits_t *limits, const taper_site_meter_t *message, uint32_t at_ms);

/**
 * Replace a known course of the limit; one without points forgets it. Times are on the world's clock, within 24 days of now,
 * on either side. Before its first point it says nothing, and the last one holds for ever.
 * @return TAPER_ERR_ARGUMENT, and nothing changed, for an unknown owner, or a curve that is out of order, has a negative
 *         limit, too many points, or points more than TAPER_CURVE_SPAN_ms apart.
 */
taper_status_t taper_limits_set_curve(taper_limits_t *limits, taper_curve_owner_t owner,
                                      const taper_limit_curve_t *curve);

/**
 * Replace the known course of the price, with the same times; one without points forgets it. A price may be negative. The
 * last one holds for TAPER_PRICE_HOLDS_ms.
 * @return TAPER_ERR_ARGUMENT, and nothing changed, for a curve that is out of order, has a price TAPER_ABSENT, too many
 *         points, or points more than TAPER_CURVE_SPAN_ms apart.
 */
taper_status_t taper_limits_set_price(taper_limits_t *limits, const taper_price_curve_t *curve);

/**
 * Forget a limit of the gateway that ran out, what it was when it flapped, and the points of the curves that are past. Call
 * it once per control tick, after the frames: old times must not come round again with the clock. Cost: O(points).
 */
void taper_limits_update(taper_limits_t *limits, uint32_t now_ms);

/** Whether a limit of the gateway is in force at `now_ms`. */
bool taper_limits_gateway_alive(const taper_limits_t *limits, uint32_t now_ms);

/** What the site draws besides, or has to be assumed to draw [W]: the meter's word for TAPER_SITE_METER_TIMEOUT_ms, then
    the greater of that and the configured maximum. */
int32_t taper_limits_other_W(const taper_limits_t *limits, uint32_t now_ms);

/** The same of a phase, 0..2 [mA]. */
int32_t taper_limits_other_mA(const taper_limits_t *limits, unsigned phase, uint32_t now_ms);

/**
 * The limit at `now_ms`, and whose it is: of equal ones failsafe before the site's own, then the gateway's curve, the file's,
 * and the gateway's present limit. Phases are bounded where the site has a limit in mA. Cost: O(points).
 */
taper_limit_now_t taper_limits_now(const taper_limits_t *limits, uint32_t now_ms);

/**
 * What is known for planning, in steps of `config->step_s` from `now_ms` on, [config->steps].
 *
 * Limits: the running step has the limit of now. Later ones have the mean, over the step, of what the least of the known
 * limits leaves for charging; they are said to be of the owner of the lowest limit in the step. A present limit that the
 * curves do not explain (it is lower by 100 W, the wire's step, or more) is taken to last, and so is other load.
 *
 * Prices: the mean over the step, over its known part if not all of it is. A step of which nothing is known has the mean of
 * the known steps. With fewer than half of the steps known, the course is not priced, and all prices are 0. All means are
 * rounded towards zero.
 *
 * Cost: O(steps + points).
 */
void taper_limits_course(const taper_limits_t *limits, uint32_t now_ms, taper_course_t *course);

#endif
