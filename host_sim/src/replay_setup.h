/** What a replay runs: what the recording's companion says, and what the command line says otherwise. */
#ifndef SIM_REPLAY_SETUP_H
#define SIM_REPLAY_SETUP_H

#include "companion.h"
#include "replay.h"

/** Names are borrowed from the command line; `made` must stay where it is. */
typedef struct {
    bool own;                    /**< the station's own recording: it has a companion */
    taper_companion_t companion; /**< only if `own` */
    taper_setup_t setup;
    const char *names[SIM_REPLAY_BUSES]; /**< interfaces of the buses */
    unsigned name_count;
    taper_made_t made; /**< `options.port` is left open */
} sim_replay_setup_t;

/**
 * Read FILE.station, if it is there, and make the station. Options that were given go before it, with one line on stderr if
 * that makes another station.
 * @return SIM_EXIT_OK, or, after one line on stderr, another exit code.
 */
int sim_replay_set_up(sim_replay_setup_t *setup, const sim_replay_options_t *options);

#endif
