/** Makes a solver's answer feasible. Private. */
#ifndef TAPER_PROJECT_H
#define TAPER_PROJECT_H

#include "solver.h"

/**
 * Bring the energies `x` [connectors x steps] within every row of `horizon`, in place: forward in time, each power is
 * limited by rate, taper and need; where a sum is above its limit all its powers shrink in proportion; where two phases
 * differ by more than they may, the powers on the stronger one shrink, those of connectors on one phase first. What is
 * cut off in one step is made up for in later ones where there is room.
 * `x` must be finite. Cost: O(connectors x steps x sums).
 */
void taper_project(const taper_horizon_t *horizon, OSQPFloat *x);

#endif
