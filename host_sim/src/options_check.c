#define _GNU_SOURCE // open_memstream

#include "options_check.h"

#include <stdio.h>

#include "arguments.h"
#include "taper/stations.h"

char *sim_policy_names(bool with_help) {
    char *names = NULL;
    size_t size = 0;
    FILE *stream = open_memstream(&names, &size);
    for (unsigned i = 0; stream != NULL && i < sim_policy_count; i++) {
        fprintf(stream, "%s%s", i == 0 ? "" : with_help ? "; " : ", ", sim_policies[i].name);
        if (with_help) {
            fprintf(stream, " (%s)", sim_policies[i].help);
        }
    }
    return stream != NULL && fclose(stream) == 0 ? names : NULL;
}

double sim_least_maximum_A(const taper_station_config_t *station) {
    int32_t least_mA = INT32_MAX;
    for (unsigned i = 0; i < station->connector_count; i++) {
        least_mA = taper_min_i32(least_mA, station->connectors[i].max_mA);
    }
    return least_mA / 1000.0;
}

/** What a board cannot do. */
static void check_bus(const sim_options_t *chosen, struct argp_state *state) {
    const taper_station_config_t *station = taper_stations[chosen->station];
    if (chosen->problems_file != NULL) {
        argp_error(state, "--problems and --bus exclude each other: the problems stay on the board");
    }
    if (chosen->policy->on_board < 0) {
        argp_error(state, "--policy %s: a board (--bus) does not have it", chosen->policy->name);
    }
    if (chosen->lambda >= 0.0 || chosen->outer_iterations > 0 || chosen->horizon_steps > 0 ||
        chosen->replan_given) {
        argp_error(state, "--bus: how a board plans is in its own description of the station");
    }
    if (chosen->learns || chosen->tapers_file != NULL) {
        argp_error(state,
                   "--learn-taper and --tapers: whether a board (--bus) learns is in its own description");
    }
    if (taper_setup_buses(station) > 1) {
        argp_error(state, "--bus: station %s has %u CAN buses, and SLCAN carries one", station->name,
                   taper_setup_buses(station));
    }
}

/** What can only be checked when all options are known. */
static void check_run(const sim_options_t *chosen, struct argp_state *state) {
    if (chosen->replay_option != NULL) {
        argp_error(state, "--%s needs --replay-log", chosen->replay_option);
    }
    if (chosen->sessions_file == NULL) {
        argp_error(state, "--sessions is needed");
    }
    if (chosen->policy == NULL) {
        argp_error(state, "--policy is needed: one of %s", sim_policy_names(false));
        return;
    }
    if (chosen->limit_file != NULL && chosen->limit_kw >= 0.0) {
        argp_error(state, "--limit-kw and --limit-csv exclude each other");
    }
    if (chosen->station == taper_station_count) {
        argp_error(state, "--station is needed: one of %s", taper_argument_station_names());
    }
    const double most_A = sim_least_maximum_A(taper_stations[chosen->station]);
    if (chosen->min_current_A > most_A) {
        argp_error(state, "--min-current-a: above %g A, the most that a connector of this station gives",
                   most_A);
    }
    if (chosen->unannounced && chosen->limit_file == NULL) {
        argp_error(state, "--limit-unannounced needs --limit-csv");
    }
    if (chosen->errors.soc_absent && chosen->errors.soc > 0.0) {
        argp_error(state, "--soc absent and --soc-error exclude each other");
    }
    if (chosen->horizon_steps > taper_stations[chosen->station]->steps) {
        argp_error(state, "--horizon-steps: station %s has %u", taper_stations[chosen->station]->name,
                   (unsigned)taper_stations[chosen->station]->steps);
    }
    if (chosen->bus != NULL) {
        check_bus(chosen, state);
    } else if (chosen->bus_timeout_s > 0) {
        argp_error(state, "--bus-timeout-s needs --bus");
    }
}

void sim_options_check(sim_options_t *chosen, struct argp_state *state) {
    if (chosen->replay.file == NULL) {
        check_run(chosen, state);
        return;
    }
    chosen->replay.setup.station = chosen->station;
    chosen->replay.setup.limit_kw = chosen->limit_kw;
    chosen->replay.setup.iterations = chosen->iterations;
    if (chosen->run_option != NULL) {
        argp_error(state, "--%s and --replay-log exclude each other", chosen->run_option);
    }
}
