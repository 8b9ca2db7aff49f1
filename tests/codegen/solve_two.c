/*
 * Works two generated solvers in one image through every call that the firmware makes, for test_generated_solver.py.
 * An array that is constant but written after all ends the program with a segmentation fault.
 * Prints for each solver the iterations, and then x.
 */
#include <stdio.h>
#include <stdlib.h>

#include "garage_workspace.h"
#include "hub_workspace.h"
#include "osqp.h"

enum { MAX_ROWS = 4096 };

/** Bounds 0..0.5 on rates, no lower bound elsewhere; the first `idle` rates are held at 0, which makes equalities. */
static void set_bounds(OSQPFloat *low, OSQPFloat *high, OSQPInt rows, OSQPInt rates, OSQPInt idle) {
    for (OSQPInt row = 0; row < rows; row++) {
        low[row] = row < rates ? (OSQPFloat)0 : (OSQPFloat)-OSQP_INFTY;
        high[row] = row < idle ? (OSQPFloat)0 : (OSQPFloat)0.5;
    }
}

static void require(OSQPInt condition, const char *what) {
    if (!condition) {
        fprintf(stderr, "%s\n", what);
        exit(1);
    }
}

static void solve(OSQPSolver *solver, OSQPFloat *a, OSQPInt a_count, OSQPFloat *p, OSQPInt p_count,
                  OSQPInt idle) {
    static OSQPFloat low[MAX_ROWS], high[MAX_ROWS], linear[MAX_ROWS];
    OSQPInt rows, variables;
    osqp_get_dimensions(solver, &rows, &variables);
    require(rows <= MAX_ROWS, "too many rows");
    set_bounds(low, high, rows, variables, idle);
    for (OSQPInt k = 0; k < variables; k++) {
        linear[k] = (OSQPFloat)-0.05;
    }
    (void)osqp_update_rho(solver, (OSQPFloat)0.3); /* its factorisation fails: there are no values yet */
    require(osqp_update_data_mat(solver, p, NULL, p_count, a, NULL, a_count) == 0, "matrices");
    require(osqp_update_data_vec(solver, linear, low, high) == 0, "vectors");
    osqp_cold_start(solver);
    require(osqp_solve(solver) == 0 && solver->info->status_val == OSQP_SOLVED, "solve");
    require(osqp_update_rho(solver, (OSQPFloat)0.3) == 0, "rho");
}

static void solve_and_print(OSQPSolver *solver, OSQPFloat *a, OSQPInt a_count, OSQPFloat *p,
                            OSQPInt p_count) {
    solve(solver, a, a_count, p, p_count, 30);
    solve(solver, a, a_count, p, p_count, 0);
    OSQPInt rows, variables;
    osqp_get_dimensions(solver, &rows, &variables);
    printf("%d\n", (int)solver->info->iter);
    for (OSQPInt k = 0; k < variables; k++) {
        printf("%.17g\n", (double)solver->solution->x[k]);
    }
}

#define COUNT(array) ((OSQPInt)(sizeof(array) / sizeof((array)[0])))
#define SOLVE_AND_PRINT(workspace)                                                                  \
    solve_and_print(&workspace##_solver, workspace##_data_A_csc_x, COUNT(workspace##_data_A_csc_x), \
                    workspace##_data_P_csc_x, COUNT(workspace##_data_P_csc_x))

int main(void) {
    SOLVE_AND_PRINT(taper_workspace_hub);
    SOLVE_AND_PRINT(taper_workspace_garage);
    return 0;
}
