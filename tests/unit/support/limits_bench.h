/** A site's limits, what its gateway says, and its curves: built for 25 kW, failsafe 4 kW, 24 steps of 900 s. */
#ifndef TAPER_TEST_LIMITS_BENCH_H
#define TAPER_TEST_LIMITS_BENCH_H

#include "taper/limits.h"

#define STEP_ms 900000u

extern taper_limits_t limits;
extern taper_station_config_t config; /**< may be changed */
extern taper_event_log_t events;
extern taper_limit_curve_t curve; /**< being put together */
extern taper_course_t course;     /**< of the last bench_course() */

/** Everything anew. */
void bench_start(void);

/** SITE_LIMIT. */
void bench_say(bool active, int32_t limit_W, uint32_t now_ms);

/** SITE_METER. */
void bench_meter(int32_t l1_mA, int32_t l2_mA, int32_t l3_mA, uint32_t now_ms);

/** One more point of `curve`. */
void bench_point(uint32_t time_ms, int32_t limit_W);

/** `curve` becomes the owner's, and is empty again. */
void bench_set(taper_curve_owner_t owner);

/** What is the limit, and whose is it? */
void bench_assert(int32_t site_W, taper_limit_source_t source, uint32_t now_ms);

void bench_course(uint32_t now_ms);

/** A step of `course`. */
void bench_assert_step(unsigned t, int32_t limit_W, taper_limit_source_t source);

/** How often an event is in the log. */
unsigned bench_noted(taper_event_code_t code);

#endif
