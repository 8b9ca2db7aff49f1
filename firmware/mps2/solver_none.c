#include <stddef.h>

#include "solver.h"

const taper_solver_t *mps2_solver(void) {
    return NULL;
}
