#include "setup.h"

const taper_solver_t *taper_setup_solver(unsigned station) {
    (void)station;
    return NULL;
}
