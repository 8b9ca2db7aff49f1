/** Values of the QP's two matrices, in the order of the generated pattern (codegen/qp.py). Private. */
#ifndef TAPER_MATRICES_H
#define TAPER_MATRICES_H

#include "solver.h"

/** What became of writing a matrix. */
typedef struct {
    OSQPInt
        count; /**< values that it has, to be compared with `a_count` or `p_count`; none beyond these is written */
    bool changed; /**< some value was not there already */
} taper_written_t;

/** A matrix being written, one value after the other. */
typedef struct {
    OSQPFloat *values;
    OSQPInt room;
    taper_written_t written;
} taper_writer_t;

/** Write the next value. What was there is compared to the bit, so that a NaN that got in by accident counts as a change. */
void taper_writer_put(taper_writer_t *writer, OSQPFloat value);

/** Write the Hessian's values, of the throughput. */
taper_written_t taper_write_hessian(const taper_solver_t *solver);

/** Write the constraint matrix's values for `horizon`: its tapers and the weights of its sums. */
taper_written_t taper_write_constraints(const taper_solver_t *solver, const taper_horizon_t *horizon);

#endif
