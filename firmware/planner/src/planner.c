#include "taper/planner.h"

#include <math.h>
#include <string.h>

#include "matrices.h"
#include "project.h"
#include "residual.h"
#include "solver.h"
#include "taper/real_math.h"
#include "warm_start.h"

_Static_assert(sizeof(OSQPFloat) == sizeof(taper_real_t),
               "solver and firmware are built for the same real type");

/**
 * Absolute and relative tolerance. In double, cost and constraints come well within 1e-3 of the optimum on every problem
 * of the tests; float cannot keep more than 1e-3 apart on the larger stations and would run out of iterations.
 */
#define ABSOLUTE_TOLERANCE ((OSQPFloat)(TAPER_REAL_IS_DOUBLE ? 1e-4 : 1e-3))
#define RELATIVE_TOLERANCE ((OSQPFloat)(TAPER_REAL_IS_DOUBLE ? 3e-4 : 1e-3))
/**
 * Tolerance of OSQP's tests for infeasibility. Standing still is always feasible and power is bounded, so they can only
 * be wrong; and at the end of a slice their approximate form would throw the iterates away.
 */
#define NEVER_INFEASIBLE ((OSQPFloat)1e-20)
/** A plan whose rows are further off than this many tolerances is refused: OSQP's own "inaccurate" is ten. */
#define RESIDUAL_FACTOR 10
/** Least penalty, and that of a fresh solver: below it the primal residual stands still. */
#define LEAST_RHO ((OSQPFloat)0.3)
/** The penalty is looked at again after every so many iterations, and changed if it is this factor off. */
#define RHO_INTERVAL  50
#define RHO_TOLERANCE ((OSQPFloat)2)

_Static_assert(TAPER_MIN_SLICE <= RHO_INTERVAL && RHO_INTERVAL % TAPER_MIN_SLICE == 0,
               "slices end where OSQP looks");
_Static_assert(TAPER_MAX_ITERATIONS % RHO_INTERVAL == 0, "the budget is a number of intervals");

static bool solver_fits(const taper_solver_t *solver, const taper_horizon_t *horizon) {
    const taper_station_config_t *config = horizon->config;
    const OSQPInt variables = (OSQPInt)config->connector_count * config->steps;
    return solver->connectors == config->connector_count && solver->steps == config->steps &&
           solver->sums == horizon->sum_count && solver->variables == variables &&
           solver->rows == 2 * variables + (OSQPInt)horizon->sum_count * config->steps;
}

/** Hand the matrices' values over if they changed, by tapers or by what connectors count: that costs a factorisation. */
static bool load_matrices(taper_planner_t *planner) {
    const taper_solver_t *solver = planner->solver;
    const taper_written_t hessian = taper_write_hessian(solver);
    const taper_written_t constraints = taper_write_constraints(solver, &planner->horizon);
    if (planner->matrix_is_current && !hessian.changed && !constraints.changed) {
        return true;
    }
    planner->matrix_is_current = hessian.count == solver->p_count && constraints.count == solver->a_count &&
                                 osqp_update_data_mat(solver->osqp, solver->p_values, NULL, solver->p_count,
                                                      solver->a_values, NULL, solver->a_count) == 0;
    return planner->matrix_is_current;
}

/** Forget everything that the solver learned: after garbage nothing of it can be trusted. */
static void reset(taper_planner_t *planner) {
    const taper_solver_t *solver = planner->solver;
    memset(planner->session, 0, sizeof planner->session);
    memset(solver->osqp->solution->x, 0, (size_t)solver->variables * sizeof(OSQPFloat));
    memset(solver->osqp->solution->y, 0, (size_t)solver->rows * sizeof(OSQPFloat));
    planner->matrix_is_current = false;
    osqp_update_rho(solver->osqp, LEAST_RHO);
    osqp_cold_start(solver->osqp);
}

taper_status_t taper_planner_init(taper_planner_t *planner, const taper_solver_t *solver,
                                  const taper_station_config_t *config) {
    memset(planner, 0, sizeof *planner);
    planner->solver = solver;
    taper_horizon_shape(&planner->horizon, config);
    if (!solver_fits(solver, &planner->horizon) || !load_matrices(planner)) {
        return TAPER_ERR_CONFIG;
    }
    solver->osqp->settings->eps_abs = ABSOLUTE_TOLERANCE;
    solver->osqp->settings->eps_rel = RELATIVE_TOLERANCE;
    solver->osqp->settings->eps_prim_inf = NEVER_INFEASIBLE;
    solver->osqp->settings->eps_dual_inf = NEVER_INFEASIBLE;
    reset(planner);
    return TAPER_OK;
}

static uint8_t steps_since(const taper_planner_t *planner, uint32_t now_ms) {
    const uint32_t step_ms = planner->horizon.config->step_s * UINT32_C(1000);
    const uint32_t elapsed = taper_elapsed_ms(now_ms, planner->started_ms) / step_ms;
    const uint8_t most = (uint8_t)(planner->horizon.config->steps - 1);
    return elapsed < most ? (uint8_t)elapsed : most;
}

void taper_planner_start(taper_planner_t *planner, const taper_snapshot_t *snapshot,
                         const taper_course_t *course) {
    taper_horizon_t *horizon = &planner->horizon;
    const uint8_t shift = steps_since(planner, snapshot->now_ms);
    if (!taper_planner_is_usable(planner->verdict) && planner->verdict != TAPER_VERDICT_NONE) {
        reset(planner);
    }
    taper_horizon_build(horizon, horizon->config, snapshot, course);
    const bool accepted =
        load_matrices(planner) &&
        osqp_update_data_vec(planner->solver->osqp, horizon->linear, horizon->lower, horizon->upper) == 0;
    if (accepted) {
        taper_warm_start(planner, snapshot, shift);
    }
    planner->verdict = accepted ? TAPER_VERDICT_SOLVING : TAPER_VERDICT_REFUSED;
    planner->iterations = 0;
    planner->slices = 0;
    planner->started_ms = snapshot->now_ms;
}

bool taper_planner_is_usable(taper_verdict_t verdict) {
    return verdict == TAPER_VERDICT_SOLVED || verdict == TAPER_VERDICT_INACCURATE;
}

static bool all_finite(const OSQPFloat *values, OSQPInt count) {
    for (OSQPInt k = 0; k < count; k++) {
        if (!isfinite(values[k])) {
            return false;
        }
    }
    return true;
}

/** Whether the rows hold by our own account: the solver's says nothing if its memory is not what we gave it. */
static bool rows_hold(const taper_planner_t *planner) {
    const taper_residual_t residual = taper_residual(&planner->horizon, planner->solver->osqp->solution->x);
    const taper_real_t tolerance = ABSOLUTE_TOLERANCE + RELATIVE_TOLERANCE * residual.size;
    return residual.worst <= RESIDUAL_FACTOR * tolerance + ABSOLUTE_TOLERANCE;
}

static bool has_stopped(const taper_planner_t *planner) {
    return planner->solver->osqp->info->status_val == OSQP_SOLVED ||
           planner->iterations >= TAPER_MAX_ITERATIONS;
}

/** Verdict on a solver that stopped. `osqp_solve` returns 0 whatever happened: only the status tells. */
static taper_verdict_t judge(const taper_planner_t *planner) {
    const taper_solver_t *solver = planner->solver;
    const OSQPInt status = solver->osqp->info->status_val;
    if (status == OSQP_PRIMAL_INFEASIBLE || status == OSQP_DUAL_INFEASIBLE || status == OSQP_NON_CVX ||
        status == OSQP_PRIMAL_INFEASIBLE_INACCURATE || status == OSQP_DUAL_INFEASIBLE_INACCURATE) {
        return TAPER_VERDICT_REFUSED; /* standing still is always feasible: a numerical fault */
    }
    if (!all_finite(solver->osqp->solution->x, solver->variables) ||
        !all_finite(solver->osqp->solution->y, solver->rows)) {
        return TAPER_VERDICT_NOT_FINITE;
    }
    if (!has_stopped(planner)) {
        return TAPER_VERDICT_SOLVING;
    }
    if (status != OSQP_SOLVED && status != OSQP_SOLVED_INACCURATE) {
        return TAPER_VERDICT_LATE;
    }
    if (!rows_hold(planner)) {
        return TAPER_VERDICT_RESIDUAL;
    }
    return status == OSQP_SOLVED ? TAPER_VERDICT_SOLVED : TAPER_VERDICT_INACCURATE;
}

/**
 * Change the penalty if the residuals are out of balance. OSQP counts its iterations anew in every call and would never
 * get there in small slices; done here, a solve takes the same steps however it is sliced.
 */
static void adapt_penalty(OSQPSolver *osqp) {
    const OSQPFloat present = osqp->settings->rho;
    const OSQPFloat estimate = osqp->info->rho_estimate;
    if (!isfinite(estimate)) {
        return;
    }
    const OSQPFloat better = taper_real_max(estimate, LEAST_RHO);
    if (better > present * RHO_TOLERANCE || better * RHO_TOLERANCE < present) {
        osqp_update_rho(osqp, better);
    }
}

/** Iterate up to the end of the slice or of the penalty's interval. @return iterations done. */
static uint16_t iterate(taper_planner_t *planner, uint16_t most) {
    OSQPSolver *osqp = planner->solver->osqp;
    const uint16_t to_interval = (uint16_t)(RHO_INTERVAL - planner->iterations % RHO_INTERVAL);
    osqp->settings->max_iter = most < to_interval ? most : to_interval;
    const bool ran = osqp_solve(osqp) == 0;
    const uint16_t done = (uint16_t)osqp->info->iter;
    planner->iterations = (uint16_t)(planner->iterations + done);
    planner->verdict = ran ? judge(planner) : TAPER_VERDICT_REFUSED;
    if (planner->verdict == TAPER_VERDICT_SOLVING && planner->iterations % RHO_INTERVAL == 0) {
        adapt_penalty(osqp);
    }
    return done;
}

taper_verdict_t taper_planner_run(taper_planner_t *planner, uint16_t iterations) {
    if (planner->verdict != TAPER_VERDICT_SOLVING) {
        return planner->verdict;
    }
    int32_t left = taper_max_i32(iterations - iterations % TAPER_MIN_SLICE, TAPER_MIN_SLICE);
    while (left > 0 && planner->verdict == TAPER_VERDICT_SOLVING) {
        left -= iterate(planner, (uint16_t)left);
    }
    planner->slices = (uint8_t)(planner->slices + (planner->slices < UINT8_MAX ? 1 : 0));
    if (taper_planner_is_usable(planner->verdict)) {
        taper_project(&planner->horizon, planner->solver->osqp->solution->x);
    }
    return planner->verdict;
}

taper_real_t taper_planner_power(const taper_planner_t *planner, uint8_t i, uint8_t t) {
    const taper_solver_t *solver = planner->solver;
    const OSQPFloat *chain = solver->osqp->solution->x + (size_t)i * solver->steps;
    return t > 0 ? chain[t] - chain[t - 1] : chain[0];
}

int32_t taper_planner_power_W(const taper_planner_t *planner, uint8_t i, uint8_t t) {
    const taper_real_t base_W = planner->horizon.base_W;
    return taper_real_to_W(taper_planner_power(planner, i, t) * base_W, taper_real_to_W(base_W, INT32_MAX));
}

uint16_t taper_planner_iterations(const taper_planner_t *planner) {
    return planner->iterations;
}
