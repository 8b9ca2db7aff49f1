/**
 * taper-sim: the firmware's sources, a fleet of simulated connectors and vehicles, and an in-memory CAN bus, in virtual
 * time. `taper-sim --help` is the manual.
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "limits_csv.h"
#include "memory.h"
#include "options.h"
#include "output.h"
#include "results.h"
#include "sessions.h"
#include "setup.h"
#include "station_board.h"
#include "station_local.h"
#include "taper/stations.h"
#include "world.h"

/** Of the log utility, where neither the station nor an option says it [1/1000 kWh2]. */
#define DEFAULT_LAMBDA_milli 100000

/** A station as the options want it, and what is borrowed by it. */
typedef struct {
    taper_station_config_t config;
    taper_connector_config_t *connectors;
} station_copy_t;

/** How the planner plans: as the station says, but for what the options and the policy say. */
static taper_planning_t planning_of(const sim_options_t *options, const taper_planning_t *own) {
    taper_planning_t planning = *own;
    planning.objective = (uint8_t)options->policy->objective;
    planning.ignores_draw = options->policy->ignores_draw;
    planning.learns_taper = planning.learns_taper || options->learns || options->policy->learns;
    if (options->horizon_steps > 0) {
        planning.horizon_steps = (uint8_t)options->horizon_steps;
    }
    if (options->outer_iterations > 0) {
        planning.outer_iterations = (uint8_t)options->outer_iterations;
    }
    if (options->replan_given) {
        planning.on_events = options->on_events;
    }
    if (options->lambda >= 0.0) {
        planning.lambda_milli_per_kWh2 = (int32_t)lround(options->lambda * 1000.0);
    } else if (planning.lambda_milli_per_kWh2 == 0) {
        planning.lambda_milli_per_kWh2 = DEFAULT_LAMBDA_milli;
    }
    return planning;
}

static station_copy_t copy_station(const sim_options_t *options) {
    const taper_station_config_t *original = taper_stations[options->station];
    station_copy_t copy = {.config = *original,
                           .connectors = sim_allocate(original->connector_count, sizeof *copy.connectors)};
    for (unsigned i = 0; i < original->connector_count; i++) {
        copy.connectors[i] = original->connectors[i];
        if (options->min_current_A >= 0.0) {
            copy.connectors[i].min_mA = (int32_t)lround(options->min_current_A * 1000.0);
        }
    }
    copy.config.connectors = copy.connectors;
    copy.config.planning = planning_of(options, &original->planning);
    copy.config.tick_ms = options->tick_s * 1000U;
    if (options->price_weight >= 0.0) {
        copy.config.price_weight_permille = (int32_t)lround(options->price_weight * 1000.0);
    }
    return copy;
}

/** Run and put the results out. @return the exit code of the program. */
static int run_case(const sim_options_t *options, const sim_case_t *run) {
    sim_results_t results;
    sim_results_init(&results, run->sessions, options->out != NULL);
    results.policy = run->policy->name;
    results.station = run->station->name;
    results.tick_s = options->tick_s;
    results.min_current_A = options->min_current_A;
    results.seed = run->seed;
    results.priced = run->prices != NULL;
    results.price_weight = options->price_weight;
    results.learns = run->station->planning.learns_taper;
    results.errors = options->errs ? run->errors : NULL;
    results.unannounced = run->unannounced;
    int code = SIM_EXIT_INPUT;
    if (sim_world_run(run, &results) && (options->out == NULL || sim_results_write(&results, options->out))) {
        sim_results_print(&results, stdout);
        code = results.violation_ticks > 0 ? SIM_EXIT_VIOLATION : SIM_EXIT_OK;
    }
    sim_results_free(&results);
    return code;
}

/** Files that are written in the course of a run. */
typedef struct {
    FILE *problems, *frames, *tapers; /**< NULL: not wanted */
} logs_t;

/** @return false, after one line on stderr, if a file of this name cannot be written. */
static bool open_log(FILE **file, const char *name) {
    if (name != NULL) {
        *file = fopen(name, "w");
        if (*file == NULL) {
            perror(name);
        }
    }
    return name == NULL || *file != NULL;
}

/** @return false, after one line on stderr, if not all of it was written. */
static bool close_log(FILE *file, const char *name) {
    if (file == NULL) {
        return true;
    }
    const bool failed = ferror(file) != 0;
    if (fclose(file) != 0 || failed) {
        perror(name);
        return false;
    }
    return true;
}

static bool close_logs(const sim_options_t *options, const logs_t *logs) {
    const bool problems = close_log(logs->problems, options->problems_file);
    const bool frames = close_log(logs->frames, options->frames_file);
    return close_log(logs->tapers, options->tapers_file) && problems && frames;
}

static void note_missing_planner(const sim_options_t *options) {
    if (options->bus == NULL && options->policy->propose == NULL &&
        taper_setup_solver(options->station) == NULL) {
        fprintf(stderr, "taper-sim: note: this build has no planner; %s charges by earliest deadline first\n",
                options->policy->name);
    }
}

/** `value` in thousandths; negative: not given. */
static int32_t given_milli(double value) {
    return value >= 0.0 ? (int32_t)lround(value * 1000.0) : TAPER_ABSENT;
}

/** The station: in this program, or on the board that the options name. */
static bool open_link(const sim_options_t *options, sim_link_t **link) {
    const sim_board_options_t board = {.address = options->bus,
                                       .timeout_s = options->bus_timeout_s,
                                       .min_mA = given_milli(options->min_current_A),
                                       .price_weight_permille = given_milli(options->price_weight)};
    *link = options->bus == NULL ? sim_station_local() : sim_station_board(&board);
    return *link != NULL;
}

/** With all options known: read the files and run. @return the exit code of the program. */
static int load_and_run(const sim_options_t *options, const taper_station_config_t *station) {
    sim_course_t limits = {0};
    sim_course_t prices = {0};
    sim_sessions_t sessions = {0};
    logs_t logs = {NULL, NULL, NULL};
    sim_errors_t errors = options->errors;
    errors.seed = options->seed;
    sim_link_t *link = NULL;
    int code = SIM_EXIT_INPUT;
    if (sim_sessions_load(&sessions, options->sessions_file, station->connector_count) &&
        sim_limits_choose(&limits, options->limit_file, options->limit_kw,
                          station->groups[0].limit_W / 1000.0) &&
        (options->price_file == NULL || sim_prices_load(&prices, options->price_file)) &&
        (options->out == NULL || sim_output_check(options->out)) &&
        open_log(&logs.problems, options->problems_file) && open_log(&logs.frames, options->frames_file) &&
        open_log(&logs.tapers, options->tapers_file) && open_link(options, &link)) {
        note_missing_planner(options);
        const sim_case_t run = {.station = station,
                                .solver = taper_setup_solver(options->station),
                                .policy = options->policy,
                                .iterations = options->iterations > 0
                                                  ? options->iterations
                                                  : taper_setup_iterations(station->tick_ms),
                                .sessions = &sessions,
                                .limits = &limits,
                                .prices = options->price_file == NULL ? NULL : &prices,
                                .seed = options->seed,
                                .errors = options->errs ? &errors : NULL,
                                .unannounced = options->unannounced,
                                .link = link,
                                .problems = logs.problems,
                                .frames = logs.frames,
                                .tapers = logs.tapers};
        code = run_case(options, &run);
        link->calls->close(link);
    }
    if (!close_logs(options, &logs)) {
        code = SIM_EXIT_INPUT;
    }
    sim_sessions_free(&sessions);
    sim_course_free(&limits);
    sim_course_free(&prices);
    return code;
}

int main(int argc, char **argv) {
    const sim_options_t options = sim_options_parse(argc, argv);
    if (options.replay.file != NULL) {
        const int result = sim_replay_run(&options.replay);
        return fflush(stdout) == 0 ? result : SIM_EXIT_INPUT;
    }
    station_copy_t station = copy_station(&options);
    const int code = load_and_run(&options, &station.config);
    free(station.connectors);
    return fflush(stdout) == 0 ? code : SIM_EXIT_INPUT;
}
