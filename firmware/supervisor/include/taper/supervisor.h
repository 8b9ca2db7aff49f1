/**
 * The mode machine. What it is told decides; it remembers only the time of the start, and whether it has left INIT.
 *
 * | heard from the gateway               | policy has a proposal | mode     |
 * |--------------------------------------|-----------------------|----------|
 * | never, up to TAPER_INIT_ms           | -                     | INIT     |
 * | never, later; or silent for too long | -                     | FAILSAFE |
 * | yes                                  | yes                   | PLAN     |
 * | yes                                  | no                    | FALLBACK |
 *
 * Every row is left by itself as soon as its condition ends.
 */
#ifndef TAPER_SUPERVISOR_H
#define TAPER_SUPERVISOR_H

#include <stdbool.h>
#include <stdint.h>

#include "taper/types.h"

/** Longest wait for the gateway's first limit after a start [ms]; then the failsafe limit applies. */
#define TAPER_INIT_ms 10000

typedef struct {
    bool gateway_alive;  /**< a limit of the gateway is in force */
    bool gateway_heard;  /**< there ever was one */
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

#endif
