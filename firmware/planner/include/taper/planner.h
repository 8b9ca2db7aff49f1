/**
 * The planner: solves the horizon's problem in bounded slices and says how good the answer is.
 *
 * Behind this header stands OSQP, generated per station by codegen; nothing here shows it, so that another solver can
 * take its place. One solver instance per station and image: the generated workspace is a global, not re-entrant.
 */
#ifndef TAPER_PLANNER_H
#define TAPER_PLANNER_H

#include <stdbool.h>
#include <stdint.h>

#include "taper/horizon.h"
#include "taper/types.h"

/** A generated solver (`taper/solvers.h`). */
typedef struct taper_solver taper_solver_t;

/** Iterations after which a quadratic programme that has not converged is given up. The log utility makes several. */
#define TAPER_MAX_ITERATIONS 500
/**
 * The planner looks for convergence every so many iterations. Longer slices are whole multiples of this. Shorter ones are for
 * a controller that must bound the work of a tick: see taper_planner_run().
 */
#define TAPER_MIN_SLICE 10

/** What is thought of the solver's last answer. On the bus in CTRL_STATUS. */
typedef enum {
    TAPER_VERDICT_NONE = 0,       /**< nothing was ever solved */
    TAPER_VERDICT_SOLVING = 1,    /**< slices remain */
    TAPER_VERDICT_SOLVED = 2,     /**< converged */
    TAPER_VERDICT_INACCURATE = 3, /**< out of iterations, residuals within ten times the tolerance: usable */
    TAPER_VERDICT_LATE = 4,       /**< out of iterations, not usable */
    TAPER_VERDICT_NOT_FINITE = 5, /**< NaN or infinite values */
    TAPER_VERDICT_REFUSED = 6,    /**< the solver refused the data or called a feasible problem infeasible */
    TAPER_VERDICT_RESIDUAL = 7,   /**< called solved, but the rows do not hold within the tolerance */
    TAPER_VERDICT_OFF = 8,        /**< not asked: see taper_health_t */
} taper_verdict_t;

/** What a problem being solved needs next. Each one but the iterations may hold one factorisation. */
typedef enum {
    TAPER_WORK_RESET,    /**< the penalty of a fresh solver */
    TAPER_WORK_MATRICES, /**< values of the matrices */
    TAPER_WORK_VECTORS,  /**< cost, bounds and starting point */
    TAPER_WORK_ITERATIONS,
    TAPER_WORK_PENALTY, /**< another penalty */
    TAPER_WORK_EXPAND,  /**< the next quadratic programme of the log utility; no factorisation */
} taper_work_t;

typedef struct {
    const taper_solver_t *solver;
    taper_horizon_t horizon; /**< the problem being solved */
    taper_verdict_t verdict;
    taper_work_t next;
    uint16_t iterations;                   /**< spent on the present quadratic programme */
    uint16_t earlier;                      /**< spent on those before it, of the same problem */
    uint8_t outer;                         /**< how many these are: log utility only */
    uint16_t slices;                       /**< of the present problem */
    uint32_t started_ms;                   /**< time of the snapshot that the problem is for */
    uint8_t session[TAPER_MAX_CONNECTORS]; /**< whose trajectory the warm start holds; 0: nobody's */
    taper_real_t
        rate[TAPER_MAX_VARIABLES]; /**< log utility: rate limits, without those of the next step's length */
    taper_real_t need[TAPER_MAX_CONNECTORS]; /**< log utility: energy wanted, in the horizon's units */
    taper_real_t
        steepest; /**< log utility: greatest worth of a unit of energy at the end, about which it was expanded */
    taper_real_t cost_scale; /**< log utility: factor of the whole cost */
    bool matrix_is_current;  /**< the solver's factorisation is that of its matrices' values */
} taper_planner_t;

/**
 * Tie a planner to its solver.
 * @return TAPER_ERR_CONFIG if the solver was generated for another shape than `config`, or refuses its matrices.
 * Cost: two factorisations.
 */
taper_status_t taper_planner_init(taper_planner_t *planner, const taper_solver_t *solver,
                                  const taper_station_config_t *config);

/**
 * State a new problem. With the log utility it is a sequence of quadratic programmes, each around the answer of the last, until
 * nothing changes any more, and no more than taper_planning_t says. If one after the first has no usable answer, the last one's
 * is the plan, INACCURATE. The last usable answer, moved on in time, is the starting point; after a problem that was dropped or
 * had no usable answer, the solver starts from nothing. The solver does not know of it before the next slice.
 * `course` as in taper_horizon_build(). Cost: that of taper_horizon_build(), and O(entries of the matrices).
 */
void taper_planner_start(taper_planner_t *planner, const taper_snapshot_t *snapshot,
                         const taper_course_t *course);

/**
 * Work one slice of at most `iterations` on the present problem. The steps taken, and so the answer, do not depend on how a
 * solve is sliced.
 *
 * From TAPER_MIN_SLICE on, `iterations` is rounded down to a multiple of it, and factorisations come on top: up to three
 * where a problem begins, and one after every 50 iterations (log utility: 20). Below, a slice is short: it holds either at most `iterations`
 * (at least 1) or one factorisation at most, and a problem takes three to four slices more than its iterations need.
 *
 * @return the verdict; TAPER_VERDICT_SOLVING: call again. Cost: docs/budgets.md has it, of an iteration and of slices.
 */
taper_verdict_t taper_planner_run(taper_planner_t *planner, uint16_t iterations);

/** Whether the verdict lets the plan be used. */
bool taper_planner_is_usable(taper_verdict_t verdict);

/**
 * Planned power of connector `i` in step `t` of a usable plan [W]: finite, within 0..what the connector can carry.
 * Anything the solver may hold is safe to read: NaN reads as 0.
 */
int32_t taper_planner_power_W(const taper_planner_t *planner, uint8_t i, uint8_t t);

/** The same before rounding, in units of `horizon.base_W`. */
taper_real_t taper_planner_power(const taper_planner_t *planner, uint8_t i, uint8_t t);

/** Iterations spent so far on the present problem. */
uint16_t taper_planner_iterations(const taper_planner_t *planner);

#endif
