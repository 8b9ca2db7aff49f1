/* The planner of an image built without one (TAPER_WITH_PLANNER=OFF): there is never a plan, the station falls back. */
#include "taper/planner.h"

#include <string.h>

taper_status_t taper_planner_init(taper_planner_t *planner, const taper_solver_t *solver,
                                  const taper_station_config_t *config) {
    (void)solver;
    memset(planner, 0, sizeof *planner);
    planner->horizon.config = config;
    return TAPER_OK;
}

void taper_planner_start(taper_planner_t *planner, const taper_snapshot_t *snapshot,
                         const taper_course_t *course) {
    (void)planner;
    (void)snapshot;
    (void)course;
}

taper_verdict_t taper_planner_run(taper_planner_t *planner, uint16_t iterations) {
    (void)planner;
    (void)iterations;
    return TAPER_VERDICT_NONE;
}

bool taper_planner_is_usable(taper_verdict_t verdict) {
    (void)verdict;
    return false;
}

taper_real_t taper_planner_power(const taper_planner_t *planner, uint8_t i, uint8_t t) {
    (void)planner;
    (void)i;
    (void)t;
    return 0;
}

int32_t taper_planner_power_W(const taper_planner_t *planner, uint8_t i, uint8_t t) {
    (void)planner;
    (void)i;
    (void)t;
    return 0;
}

uint16_t taper_planner_iterations(const taper_planner_t *planner) {
    (void)planner;
    return 0;
}
