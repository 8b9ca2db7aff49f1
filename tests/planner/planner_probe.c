/*
 * The firmware's planner as a filter, to compare it with other solvers on the same problems. `taper-sim --problems FILE`
 * writes what it reads:
 *
 *     station NAME                starts cold
 *     planning OBJECTIVE LAMBDA_milli_per_kWh2 OUTER_ITERATIONS HORIZON_STEPS
 *                                 as in taper_planning_t, starts cold; as described if not given
 *     time MS                     of the snapshot; 0 if not given
 *     limit W0 .. W(T-1)
 *     phases mA mA mA             what other load leaves on each; as described if not given
 *     demand CONNECTOR SESSION stored_Wh capacity_Wh need_Wh peak_W taper_W max_mA W_per_A departs_in_s [PHASES]
 *     second CONNECTOR peak_W taper_W
 *                                 of the demand before: another line of its taper; none if not given
 *     solve
 *
 * `solve` prints "VERDICT ITERATIONS MICROSECONDS" and then T planned powers (per unit) a line for every connector. With
 * --numbers, the lines are instead those of the problem itself: linear cost, lower and upper bounds, and the taper
 * factors. PHASES has a bit for each phase of the supply that the vehicle draws from; without it, the description says.
 * Limits and demands are then forgotten, the warm start is not.
 */
#define _POSIX_C_SOURCE 199309L

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "taper/planner.h"
#include "taper/solvers.h"
#include "taper/stations.h"

static taper_planner_t planner;
static taper_snapshot_t snapshot;
static taper_course_t course;
static taper_station_config_t chosen;
static const taper_station_config_t *const config = &chosen;
static const taper_solver_t *solver;

static void fail(const char *line) {
    fprintf(stderr, "planner_probe: cannot use: %s", line);
    exit(1);
}

static void start_cold(const char *line) {
    if (solver == NULL || taper_planner_init(&planner, solver, config) != TAPER_OK) {
        fail(line);
    }
}

static void select_planning(const char *line) {
    taper_planning_t *planning = &chosen.planning;
    unsigned objective = 0, outer = 0, horizon = 0;
    if (sscanf(line, "planning %u %d %u %u", &objective, &planning->lambda_milli_per_kWh2, &outer,
               &horizon) != 4) {
        fail(line);
    }
    planning->objective = (uint8_t)objective;
    planning->outer_iterations = (uint8_t)outer;
    planning->horizon_steps = (uint8_t)horizon;
    start_cold(line);
}

static void select_station(const char *line) {
    char name[64];
    if (sscanf(line, "station %63s", name) != 1) {
        fail(line);
    }
    for (unsigned k = 0; k < taper_station_count; k++) {
        if (strcmp(taper_stations[k]->name, name) == 0) {
            chosen = *taper_stations[k];
            solver = taper_solvers[k];
            start_cold(line);
            return;
        }
    }
    fail(line);
}

static void read_limits(char *line) {
    char *at = line + strlen("limit");
    for (uint8_t t = 0; t < config->steps; t++) {
        course.limit_W[t] = (int32_t)strtol(at, &at, 10);
    }
}

static void forget_phases(void) {
    for (unsigned k = 0; k < 3; k++) {
        course.phase_mA[k] = TAPER_NO_LIMIT;
    }
}

static void read_phases(const char *line) {
    if (sscanf(line, "phases %d %d %d", &course.phase_mA[0], &course.phase_mA[1], &course.phase_mA[2]) != 3) {
        fail(line);
    }
}

static void read_demand(const char *line) {
    int i = 0;
    unsigned session = 0, phases = 0;
    taper_demand_t d = {.active = true};
    if (sscanf(line, "demand %d %u %d %d %d %d %d %d %d %d %u", &i, &session, &d.stored_Wh, &d.capacity_Wh,
               &d.need_Wh, &d.peak_W, &d.taper_W, &d.max_mA, &d.W_per_A, &d.departs_in_s, &phases) < 10 ||
        i < 0 || i >= config->connector_count) {
        fail(line);
    }
    d.session = (uint8_t)session;
    if (phases != 0) {
        d.booking = (taper_booking_t){.W_per_A = d.W_per_A, .permille = 1000, .phases = (uint8_t)phases};
    }
    snapshot.demand[i] = d;
}

static void read_second(const char *line) {
    int i = 0, peak_W = 0, taper_W = 0;
    if (sscanf(line, "second %d %d %d", &i, &peak_W, &taper_W) != 3 || i < 0 ||
        i >= config->connector_count) {
        fail(line);
    }
    snapshot.demand[i].second_peak_W = peak_W;
    snapshot.demand[i].second_taper_W = taper_W;
}

static double now_us(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec * 1e6 + (double)now.tv_nsec / 1e3;
}

static void print_plan(void) {
    for (uint8_t i = 0; i < config->connector_count; i++) {
        for (uint8_t t = 0; t < config->steps; t++) {
            printf("%.9g ", (double)taper_planner_power(&planner, i, t));
        }
        printf("\n");
    }
}

static void print_reals(const taper_real_t *values, unsigned count) {
    for (unsigned k = 0; k < count; k++) {
        printf("%.17g ", (double)values[k]);
    }
    printf("\n");
}

static void print_numbers(void) {
    const unsigned variables = (unsigned)config->connector_count * config->steps;
    const unsigned sums = (unsigned)planner.horizon.sum_count * config->steps;
    const unsigned rows = (unsigned)taper_first_sum_row(config) + sums;
    print_reals(planner.horizon.linear, variables);
    print_reals(planner.horizon.lower, rows);
    print_reals(planner.horizon.upper, rows);
    for (uint8_t line = 0; line < taper_lines_planned(config); line++) {
        print_reals(planner.horizon.taper_keep[line], config->connector_count);
    }
}

static void solve(bool numbers) {
    snapshot.count = config->connector_count;
    const double began_us = now_us();
    taper_planner_start(&planner, &snapshot, &course);
    while (taper_planner_run(&planner, TAPER_MAX_ITERATIONS) == TAPER_VERDICT_SOLVING) {
    }
    const double took_us = now_us() - began_us;
    printf("%d %u %.1f\n", (int)planner.verdict, (unsigned)taper_planner_iterations(&planner), took_us);
    if (numbers) {
        print_numbers();
    } else {
        print_plan();
    }
    memset(&snapshot, 0, sizeof snapshot);
    forget_phases();
}

int main(int argc, char **argv) {
    static char line[4096];
    const bool numbers = argc == 2 && strcmp(argv[1], "--numbers") == 0;
    forget_phases();
    while (fgets(line, sizeof line, stdin) != NULL) {
        if (strncmp(line, "station", 7) == 0) {
            select_station(line);
        } else if (solver == NULL) {
            fail(line);
        } else if (strncmp(line, "planning", 8) == 0) {
            select_planning(line);
        } else if (strncmp(line, "time", 4) == 0) {
            snapshot.now_ms = (uint32_t)strtoul(line + 4, NULL, 10);
        } else if (strncmp(line, "limit", 5) == 0) {
            read_limits(line);
        } else if (strncmp(line, "phases", 6) == 0) {
            read_phases(line);
        } else if (strncmp(line, "demand", 6) == 0) {
            read_demand(line);
        } else if (strncmp(line, "second", 6) == 0) {
            read_second(line);
        } else if (strncmp(line, "solve", 5) == 0) {
            solve(numbers);
        } else {
            fail(line);
        }
    }
    return 0;
}
