/**
 * The allocator: any proposal -> setpoints that hold every hard limit. Integers only; the safety argument is here.
 *
 * Room is kept for every row of the feeder tree (rows.h): power, and the current of each phase. A connector's current is
 * only ever raised by what fits into every row above it, rounded down to the step of the wire, and that much is taken from
 * each of them: so no sum exceeds a limit, whatever the proposal says. Where a group limits the imbalance of its phases,
 * currents on the stronger phases are lowered at the end until it holds. The guard recomputes all of it from nothing.
 *
 * Turns. A connector with a minimum current gets at least that or nothing. Minima come first, then what wishes and ceilings
 * go beyond them, in the order of rank. Where the minima of all that are wished for do not fit, the order is: who was
 * switched on less than `min_on_ms` ago; whose turn is not over (on for less than `turn_ms`); who has waited for `turn_ms`,
 * longest first; the rest by laxity, least first. So when a limit falls, who can wait longest is shed first. Nobody is
 * switched on within `min_off_ms` of being switched off. Whom only a ceiling calls for comes after all wishes.
 *
 * If one minimum fits, somebody is on. With places for K of M connectors nobody waits longer than ceil(M / K) turns, one
 * `min_off_ms`, and a tick per turn, while limits and wishes stay; a turn is the longest of `turn_ms`, `min_on_ms`, and, where
 * vehicles take time to follow, twice what a hand-over takes (the longest reaction and `change_ms`). Where
 * minima differ, room is kept for the first one that waited for a turn in vain, so that small ones do not shut it out.
 *
 * A wish below the minimum is followed over time: what is given is booked against what was wished. The connector is
 * switched on when it is owed half the energy of the minimum for `min_on_ms`, and until it is owed none. The two differ by
 * no more than the minimum for the longer of `min_on_ms` and `min_off_ms`, and one tick, while there is a place for it. It
 * has the minimum besides, as all others, if its ceiling allows it and room is left over.
 */
#ifndef TAPER_ALLOCATOR_H
#define TAPER_ALLOCATOR_H

#include <stdbool.h>
#include <stdint.h>

#include "taper/rows.h"
#include "taper/types.h"

/** One connector. All of it belongs to a session; another one begins anew. */
typedef struct {
    bool on;
    bool switched; /**< `since_ms` is set: it was switched at least once in this session */
    uint8_t place; /**< among those that wait; 0: it does not */
    uint8_t session;
    uint32_t since_ms;   /**< of the last switch */
    uint32_t waiting_ms; /**< since when it waits */
    int64_t
        owed_mWs; /**< wished and not given; no further from 0 than the minimum for `min_on_ms` and a tick */
    int64_t lacks_mW; /**< wished and not given since the last allocation; negative: given beyond the wish */
} taper_turn_t;

typedef struct {
    taper_turn_t turn[TAPER_MAX_CONNECTORS];
    bool started;
    uint32_t updated_ms; /**< time of the last snapshot */
    uint8_t waiting;     /**< so many wait */
    uint32_t switches;   /**< counts them all; wraps */
} taper_allocator_t;

/** What of a turn has to outlive a restart. Ages are in the world's time. */
typedef struct {
    bool on, switched; /**< as in taper_turn_t */
    bool waits;
    uint32_t since_s;   /**< so long ago was the last switch */
    uint32_t waiting_s; /**< so long does it wait */
    int32_t owed_Ws;
} taper_turn_kept_t;

/** Where a connector stands among those that wait: `place` 1.. of `of`; 0 of 0: it does not wait. */
typedef struct {
    uint8_t place, of;
} taper_waiting_t;

/** All connectors off, nobody waits. */
void taper_allocator_init(taper_allocator_t *allocator);

/**
 * Bound `proposal` by the limits of connectors, vehicles and groups; `rows` are those of now. `reserved_mA` [connectors] is
 * what each draws whatever it is told: silent, deaf, or out of hand; its own setpoint counts up to that without more room.
 * NULL: nothing. Times are those of the snapshot.
 * Cost: O(connectors x depth of the tree), a few times, and O(connectors^2) comparisons at worst for the order. Stack: about
 * 20 bytes per connector and 220 per group.
 */
void taper_allocate(taper_allocator_t *allocator, const taper_station_config_t *config,
                    const taper_snapshot_t *snapshot, const taper_proposal_t *proposal,
                    const taper_rows_t *rows, const int32_t *reserved_mA, taper_setpoints_t *setpoints);

/** The turn of a connector, to be kept. `now_ms` is that of a snapshot. */
taper_turn_kept_t taper_allocator_keep(const taper_allocator_t *allocator, uint8_t connector,
                                       uint32_t now_ms);

/** The connector goes on with a turn that was kept, `later_s` after that, for the `session` that it has at the next snapshot. */
void taper_allocator_restore(taper_allocator_t *allocator, uint8_t connector, uint8_t session,
                             const taper_turn_kept_t *kept, uint32_t later_s, uint32_t now_ms);

/** Who waits, by the last allocation, in the order in which they will be switched on. Cost: constant. */
taper_waiting_t taper_allocator_waiting(const taper_allocator_t *allocator, uint8_t connector);

/**
 * Lower currents until no group's imbalance is above its limit, on whatever phases those are whose phases are unsure: of those
 * that may be on its strongest phase and are not for sure on its weakest one, first who is unsure, then who is on one phase,
 * from the end of `rank` up, down to the minimum; only if that is not enough, to 0. Nothing is raised. `rank` is [connectors];
 * whom it does not name is cut first. Cost: O(connectors x depth) for every group that limits its imbalance, and while one
 * tilts that again, at most (connectors + groups) x 2 times.
 */
void taper_balance(const taper_station_config_t *config, const taper_snapshot_t *snapshot,
                   const taper_rows_t *rows, const uint8_t *rank, taper_setpoints_t *setpoints);

/**
 * Whether `setpoints` hold every limit of connectors, groups, phases and imbalance, recomputed from nothing. Currents of
 * pairs of lines are added as phasors, in integers: what the rows bound from above, here is the current itself.
 * Cost: O(connectors + groups).
 */
bool taper_guard_passes(const taper_station_config_t *config, const taper_snapshot_t *snapshot,
                        const taper_supply_t *supply, const taper_setpoints_t *setpoints);

#endif
