/** The command line. */
#ifndef SIM_OPTIONS_H
#define SIM_OPTIONS_H

#include <stdbool.h>
#include <stdint.h>

#include "baselines.h"
#include "errors.h"
#include "exit_codes.h"
#include "replay.h"
#include "taper/types.h"

/** Strings are borrowed from the command line. */
typedef struct {
    const char *sessions_file;
    const char *limit_file;    /**< NULL: none */
    const char *price_file;    /**< NULL: none */
    const char *out;           /**< NULL: no files */
    const char *problems_file; /**< NULL: none */
    const char *frames_file;   /**< NULL: none */
    const char *tapers_file;   /**< NULL: none */
    const char *bus;           /**< HOST:PORT of the board; NULL: the station is part of the program */
    unsigned bus_timeout_s;
    const sim_policy_t *policy;
    unsigned station;             /**< index in taper_stations[] */
    double limit_kw;              /**< negative: not given */
    double min_current_A;         /**< negative: the station's own */
    double price_weight;          /**< 0..1; negative: the station's own */
    double lambda;                /**< of the log utility [1/kWh2]; negative: the station's own */
    unsigned outer_iterations;    /**< of the log utility; 0: the station's own */
    unsigned horizon_steps;       /**< 0: the station's own */
    bool replan_given, on_events; /**< the paper's rule of planning anew */
    uint32_t tick_s;
    uint16_t iterations; /**< of the solver in a tick; 0: as the tick has room */
    uint64_t seed;
    bool learns;                 /**< tapers are learned, whatever the policy and the station say */
    bool unannounced;            /**< the course of the limit is not told ahead */
    sim_errors_t errors;         /**< but for its seed */
    bool errs;                   /**< some of them were asked for */
    sim_replay_options_t replay; /**< its file is NULL: no replay, a run */
    const char *run_option;      /**< an option given that only a run knows, or NULL */
    const char *replay_option;   /**< an option given that only a replay knows, or NULL */
} sim_options_t;

/** Read the command line. Prints and ends the program on --help (0) and on what it does not understand (2). */
sim_options_t sim_options_parse(int argc, char **argv);

/** The least of the connectors' maximum currents [A]. */
double sim_least_maximum_A(const taper_station_config_t *station);

#endif
