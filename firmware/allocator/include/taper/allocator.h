/**
 * The allocator: any proposal -> setpoints that hold every hard limit. Integers only; the safety argument is here.
 *
 * Room is kept for every row of the feeder tree (rows.h): power, and the current of each phase. A connector's current is
 * only ever raised by what fits into every row above it, rounded down to the step of the wire, and that much is taken from
 * each of them: so no sum exceeds a limit, whatever the proposal says. Where a group limits the imbalance of its phases,
 * currents on the stronger phases are lowered at the end until it holds. The guard recomputes all of it from nothing.
 *
 * Turns. A connector with a minimum current gets at least that or nothing. Where the minima of all that are wished for do
 * not fit, the order is: who was switched on less than `min_on_ms` ago; whose turn is not over (on for less than `turn_ms`);
 * who has waited for `turn_ms`, longest first; the rest by laxity, least first. Nobody is switched on within `min_off_ms` of
 * being switched off. So with places for K of M connectors nobody waits longer than ceil(M / K) turns and one
 * `min_off_ms`, while limits and wishes stay.
 *
 * A wish below the minimum is followed over time: what is given is booked against what was wished, and the connector is
 * switched on while it is owed energy. The two differ by no more than the minimum for `min_on_ms` and one tick.
 */
#ifndef TAPER_ALLOCATOR_H
#define TAPER_ALLOCATOR_H

#include <stdbool.h>
#include <stdint.h>

#include "taper/types.h"

/** One connector. All of it belongs to a session; another one begins anew. */
typedef struct {
    bool on;
    bool switched; /**< `since_ms` is set: it was switched at least once in this session */
    bool waits;    /**< it was to have current, and there was no place for its minimum */
    uint8_t session;
    uint32_t since_ms;   /**< of the last switch */
    uint32_t waiting_ms; /**< since when it waits */
    int64_t owed_mWs;    /**< wished and not given; bounded by the minimum for `min_on_ms` */
} taper_turn_t;

typedef struct {
    taper_turn_t turn[TAPER_MAX_CONNECTORS];
    bool started;
    uint32_t updated_ms; /**< time of the last snapshot */
} taper_allocator_t;

/** Where a connector stands among those that wait: `place` 1.. of `of`; 0 of 0: it does not wait. */
typedef struct {
    uint8_t place, of;
} taper_waiting_t;

/** All connectors off, nobody waits. */
void taper_allocator_init(taper_allocator_t *allocator);

/**
 * Bound `proposal` by the limits of connectors, vehicles and groups; `supply` (negative counts as 0) bounds group 0
 * besides its own limits. `reserved_mA` [connectors] is kept free for connectors that are silent, but may still draw;
 * NULL: nothing. Times are those of the snapshot.
 * Cost: O(connectors x depth of the tree), a few times, and O(connectors^2) comparisons at worst for the order.
 */
void taper_allocate(taper_allocator_t *allocator, const taper_station_config_t *config,
                    const taper_snapshot_t *snapshot, const taper_proposal_t *proposal,
                    const taper_supply_t *supply, const int32_t *reserved_mA, taper_setpoints_t *setpoints);

/** Who waits, by the last allocation: the first of them is switched on next. Cost: O(connectors). */
taper_waiting_t taper_allocator_waiting(const taper_allocator_t *allocator,
                                        const taper_station_config_t *config,
                                        const taper_snapshot_t *snapshot, uint8_t connector);

/** Lower currents until no group's imbalance is above its limit. Nothing is raised; whatever it cuts to below its minimum
    becomes 0. `rank`: who is served first is cut last. Cost: O(groups x connectors^2) at worst. */
void taper_balance(const taper_station_config_t *config, const taper_snapshot_t *snapshot,
                   const uint8_t *rank, taper_setpoints_t *setpoints);

/**
 * Whether `setpoints` hold every limit of connectors, groups, phases and imbalance, recomputed from nothing.
 * Cost: O(connectors + groups).
 */
bool taper_guard_passes(const taper_station_config_t *config, const taper_snapshot_t *snapshot,
                        const taper_supply_t *supply, const taper_setpoints_t *setpoints);

#endif
