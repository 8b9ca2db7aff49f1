#include "work.h"

static void keep_worst(uint32_t *worst, uint32_t instructions) {
    *worst = instructions > *worst ? instructions : *worst;
}

void sim_work_add(sim_work_t *work, sim_call_t call, bool planned, uint32_t instructions) {
    if (instructions == 0) {
        return;
    }
    if (call == SIM_POLL) {
        keep_worst(&work->worst_poll, instructions);
        return;
    }
    sim_samples_add(&work->ticks, instructions);
    keep_worst(&work->worst, instructions);
    if (!planned) {
        keep_worst(&work->worst_without_slice, instructions);
    }
}

void sim_work_free(sim_work_t *work) {
    sim_samples_free(&work->ticks);
    *work = (sim_work_t){0};
}
