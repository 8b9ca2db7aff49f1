/**
 * When a frame is due: on a grid of its period, and besides when what it says has changed. Frames sent on a change do not
 * move the grid, so nodes whose grids are spread stay spread.
 */
#ifndef SIM_SCHEDULE_H
#define SIM_SCHEDULE_H

#include <stdbool.h>
#include <stdint.h>

typedef struct {
    int64_t period_ms;
    int64_t gap_ms; /**< least time between two frames */
} sim_cycle_t;

typedef struct {
    int64_t phase_ms; /**< the grid is phase_ms + k * period_ms */
    int64_t due_ms;
    int64_t sent_ms;
    uint32_t key; /**< what the last frame said, as far as a change of it counts */
} sim_slot_t;

/** A sender starts: its first frame is due at `first_ms`, then the grid holds, 0 <= phase_ms < period_ms. */
void sim_slot_start(sim_slot_t *slot, const sim_cycle_t *cycle, int64_t first_ms, int64_t phase_ms);

/** Whether a frame is to be sent at `now_ms` that says `key`. */
bool sim_slot_is_due(const sim_slot_t *slot, const sim_cycle_t *cycle, int64_t now_ms, uint32_t key);

/** It was sent. */
void sim_slot_sent(sim_slot_t *slot, const sim_cycle_t *cycle, int64_t now_ms, uint32_t key);

#endif
