/** How many instructions a board spends in its calls. */
#ifndef SIM_WORK_H
#define SIM_WORK_H

#include <stdbool.h>
#include <stdint.h>

#include "stats.h"

typedef enum { SIM_STEP, SIM_POLL } sim_call_t;

typedef struct {
    sim_samples_t ticks;          /**< of every step */
    uint32_t worst;               /**< of a step */
    uint32_t worst_without_slice; /**< of a step in which the planner did nothing */
    uint32_t worst_poll;
} sim_work_t;

/** A call that took so many `instructions`; 0: not known, and not counted. `planned`: the planner worked in it. */
void sim_work_add(sim_work_t *work, sim_call_t call, bool planned, uint32_t instructions);

void sim_work_free(sim_work_t *work);

#endif
