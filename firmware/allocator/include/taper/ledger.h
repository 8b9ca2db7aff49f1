/**
 * The ledger: what every connector may still draw by the setpoints that it was sent, whatever it is sent next.
 *
 * A setpoint is in force from the moment it may have arrived until a later one is known to have been accepted (the echo
 * in EVSE_STATUS), until its validity ends, or until the connector says that it fell back. The vehicle then has the
 * connector's `reaction_ms` more to follow: the level fades. Once nothing is in force any more, a connector with a vehicle
 * draws the fallback current of the setpoint that it accepted last, for as long as nobody reaches it. Without a vehicle
 * (pilot A, or so it says) its contactor is open and all of this is over at once; the next vehicle draws nothing before
 * its first setpoint. What one connector holds like this, no other is given: break before make (docs/protocol.md, the four
 * rules). An echo proves nothing of a setpoint whose counter it named before that was sent: a frame whose counter was
 * corrupted may have a good CRC (docs/protocol.md). The next setpoint is proven again.
 *
 * What a connector measures above all that, and above the tolerance of draw.h, counts as drawn for as long as it says so
 * (fault 41).
 *
 * Times are those of the bus; a vehicle reacts in the world's time, which is `time_scale` times as fast.
 */
#ifndef TAPER_LEDGER_H
#define TAPER_LEDGER_H

#include <stdbool.h>
#include <stdint.h>

#include "taper/message.h"
#include "taper/rows.h"
#include "taper/types.h"

/** Counters of SETPOINT, and so setpoints that the echo can tell apart. */
#define TAPER_LEDGER_SETPOINTS 16u
/** A frame may have waited so long in a send queue: the validity of a setpoint is taken to begin this much later [ms]. */
#define TAPER_LEDGER_LATE_ms 500u
/** Levels that a vehicle may be on its way down from. More are booked as the higher of two. */
#define TAPER_LEDGER_FADES 4u
/** Step and greatest value of a fallback current on the wire [mA] (SETPOINT, 0.5 A). */
#define TAPER_FALLBACK_STEP_mA 500
#define TAPER_FALLBACK_MOST_mA 127000

/** A level that the vehicle may draw until a time. */
typedef struct {
    int32_t mA;
    uint32_t until_ms;
} taper_ledger_fade_t;

/** One connector. */
typedef struct {
    uint16_t sent_dA[TAPER_LEDGER_SETPOINTS]; /**< current by counter, in steps of the wire */
    uint16_t
        fallback_dA[TAPER_LEDGER_SETPOINTS]; /**< and the fallback current told with it, never above it */
    uint32_t sent_ms[TAPER_LEDGER_SETPOINTS];
    uint16_t open;   /**< bit c: the setpoint with counter c may be in force, now or later */
    uint16_t echoed; /**< bit c: that, or a report on its way may still name it */
    int32_t open_mA, open_fallback_mA; /**< the most of these two lists that is open */
    taper_ledger_fade_t
        fade[TAPER_LEDGER_FADES]; /**< mA falling, times not; mA 0: free, and so are all behind */
    int32_t
        over_fallback_mA; /**< the most told with setpoints that are over, any of which may be accepted last */
    int32_t unknown_mA;   /**< what a controller before this one may have told it; 0: nothing any more */
    uint32_t unknown_until_ms; /**< end of that, with the vehicle's reaction */
    uint8_t first_echo;      /**< + 1; may still be of that time. 0: none heard; UINT8_MAX: echoes are ours */
    uint8_t reported;        /**< + 1: the counter that it echoed last; 0: none, or it fell back since */
    uint8_t unproven;        /**< + 1: the setpoint whose counter it echoed before that was sent; 0: none */
    bool accepts;            /**< it has accepted a setpoint of ours since its vehicle came */
    int32_t drawn_mA;        /**< measured above what it may; 0: not so */
    uint32_t drawn_until_ms; /**< for how long that holds without another report */
    int32_t last_mA;         /**< the setpoint sent last */
    int32_t last_fallback_mA; /**< and its fallback current */
} taper_ledger_entry_t;

typedef struct {
    const taper_station_config_t *config;
    uint32_t validity_ms; /**< of every setpoint sent */
    uint32_t time_scale;  /**< world seconds per second of the bus: vehicles react in the world's time */
    taper_ledger_entry_t entry[TAPER_MAX_CONNECTORS];
} taper_ledger_t;

/**
 * Start at `now_ms` without knowing what went before: every connector may draw its maximum until the validity of the last
 * setpoint of an earlier life has ended and its vehicle has followed, or until it is heard to have accepted a setpoint of
 * ours or to have fallen back, and its vehicle has followed. Its configured fallback current counts until a setpoint of ours is
 * echoed. Without a vehicle all that is over at once. Whatever was on its way in that life has arrived by now, or never
 * will: a start takes longer than a queue. All setpoints are sent with `validity_ms`. `time_scale` >= 1.
 */
void taper_ledger_init(taper_ledger_t *ledger, const taper_station_config_t *config, uint32_t validity_ms,
                       uint32_t time_scale, uint32_t now_ms);

/** Whether the setpoint with `counter` may be sent: false while an older one with that counter may be in force, or a report
    that names it on its way. */
bool taper_ledger_can_send(const taper_ledger_t *ledger, uint8_t connector, uint8_t counter);

/**
 * A setpoint went out at `now_ms`. `current_mA` is a multiple of TAPER_CURRENT_STEP_mA, `fallback_mA` of
 * TAPER_FALLBACK_STEP_mA, and 0 <= fallback_mA <= current_mA.
 */
void taper_ledger_sent(taper_ledger_t *ledger, uint8_t connector, uint8_t counter, int32_t current_mA,
                       int32_t fallback_mA, uint32_t now_ms);

/** What a connector reported at `at_ms` ends what it shows to be over. Cost: O(TAPER_LEDGER_SETPOINTS). */
void taper_ledger_hear(taper_ledger_t *ledger, uint8_t connector, const taper_evse_status_t *status,
                       uint32_t at_ms);

/** Close what ran out by `now_ms`. Call it once per tick and poll. Cost: O(connectors x TAPER_LEDGER_SETPOINTS). */
void taper_ledger_update(taper_ledger_t *ledger, uint32_t now_ms);

/** Whether a connector is known to have accepted a setpoint of ours, and so to be in the session that it was for. */
bool taper_ledger_is_accepted(const taper_ledger_t *ledger, uint8_t connector);

/** Whether what an earlier controller told some connector may still be in force. Cost: O(connectors). */
bool taper_ledger_is_starting(const taper_ledger_t *ledger);

/** What a connector may draw per phase, by all that is open, and what it is seen to draw [mA]. */
int32_t taper_ledger_may_mA(const taper_ledger_t *ledger, uint8_t connector);

/** The same without what it is only seen to draw: what it was told, by this controller or the one before, and its vehicle
    has not had the time to leave [mA]. */
int32_t taper_ledger_told_mA(const taper_ledger_t *ledger, uint8_t connector);

/** The greatest fallback current that a connector may have been told last [mA]. */
int32_t taper_ledger_fallback_mA(const taper_ledger_t *ledger, uint8_t connector);

/**
 * The fallback current that a connector may draw whatever it is told now: a setpoint ran out, and none after it was heard to
 * be accepted [mA]. taper_allocate() has to reserve it also for a connector that is heard: else what the others are lowered
 * to when a limit falls leaves no room for it.
 */
int32_t taper_ledger_unreached_mA(const taper_ledger_t *ledger, uint8_t connector);

/**
 * Bound `target`, which holds every limit by itself, by what others may still draw: decreases go through, increases in the
 * order of `rank` as far as room is left in every row of `rows`, those of now. Below a row that is overdrawn (its limit fell,
 * or a vehicle over-draws) nobody is told more than last, so the excess ends when the slowest vehicle has followed; and whose
 * setpoints ran out nothing, since he may draw nothing by now.
 * `granted <= target` for every connector, and at least the minimum current or nothing. Where a group limits its imbalance,
 * that holds for what is granted too. Cost: O(connectors x depth of the tree), and that of taper_balance().
 */
void taper_ledger_grant(const taper_ledger_t *ledger, const taper_station_config_t *config,
                        const taper_snapshot_t *snapshot, const uint8_t *rank, const taper_rows_t *rows,
                        const taper_setpoints_t *target, taper_setpoints_t *granted);

/**
 * Choose the fallback current that goes with each setpoint: in the order of `rank` the configured one, never above what is
 * granted, at least the minimum current or nothing, in steps of TAPER_FALLBACK_STEP_mA. The sum of the power of all that connectors may
 * have been told stays within `failsafe_W`, however old. What was told last is kept where it can be, so a higher rank takes
 * from nobody. While the sum is above (the limit fell, or after a start) nobody is told any: who can be reached gives up for who
 * cannot. Cost: O(connectors).
 */
void taper_ledger_grant_fallback(const taper_ledger_t *ledger, const taper_station_config_t *config,
                                 const taper_snapshot_t *snapshot, const taper_rows_t *rows,
                                 const uint8_t *rank, int32_t failsafe_W, const taper_setpoints_t *granted,
                                 taper_setpoints_t *fallback);

/**
 * The guard of the hand-over, recomputed from nothing: with `granted` sent, what all connectors may draw exceeds no limit
 * of power or of the current of a phase that it does not exceed already. Cost: O(connectors + groups).
 */
bool taper_guard_hand_over_passes(const taper_ledger_t *ledger, const taper_station_config_t *config,
                                  const taper_snapshot_t *snapshot, const taper_supply_t *supply,
                                  const taper_setpoints_t *granted);

/** The same for fallback currents: none above its setpoint, and the sum of all that may have been told within `failsafe_W`, or none. */
bool taper_guard_fallback_passes(const taper_ledger_t *ledger, const taper_station_config_t *config,
                                 const taper_snapshot_t *snapshot, int32_t failsafe_W,
                                 const taper_setpoints_t *granted, const taper_setpoints_t *fallback);

#endif
