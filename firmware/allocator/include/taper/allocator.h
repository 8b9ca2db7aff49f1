/**
 * The allocator: any proposal -> setpoints that hold every hard limit. Integers only; the safety argument is here.
 *
 * Room is kept per group of the feeder tree. A connector's current is only ever raised by what fits into the room of
 * every group above it, rounded down to the step of the wire, and that much is taken from each of them: so no sum
 * exceeds a limit, whatever the proposal says. The guard recomputes all sums from nothing before anything is sent.
 */
#ifndef TAPER_ALLOCATOR_H
#define TAPER_ALLOCATOR_H

#include <stdbool.h>
#include <stdint.h>

#include "taper/types.h"

/** Whether a connector has current, and since when: for the minimum on and off times. */
typedef struct {
    bool on;
    bool switched; /**< `since_ms` is set: it was switched at least once in this session */
    uint8_t session;
    uint32_t since_ms;
} taper_switch_t;

typedef struct {
    taper_switch_t state[TAPER_MAX_CONNECTORS];
} taper_allocator_t;

/** All connectors off. */
void taper_allocator_init(taper_allocator_t *allocator);

/**
 * Bound `proposal` by the limits of connectors, vehicles and groups; `site_limit_W` (negative counts as 0) bounds
 * group 0 besides its own limit. A connector gets at least its minimum current or nothing. With a minimum, it stays on
 * for `min_on_ms` while there is room, and off for `min_off_ms`. `reserved_mA` [connectors] is kept free for connectors
 * that are silent, but may still draw; NULL: nothing.
 * Cost: O(connectors x depth of the tree), three times.
 */
void taper_allocate(taper_allocator_t *allocator, const taper_station_config_t *config,
                    const taper_snapshot_t *snapshot, const taper_proposal_t *proposal, int32_t site_limit_W,
                    const int32_t *reserved_mA, taper_setpoints_t *setpoints);

/** Whether `setpoints` hold every limit of connectors and groups, recomputed from nothing. Cost: O(connectors + groups). */
bool taper_guard_passes(const taper_station_config_t *config, const taper_snapshot_t *snapshot,
                        int32_t site_limit_W, const taper_setpoints_t *setpoints);

#endif
