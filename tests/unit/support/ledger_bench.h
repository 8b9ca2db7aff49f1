/** Connector 0 of scene_four() and its ledger, with a reaction of 5 s: what it is told, and what is heard of it. */
#ifndef TAPER_TEST_LEDGER_BENCH_H
#define TAPER_TEST_LEDGER_BENCH_H

#include "taper/ledger.h"

#define VALIDITY_ms 3000u
#define EXPIRED_ms  (VALIDITY_ms + TAPER_LEDGER_LATE_ms)
#define REACTION_ms 5000u

extern taper_connector_config_t connectors[5]; /**< may be changed; the last one is not there */
extern taper_station_config_t config;
extern taper_ledger_t ledger;
extern uint32_t now_ms; /**< it wraps in every test that waits for some seconds */

/** Everything anew, and nothing of an earlier life is left on connector 0. */
void bench_begin(void);

/** The controller starts, and knows nothing of what went before. */
void bench_start(uint32_t time_scale);

/** Time passes; the ledger is updated once, at its end. */
void bench_wait_ms(uint32_t ms);

/** A setpoint goes out. */
void bench_send(uint8_t counter, int32_t current_mA, int32_t told_fallback_mA);

/** A report of a connector with a vehicle that accepted this setpoint last, and measures nothing. */
taper_evse_status_t bench_status(uint8_t echo);

void bench_hear_echo(uint8_t counter);
void bench_hear_fallback(void);
void bench_hear_no_vehicle(void);
void bench_hear_draw(uint8_t echo, int32_t L1_mA, int32_t L2_mA, int32_t L3_mA);

int32_t bench_may_mA(void);
int32_t bench_told_mA(void);
int32_t bench_fallback_mA(void);

/** What it may draw is `then_mA` exactly from `ms` on, and `before_mA` until then. */
void bench_assert_changes_after(uint32_t ms, int32_t before_mA, int32_t then_mA);

#endif
