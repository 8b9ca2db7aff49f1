/* The planner's own promises. Whether its answers are right is asked of an independent solver: tests/planner. */
#include <math.h>
#include <string.h>

#include "algebra_vector.h"
#include "matrices.h"
#include "scene.h"
#include "solver.h"
#include "taper/planner.h"
#include "taper/real_math.h"
#include "taper/solvers.h"
#include "taper/stations.h"
#include "types.h"
#include "unity.h"

static taper_planner_t planner;
static taper_snapshot_t snapshot;
static taper_course_t course;
static OSQPFloat poisoned[TAPER_MAX_VARIABLES];

static unsigned index_of(const char *name) {
    for (unsigned k = 0; k < taper_station_count; k++) {
        if (strcmp(taper_stations[k]->name, name) == 0) {
            return k;
        }
    }
    TEST_FAIL_MESSAGE(name);
    return 0;
}

static void start_hub(void) {
    const unsigned hub = index_of("hub");
    TEST_ASSERT_EQUAL(TAPER_OK, taper_planner_init(&planner, taper_solvers[hub], taper_stations[hub]));
}

/** Eight vehicles that differ, at a limit that half of them could use up. */
static void set_scene(void) {
    memset(&snapshot, 0, sizeof snapshot);
    for (unsigned line = 0; line < 3; line++) {
        course.phase_mA[line] = TAPER_NO_LIMIT;
    }
    snapshot.count = 8;
    for (uint8_t i = 0; i < 8; i++) {
        taper_demand_t *demand = &snapshot.demand[i];
        *demand = scene_demand();
        demand->session = (uint8_t)(i + 1);
        demand->W_per_A = 690;
        demand->peak_W = 11000;
        demand->taper_W = 1000 * i;
        demand->stored_Wh = 6000 * i;
        demand->need_Wh = 4000 + 1500 * i;
        demand->departs_in_s = 3600 + 1800 * i;
    }
    for (int t = 0; t < 24; t++) {
        course.limit_W[t] = t < 8 ? 44000 : 22000;
    }
}

void setUp(void) {
    start_hub();
    set_scene();
}
void tearDown(void) {}

static taper_verdict_t run_to_the_end(uint16_t slice) {
    taper_verdict_t verdict = TAPER_VERDICT_SOLVING;
    while (verdict == TAPER_VERDICT_SOLVING) {
        verdict = taper_planner_run(&planner, slice);
    }
    return verdict;
}

static taper_verdict_t solve(uint16_t slice) {
    taper_planner_start(&planner, &snapshot, &course);
    return run_to_the_end(slice);
}

static void read_plan(taper_real_t *plan) {
    for (uint8_t i = 0; i < 8; i++) {
        for (uint8_t t = 0; t < 24; t++) {
            plan[i * 24 + t] = taper_planner_power(&planner, i, t);
        }
    }
}

/** A NaN in the solver's memory, as a bit flip would leave it. */
static void poison_linear_cost(const taper_solver_t *solver) {
    for (unsigned v = 0; v < TAPER_MAX_VARIABLES; v++) {
        poisoned[v] = (OSQPFloat)NAN;
    }
    TEST_ASSERT_EQUAL(0, osqp_update_data_vec(solver->osqp, poisoned, NULL, NULL));
}

static void test_the_answer_does_not_depend_on_the_slices(void) {
    static taper_real_t whole[8 * 24], sliced[8 * 24];
    TEST_ASSERT_EQUAL(TAPER_VERDICT_SOLVED, solve(TAPER_MAX_ITERATIONS));
    const uint16_t iterations = taper_planner_iterations(&planner);
    TEST_ASSERT_GREATER_THAN_UINT16(50, iterations); /* long enough to change the penalty on the way */
    read_plan(whole);
    const uint16_t slices[] = {10, 20, 37, 50, 120, 1, 3, 7, 9};
    for (unsigned k = 0; k < sizeof slices / sizeof slices[0]; k++) {
        start_hub();
        TEST_ASSERT_EQUAL(TAPER_VERDICT_SOLVED, solve(slices[k]));
        TEST_ASSERT_EQUAL_UINT16(iterations, taper_planner_iterations(&planner));
        read_plan(sliced);
        TEST_ASSERT_EQUAL_MEMORY(whole, sliced, sizeof whole);
    }
}

static void test_a_slice_does_no_more_than_it_may(void) {
    taper_planner_start(&planner, &snapshot, &course);
    TEST_ASSERT_EQUAL(TAPER_VERDICT_SOLVING, taper_planner_run(&planner, 20));
    TEST_ASSERT_EQUAL_UINT16(20, taper_planner_iterations(&planner));
    TEST_ASSERT_EQUAL(TAPER_VERDICT_SOLVING, taper_planner_run(&planner, 29)); /* whole tens only */
    TEST_ASSERT_EQUAL_UINT16(40, taper_planner_iterations(&planner));
}

static void test_a_short_slice_holds_iterations_or_one_piece_of_other_work(void) {
    start_hub();
    taper_planner_start(&planner, &snapshot, &course);
    unsigned pieces[TAPER_WORK_PENALTY + 1] = {0};
    while (planner.verdict == TAPER_VERDICT_SOLVING) {
        if (planner.iterations == 49) { /* a penalty that the planner will want to change */
            osqp_update_rho(planner.solver->osqp, 100);
        }
        const taper_work_t work = planner.next;
        const uint16_t before = planner.iterations;
        taper_planner_run(&planner, 7);
        pieces[work]++;
        const uint16_t done = (uint16_t)(planner.iterations - before);
        TEST_ASSERT_TRUE(work == TAPER_WORK_ITERATIONS ? done >= 1 && done <= 7 : done == 0);
    }
    TEST_ASSERT_EQUAL(TAPER_VERDICT_SOLVED, planner.verdict);
    TEST_ASSERT_EQUAL_UINT(1, pieces[TAPER_WORK_RESET]);
    TEST_ASSERT_EQUAL_UINT(1, pieces[TAPER_WORK_MATRICES]);
    TEST_ASSERT_EQUAL_UINT(1, pieces[TAPER_WORK_VECTORS]);
    TEST_ASSERT_GREATER_THAN_UINT(0, pieces[TAPER_WORK_PENALTY]);
}

static void test_a_new_problem_takes_the_place_of_one_that_is_only_half_handed_over(void) {
    static taper_real_t after[8 * 24], fresh[8 * 24];
    start_hub();
    taper_planner_start(&planner, &snapshot, &course);
    taper_planner_run(&planner, 1);
    course.limit_W[0] = 33000;
    taper_planner_start(&planner, &snapshot, &course);
    TEST_ASSERT_EQUAL(TAPER_VERDICT_SOLVED, run_to_the_end(1));
    read_plan(after);
    start_hub();
    TEST_ASSERT_EQUAL(TAPER_VERDICT_SOLVED, solve(50));
    read_plan(fresh);
    TEST_ASSERT_EQUAL_MEMORY(fresh, after, sizeof fresh);
}

/** Solve with a tolerance that is `part` of the residuals that 500 iterations leave. */
static taper_verdict_t solve_to_a_part_of_what_is_left(OSQPFloat part, uint16_t slice) {
    OSQPSolver *osqp = planner.solver->osqp;
    start_hub();
    osqp->settings->eps_abs = (OSQPFloat)1e-30;
    osqp->settings->eps_rel = 0;
    TEST_ASSERT_EQUAL(TAPER_VERDICT_LATE, solve(slice));
    const OSQPFloat left = taper_real_max(taper_real_max(osqp->info->prim_res, osqp->info->dual_res),
                                          (OSQPFloat)fabs((double)osqp->info->duality_gap));
    start_hub();
    osqp->settings->eps_abs = left * part;
    osqp->settings->eps_rel = 0;
    return solve(slice);
}

static void test_what_is_nearly_there_at_the_last_iteration_is_inaccurate_however_sliced(void) {
    const uint16_t slices[] = {TAPER_MAX_ITERATIONS, 10, 9};
    for (unsigned k = 0; k < 3; k++) {
        TEST_ASSERT_EQUAL(TAPER_VERDICT_INACCURATE,
                          solve_to_a_part_of_what_is_left((OSQPFloat)0.125, slices[k]));
        TEST_ASSERT_EQUAL_UINT16(TAPER_MAX_ITERATIONS, taper_planner_iterations(&planner));
        TEST_ASSERT_EQUAL(TAPER_VERDICT_LATE, solve_to_a_part_of_what_is_left((OSQPFloat)0.0625, slices[k]));
    }
}

static void test_a_usable_plan_keeps_every_limit_exactly(void) {
    TEST_ASSERT_EQUAL(TAPER_VERDICT_SOLVED, solve(TAPER_MAX_ITERATIONS));
    const double base_W = (double)planner.horizon.base_W;
    for (uint8_t t = 0; t < 24; t++) {
        double site_W = 0;
        for (uint8_t i = 0; i < 8; i++) {
            const double power_W = (double)taper_planner_power(&planner, i, t) * base_W;
            TEST_ASSERT_TRUE(power_W >= 0 && power_W <= 11000.5);
            site_W += power_W;
        }
        TEST_ASSERT_TRUE(site_W <= course.limit_W[t] + 0.5);
    }
}

static void test_the_same_problem_again_is_solved_at_once(void) {
    TEST_ASSERT_EQUAL(TAPER_VERDICT_SOLVED, solve(TAPER_MAX_ITERATIONS));
    TEST_ASSERT_EQUAL(TAPER_VERDICT_SOLVED, solve(TAPER_MAX_ITERATIONS));
    TEST_ASSERT_LESS_OR_EQUAL_UINT16(50, taper_planner_iterations(&planner));
}

static void test_a_second_start_repeats_the_first_to_the_bit(void) {
    static taper_real_t first[8 * 24], second[8 * 24];
    TEST_ASSERT_EQUAL(TAPER_VERDICT_SOLVED, solve(50));
    const uint16_t iterations = taper_planner_iterations(&planner);
    read_plan(first);
    start_hub();
    TEST_ASSERT_EQUAL(TAPER_VERDICT_SOLVED, solve(50));
    TEST_ASSERT_EQUAL_UINT16(iterations, taper_planner_iterations(&planner));
    read_plan(second);
    TEST_ASSERT_EQUAL_MEMORY(first, second, sizeof first);
}

static void test_a_vehicle_that_left_is_not_planned_for(void) {
    TEST_ASSERT_EQUAL(TAPER_VERDICT_SOLVED, solve(50));
    TEST_ASSERT_GREATER_THAN_INT32(0, taper_planner_power_W(&planner, 0, 0));
    snapshot.demand[0].active = false;
    snapshot.now_ms += 900000;
    TEST_ASSERT_EQUAL(TAPER_VERDICT_SOLVED, solve(50));
    for (uint8_t t = 0; t < 24; t++) {
        TEST_ASSERT_EQUAL_INT32(0, taper_planner_power_W(&planner, 0, t));
    }
}

static void test_a_contradiction_is_refused_and_the_next_problem_is_solved(void) {
    course.limit_W[0] = -1; /* an upper bound below the lower one */
    TEST_ASSERT_EQUAL(TAPER_VERDICT_REFUSED, solve(50));
    TEST_ASSERT_FALSE(taper_planner_is_usable(planner.verdict));
    set_scene();
    TEST_ASSERT_EQUAL(TAPER_VERDICT_SOLVED, solve(50));
}

static void test_values_that_are_not_finite_are_seen_and_forgotten(void) {
    taper_planner_start(&planner, &snapshot, &course);
    TEST_ASSERT_EQUAL(TAPER_VERDICT_SOLVING, taper_planner_run(&planner, TAPER_MIN_SLICE));
    poison_linear_cost(planner.solver);
    TEST_ASSERT_EQUAL(TAPER_VERDICT_NOT_FINITE, run_to_the_end(50));
    TEST_ASSERT_EQUAL(TAPER_VERDICT_SOLVED, solve(50));
}

/* ---- What a bit flip may do to the solver's memory ---- */

/** Begin a problem and let the solver come near its answer. */
static void work_on_the_scene(void) {
    start_hub();
    taper_planner_start(&planner, &snapshot, &course);
    TEST_ASSERT_EQUAL(TAPER_VERDICT_SOLVING, taper_planner_run(&planner, 20));
}

/** Whatever happened to the solver, the next problem is solved as by a fresh one. */
static void assert_recovers(void) {
    static taper_real_t after[8 * 24], fresh[8 * 24];
    TEST_ASSERT_EQUAL(TAPER_VERDICT_SOLVED, solve(50));
    read_plan(after);
    start_hub();
    TEST_ASSERT_EQUAL(TAPER_VERDICT_SOLVED, solve(50));
    read_plan(fresh);
    TEST_ASSERT_EQUAL_MEMORY(fresh, after, sizeof fresh);
}

static void test_weights_that_fell_in_the_solvers_memory_are_seen_by_the_rows_that_do_not_hold(void) {
    work_on_the_scene();
    const taper_solver_t *solver = planner.solver;
    for (OSQPInt k = 0; k < solver->a_count; k++) {
        solver->a_values[k] *= (OSQPFloat)0.25;
    }
    TEST_ASSERT_EQUAL(0, osqp_update_data_mat(solver->osqp, NULL, NULL, 0, solver->a_values, NULL, 0));
    TEST_ASSERT_EQUAL(TAPER_VERDICT_RESIDUAL, run_to_the_end(50));
    TEST_ASSERT_FALSE(taper_planner_is_usable(planner.verdict));
    assert_recovers();
}

static void test_a_limit_that_was_lifted_in_the_solvers_memory_is_seen_by_the_rows_that_do_not_hold(void) {
    work_on_the_scene();
    OSQPFloat *upper = OSQPVectorf_data(planner.solver->osqp->work->data->u);
    const size_t first = taper_first_sum_row(planner.horizon.config);
    for (size_t row = first; row < (size_t)planner.solver->rows; row++) {
        upper[row] *= 2;
    }
    TEST_ASSERT_EQUAL(TAPER_VERDICT_RESIDUAL, run_to_the_end(50));
    assert_recovers();
}

static void test_bounds_that_are_infinite_or_not_a_number_give_no_plan(void) {
    const OSQPFloat wrong[] = {(OSQPFloat)INFINITY, (OSQPFloat)NAN, -(OSQPFloat)INFINITY};
    const taper_verdict_t verdict[] = {TAPER_VERDICT_LATE, TAPER_VERDICT_NOT_FINITE,
                                       TAPER_VERDICT_NOT_FINITE};
    for (unsigned k = 0; k < 3; k++) {
        work_on_the_scene();
        OSQPFloat *upper = OSQPVectorf_data(planner.solver->osqp->work->data->u);
        const size_t first = taper_first_sum_row(planner.horizon.config);
        for (size_t row = first; row < (size_t)planner.solver->rows; row++) {
            upper[row] = wrong[k];
        }
        TEST_ASSERT_EQUAL(verdict[k], run_to_the_end(50));
        assert_recovers();
    }
}

static void test_iterates_that_are_not_finite_give_no_plan(void) {
    const OSQPFloat wrong[] = {(OSQPFloat)NAN, (OSQPFloat)INFINITY};
    for (unsigned k = 0; k < 2; k++) {
        work_on_the_scene();
        OSQPVectorf_data(planner.solver->osqp->work->x)[7] = wrong[k];
        TEST_ASSERT_EQUAL(TAPER_VERDICT_NOT_FINITE, run_to_the_end(50));
        assert_recovers();
        work_on_the_scene();
        OSQPVectorf_data(planner.solver->osqp->work->y)[7] = wrong[k];
        TEST_ASSERT_EQUAL(TAPER_VERDICT_NOT_FINITE, run_to_the_end(50));
        assert_recovers();
    }
}

static void test_iterates_that_are_finite_but_wrong_lead_to_the_answer_or_to_none(void) {
    work_on_the_scene();
    for (OSQPInt v = 0; v < planner.solver->variables; v++) {
        OSQPVectorf_data(planner.solver->osqp->work->x)[v] = 100;
    }
    for (OSQPInt row = 0; row < planner.solver->rows; row++) {
        OSQPVectorf_data(planner.solver->osqp->work->y)[row] = -100;
    }
    const taper_verdict_t verdict = run_to_the_end(50);
    TEST_ASSERT_TRUE(verdict == TAPER_VERDICT_SOLVED || verdict == TAPER_VERDICT_LATE);
    set_scene();
    TEST_ASSERT_EQUAL(TAPER_VERDICT_SOLVED, solve(50));
}

static void test_a_hessian_that_is_not_finite_is_written_anew(void) {
    work_on_the_scene();
    const taper_solver_t *solver = planner.solver;
    for (OSQPInt k = 0; k < solver->p_count; k++) {
        solver->p_values[k] = (OSQPFloat)NAN;
    }
    (void)osqp_update_data_mat(solver->osqp, solver->p_values, NULL, 0, NULL, NULL, 0);
    TEST_ASSERT_FALSE(taper_planner_is_usable(run_to_the_end(50)));
    assert_recovers();
}

static void test_a_problem_of_our_own_that_is_not_a_number_gives_no_plan(void) {
    work_on_the_scene();
    planner.horizon.upper[taper_first_sum_row(planner.horizon.config)] = (taper_real_t)NAN;
    TEST_ASSERT_EQUAL(TAPER_VERDICT_RESIDUAL, run_to_the_end(50));
    assert_recovers();
}

/* ---- The rows of phases ---- */

static void assert_phase_currents_within(const double *limit_A) {
    const double base_W = (double)planner.horizon.base_W;
    for (uint8_t t = 0; t < 24; t++) {
        double current_A[3] = {0};
        for (uint8_t i = 0; i < 8; i++) {
            const taper_demand_t *demand = &snapshot.demand[i];
            const double drawn_A = (double)taper_planner_power(&planner, i, t) * base_W / demand->W_per_A;
            for (unsigned line = 0; line < 3; line++) {
                const bool uses = demand->booking.phases == 0 || (demand->booking.phases >> line & 1u) != 0;
                current_A[line] += uses ? drawn_A : 0;
            }
        }
        for (unsigned line = 0; line < 3; line++) {
            TEST_ASSERT_TRUE(current_A[line] <= limit_A[line] + 0.001);
        }
    }
}

/** Vehicles 0 to 2 use one conductor each, all on L1. */
static void put_three_on_one_phase(void) {
    for (uint8_t i = 0; i < 3; i++) {
        snapshot.demand[i].W_per_A = 230;
        snapshot.demand[i].booking = (taper_booking_t){.W_per_A = 230, .permille = 1000, .phases = 1};
    }
}

static void test_a_usable_plan_keeps_what_other_load_leaves_of_each_phase(void) {
    course.phase_mA[0] = 40000;
    course.phase_mA[2] = 25000;
    put_three_on_one_phase();
    TEST_ASSERT_EQUAL(TAPER_VERDICT_SOLVED, solve(TAPER_MAX_ITERATIONS));
    assert_phase_currents_within((double[]){40, 160, 25});
}

static void test_a_vehicle_that_turns_out_to_use_one_phase_changes_the_rows(void) {
    for (int t = 0; t < 24; t++) {
        course.limit_W[t] = 110000;
    }
    course.phase_mA[0] = 60000;
    TEST_ASSERT_EQUAL(TAPER_VERDICT_SOLVED, solve(TAPER_MAX_ITERATIONS));
    put_three_on_one_phase();
    TEST_ASSERT_EQUAL(TAPER_VERDICT_SOLVED, solve(TAPER_MAX_ITERATIONS));
    assert_phase_currents_within((double[]){60, 160, 160});
}

static void test_a_phase_without_room_lets_nobody_charge_who_needs_it(void) {
    course.phase_mA[0] = 0;
    TEST_ASSERT_EQUAL(TAPER_VERDICT_SOLVED, solve(TAPER_MAX_ITERATIONS));
    for (uint8_t i = 0; i < 8; i++) {
        TEST_ASSERT_EQUAL_INT32(0, taper_planner_power_W(&planner, i, 0));
    }
}

/* ---- One pattern, stated by the generator and by the firmware ---- */

/** Greatest difference between a value that the generator wrote and ours; -1: not the same number of them. */
static double pattern_error[16];

/** To be called before any planner is tied to a solver: that writes over the generator's values. */
static void compare_patterns(void) {
    static OSQPFloat ours[400000];
    static taper_horizon_t horizon;
    for (unsigned k = 0; k < taper_station_count; k++) {
        const taper_solver_t *solver = taper_solvers[k];
        taper_solver_t copy = *solver;
        copy.a_values = ours;
        taper_horizon_shape(&horizon, taper_stations[k]);
        for (uint8_t i = 0; i < taper_stations[k]->connector_count; i++) {
            horizon.taper_keep[0][i] = (taper_real_t)0.97; /* the generator's example */
        }
        const bool fits = solver->a_count <= (OSQPInt)(sizeof ours / sizeof ours[0]) &&
                          taper_write_constraints(&copy, &horizon).count == solver->a_count;
        pattern_error[k] = fits ? 0 : -1;
        for (OSQPInt at = 0; fits && at < solver->a_count; at++) {
            pattern_error[k] = fmax(pattern_error[k], fabs((double)ours[at] - (double)solver->a_values[at]));
        }
    }
}

static void test_every_stations_rows_are_those_that_its_solver_was_generated_for(void) {
    TEST_ASSERT_TRUE(taper_station_count <= sizeof pattern_error / sizeof pattern_error[0]);
    for (unsigned k = 0; k < taper_station_count; k++) {
        TEST_ASSERT_TRUE_MESSAGE(pattern_error[k] >= 0 && pattern_error[k] < 1e-6, taper_stations[k]->name);
    }
}

static void test_a_solver_of_another_station_is_refused(void) {
    TEST_ASSERT_EQUAL(TAPER_ERR_CONFIG, taper_planner_init(&planner, taper_solvers[index_of("garage")],
                                                           taper_stations[index_of("hub")]));
}

int main(void) {
    compare_patterns();
    UNITY_BEGIN();
    RUN_TEST(test_the_answer_does_not_depend_on_the_slices);
    RUN_TEST(test_a_slice_does_no_more_than_it_may);
    RUN_TEST(test_a_short_slice_holds_iterations_or_one_piece_of_other_work);
    RUN_TEST(test_a_new_problem_takes_the_place_of_one_that_is_only_half_handed_over);
    RUN_TEST(test_what_is_nearly_there_at_the_last_iteration_is_inaccurate_however_sliced);
    RUN_TEST(test_a_usable_plan_keeps_every_limit_exactly);
    RUN_TEST(test_the_same_problem_again_is_solved_at_once);
    RUN_TEST(test_a_second_start_repeats_the_first_to_the_bit);
    RUN_TEST(test_a_vehicle_that_left_is_not_planned_for);
    RUN_TEST(test_a_contradiction_is_refused_and_the_next_problem_is_solved);
    RUN_TEST(test_values_that_are_not_finite_are_seen_and_forgotten);
    RUN_TEST(test_weights_that_fell_in_the_solvers_memory_are_seen_by_the_rows_that_do_not_hold);
    RUN_TEST(test_a_limit_that_was_lifted_in_the_solvers_memory_is_seen_by_the_rows_that_do_not_hold);
    RUN_TEST(test_bounds_that_are_infinite_or_not_a_number_give_no_plan);
    RUN_TEST(test_iterates_that_are_not_finite_give_no_plan);
    RUN_TEST(test_iterates_that_are_finite_but_wrong_lead_to_the_answer_or_to_none);
    RUN_TEST(test_a_hessian_that_is_not_finite_is_written_anew);
    RUN_TEST(test_a_problem_of_our_own_that_is_not_a_number_gives_no_plan);
    RUN_TEST(test_a_usable_plan_keeps_what_other_load_leaves_of_each_phase);
    RUN_TEST(test_a_vehicle_that_turns_out_to_use_one_phase_changes_the_rows);
    RUN_TEST(test_a_phase_without_room_lets_nobody_charge_who_needs_it);
    RUN_TEST(test_every_stations_rows_are_those_that_its_solver_was_generated_for);
    RUN_TEST(test_a_solver_of_another_station_is_refused);
    return UNITY_END();
}
