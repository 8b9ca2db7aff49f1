#include "solver.h"
#include "taper/solvers.h"

const taper_solver_t *sim_solver(unsigned station) {
    return taper_solvers[station];
}
