/** One run: the station, its field and the gateway on one bus, tick after tick in virtual time. */
#ifndef SIM_WORLD_H
#define SIM_WORLD_H

#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>

#include "baselines.h"
#include "errors.h"
#include "limits_csv.h"
#include "results.h"
#include "sessions.h"
#include "station_link.h"

/** What to run. Everything is borrowed. */
typedef struct {
    const taper_station_config_t *station; /**< its tick is a whole number of seconds */
    const taper_solver_t *solver;          /**< NULL: none was built in */
    const sim_policy_t *policy;
    uint16_t iterations; /**< of the solver in a tick */
    const sim_sessions_t *sessions;
    const sim_course_t *limits; /**< nowhere above the station's own site limit */
    const sim_course_t *prices; /**< of energy, per kWh; NULL: none */
    uint64_t seed;              /**< decides in which order nodes send, and nothing else without `errors` */
    const sim_errors_t *errors; /**< of vehicles and meters; NULL: none */
    bool unannounced;           /**< the gateway does not tell what the limit will be */
    sim_link_t *link;           /**< the station; not started yet */
    FILE *problems;             /**< where the planning problems go; NULL: nowhere */
    FILE *frames;               /**< where the station's frames go; NULL: nowhere */
    FILE *tapers;               /**< where learned tapers go (tapers.h); NULL: nowhere. Not on a board */
} sim_case_t;

/**
 * Run from the tick of the first arrival to the last departure, and add what happened to `results`.
 * @return false, after one line on stderr, if the simulation itself broke, or the station was lost.
 */
bool sim_world_run(const sim_case_t *run, sim_results_t *results);

#endif
