/** One vehicle and what is reported of it: told 16 A and drawing 16 A, not below 6 A. */
#ifndef TAPER_TEST_DRAW_BENCH_H
#define TAPER_TEST_DRAW_BENCH_H

#include "taper/draw.h"

extern taper_draw_t draw;
extern taper_draw_report_t report; /**< of the next update */
extern uint32_t now_ms;            /**< it wraps within every time that counts */

/** Everything anew. */
void bench_start(void);

/** @return whether the state or the cap changed. */
bool bench_update(void);
bool bench_update_after(uint32_t ms);

/** What it draws, and what it was told, from the next update on. */
void bench_draws(int32_t measured_mA);
void bench_is_told(int32_t setpoint_mA, int32_t allowed_mA);

#endif
