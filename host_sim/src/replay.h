/** Replay: a recorded bus is fed to a fresh station, and everything that it sends is compared with the recording. */
#ifndef SIM_REPLAY_H
#define SIM_REPLAY_H

#include "setup.h"

/** Interfaces that can be named. */
#define SIM_REPLAY_BUSES 4

/** What the command line says. */
typedef struct {
    const char *file;
    const char
        *names[SIM_REPLAY_BUSES]; /**< interfaces of the buses; none: as recorded, or by first appearance */
    unsigned name_count;
    bool station_given;
    taper_setup_t setup; /**< as setup.h says for what was not given; a time_scale that was not is 0 */
} sim_replay_options_t;

/** Run, and tell the result on stdout. @return the exit code of the program. */
int sim_replay_run(const sim_replay_options_t *options);

#endif
