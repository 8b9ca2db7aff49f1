/** Small stations and demands that the tests of battery, horizon, planner, fallback and allocator share. */
#ifndef TAPER_TEST_SCENE_H
#define TAPER_TEST_SCENE_H

#include "taper/rows.h"

/** Four single-phase connectors, 230 V, 6..32 A: 0 and 1 under "left" (group 1), 2 and 3 under "right" (group 2). */
const taper_station_config_t *scene_four(void);

/** The same without a minimum current. */
const taper_station_config_t *scene_four_continuous(void);

/** A vehicle of 60 kWh at half charge that wants 10 kWh within 2 h, 7.36 kW flat, on a connector of scene_four(). */
taper_demand_t scene_demand(void);

/** A snapshot of scene_four() at `now_ms` with the first `active` connectors occupied by scene_demand(). */
taper_snapshot_t scene_snapshot(uint32_t now_ms, uint8_t active);

/** A proposal that wishes `wish_W` for every connector, ceiling equal to the wish, served in index order. */
taper_proposal_t scene_proposal(int32_t wish_W);

/** The rows of now; overwritten by the next call. */
const taper_rows_t *scene_rows(const taper_station_config_t *station, const taper_snapshot_t *snapshot,
                               const taper_supply_t *supply);

/** Next value of a small fixed pseudo-random generator (xorshift32); `state` must not be 0. */
uint32_t scene_random(uint32_t *state);

/**
 * A copy of `station` whose setpoints move freely: no ramp, no deadband, no pause between changes, vehicles that follow at
 * once, no fallback currents. For what is about something else. It is good until the next call.
 */
const taper_station_config_t *scene_free_moving(const taper_station_config_t *station);

#endif
