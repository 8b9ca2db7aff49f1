/**
 * The supervisor: which proposal is used, whether the planner is asked at all, and whether this controller still trusts
 * itself. Conditions, modes, deadlines and ways back are one table, in supervisor.c. Every row is left by itself as soon as
 * its condition ends, and nothing is remembered but what stands in the structs below.
 */
#ifndef TAPER_SUPERVISOR_H
#define TAPER_SUPERVISOR_H

#include <stdbool.h>
#include <stdint.h>

#include "taper/types.h"

/** Longest wait for the gateway's first limit after a start [ms]; then the failsafe limit applies. */
#define TAPER_INIT_ms 10000
/** Plans in a row that are no good, and how long the planner is left alone then [ms] (docs/protocol.md, fault 24). */
#define TAPER_BAD_PLANS      3
#define TAPER_PLANNER_OFF_ms UINT32_C(600000)
/** Ticks in a row that took too long, or setpoints found flipped: the watchdog is left to bite (faults 47, 48). */
#define TAPER_RESET_OVERRUNS 2
#define TAPER_RESET_FLIPS    2

typedef struct {
    bool gateway_alive;  /**< a limit of the gateway is in force */
    bool gateway_heard;  /**< there ever was one */
    bool tick_overran;   /**< the last tick took too long */
    bool proposal_ready; /**< the configured policy has an answer to use now */
} taper_situation_t;

typedef struct {
    taper_mode_t mode;
    bool started;
    uint32_t started_ms; /**< time of the first update */
} taper_supervisor_t;

/** Mode INIT. */
void taper_supervisor_init(taper_supervisor_t *supervisor);

/** Decide the mode at `now_ms`. Cost: constant. */
taper_mode_t taper_supervisor_update(taper_supervisor_t *supervisor, const taper_situation_t *situation,
                                     uint32_t now_ms);

/** What the planner's answers were worth. Zero-initialised: it is trusted. */
typedef struct {
    uint8_t bad; /**< in a row */
    bool off;
    uint32_t off_ms; /**< since when */
} taper_health_t;

/** An answer came at `now_ms`; while the planner is off, it does not count. @return whether it turned the planner off. */
bool taper_health_judge(taper_health_t *health, bool usable, uint32_t now_ms);

/** Whether the planner may be asked at `now_ms`. After TAPER_PLANNER_OFF_ms it may again, and one more bad answer turns
    it off; a good one makes it trusted. Ask in every tick: the time off must not come round with the clock.
    @return false while it is off. */
bool taper_health_may_plan(taper_health_t *health, uint32_t now_ms);

/** Faults of this controller itself. Zero-initialised: none. */
typedef struct {
    bool overran;     /**< the last tick did */
    uint8_t overruns; /**< in a row; stays at TAPER_RESET_OVERRUNS once it was reached */
    uint8_t flips;    /**< setpoints that differed from their inverse, ever, up to TAPER_RESET_FLIPS */
} taper_self_t;

/**
 * A tick began `late_ms` late: so much longer than `tick_ms` took the one before, or what ran beside it. More than half a
 * tick is too long: setpoints are to be on the bus half a tick late at the latest (docs/protocol.md, Faults).
 * @return whether it was too long.
 */
bool taper_self_ticked(taper_self_t *self, uint32_t late_ms, uint32_t tick_ms);

/** A setpoint differed from its inverse. */
void taper_self_flipped(taper_self_t *self);

/** Whether the watchdog is to be kicked. Once it is not, it never is again: this controller is to be restarted. */
bool taper_self_is_sound(const taper_self_t *self);

#endif
