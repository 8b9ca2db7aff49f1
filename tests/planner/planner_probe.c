/*
 * The firmware's planner as a filter, for comparison with an independent solver (test_against_an_independent_solver.py).
 *
 *     station NAME
 *     limit W0 .. W(T-1)
 *     demand CONNECTOR stored_Wh capacity_Wh need_Wh peak_W taper_W max_mA W_per_A departs_in_s
 *     solve
 *
 * `solve` prints "VERDICT ITERATIONS" and then T planned powers (per unit) a line for every connector; limits and demands are
 * then forgotten, the warm start is not; `station` starts cold.
 */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "taper/planner.h"
#include "taper/solvers.h"
#include "taper/stations.h"

static taper_planner_t planner;
static taper_snapshot_t snapshot;
static int32_t limit_W[TAPER_MAX_STEPS];
static const taper_station_config_t *config;

static void fail(const char *line) {
    fprintf(stderr, "planner_probe: cannot use: %s", line);
    exit(1);
}

static void select_station(const char *line) {
    char name[64];
    if (sscanf(line, "station %63s", name) != 1) {
        fail(line);
    }
    for (unsigned k = 0; k < taper_station_count; k++) {
        if (strcmp(taper_stations[k]->name, name) == 0) {
            config = taper_stations[k];
            if (taper_planner_init(&planner, taper_solvers[k], config) != TAPER_OK) {
                fail(line);
            }
            return;
        }
    }
    fail(line);
}

static void read_limits(char *line) {
    char *at = line + strlen("limit");
    for (uint8_t t = 0; t < config->steps; t++) {
        limit_W[t] = (int32_t)strtol(at, &at, 10);
    }
}

static void read_demand(const char *line) {
    int i = 0;
    taper_demand_t d = {.active = true, .session = 1};
    if (sscanf(line, "demand %d %d %d %d %d %d %d %d %d", &i, &d.stored_Wh, &d.capacity_Wh, &d.need_Wh, &d.peak_W,
               &d.taper_W, &d.max_mA, &d.W_per_A, &d.departs_in_s) != 9 ||
        i < 0 || i >= config->connector_count) {
        fail(line);
    }
    snapshot.demand[i] = d;
}

static void solve(void) {
    snapshot.count = config->connector_count;
    taper_planner_start(&planner, &snapshot, limit_W);
    while (taper_planner_run(&planner, 50) == TAPER_VERDICT_SOLVING) {
    }
    printf("%d %u\n", (int)planner.verdict, (unsigned)taper_planner_iterations(&planner));
    for (uint8_t i = 0; i < config->connector_count; i++) {
        for (uint8_t t = 0; t < config->steps; t++) {
            printf("%.9g ", (double)taper_planner_power(&planner, i, t));
        }
        printf("\n");
    }
    memset(&snapshot, 0, sizeof snapshot);
}

int main(void) {
    static char line[4096];
    while (fgets(line, sizeof line, stdin) != NULL) {
        if (strncmp(line, "station", 7) == 0) {
            select_station(line);
        } else if (config == NULL) {
            fail(line);
        } else if (strncmp(line, "limit", 5) == 0) {
            read_limits(line);
        } else if (strncmp(line, "demand", 6) == 0) {
            read_demand(line);
        } else if (strncmp(line, "solve", 5) == 0) {
            solve();
        } else {
            fail(line);
        }
    }
    return 0;
}
