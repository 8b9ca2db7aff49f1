#define _POSIX_C_SOURCE 200809L

#include "progress.h"

#include <stdio.h>
#include <time.h>
#include <unistd.h>

#define PERIOD_US 200000U
#define QUIET_US  1000000U

uint64_t sim_now_us(void) {
    struct timespec now;
    (void)clock_gettime(CLOCK_MONOTONIC, &now);
    return (uint64_t)now.tv_sec * 1000000U + (uint64_t)now.tv_nsec / 1000U;
}

void sim_progress_init(sim_progress_t *progress) {
    *progress = (sim_progress_t){.wanted = isatty(STDERR_FILENO) == 1, .due_us = sim_now_us() + QUIET_US};
}

void sim_progress_show(sim_progress_t *progress, int64_t done, int64_t all) {
    if (!progress->wanted || sim_now_us() < progress->due_us) {
        return;
    }
    fprintf(stderr, "\rtaper-sim: %3.0f %% of the time simulated", 100.0 * (double)done / (double)all);
    fflush(stderr);
    progress->shown = true;
    progress->due_us = sim_now_us() + PERIOD_US;
}

void sim_progress_end(sim_progress_t *progress) {
    if (progress->shown) {
        fputs("\r\033[K", stderr);
        progress->shown = false;
    }
}
