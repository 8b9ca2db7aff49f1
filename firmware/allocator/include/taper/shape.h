/**
 * How a setpoint may move: decreases at once, increases slowly. Between the allocator's target and what the ledger grants.
 *
 * - An increase comes no sooner than `change_ms` after the last change of that setpoint (IEC 61851-1: a vehicle has 5 s to
 *   follow a new duty cycle; DC connectors are exempt).
 * - It is no steeper than `ramp_mA_per_s`, counted for the time since the last change, but at most for the longest of
 *   `change_ms`, a control tick, and what one step of the wire takes. The step from below the minimum current to it is
 *   always allowed.
 * - If what is missing to the target is below `deadband_mA`, it waits until nothing changed for TAPER_SHAPE_SETTLE_ms. That
 *   keeps no connector off.
 *
 * Times are the world's (`snapshot->now_ms`).
 */
#ifndef TAPER_SHAPE_H
#define TAPER_SHAPE_H

#include <stdbool.h>
#include <stdint.h>

#include "taper/types.h"

/** An increase below the deadband is made when the setpoint stood still for so long [ms]. */
#define TAPER_SHAPE_SETTLE_ms UINT32_C(30000)

typedef struct {
    bool changed[TAPER_MAX_CONNECTORS];        /**< there was a change: `changed_ms` is set */
    uint32_t changed_ms[TAPER_MAX_CONNECTORS]; /**< of the last setpoint that differed from the one before */
    int32_t sent_mA[TAPER_MAX_CONNECTORS];     /**< the last setpoint */
} taper_shape_t;

/** No setpoint was ever sent: all are 0. */
void taper_shape_init(taper_shape_t *shape);

/** A setpoint was sent at `now_ms`. `new_session`: the one before was for somebody else, and holds nothing back. */
void taper_shape_sent(taper_shape_t *shape, uint8_t connector, int32_t current_mA, bool new_session,
                      uint32_t now_ms);

/**
 * Bound `target` by what may be sent at `now_ms`: `shaped <= target` for every connector, at least its minimum current or
 * nothing, a whole number of steps. Cost: O(connectors).
 */
void taper_shape_bound(const taper_shape_t *shape, const taper_station_config_t *config,
                       const taper_snapshot_t *snapshot, const taper_setpoints_t *target, uint32_t now_ms,
                       taper_setpoints_t *shaped);

#endif
