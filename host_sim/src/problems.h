/** Writes the planning problems of a run down, for planner_probe (tests/planner): to solve them again, elsewhere. */
#ifndef SIM_PROBLEMS_H
#define SIM_PROBLEMS_H

#include <stdio.h>

#include "taper/station.h"

/** First line: the station that the problems are for. */
void sim_problems_begin(FILE *file, const taper_station_t *station);

/** The problem that `station` solved in its last step. */
void sim_problems_add(FILE *file, const taper_station_t *station);

#endif
