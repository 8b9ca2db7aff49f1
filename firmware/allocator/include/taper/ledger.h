/**
 * The ledger: what every connector may still draw by the setpoints that it was sent, whatever it is sent next.
 *
 * A setpoint is in force from the moment it may have arrived until a later one is known to have been accepted (the echo
 * in EVSE_STATUS), until its validity ends, or until the connector says that it fell back or has no vehicle. What one
 * connector holds like this, no other is given: break before make (docs/protocol.md, the four rules).
 */
#ifndef TAPER_LEDGER_H
#define TAPER_LEDGER_H

#include <stdbool.h>
#include <stdint.h>

#include "taper/message.h"
#include "taper/types.h"

/** Counters of SETPOINT, and so setpoints that the echo can tell apart. */
#define TAPER_LEDGER_SETPOINTS 16u
/** A frame may have waited so long in a send queue: the validity of a setpoint is taken to begin this much later [ms]. */
#define TAPER_LEDGER_LATE_ms 500u

/** One connector. Zero-initialised: it was never sent anything. */
typedef struct {
    uint16_t sent_dA[TAPER_LEDGER_SETPOINTS]; /**< current by counter, in steps of the wire */
    uint32_t sent_ms[TAPER_LEDGER_SETPOINTS];
    uint16_t open;             /**< bit c: the setpoint with counter c may be in force, now or later */
    int32_t unknown_mA;        /**< what a controller before this one may have told it; 0: nothing any more */
    uint32_t unknown_until_ms; /**< end of that */
    uint8_t first_echo;        /**< + 1; may still be of that time. 0: none heard */
} taper_ledger_entry_t;

typedef struct {
    uint32_t validity_ms; /**< of every setpoint sent */
    taper_ledger_entry_t entry[TAPER_MAX_CONNECTORS];
} taper_ledger_t;

/**
 * Start at `now_ms` without knowing what went before: every connector may draw its maximum until the validity of the last
 * setpoint of an earlier life has ended. Whatever was on its way in that life has arrived by now, or never will: a start
 * takes longer than a queue. All setpoints are sent with `validity_ms`.
 */
void taper_ledger_init(taper_ledger_t *ledger, const taper_station_config_t *config, uint32_t validity_ms,
                       uint32_t now_ms);

/** Whether the setpoint with `counter` may be sent: false while an older one with that counter may be in force. */
bool taper_ledger_can_send(const taper_ledger_t *ledger, uint8_t connector, uint8_t counter);

/** A setpoint went out at `now_ms`. `current_mA`: a multiple of TAPER_CURRENT_STEP_mA. */
void taper_ledger_sent(taper_ledger_t *ledger, uint8_t connector, uint8_t counter, int32_t current_mA,
                       uint32_t now_ms);

/** What a connector reported at `at_ms` ends what it shows to be over. Cost: O(TAPER_LEDGER_SETPOINTS). */
void taper_ledger_hear(taper_ledger_t *ledger, uint8_t connector, const taper_evse_status_t *status,
                       uint32_t at_ms);

/** Close what ran out by `now_ms`. Call it once per tick and poll. Cost: O(connectors x TAPER_LEDGER_SETPOINTS). */
void taper_ledger_update(taper_ledger_t *ledger, const taper_station_config_t *config, uint32_t now_ms);

/** What a connector may draw per phase, by all that is open [mA]. */
int32_t taper_ledger_may_mA(const taper_ledger_t *ledger, uint8_t connector);

/** The part of it that this controller told: what it may be told again without asking for room. */
int32_t taper_ledger_told_mA(const taper_ledger_t *ledger, uint8_t connector);

/**
 * Bound `target`, which holds every limit by itself, by what others may still draw: decreases go through, increases in the
 * order of `rank` as far as room is left in every group. `granted <= target` for every connector, and at least the minimum
 * current or nothing. Cost: O(connectors x depth of the tree).
 */
void taper_ledger_grant(const taper_ledger_t *ledger, const taper_station_config_t *config,
                        const taper_snapshot_t *snapshot, const uint8_t *rank, int32_t site_limit_W,
                        const taper_setpoints_t *target, taper_setpoints_t *granted);

/**
 * The guard of the hand-over, recomputed from nothing: with `granted` sent, what all connectors may draw exceeds no limit
 * that it does not exceed already. Cost: O(connectors + groups).
 */
bool taper_guard_hand_over_passes(const taper_ledger_t *ledger, const taper_station_config_t *config,
                                  const taper_snapshot_t *snapshot, int32_t site_limit_W,
                                  const taper_setpoints_t *granted);

#endif
