#include "taper/planner.h"

#include <string.h>
#include <tgmath.h>

#include "iterate.h"
#include "matrices.h"
#include "project.h"
#include "residual.h"
#include "solver.h"
#include "taper/real_math.h"
#include "utility.h"
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
 * The same of the log utility: the primal one as a share of the vehicles' mean power, which may be a small part of the
 * strongest connector's. Where the need of many cannot be met, lambda makes multipliers that are thousands of times the
 * gradients of the logarithm, which decide about the powers: the dual residual may be a share of them besides.
 */
#define LOG_PRIMAL_TOLERANCE ((OSQPFloat)(TAPER_REAL_IS_DOUBLE ? 4e-4 : 2e-3))
#define LOG_DUAL_TOLERANCE   ((OSQPFloat)(TAPER_REAL_IS_DOUBLE ? 2e-4 : 2e-3))
#define STEEPEST_SHARE       ((OSQPFloat)(TAPER_REAL_IS_DOUBLE ? 5e-7 : 1e-5))
/** Mean powers below this share of the strongest connector's have no tolerance of their own: float has not the digits. */
#define LEAST_SIZE ((taper_real_t)(TAPER_REAL_IS_DOUBLE ? 0 : 0.1))
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
#define RHO_INTERVAL     50
#define LOG_RHO_INTERVAL 20
#define RHO_TOLERANCE    ((OSQPFloat)2)
/** Most iterations of a quadratic programme of the log utility: of the last one, and of those before, which need not be exact. */
#define LOG_MOST_ITERATIONS   2000
#define OUTER_MOST_ITERATIONS 200

_Static_assert(RHO_INTERVAL % TAPER_MIN_SLICE == 0 && LOG_RHO_INTERVAL % TAPER_MIN_SLICE == 0,
               "the penalty is changed where the solver was looked at");
_Static_assert(TAPER_MAX_ITERATIONS % RHO_INTERVAL == 0 && LOG_MOST_ITERATIONS % TAPER_MIN_SLICE == 0,
               "the budget is a number of intervals");

static bool solver_fits(const taper_solver_t *solver, const taper_horizon_t *horizon) {
    const taper_station_config_t *config = horizon->config;
    const OSQPInt variables = (OSQPInt)config->connector_count * config->steps;
    return solver->connectors == config->connector_count && solver->steps == config->steps &&
           solver->sums == horizon->sum_count && solver->variables == variables &&
           solver->rows == (OSQPInt)taper_first_sum_row(config) + (OSQPInt)horizon->sum_count * config->steps;
}

/** Write the matrices' values, and note whether they changed, by tapers or by what connectors count. @return they fit. */
static bool write_matrices(taper_planner_t *planner) {
    const taper_solver_t *solver = planner->solver;
    const taper_written_t hessian =
        planner->horizon.log_utility ? taper_utility_expand(planner) : taper_write_hessian(solver);
    const taper_written_t constraints = taper_write_constraints(solver, &planner->horizon);
    planner->matrix_is_current = planner->matrix_is_current && !hessian.changed && !constraints.changed;
    return hessian.count == solver->p_count && constraints.count == solver->a_count;
}

/** Hand the matrices' values over if they changed: that costs a factorisation. */
static bool load_matrices(taper_planner_t *planner) {
    const taper_solver_t *solver = planner->solver;
    if (!planner->matrix_is_current) {
        planner->matrix_is_current =
            osqp_update_data_mat(solver->osqp, solver->p_values, NULL, solver->p_count, solver->a_values,
                                 NULL, solver->a_count) == 0;
    }
    return planner->matrix_is_current;
}

/** Forget everything that the solver learned: after garbage nothing of it can be trusted. */
static void forget(taper_planner_t *planner) {
    const taper_solver_t *solver = planner->solver;
    memset(planner->session, 0, sizeof planner->session);
    memset(solver->osqp->solution->x, 0, (size_t)solver->variables * sizeof(OSQPFloat));
    memset(solver->osqp->solution->y, 0, (size_t)solver->rows * sizeof(OSQPFloat));
    planner->matrix_is_current = false;
    taper_forget_equalities(solver->osqp);
    osqp_cold_start(solver->osqp);
}

taper_status_t taper_planner_init(taper_planner_t *planner, const taper_solver_t *solver,
                                  const taper_station_config_t *config) {
    memset(planner, 0, sizeof *planner);
    planner->solver = solver;
    planner->cost_scale = 1;
    taper_horizon_shape(&planner->horizon, config);
    if (!solver_fits(solver, &planner->horizon)) {
        return TAPER_ERR_CONFIG;
    }
    (void)osqp_update_rho(solver->osqp, LEAST_RHO); /* a fresh solver has nothing to factorise yet */
    if (!write_matrices(planner) || !load_matrices(planner)) {
        return TAPER_ERR_CONFIG;
    }
    solver->osqp->settings->eps_abs = ABSOLUTE_TOLERANCE;
    solver->osqp->settings->eps_rel = RELATIVE_TOLERANCE;
    solver->osqp->settings->eps_prim_inf = NEVER_INFEASIBLE;
    solver->osqp->settings->eps_dual_inf = NEVER_INFEASIBLE;
    forget(planner);
    planner->next = TAPER_WORK_RESET;
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
    planner->next = TAPER_WORK_MATRICES;
    if (!taper_planner_is_usable(planner->verdict)) {
        forget(planner);
        planner->next = TAPER_WORK_RESET;
    }
    if (horizon->log_utility) {
        taper_utility_end(planner);
    }
    taper_horizon_build(horizon, horizon->config, snapshot, course);
    taper_warm_start(planner, snapshot, shift);
    if (horizon->log_utility) {
        taper_utility_begin(planner);
    }
    planner->verdict = write_matrices(planner) ? TAPER_VERDICT_SOLVING : TAPER_VERDICT_REFUSED;
    planner->iterations = 0;
    planner->earlier = 0;
    planner->outer = 0;
    planner->slices = 0;
    planner->started_ms = snapshot->now_ms;
}

bool taper_planner_is_usable(taper_verdict_t verdict) {
    return verdict == TAPER_VERDICT_SOLVED || verdict == TAPER_VERDICT_INACCURATE;
}

static taper_tolerance_t tolerance_of(const taper_planner_t *planner) {
    const taper_real_t size = taper_real_min(taper_real_max(sqrt(planner->cost_scale), LEAST_SIZE), 1);
    return (taper_tolerance_t){.primal = LOG_PRIMAL_TOLERANCE * size,
                               .dual = LOG_DUAL_TOLERANCE + STEEPEST_SHARE * planner->steepest};
}

/** Whether the rows hold by our own account: the solver's says nothing if its memory is not what we gave it. */
static bool rows_hold(const taper_planner_t *planner) {
    const taper_residual_t residual = taper_residual(&planner->horizon, planner->solver->osqp->solution->x);
    const bool is_log = planner->horizon.log_utility;
    const taper_real_t absolute = is_log ? tolerance_of(planner).primal : ABSOLUTE_TOLERANCE;
    const taper_real_t tolerance = absolute + (is_log ? 0 : RELATIVE_TOLERANCE * residual.size);
    return residual.worst <= RESIDUAL_FACTOR * tolerance + absolute;
}

static uint16_t most_iterations(const taper_planner_t *planner) {
    return planner->horizon.log_utility ? LOG_MOST_ITERATIONS : TAPER_MAX_ITERATIONS;
}

/** Verdict on what the last look saw; the last of a problem decides. */
static taper_verdict_t judge(const taper_planner_t *planner) {
    const OSQPSolver *osqp = planner->solver->osqp;
    const OSQPInt status = osqp->info->status_val;
    if (!taper_iterates_are_finite(osqp)) {
        return TAPER_VERDICT_NOT_FINITE;
    }
    switch (status) {
    case OSQP_SOLVED: return TAPER_VERDICT_SOLVED;
    case OSQP_SOLVED_INACCURATE: return TAPER_VERDICT_INACCURATE;
    case OSQP_UNSOLVED:
        return planner->iterations < most_iterations(planner) ? TAPER_VERDICT_SOLVING : TAPER_VERDICT_LATE;
    default: return TAPER_VERDICT_REFUSED; /* standing still is always feasible: a numerical fault */
    }
}

/** The penalty for the next interval: the present one, unless the residuals are out of balance. */
static OSQPFloat next_penalty(const taper_planner_t *planner) {
    const OSQPSolver *osqp = planner->solver->osqp;
    const OSQPFloat present = osqp->settings->rho;
    const OSQPFloat balancing = planner->horizon.log_utility
                                    ? taper_balancing_penalty_within(osqp, tolerance_of(planner))
                                    : taper_balancing_penalty(osqp);
    if (!isfinite(balancing)) {
        return present;
    }
    const OSQPFloat better = taper_real_max(balancing, LEAST_RHO);
    return better > present * RHO_TOLERANCE || better * RHO_TOLERANCE < present ? better : present;
}

static uint8_t outer_iterations(const taper_planner_t *planner) {
    const uint8_t chosen = planner->horizon.config->planning.outer_iterations;
    return chosen > 0 ? chosen : TAPER_DEFAULT_OUTER_ITERATIONS;
}

/** Log utility: from one quadratic programme to the next. The answer of the last one is a plan, whatever comes of this. */
static void go_on(taper_planner_t *planner) {
    const bool usable = taper_planner_is_usable(planner->verdict);
    const bool is_last =
        planner->outer + 1 >= outer_iterations(planner) || (usable && taper_utility_has_settled(planner));
    const bool is_late =
        planner->verdict == TAPER_VERDICT_SOLVING && planner->iterations >= OUTER_MOST_ITERATIONS;
    if (planner->verdict == TAPER_VERDICT_LATE && planner->outer > 0) {
        planner->verdict = TAPER_VERDICT_INACCURATE;
    } else if (!is_last && (is_late || usable)) {
        if (is_late) {
            taper_store_iterates(planner->solver->osqp);
        }
        planner->outer++;
        planner->earlier = (uint16_t)(planner->earlier + planner->iterations);
        planner->iterations = 0;
        planner->verdict = TAPER_VERDICT_SOLVING;
        planner->next = TAPER_WORK_EXPAND;
    }
}

static uint16_t rho_interval(const taper_planner_t *planner) {
    return planner->horizon.log_utility ? LOG_RHO_INTERVAL : RHO_INTERVAL;
}

/** See how far the solver is. */
static void look(taper_planner_t *planner) {
    OSQPSolver *osqp = planner->solver->osqp;
    const bool last = planner->iterations >= most_iterations(planner);
    if (planner->horizon.log_utility) {
        taper_look_within(osqp, tolerance_of(planner), last);
    } else {
        taper_look(osqp, last);
    }
    planner->verdict = judge(planner);
    if (taper_planner_is_usable(planner->verdict)) {
        taper_store_iterates(osqp);
        planner->verdict = rows_hold(planner) ? planner->verdict : TAPER_VERDICT_RESIDUAL;
    }
    if (planner->horizon.log_utility) {
        go_on(planner);
    }
    if (planner->next == TAPER_WORK_ITERATIONS && planner->verdict == TAPER_VERDICT_SOLVING &&
        planner->iterations % rho_interval(planner) == 0 && next_penalty(planner) != osqp->settings->rho) {
        planner->next = TAPER_WORK_PENALTY;
    }
}

/** Iterate up to the next look or the end of the slice. @return iterations done. */
static uint16_t iterate(taper_planner_t *planner, uint16_t most) {
    const uint16_t to_look = (uint16_t)(TAPER_MIN_SLICE - planner->iterations % TAPER_MIN_SLICE);
    const uint16_t count = most < to_look ? most : to_look;
    taper_iterate(planner->solver->osqp, count);
    planner->iterations = (uint16_t)(planner->iterations + count);
    if (count == to_look) {
        look(planner);
    }
    return count;
}

/** Hand vectors and the starting point over; rows that became or ceased to be equalities cost a factorisation. */
static bool load_vectors(taper_planner_t *planner) {
    const taper_horizon_t *horizon = &planner->horizon;
    OSQPSolver *osqp = planner->solver->osqp;
    return osqp_update_data_vec(osqp, horizon->linear, horizon->lower, horizon->upper) == 0 &&
           osqp_warm_start(osqp, osqp->solution->x, osqp->solution->y) == 0;
}

/** What comes before the next iteration, with one factorisation at most. */
static void prepare(taper_planner_t *planner) {
    OSQPSolver *osqp = planner->solver->osqp;
    bool accepted = true;
    switch ((taper_work_t)planner->next) {
    case TAPER_WORK_RESET:
        osqp_update_rho(osqp, LEAST_RHO);
        planner->next = TAPER_WORK_MATRICES;
        break;
    case TAPER_WORK_EXPAND:
        accepted = write_matrices(planner);
        planner->next = TAPER_WORK_MATRICES;
        break;
    case TAPER_WORK_MATRICES:
        accepted = load_matrices(planner);
        planner->next = TAPER_WORK_VECTORS;
        break;
    case TAPER_WORK_VECTORS:
        accepted = load_vectors(planner);
        planner->next = TAPER_WORK_ITERATIONS;
        break;
    default:
        osqp_update_rho(osqp, next_penalty(planner));
        planner->next = TAPER_WORK_ITERATIONS;
        break;
    }
    planner->verdict = accepted ? TAPER_VERDICT_SOLVING : TAPER_VERDICT_REFUSED;
}

taper_verdict_t taper_planner_run(taper_planner_t *planner, uint16_t iterations) {
    if (planner->verdict != TAPER_VERDICT_SOLVING) {
        return planner->verdict;
    }
    const bool is_short = iterations < TAPER_MIN_SLICE;
    int32_t left = is_short ? taper_max_i32(iterations, 1) : iterations - iterations % TAPER_MIN_SLICE;
    while (left > 0 && planner->verdict == TAPER_VERDICT_SOLVING) {
        const bool iterates = planner->next == TAPER_WORK_ITERATIONS;
        if (iterates) {
            left -= iterate(planner, (uint16_t)left);
        } else {
            prepare(planner);
        }
        if (is_short && (!iterates || planner->next != TAPER_WORK_ITERATIONS)) {
            break; /* a factorisation never shares a short slice */
        }
    }
    planner
        ->slices++; /* a quadratic programme takes less than twice TAPER_MAX_ITERATIONS, and there are 20 at most */
    if (taper_planner_is_usable(planner->verdict)) {
        taper_project(&planner->horizon, planner->solver->osqp->solution->x);
    }
    return planner->verdict;
}

taper_real_t taper_planner_power(const taper_planner_t *planner, uint8_t i, uint8_t t) {
    const taper_solver_t *solver = planner->solver;
    const OSQPFloat *chain = solver->osqp->solution->x + (size_t)i * solver->steps;
    return (t > 0 ? chain[t] - chain[t - 1] : chain[0]) * planner->horizon.unit[i];
}

int32_t taper_planner_power_W(const taper_planner_t *planner, uint8_t i, uint8_t t) {
    const taper_real_t base_W = planner->horizon.base_W;
    return taper_real_to_W(taper_planner_power(planner, i, t) * base_W, taper_real_to_W(base_W, INT32_MAX));
}

uint16_t taper_planner_iterations(const taper_planner_t *planner) {
    return (uint16_t)(planner->earlier + planner->iterations);
}
