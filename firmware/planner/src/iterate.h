/**
 * OSQP's iteration, taken apart. osqp_solve() works in one piece and looks at the residuals at the end of every call; here
 * a solve may pause after any iteration, at no cost, and the results are the same to the bit.
 */
#ifndef TAPER_ITERATE_H
#define TAPER_ITERATE_H

#include <stdbool.h>
#include <stdint.h>

#include "osqp.h"

/** `count` iterations, as osqp_solve() makes them, without a look at what comes out. */
void taper_iterate(OSQPSolver *osqp, uint16_t count);

/**
 * Work out the residuals, and the status from them: OSQP_UNSOLVED until it is known. `last`: it is wanted now; what is
 * within ten times the tolerance then is OSQP_SOLVED_INACCURATE.
 */
void taper_look(OSQPSolver *osqp, bool last);

/** Tolerances of one's own, without the sizes of the problem. */
typedef struct {
    OSQPFloat primal, dual;
} taper_tolerance_t;

/** taper_look() against such tolerances. */
void taper_look_within(OSQPSolver *osqp, taper_tolerance_t tolerance, bool last);

/** The penalty that would balance the residuals of the last look. May be not finite. */
OSQPFloat taper_balancing_penalty(const OSQPSolver *osqp);

/**
 * The same, with each residual in its tolerance. OSQP's own takes them as shares of the multipliers, so that large ones make
 * any dual residual look small: the penalty stays high, and the powers hardly move.
 */
OSQPFloat taper_balancing_penalty_within(const OSQPSolver *osqp, taper_tolerance_t tolerance);

/** Whether all iterates are finite. Cost: O(rows), as everything else here. */
bool taper_iterates_are_finite(const OSQPSolver *osqp);

/** Take no row for an equality. With the next bounds that differs, so that they are looked at anew. */
void taper_forget_equalities(OSQPSolver *osqp);

/** Copy the iterates into `osqp->solution`. */
void taper_store_iterates(OSQPSolver *osqp);

#endif
