/* The planner's own promises. Whether its answers are right is asked of an independent solver: tests/planner. */
#include <math.h>
#include <string.h>

#include "scene.h"
#include "solver.h"
#include "taper/planner.h"
#include "taper/solvers.h"
#include "taper/stations.h"
#include "unity.h"

static taper_planner_t planner;
static taper_snapshot_t snapshot;
static taper_course_t course = {.phase_mA = {TAPER_NO_LIMIT, TAPER_NO_LIMIT, TAPER_NO_LIMIT}};
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
    const uint16_t slices[] = {10, 20, 37, 50, 120};
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
    poison_linear_cost(planner.solver);
    TEST_ASSERT_EQUAL(TAPER_VERDICT_NOT_FINITE, run_to_the_end(50));
    TEST_ASSERT_EQUAL(TAPER_VERDICT_SOLVED, solve(50));
}

static void test_a_solver_of_another_station_is_refused(void) {
    TEST_ASSERT_EQUAL(TAPER_ERR_CONFIG, taper_planner_init(&planner, taper_solvers[index_of("garage")],
                                                           taper_stations[index_of("hub")]));
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_the_answer_does_not_depend_on_the_slices);
    RUN_TEST(test_a_slice_does_no_more_than_it_may);
    RUN_TEST(test_a_usable_plan_keeps_every_limit_exactly);
    RUN_TEST(test_the_same_problem_again_is_solved_at_once);
    RUN_TEST(test_a_second_start_repeats_the_first_to_the_bit);
    RUN_TEST(test_a_vehicle_that_left_is_not_planned_for);
    RUN_TEST(test_a_contradiction_is_refused_and_the_next_problem_is_solved);
    RUN_TEST(test_values_that_are_not_finite_are_seen_and_forgotten);
    RUN_TEST(test_a_solver_of_another_station_is_refused);
    return UNITY_END();
}
