/**
 * A tree for the guard of the hand-over: connectors 0 to 2 are below group 1, the others below group 2; all of one phase,
 * 230 V, wired to L1. Limits that no test reaches by chance: 1 MW everywhere, none of a current.
 */
#ifndef TAPER_TEST_HAND_OVER_BENCH_H
#define TAPER_TEST_HAND_OVER_BENCH_H

#include "taper/ledger.h"

#define CONNECTORS 6

extern taper_connector_config_t connectors[CONNECTORS]; /**< may be changed, as all of these */
extern taper_group_config_t groups[3];
extern taper_station_config_t config;
extern taper_ledger_t ledger;
extern taper_snapshot_t snapshot;
extern taper_supply_t supply;
extern taper_setpoints_t granted; /**< what the guard is asked for */

/** Everything anew; nobody may draw anything. */
void bench_start(void);

/** Ask for this of a connector, from the next look of the guard on. */
void bench_grant(uint8_t i, int32_t current_mA);

/** It was told so, and may draw it. */
void bench_may_draw(uint8_t i, int32_t current_mA);

/** Connector `i` is between two lines: 0 L1-L2, 1 L2-L3, 2 L3-L1. */
void bench_put_between(uint8_t i, int pair);

/** Whether the guard lets `granted` pass. */
bool bench_passes(void);

/** With `most_mA` of connector `i` it passes, with one milliampere more it does not. */
void bench_assert_bound(uint8_t i, int32_t most_mA);

#endif
