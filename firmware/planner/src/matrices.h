/** Values of the QP's two matrices, in the order of the generated pattern (codegen/qp.py). Private. */
#ifndef TAPER_MATRICES_H
#define TAPER_MATRICES_H

#include "solver.h"

/** Write the Hessian's values. @return how many, to be compared with `solver->p_count`. */
OSQPInt taper_write_hessian(const taper_solver_t *solver);

/** Write the constraint matrix's values. @return how many, to be compared with `solver->a_count`. */
OSQPInt taper_write_constraints(const taper_solver_t *solver, const taper_station_config_t *config,
                                const taper_real_t *taper_keep);

#endif
