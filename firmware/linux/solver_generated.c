#include "setup.h"
#include "taper/solvers.h"

const taper_solver_t *taper_setup_solver(unsigned station) {
    return taper_solvers[station];
}
