#define _GNU_SOURCE // open_memstream

#include "options.h"

#include <argp.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "arguments.h"
#include "taper/stations.h"

#define LONGEST_TICK_S 3600
/** The firmware takes no greater one. */
#define MOST_LAMBDA     10000
#define DEFAULT_STATION "garage"
/** Greatest errors of SOC and of the meter. */
#define MOST_SOC_ERROR 0.1
#define MOST_NOISE     0.1
/** A whole solve of the largest station takes an emulator on a busy machine some seconds. */
#define BUS_TIMEOUT_S     60
#define LONGEST_TIMEOUT_S 3600
static const char bus_prefix[] = "slcan:";

static const char description[] =
    "Replay charging sessions through the Taper firmware and a simulated fleet, in virtual time; or replay "
    "the "
    "recorded bus of a real station through it (--replay-log)."
    "\v"
    "SESSIONS CSV: a header, then one row per session, columns in any order: session_id, connector (1.., "
    "empty: the first free one), arrival_s, departure_s [s], battery_kwh [kWh], soc_arrival, soc_target "
    "[0..1], max_kw, taper_kw [kW], and optionally expected_departure_s [s], which is what the driver tells, "
    "and phases (1 or 3, empty: all of the connector's) that the charger uses. "
    "A vehicle takes at most max_kw - taper_kw * SOC and tells that; second_max_kw and second_taper_kw are a "
    "second such line, and the lower one counts. With the optional column curve it obeys that instead: "
    "points "
    "SOC:KW by ascending SOC, separated by blanks, such as '0:95 0.18:90 0.8:50 1:8', linear in between; it "
    "then tells the lines, and as its flat limit the greatest power of the curve.\n"
    "\n"
    "LIMIT CSV: time_s [s], ascending, and limit_kw [kW]; each limit holds until the next one, the first one "
    "before its time too. The station's own limit holds besides.\n"
    "\n"
    "PRICE CSV: time_s [s], ascending, and price_per_kwh in any currency, -32.767..32.767; each price holds "
    "until "
    "the next one, the first one before its time too.\n"
    "\n"
    "TAPERS CSV: session_id, share of the charge, learned (by samples or the fleet) and sure (to 2.5 %) 0 or "
    "1, limit by the station and the vehicle's own "
    "[kW], at that energy and at the end of the charge, and error: the greater difference of the two, as a "
    "share of max_kw.\n"
    "\n"
    "OUTPUT in DIR: summary.json, sessions.csv, steps.csv, connectors.csv. Equal runs give equal bytes, "
    "except for solve_ms in summary.json, which is wall time. A session that is plugged in at the first tick "
    "after its arrival has queued for 0 s.\n"
    "\n"
    "BOARD: with --bus the station is not part of this program, but runs on a board, or an emulated one, "
    "that obeys "
    "taper/drive.h. It gets frames and time from here; the same run without --bus, in a build with the "
    "board's "
    "floating-point type, gives the same bytes in all files of DIR and in that of --frames. Only "
    "summary.json "
    "differs: solve_ms is null there, and board tells what was measured. The board decides about the "
    "policies "
    "that it has: not equal-share. It has one bus, and no --problems.\n"
    "\n"
    "RECORDED BUS: --replay-log FILE feeds what taper-station --record FILE wrote to a fresh station, and "
    "compares all that it sends with the recording, bit by bit. FILE.station, which was written with it, "
    "tells how the station ran: no other option is needed, and one that is given goes before it. A log of "
    "candump -l does too, if it begins before the station. It has no FILE.station: --station is needed, and "
    "its times tell those of the station's calls to about a millisecond; a frame that came within that of a "
    "call can make a difference that was none. Who sent a frame is told by its identifier. Both need the "
    "station's life from its start, without a store, bus-off or a second controller.\n"
    "\n"
    "EXIT CODE: 0 good, 1 bad input, 2 bad command line, 3 a limit was exceeded, 4 a replay differs from its "
    "recording.\n";

enum {
    KEY_SESSIONS = 256,
    KEY_POLICY,
    KEY_STATION,
    KEY_LIMIT,
    KEY_LIMIT_CSV,
    KEY_PRICE_CSV,
    KEY_PRICE_WEIGHT,
    KEY_LAMBDA,
    KEY_OUTER_ITERATIONS,
    KEY_HORIZON,
    KEY_REPLAN,
    KEY_TICK,
    KEY_MINIMUM,
    KEY_SEED,
    KEY_OUT,
    KEY_PROBLEMS,
    KEY_FRAMES,
    KEY_LEARN,
    KEY_SOC,
    KEY_SOC_ERROR,
    KEY_TAPER_ERROR,
    KEY_METER_NOISE,
    KEY_UNANNOUNCED,
    KEY_TAPERS,
    KEY_BUS,
    KEY_BUS_TIMEOUT,
    KEY_ITERATIONS,
    KEY_REPLAY_LOG, // the first that only a replay knows
    KEY_CAN,
    KEY_FAILSAFE,
    KEY_TICK_MS,
    KEY_TIME_SCALE,
    KEY_NO_PLANNER, // the last of them
};

static const struct argp_option options[] = {
    {"sessions", KEY_SESSIONS, "FILE", 0, "Charging sessions to replay (CSV, see below)", 0},
    {"policy", KEY_POLICY, "NAME", 0, "Who gets how much", 0},
    {"station", KEY_STATION, "NAME", 0, "Station to simulate (default: garage)", 0},
    {"limit-kw", KEY_LIMIT, "X", 0, "Site limit [kW] (default: the station's own)", 0},
    {"limit-csv", KEY_LIMIT_CSV, "FILE", 0, "Site limit over time, known in advance (CSV, see below)", 0},
    {"price-csv", KEY_PRICE_CSV, "FILE", 0, "Price of energy over time, known in advance (CSV, see below)",
     0},
    {"price-weight", KEY_PRICE_WEIGHT, "W", 0,
     "Weight of the price against having energy early, 0..1 (default: the station's own)", 0},
    {"lambda", KEY_LAMBDA, "X", 0,
     "Policies by log utility: weight of the squared energy missing at departure [1/kWh2] (default: the "
     "station's own, or 100)",
     0},
    {"outer-iterations", KEY_OUTER_ITERATIONS, "N", 0,
     "The same: quadratic programmes per plan, at most, 1..20 (default: the station's own, or 8)", 0},
    {"horizon-steps", KEY_HORIZON, "N", 0,
     "Steps that are planned, 2.. those of the station (default: the station's own, or all)", 0},
    {"replan", KEY_REPLAN, "WHEN", 0,
     "steps: plan once a step and at every event; events: only when a vehicle comes, leaves or reaches its "
     "target, or a limit changes, as in the paper (default: the station's own, or steps)",
     0},
    {"tick-s", KEY_TICK, "N", 0, "Control tick [s], 1..3600 (default: 60)", 0},
    {"iterations", KEY_ITERATIONS, "N", 0,
     "Solver iterations in a tick, 1..500; fewer than 10 bound its work, 500 are a whole solve (default: 500 "
     "in ticks of 10 s or "
     "more, else 50); in a replay, as "
     "taper-station was told",
     0},
    {"min-current-a", KEY_MINIMUM, "X", 0,
     "Least current per phase [A] of every connector; 0: any (default: the station's own)", 0},
    {"seed", KEY_SEED, "N", 0,
     "Decides in which order nodes send; no result depends on it (default: 0), but for errors of SOC, taper "
     "and meter",
     0},
    {"learn-taper", KEY_LEARN, NULL, 0,
     "The station learns tapers from what vehicles accept; what they tell is a first guess", 0},
    {"tapers", KEY_TAPERS, "FILE", 0,
     "Write what it has learned after 10, 25 and 50 % of each charge to this file (CSV, see below)", 0},
    {"soc", KEY_SOC, "HOW", 0, "absent: vehicles tell no SOC; exact (default)", 0},
    {"soc-error", KEY_SOC_ERROR, "P", 0,
     "Each vehicle's SOC is off by a constant, uniform within P, 0..0.1; the energy that it wants is right",
     0},
    {"taper-error", KEY_TAPER_ERROR, "P", 0,
     "Each vehicle's taper_kw is told wrong by a factor, uniform within 1-P..1+P, P 0..1", 0},
    {"meter-noise", KEY_METER_NOISE, "P", 0,
     "Each report of current or power is wrong by a factor, normal with standard deviation P, 0..0.1", 0},
    {"limit-unannounced", KEY_UNANNOUNCED, NULL, 0,
     "The course of --limit-csv is not told ahead: the station learns of each change when it comes", 0},
    {"problems", KEY_PROBLEMS, "FILE", 0,
     "Write every planning problem to this file (input of planner_probe)", 0},
    {"frames", KEY_FRAMES, "FILE", 0, "Write every frame that the station sends to this file (candump -l)",
     0},
    {"bus", KEY_BUS, "slcan:HOST:PORT", 0,
     "Drive the station on a board, which is attached there by SLCAN over TCP (see below)", 0},
    {"bus-timeout-s", KEY_BUS_TIMEOUT, "N", 0,
     "Give a board up that says nothing for so long [s] (default: 60)", 0},
    {"out", KEY_OUT, "DIR", 0,
     "Write the results to this directory, made if missing (default: only print a summary)", 0},
    {NULL, 0, NULL, 0,
     "Replay of a recorded bus. If FILE.station does not tell them, with --station, --limit-kw, --iterations "
     "and:",
     1},
    {"replay-log", KEY_REPLAY_LOG, "FILE", 0, "Recording of taper-station or of candump -l (see below)", 1},
    {"can", KEY_CAN, "IFACE", 0,
     "Interface in the recording; once for each bus, bus 0 first (default: as recorded, or in order of "
     "appearance)",
     1},
    {"failsafe-kw", KEY_FAILSAFE, "X", 0, "As taper-station was told", 1},
    {"tick-ms", KEY_TICK_MS, "N", 0, "As taper-station was told", 1},
    {"time-scale", KEY_TIME_SCALE, "S", 0, "As taper-station was told", 1},
    {"no-planner", KEY_NO_PLANNER, NULL, 0, "As taper-station was told", 1},
    {0},
};

/** The names, separated by commas; for help and errors. To be freed. */
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
    char *names = key == KEY_POLICY    ? policy_names(true)
                  : key == KEY_STATION ? taper_argument_station_names()
                                       : NULL;
    return taper_argument_with_names(text, names);
}

static void set_policy(sim_options_t *chosen, const char *name, struct argp_state *state) {
    chosen->policy = sim_policy_find(name);
    if (chosen->policy == NULL) {
        argp_error(state, "--policy: unknown policy '%s'; there are %s", name, policy_names(false));
    }
}

static void set_price_weight(sim_options_t *chosen, const char *text, struct argp_state *state) {
    chosen->price_weight = taper_argument_not_negative("--price-weight", text, state);
    if (chosen->price_weight > 1.0) {
        argp_error(state, "--price-weight: above 1: '%s'", text);
    }
}

static void set_replan(sim_options_t *chosen, const char *text, struct argp_state *state) {
    chosen->replan_given = true;
    chosen->on_events = strcmp(text, "events") == 0;
    if (!chosen->on_events && strcmp(text, "steps") != 0) {
        argp_error(state, "--replan: neither steps nor events: '%s'", text);
    }
}

static void set_soc(sim_options_t *chosen, const char *text, struct argp_state *state) {
    chosen->errors.soc_absent = strcmp(text, "absent") == 0;
    if (!chosen->errors.soc_absent && strcmp(text, "exact") != 0) {
        argp_error(state, "--soc: neither absent nor exact: '%s'", text);
    }
}

static double share(const char *option, const char *text, double most, struct argp_state *state) {
    const double value = taper_argument_not_negative(option, text, state);
    if (value > most) {
        argp_error(state, "%s: above %g: '%s'", option, most, text);
    }
    return value;
}

/** The name of an option. */
static const char *name_of(int key) {
    const struct argp_option *option = options;
    while (option->name == NULL || option->key != key) {
        option++;
    }
    return option->name;
}

/** Both kinds of run know these. */
static bool is_of_both(int key) {
    return key == KEY_STATION || key == KEY_LIMIT || key == KEY_ITERATIONS;
}

static bool is_of_replay(int key) {
    return key >= KEY_REPLAY_LOG && key <= KEY_NO_PLANNER && !is_of_both(key);
}

/** Remember one option of either kind, to refuse what makes no sense together. */
static void note_option(sim_options_t *chosen, int key) {
    if (is_of_replay(key)) {
        chosen->replay_option = key == KEY_REPLAY_LOG ? chosen->replay_option : name_of(key);
    } else if (key >= KEY_SESSIONS && key < KEY_REPLAY_LOG && !is_of_both(key)) {
        chosen->run_option = name_of(key);
    }
    chosen->replay.station_given = chosen->replay.station_given || key == KEY_STATION;
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
        argp_error(state, "--policy is needed: one of %s", policy_names(false));
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

static void check(sim_options_t *chosen, struct argp_state *state) {
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

static void set_bus(sim_options_t *chosen, const char *text, struct argp_state *state) {
    const size_t prefix = sizeof bus_prefix - 1;
    const char *colon = strrchr(text, ':');
    if (strncmp(text, bus_prefix, prefix) != 0 || colon <= text + prefix || colon[1] == '\0') {
        argp_error(state, "--bus: must be slcan:HOST:PORT: '%s'", text);
        return;
    }
    chosen->bus = text + prefix;
}

static void add_interface(sim_replay_options_t *replay, const char *name, struct argp_state *state) {
    if (replay->name_count == sizeof replay->names / sizeof replay->names[0]) {
        argp_error(state, "--can: more than %u buses", replay->name_count);
        return;
    }
    replay->names[replay->name_count++] = name;
}

static uint16_t whole(const char *option, const char *text, uint16_t low, uint16_t high,
                      struct argp_state *state) {
    return (uint16_t)taper_argument_whole(option, text, low, high, state);
}

/** The options of --replay-log. @return whether `key` is one. */
static bool parse_replay(int key, const char *text, sim_replay_options_t *replay, struct argp_state *state) {
    taper_setup_t *setup = &replay->setup;
    switch (key) {
    case KEY_REPLAY_LOG: replay->file = text; break;
    case KEY_CAN: add_interface(replay, text, state); break;
    case KEY_FAILSAFE: setup->failsafe_kw = taper_argument_not_negative("--failsafe-kw", text, state); break;
    case KEY_TICK_MS:
        setup->tick_ms = whole("--tick-ms", text, TAPER_SETUP_TICK_MIN_ms, TAPER_SETUP_TICK_MAX_ms, state);
        break;
    case KEY_TIME_SCALE:
        setup->time_scale = whole("--time-scale", text, 1, TAPER_MAX_TIME_SCALE, state);
        break;
    case KEY_NO_PLANNER: setup->no_planner = true; break;
    default: return false;
    }
    return true;
}

/** The options of how the planner plans. @return whether `key` is one. */
static bool parse_planning(int key, const char *text, sim_options_t *chosen, struct argp_state *state) {
    switch (key) {
    case KEY_PRICE_WEIGHT: set_price_weight(chosen, text, state); break;
    case KEY_LAMBDA:
        chosen->lambda = taper_argument_not_negative("--lambda", text, state);
        if (chosen->lambda > MOST_LAMBDA) {
            argp_error(state, "--lambda: above %d: '%s'", MOST_LAMBDA, text);
        }
        break;
    case KEY_OUTER_ITERATIONS:
        chosen->outer_iterations = whole("--outer-iterations", text, 1, TAPER_MAX_OUTER_ITERATIONS, state);
        break;
    case KEY_HORIZON:
        chosen->horizon_steps = whole("--horizon-steps", text, 2, TAPER_MAX_STEPS, state);
        break;
    case KEY_REPLAN: set_replan(chosen, text, state); break;
    default: return false;
    }
    return true;
}

/** The options of what the station does not know. @return whether `key` is one. */
static bool parse_errors(int key, const char *text, sim_options_t *chosen, struct argp_state *state) {
    sim_errors_t *errors = &chosen->errors;
    switch (key) {
    case KEY_LEARN: chosen->learns = true; return true;
    case KEY_TAPERS: chosen->tapers_file = text; return true;
    case KEY_UNANNOUNCED: chosen->unannounced = true; break;
    case KEY_SOC: set_soc(chosen, text, state); break;
    case KEY_SOC_ERROR: errors->soc = share("--soc-error", text, MOST_SOC_ERROR, state); break;
    case KEY_TAPER_ERROR: errors->taper = share("--taper-error", text, 1.0, state); break;
    case KEY_METER_NOISE: errors->meter_noise = share("--meter-noise", text, MOST_NOISE, state); break;
    default: return false;
    }
    chosen->errs = true;
    return true;
}

/** The options of --bus, of what goes beside the results, and --iterations. @return whether `key` is one. */
static bool parse_bus(int key, const char *text, sim_options_t *chosen, struct argp_state *state) {
    switch (key) {
    case KEY_PROBLEMS: chosen->problems_file = text; break;
    case KEY_FRAMES: chosen->frames_file = text; break;
    case KEY_BUS: set_bus(chosen, text, state); break;
    case KEY_BUS_TIMEOUT:
        chosen->bus_timeout_s = whole("--bus-timeout-s", text, 1, LONGEST_TIMEOUT_S, state);
        break;
    case KEY_ITERATIONS:
        chosen->iterations = whole("--iterations", text, 1, TAPER_MAX_ITERATIONS, state);
        break;
    default: return false;
    }
    return true;
}

static error_t parse(int key, char *text, struct argp_state *state) {
    sim_options_t *chosen = state->input;
    note_option(chosen, key);
    switch (key) {
    case KEY_SESSIONS: chosen->sessions_file = text; break;
    case KEY_POLICY: set_policy(chosen, text, state); break;
    case KEY_STATION: chosen->station = taper_argument_station("--station", text, state); break;
    case KEY_LIMIT: chosen->limit_kw = taper_argument_not_negative("--limit-kw", text, state); break;
    case KEY_LIMIT_CSV: chosen->limit_file = text; break;
    case KEY_PRICE_CSV: chosen->price_file = text; break;
    case KEY_TICK:
        chosen->tick_s = (uint32_t)taper_argument_whole("--tick-s", text, 1, LONGEST_TICK_S, state);
        break;
    case KEY_MINIMUM:
        chosen->min_current_A = taper_argument_not_negative("--min-current-a", text, state);
        break;
    case KEY_SEED: chosen->seed = taper_argument_whole("--seed", text, 0, UINT64_MAX, state); break;
    case KEY_OUT: chosen->out = text; break;
    case ARGP_KEY_ARG: argp_error(state, "unexpected argument '%s'", text); break;
    case ARGP_KEY_END: check(chosen, state); break;
    default:
        return parse_bus(key, text, chosen, state) || parse_planning(key, text, chosen, state) ||
                       parse_errors(key, text, chosen, state) ||
                       parse_replay(key, text, &chosen->replay, state)
                   ? 0
                   : ARGP_ERR_UNKNOWN;
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
    sim_options_t chosen = {.limit_kw = -1.0,
                            .min_current_A = -1.0,
                            .price_weight = -1.0,
                            .lambda = -1.0,
                            .tick_s = 60,
                            .replay.setup = taper_setup_default(0)};
    chosen.replay.setup.time_scale = 0; // not given
    while (chosen.station < taper_station_count &&
           strcmp(taper_stations[chosen.station]->name, DEFAULT_STATION) != 0) {
        chosen.station++;
    }
    argp_err_exit_status = SIM_EXIT_USAGE;
    // Every error of ours ends the program inside; what is left is memory that argp could not get.
    if (argp_parse(&parser, argc, argv, 0, NULL, &chosen) != 0) {
        exit(SIM_EXIT_USAGE);
    }
    if (chosen.bus_timeout_s == 0) {
        chosen.bus_timeout_s = BUS_TIMEOUT_S;
    }
    return chosen;
}
