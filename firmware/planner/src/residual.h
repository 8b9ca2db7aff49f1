/** How well an answer holds, worked out from nothing. Private. */
#ifndef TAPER_RESIDUAL_H
#define TAPER_RESIDUAL_H

#include "solver.h"

/** In the units of the rows as they are scaled. */
typedef struct {
    taper_real_t worst; /**< greatest violation of a row; NaN if a row or the answer has one */
    taper_real_t size;  /**< greatest value of a row, as far as its bounds allow */
} taper_residual_t;

/**
 * Put the energies `x` [connectors x steps] into every row of `horizon`. Asks no memory of the solver besides `x`.
 * Cost: O(steps x connectors x sums).
 */
taper_residual_t taper_residual(const taper_horizon_t *horizon, const OSQPFloat *x);

#endif
