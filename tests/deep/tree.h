/** Stations of any shape for the tests of allocator, balance and guard, built one connector at a time. */
#ifndef TAPER_TEST_TREE_H
#define TAPER_TEST_TREE_H

#include "taper/allocator.h"

/** Points into itself: not to be copied. */
typedef struct {
    taper_group_config_t group[TAPER_MAX_GROUPS];
    taper_connector_config_t connector[TAPER_MAX_CONNECTORS];
    taper_station_config_t config;
    taper_snapshot_t snapshot;
    taper_proposal_t proposal;
    taper_supply_t supply; /**< at first bounded by nothing */
    taper_allocator_t allocator;
    taper_setpoints_t setpoints;
} tree_t;

/** Lines, as bits. */
enum { L1 = 1, L2 = 2, L3 = 4 };

/** A site of 1 MW and nothing else. At 10 s; on and off for 300 s at least, turns of 900 s, ticks of 1 s. */
void tree_init(tree_t *tree);

/** A group without limits. @return its index. */
uint8_t tree_add_group(tree_t *tree, uint8_t parent);

/**
 * A connector, 230 V, 6..32 A, one phase or three on `lines`, with a vehicle that takes all of it, wants 50 kWh in 8 h,
 * and is wished 32 A. It is served after those before. @return its index.
 */
uint8_t tree_add(tree_t *tree, uint8_t group, uint8_t lines);

/** One between two lines, 208 V. */
uint8_t tree_add_pair(tree_t *tree, uint8_t group, uint8_t lines);

/** Wish and ceiling of connector `i`, in mA. */
void tree_wish(tree_t *tree, uint8_t i, int32_t wish_mA, int32_t ceiling_mA);

/** Departure so late that the laxity of connector `i` is this. */
void tree_laxity(tree_t *tree, uint8_t i, int32_t laxity_s);

/** The rows of now; overwritten by the next call. */
const taper_rows_t *tree_rows(const tree_t *tree);

/** Allocate; the guard has to pass it. @return the current of connector 0. */
int32_t tree_allocate(tree_t *tree);

/** The same, `ms` later. */
int32_t tree_allocate_after(tree_t *tree, uint32_t ms);

/** Whether the guard passes the setpoints. */
bool tree_guard(const tree_t *tree);

/** For the guard `limit`, one of the tree's, is just enough: one less is not. It stays at that. */
void tree_assert_just_enough(const tree_t *tree, int32_t *limit, int32_t enough);

/** Next value of a small fixed pseudo-random generator (xorshift32), below `bound`. */
uint32_t tree_random(uint32_t *state, uint32_t bound);

/** `vehicles` on one phase, `places` for their minima. Laxity rises with the index, an hour each. */
void tree_start(tree_t *tree, unsigned vehicles, int32_t places);

bool tree_is_on(const tree_t *tree, uint8_t i);

/** Those that are on are these, as a string of digits. */
void tree_assert_on(const tree_t *tree, const char *expected);

/** Connector `i` waits in this place; 0 of 0: it does not. */
void tree_assert_waiting(const tree_t *tree, uint8_t i, uint8_t place, uint8_t of);

#endif
