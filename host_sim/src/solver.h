/** The solvers that were generated into this program, or that there are none (TAPER_WITH_PLANNER=OFF). */
#ifndef SIM_SOLVER_H
#define SIM_SOLVER_H

#include "taper/planner.h"

/** @return the solver of `taper_stations[station]`, or NULL in a build without the planner. */
const taper_solver_t *sim_solver(unsigned station);

#endif
