/** Replay: a recorded bus is fed to a fresh station, and everything that it sends is compared with the recording. */
#ifndef SIM_REPLAY_H
#define SIM_REPLAY_H

#include "setup.h"

typedef struct {
    const char *file;
    const char *names[4]; /**< interfaces of the buses; none: by first appearance */
    unsigned name_count;
    taper_setup_t setup;
} sim_replay_options_t;

/** Run, and tell the result on stdout. @return the exit code of the program. */
int sim_replay_run(const sim_replay_options_t *options);

#endif
