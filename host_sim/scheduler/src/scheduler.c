/* Open, close, and the call of a period. What may be set is in settings.c. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "scheduler_internal.h"
#include "taper/config_check.h"
#include "taper/stations.h"

#if TAPER_SCHEDULER_HAS_PLANNER
#    include "taper/solvers.h"
#endif

#define MOST_TIME_s 1e12

/** Stations that are open: a generated solver is one global. */
static taper_scheduler_t *open_stations;

int32_t taper_scheduler_version(void) {
    return TAPER_SCHEDULER_VERSION;
}

const char *taper_scheduler_station_name(int32_t index) {
    return index >= 0 && (unsigned)index < taper_station_count ? taper_stations[index]->name : NULL;
}

const char *taper_scheduler_status_text(int32_t status) {
    switch (status) {
    case TAPER_SCHEDULER_OK: return "done";
    case TAPER_SCHEDULER_ERR_ARGUMENT: return "an argument is out of its range";
    case TAPER_SCHEDULER_ERR_STATION: return "there is no station of that name in this library";
    case TAPER_SCHEDULER_ERR_OPEN: return "the station is open already: there is one of each per process";
    case TAPER_SCHEDULER_ERR_NO_PLANNER: return "built without planner: only the policy edf-soc";
    case TAPER_SCHEDULER_ERR_MEMORY: return "out of memory";
    default: return "not a status of this library";
    }
}

void taper_scheduler_defaults(taper_scheduler_options_t *options) {
    *options = (taper_scheduler_options_t){
        .policy = TAPER_SCHEDULER_HAS_PLANNER ? TAPER_SCHEDULER_SOC_MPC : TAPER_SCHEDULER_EDF_SOC,
        .period_s = 300,
        .objective = TAPER_OBJECTIVE_THROUGHPUT,
        .fill = 1,
    };
}

/** Index of a built-in station, or `taper_station_count`. */
static unsigned find_station(const char *name) {
    unsigned k = 0;
    while (k < taper_station_count && strcmp(taper_stations[k]->name, name) != 0) {
        k++;
    }
    return k;
}

static bool is_open(const char *name) {
    for (const taper_scheduler_t *at = open_stations; at != NULL; at = at->next) {
        if (strcmp(at->station, name) == 0) {
            return true;
        }
    }
    return false;
}

static bool options_are_sound(const taper_scheduler_options_t *options) {
    return (options->policy == TAPER_SCHEDULER_SOC_MPC || options->policy == TAPER_SCHEDULER_EDF_SOC) &&
           is_within(options->period_s, 1, 3600) &&
           is_within(options->objective, TAPER_OBJECTIVE_THROUGHPUT, TAPER_OBJECTIVE_LOG_UTILITY) &&
           is_within(options->outer_iterations, 0, TAPER_MAX_OUTER_ITERATIONS) &&
           is_within(options->horizon_steps, 0, UINT8_MAX) && is_within(options->lambda_per_kWh2, 0, 10000);
}

/** The description, in memory of its own that may be changed: planning as ordered, a period as the control tick. */
static void copy_description(taper_scheduler_t *scheduler, const taper_station_config_t *built) {
    const taper_scheduler_options_t *options = &scheduler->options;
    memcpy(scheduler->connector, built->connectors, built->connector_count * sizeof built->connectors[0]);
    memcpy(scheduler->group, built->groups, built->group_count * sizeof built->groups[0]);
    scheduler->station = built->name;
    scheduler->config = *built;
    scheduler->config.connectors = scheduler->connector;
    scheduler->config.groups = scheduler->group;
    scheduler->config.tick_ms = scheduler->period_ms;
    scheduler->config.other_load_W = 0; /* the limits that are told are for charging alone */
    scheduler->config.other_load_mA = 0;
    scheduler->config.planning.objective = (uint8_t)options->objective;
    scheduler->config.planning.outer_iterations = (uint8_t)options->outer_iterations;
    scheduler->config.planning.horizon_steps = (uint8_t)options->horizon_steps;
    scheduler->config.planning.lambda_milli_per_kWh2 = (int32_t)lrint(options->lambda_per_kWh2 * 1000);
}

static int32_t start_planner(taper_scheduler_t *scheduler, unsigned station) {
    if (scheduler->options.policy == TAPER_SCHEDULER_EDF_SOC) {
        return TAPER_SCHEDULER_OK;
    }
#if TAPER_SCHEDULER_HAS_PLANNER
    const taper_status_t status =
        taper_planner_init(&scheduler->planner, taper_solvers[station], &scheduler->config);
    return status == TAPER_OK ? TAPER_SCHEDULER_OK : TAPER_SCHEDULER_ERR_ARGUMENT;
#else
    (void)station;
    return TAPER_SCHEDULER_ERR_NO_PLANNER;
#endif
}

static int32_t start(taper_scheduler_t *scheduler, unsigned station,
                     const taper_scheduler_options_t *options) {
    scheduler->options = *options;
    scheduler->period_ms = (uint32_t)options->period_s * 1000u;
    scheduler->now_s = -1;
    copy_description(scheduler, taper_stations[station]);
    scheduler->limit_W = scheduler->group[0].limit_W;
    if (taper_config_check(&scheduler->config) != TAPER_OK) {
        return TAPER_SCHEDULER_ERR_ARGUMENT;
    }
    taper_limits_init(&scheduler->limits, &scheduler->config);
    taper_allocator_init(&scheduler->allocator);
    return start_planner(scheduler, station);
}

int32_t taper_scheduler_open(taper_scheduler_t **scheduler, const char *station,
                             const taper_scheduler_options_t *options) {
    if (scheduler == NULL) {
        return TAPER_SCHEDULER_ERR_ARGUMENT;
    }
    *scheduler = NULL;
    if (station == NULL || options == NULL || !options_are_sound(options)) {
        return TAPER_SCHEDULER_ERR_ARGUMENT;
    }
    const unsigned found = find_station(station);
    if (found == taper_station_count) {
        return TAPER_SCHEDULER_ERR_STATION;
    }
    if (is_open(station)) {
        return TAPER_SCHEDULER_ERR_OPEN;
    }
    taper_scheduler_t *opened = calloc(1, sizeof *opened);
    if (opened == NULL) {
        return TAPER_SCHEDULER_ERR_MEMORY;
    }
    const int32_t status = start(opened, found, options);
    if (status != TAPER_SCHEDULER_OK) {
        free(opened);
        return status;
    }
    opened->next = open_stations;
    open_stations = opened;
    *scheduler = opened;
    return TAPER_SCHEDULER_OK;
}

void taper_scheduler_close(taper_scheduler_t *scheduler) {
    for (taper_scheduler_t **at = &open_stations; *at != NULL; at = &(*at)->next) {
        if (*at == scheduler) {
            *at = scheduler->next;
            free(scheduler);
            return;
        }
    }
}

uint32_t scheduler_ms(double time_s) {
    return (uint32_t)(uint64_t)llrint(time_s * 1000);
}

static void answer(const taper_scheduler_t *scheduler, taper_scheduler_current_t *currents) {
    for (uint8_t i = 0; i < scheduler->config.connector_count; i++) {
        currents[i] = (taper_scheduler_current_t){
            .current_A = scheduler->setpoints.current_mA[i] / 1000.0,
            .wish_kW = scheduler->proposal.wish_W[i] / 1000.0,
            .why = scheduler_why(scheduler, i),
        };
    }
}

int32_t taper_scheduler_plan(taper_scheduler_t *scheduler, double now_s,
                             taper_scheduler_current_t *currents) {
    if (!is_within(now_s, 0, MOST_TIME_s) || now_s < scheduler->now_s || currents == NULL) {
        return TAPER_SCHEDULER_ERR_ARGUMENT;
    }
    scheduler->now_s = now_s;
    scheduler_take_snapshot(scheduler, now_s);
    scheduler_propose(scheduler, scheduler_ms(now_s));
    scheduler_allocate(scheduler);
    answer(scheduler, currents);
    return TAPER_SCHEDULER_OK;
}

void taper_scheduler_account(const taper_scheduler_t *scheduler, taper_scheduler_account_t *account) {
    *account = scheduler->account;
}
