#include "solver.h"

#include <stddef.h>

const taper_solver_t *sim_solver(unsigned station) {
    (void)station;
    return NULL;
}
