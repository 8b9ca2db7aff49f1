/** The solver of the image's station; which file says so is CMake's choice. */
#ifndef MPS2_SOLVER_H
#define MPS2_SOLVER_H

#include "taper/planner.h"

/** NULL in an image without the planner. */
const taper_solver_t *mps2_solver(void);

#endif
