#include "iterate.h"

#include <math.h>
#include <string.h>

#include "algebra_impl.h"
#include "algebra_vector.h"
#include "auxil.h"
#include "types.h"

/** The body of the loop in osqp_solve(), as it is without printing, profiling and interrupts. */
static void iterate_once(OSQPSolver *osqp) {
    OSQPWorkspace *work = osqp->work;
    swap_vectors(&work->x, &work->x_prev);
    swap_vectors(&work->z, &work->z_prev);
    update_xz_tilde(osqp, 1); /* its number matters to iterative solvers of the linear system only */
    update_x(osqp);
    update_z(osqp);
    update_y(osqp);
}

void taper_iterate(OSQPSolver *osqp, uint16_t count) {
    for (uint16_t k = 0; k < count; k++) {
        iterate_once(osqp);
    }
}

void taper_look(OSQPSolver *osqp, bool last) {
    update_status(osqp->info, OSQP_UNSOLVED);
    update_info(osqp, 0, 0);
    const bool known = check_termination(osqp, 0) != 0;
    if (last && !known) {
        check_termination(osqp, 1);
    }
}

/** Ten tolerances are what check_termination() calls inaccurate. */
#define INACCURATE_FACTOR 10

void taper_look_within(OSQPSolver *osqp, taper_tolerance_t tolerance, bool last) {
    OSQPInfo *info = osqp->info;
    update_status(info, OSQP_UNSOLVED);
    update_info(osqp, 0, 0);
    if (info->prim_res <= tolerance.primal && info->dual_res <= tolerance.dual) {
        update_status(info, OSQP_SOLVED);
    } else if (last && info->prim_res <= INACCURATE_FACTOR * tolerance.primal &&
               info->dual_res <= INACCURATE_FACTOR * tolerance.dual) {
        update_status(info, OSQP_SOLVED_INACCURATE);
    }
}

OSQPFloat taper_balancing_penalty(const OSQPSolver *osqp) {
    return compute_rho_estimate(osqp);
}

OSQPFloat taper_balancing_penalty_within(const OSQPSolver *osqp, taper_tolerance_t tolerance) {
    const OSQPFloat primal = osqp->info->prim_res / tolerance.primal;
    const OSQPFloat dual = osqp->info->dual_res / tolerance.dual;
    return osqp->settings->rho * c_sqrt(primal / dual);
}

static bool all_finite(const OSQPVectorf *vector) {
    const OSQPFloat *values = OSQPVectorf_data(vector);
    const OSQPInt count = OSQPVectorf_length(vector);
    for (OSQPInt k = 0; k < count; k++) {
        if (!isfinite(values[k])) {
            return false;
        }
    }
    return true;
}

bool taper_iterates_are_finite(const OSQPSolver *osqp) {
    return all_finite(osqp->work->x) && all_finite(osqp->work->y);
}

void taper_forget_equalities(OSQPSolver *osqp) {
    OSQPVectori *types = osqp->work->constr_type;
    memset(types->values, 0, (size_t)types->length * sizeof types->values[0]);
}

void taper_store_iterates(OSQPSolver *osqp) {
    OSQPVectorf_to_raw(osqp->solution->x, osqp->work->x);
    OSQPVectorf_to_raw(osqp->solution->y, osqp->work->y);
}
