/** The next problem begins where the last one ended. Private. */
#ifndef TAPER_WARM_START_H
#define TAPER_WARM_START_H

#include "solver.h"

/**
 * Make a starting point of the last answer, in place: moved on by `shift` steps, without the vehicles that are new or gone
 * in `snapshot`; `planner->session` is that of the snapshot afterwards. Cost: O(rows).
 */
void taper_warm_start(taper_planner_t *planner, const taper_snapshot_t *snapshot, uint8_t shift);

#endif
