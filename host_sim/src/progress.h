/** One line on stderr, if that is a terminal, that shows how far a long run is. */
#ifndef SIM_PROGRESS_H
#define SIM_PROGRESS_H

#include <stdbool.h>
#include <stdint.h>

typedef struct {
    bool shown;      /**< something stands on the line */
    bool wanted;     /**< stderr is a terminal */
    uint64_t due_us; /**< when it may change next */
} sim_progress_t;

/** Monotonic time [us]. */
uint64_t sim_now_us(void);

void sim_progress_init(sim_progress_t *progress);

/** Show that `done` of `all` are done; at most five times a second, and not in the first second. */
void sim_progress_show(sim_progress_t *progress, int64_t done, int64_t all);

/** Clear the line. */
void sim_progress_end(sim_progress_t *progress);

#endif
