#include "solver.h"
#include "taper/solvers.h"

const taper_solver_t *mps2_solver(void) {
    return taper_solvers[0];
}
