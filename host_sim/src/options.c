#define _GNU_SOURCE // asprintf

#include "options.h"

#include <argp.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "taper/stations.h"

#define LONGEST_TICK_S 3600

static const char description[] =
    "Replay charging sessions through the Taper firmware and a simulated fleet, in virtual time."
    "\v"
    "SESSIONS CSV: a header, then one row per session, columns in any order: session_id, connector (1.., "
    "empty: the first free one), arrival_s, departure_s [s], battery_kwh [kWh], soc_arrival, soc_target "
    "[0..1], max_kw, taper_kw [kW], and optionally expected_departure_s [s], which is what the driver tells. "
    "A vehicle takes at most max_kw - taper_kw * SOC.\n"
    "\n"
    "LIMIT CSV: time_s [s], ascending, and limit_kw [kW]; each limit holds until the next one, the first one "
    "before its time too. The station's own limit holds besides.\n"
    "\n"
    "OUTPUT in DIR: summary.json, sessions.csv, steps.csv, connectors.csv. Equal runs give equal bytes, "
    "except for solve_ms in summary.json, which is wall time. A session that is plugged in at the first tick "
    "after its arrival has queued for 0 s.\n"
    "\n"
    "EXIT CODE: 0 good, 1 bad input, 2 bad command line, 3 a limit was exceeded.\n";

enum {
    KEY_SESSIONS = 256,
    KEY_POLICY,
    KEY_STATION,
    KEY_LIMIT,
    KEY_LIMIT_CSV,
    KEY_TICK,
    KEY_MINIMUM,
    KEY_SEED,
    KEY_OUT,
    KEY_PROBLEMS,
};

static const struct argp_option options[] = {
    {"sessions", KEY_SESSIONS, "FILE", 0, "Charging sessions to replay (CSV, see below)", 0},
    {"policy", KEY_POLICY, "NAME", 0, "Who gets how much", 0},
    {"station", KEY_STATION, "NAME", 0, "Station to simulate (default: garage)", 0},
    {"limit-kw", KEY_LIMIT, "X", 0, "Site limit [kW] (default: the station's own)", 0},
    {"limit-csv", KEY_LIMIT_CSV, "FILE", 0, "Site limit over time, known in advance (CSV, see below)", 0},
    {"tick-s", KEY_TICK, "N", 0, "Control tick [s], 1..3600 (default: 60)", 0},
    {"min-current-a", KEY_MINIMUM, "X", 0,
     "Least current per phase [A] of every connector; 0: any (default: the station's own)", 0},
    {"seed", KEY_SEED, "N", 0, "Decides in which order nodes send; no result depends on it (default: 0)", 0},
    {"problems", KEY_PROBLEMS, "FILE", 0,
     "Write every planning problem to this file (input of planner_probe)", 0},
    {"out", KEY_OUT, "DIR", 0,
     "Write the results to this directory, made if missing (default: only print a summary)", 0},
    {0},
};

static char *policy_names(bool with_help) {
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

/** Add the names that this program knows to the help. */
static char *add_names(int key, const char *text, void *input) {
    (void)input;
    char *names = key == KEY_POLICY ? policy_names(true) : key == KEY_STATION ? sim_station_names() : NULL;
    char *longer = NULL;
    if (names != NULL && asprintf(&longer, "%s: %s", text, names) < 0) {
        longer = NULL;
    }
    free(names);
    return longer != NULL ? longer : (char *)text;
}

static void set_policy(sim_options_t *chosen, const char *name, struct argp_state *state) {
    chosen->policy = sim_policy_find(name);
    if (chosen->policy == NULL) {
        argp_error(state, "--policy: unknown policy '%s'; there are %s", name, policy_names(false));
    }
}

/** What can only be checked when all options are known. */
static void check(const sim_options_t *chosen, struct argp_state *state) {
    if (chosen->sessions_file == NULL) {
        argp_error(state, "--sessions is needed");
    }
    if (chosen->policy == NULL) {
        argp_error(state, "--policy is needed: one of %s", policy_names(false));
        return;
    }
    if (chosen->limit_file != NULL && chosen->limit_kw >= 0.0) {
        argp_error(state, "--limit-kw and --limit-csv exclude each other");
    }
    if (chosen->station == taper_station_count) {
        argp_error(state, "--station is needed: one of %s", sim_station_names());
    }
    const double most_A = sim_least_maximum_A(taper_stations[chosen->station]);
    if (chosen->min_current_A > most_A) {
        argp_error(state, "--min-current-a: above %g A, the most that a connector of this station gives",
                   most_A);
    }
}

static error_t parse(int key, char *text, struct argp_state *state) {
    sim_options_t *chosen = state->input;
    switch (key) {
    case KEY_SESSIONS: chosen->sessions_file = text; break;
    case KEY_POLICY: set_policy(chosen, text, state); break;
    case KEY_STATION: chosen->station = sim_argument_station(text, state); break;
    case KEY_LIMIT: chosen->limit_kw = sim_argument_number("--limit-kw", text, state); break;
    case KEY_LIMIT_CSV: chosen->limit_file = text; break;
    case KEY_TICK:
        chosen->tick_s = (uint32_t)sim_argument_whole("--tick-s", text, 1, LONGEST_TICK_S, state);
        break;
    case KEY_MINIMUM: chosen->min_current_A = sim_argument_number("--min-current-a", text, state); break;
    case KEY_SEED: chosen->seed = sim_argument_whole("--seed", text, 0, UINT64_MAX, state); break;
    case KEY_OUT: chosen->out = text; break;
    case KEY_PROBLEMS: chosen->problems_file = text; break;
    case ARGP_KEY_ARG: argp_error(state, "unexpected argument '%s'", text); break;
    case ARGP_KEY_END: check(chosen, state); break;
    default: return ARGP_ERR_UNKNOWN;
    }
    return 0;
}

double sim_least_maximum_A(const taper_station_config_t *station) {
    int32_t least_mA = INT32_MAX;
    for (unsigned i = 0; i < station->connector_count; i++) {
        least_mA = taper_min_i32(least_mA, station->connectors[i].max_mA);
    }
    return least_mA / 1000.0;
}

sim_options_t sim_options_parse(int argc, char **argv) {
    static const struct argp parser = {
        .options = options, .parser = parse, .doc = description, .help_filter = add_names};
    sim_options_t chosen = {
        .station = sim_station_find("garage"), .limit_kw = -1.0, .min_current_A = -1.0, .tick_s = 60};
    argp_err_exit_status = SIM_EXIT_USAGE;
    // Every error of ours ends the program inside; what is left is memory that argp could not get.
    if (argp_parse(&parser, argc, argv, 0, NULL, &chosen) != 0) {
        exit(SIM_EXIT_USAGE);
    }
    return chosen;
}
