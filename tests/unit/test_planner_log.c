/* The planner by the log utility, on problems with answers that can be worked out by hand. Whether it is right on others is
   asked of an exact solver: tests/planner. */
#include <math.h>
#include <string.h>

#include "algebra_vector.h"
#include "scene.h"
#include "solver.h"
#include "taper/planner.h"
#include "taper/solvers.h"
#include "taper/stations.h"
#include "types.h"
#include "unity.h"

#define STEPS 24
/** Of the hub's connectors: 3 x 230 V x 32 A. */
#define BASE_W 22080
/** Powers come within this share of the strongest connector's. */
#define WITHIN 0.004

static taper_planner_t planner;
static taper_station_config_t station;
static taper_snapshot_t snapshot;
static taper_course_t course;
static const taper_solver_t *solver;

static void start(uint8_t outer_iterations, int32_t lambda_milli) {
    for (unsigned k = 0; k < taper_station_count; k++) {
        if (strcmp(taper_stations[k]->name, "hub") == 0) {
            station = *taper_stations[k];
            solver = taper_solvers[k];
        }
    }
    station.planning = (taper_planning_t){.objective = TAPER_OBJECTIVE_LOG_UTILITY,
                                          .outer_iterations = outer_iterations,
                                          .lambda_milli_per_kWh2 = lambda_milli};
    TEST_ASSERT_EQUAL(TAPER_OK, taper_planner_init(&planner, solver, &station));
}

/** A vehicle without a taper that takes 11 kW and stays beyond the horizon. */
static void plug_in(uint8_t i, int32_t need_Wh) {
    snapshot.demand[i] = scene_demand();
    snapshot.demand[i].session = (uint8_t)(i + 1);
    snapshot.demand[i].W_per_A = 690;
    snapshot.demand[i].peak_W = 11000;
    snapshot.demand[i].taper_W = 0;
    snapshot.demand[i].need_Wh = need_Wh;
    snapshot.demand[i].departs_in_s = 100000;
}

static void set_limit(int32_t limit_W) {
    for (unsigned t = 0; t < STEPS; t++) {
        course.limit_W[t] = limit_W;
    }
}

void setUp(void) {
    start(0, 100000);
    memset(&snapshot, 0, sizeof snapshot);
    snapshot.count = 8;
    for (unsigned line = 0; line < 3; line++) {
        course.phase_mA[line] = TAPER_NO_LIMIT;
    }
    set_limit(110000);
}
void tearDown(void) {}

/** Eight vehicles that differ in all that a vehicle can, at a limit that half of them could use up. */
static void set_scene(void) {
    for (uint8_t i = 0; i < 8; i++) {
        plug_in(i, 4000 + 1500 * i);
        snapshot.demand[i].taper_W = 1000 * i;
        snapshot.demand[i].stored_Wh = 6000 * i;
        snapshot.demand[i].departs_in_s = 3600 + 1800 * i;
    }
    set_limit(30000);
}

static taper_verdict_t solve(uint16_t slice) {
    taper_planner_start(&planner, &snapshot, &course);
    while (taper_planner_run(&planner, slice) == TAPER_VERDICT_SOLVING) {
    }
    return planner.verdict;
}

static double power_of(uint8_t i, uint8_t t) {
    return (double)taper_planner_power(&planner, i, t);
}

static void assert_power_W(double expected_W, uint8_t i, uint8_t t) {
    TEST_ASSERT_DOUBLE_WITHIN(WITHIN, expected_W / BASE_W, power_of(i, t));
}

static void read_plan(double *plan) {
    for (uint8_t i = 0; i < 8; i++) {
        for (uint8_t t = 0; t < STEPS; t++) {
            plan[i * STEPS + t] = power_of(i, t);
        }
    }
}

static void test_equal_vehicles_share_a_scarce_limit_equally(void) {
    for (uint8_t i = 0; i < 4; i++) {
        plug_in(i, 90000);
    }
    set_limit(20000);
    TEST_ASSERT_EQUAL(TAPER_VERDICT_SOLVED, solve(TAPER_MAX_ITERATIONS));
    for (uint8_t i = 0; i < 4; i++) {
        assert_power_W(5000, i, 0);
        assert_power_W(5000, i, STEPS - 1);
    }
}

static void test_what_one_cannot_take_goes_to_the_others_in_equal_parts(void) {
    for (uint8_t i = 0; i < 3; i++) {
        plug_in(i, 90000);
    }
    snapshot.demand[0].max_mA = 2900; /* 2001 W */
    set_limit(12000);
    TEST_ASSERT_EQUAL(TAPER_VERDICT_SOLVED, solve(TAPER_MAX_ITERATIONS));
    assert_power_W(2001, 0, 0);
    assert_power_W(4999.5, 1, 0);
    assert_power_W(4999.5, 2, 0);
}

static void test_with_power_to_spare_the_need_is_met_at_an_even_power(void) {
    plug_in(0, 6000);
    TEST_ASSERT_EQUAL(TAPER_VERDICT_SOLVED, solve(TAPER_MAX_ITERATIONS));
    for (uint8_t t = 0; t < STEPS; t++) {
        assert_power_W(1000, 0, t);
    }
}

static void test_the_logarithm_is_weighed_against_the_missing_energy(void) {
    /* One shared limit E for the horizon, in kWh a and E - a: 24 / a - 24 / (E - a) = 2 lambda ((E - a - n1) - (a - n0)). */
    start(10, 20); /* lambda 0.02 per kWh2: both terms count */
    plug_in(0, 20000);
    plug_in(1, 60000);
    set_limit(10000); /* 60 kWh: a solves 24 / a - 24 / (60 - a) = 0.04 (20 - 2 a) */
    TEST_ASSERT_EQUAL(TAPER_VERDICT_SOLVED, solve(TAPER_MAX_ITERATIONS));
    double low = 10, high = 20;
    for (int k = 0; k < 60; k++) {
        const double a = (low + high) / 2;
        const double excess = 24 / a - 24 / (60 - a) - 0.04 * (2 * a - 20);
        low = excess > 0 ? a : low;
        high = excess > 0 ? high : a;
    }
    assert_power_W(low / 6 * 1000, 0, 0);
    assert_power_W((60 - low) / 6 * 1000, 1, 0);
}

static void test_the_answer_does_not_depend_on_the_slices(void) {
    static double whole[8 * STEPS], sliced[8 * STEPS];
    set_scene();
    TEST_ASSERT_EQUAL(TAPER_VERDICT_SOLVED, solve(TAPER_MAX_ITERATIONS));
    const uint16_t iterations = taper_planner_iterations(&planner);
    read_plan(whole);
    const uint16_t slices[] = {10, 20, 37, 120, 1, 7};
    for (unsigned k = 0; k < sizeof slices / sizeof slices[0]; k++) {
        start(0, 100000);
        TEST_ASSERT_EQUAL(TAPER_VERDICT_SOLVED, solve(slices[k]));
        TEST_ASSERT_EQUAL_UINT16(iterations, taper_planner_iterations(&planner));
        read_plan(sliced);
        TEST_ASSERT_EQUAL_MEMORY(whole, sliced, sizeof whole);
    }
}

/** Quadratic programmes of one plan of the scene. */
static unsigned programmes(uint8_t outer_iterations) {
    start(outer_iterations, 100000);
    unsigned count = 1;
    taper_planner_start(&planner, &snapshot, &course);
    while (planner.verdict == TAPER_VERDICT_SOLVING) {
        count += planner.next == TAPER_WORK_EXPAND ? 1U : 0U;
        taper_planner_run(&planner, 1);
    }
    TEST_ASSERT_TRUE(taper_planner_is_usable(planner.verdict));
    return count;
}

static void test_there_are_as_many_programmes_as_are_of_use_and_no_more_than_were_asked_for(void) {
    set_scene();
    const unsigned useful = programmes(TAPER_MAX_OUTER_ITERATIONS);
    TEST_ASSERT_TRUE(useful > 2 && useful < TAPER_MAX_OUTER_ITERATIONS);
    for (uint8_t outer = 1; outer < TAPER_MAX_OUTER_ITERATIONS; outer++) {
        TEST_ASSERT_EQUAL_UINT(outer < useful ? outer : useful, programmes(outer));
    }
}

static void test_a_short_slice_holds_iterations_or_one_piece_of_other_work(void) {
    set_scene();
    taper_planner_start(&planner, &snapshot, &course);
    while (planner.verdict == TAPER_VERDICT_SOLVING) {
        const taper_work_t work = planner.next;
        const uint16_t before = taper_planner_iterations(&planner);
        taper_planner_run(&planner, 7);
        const int done = taper_planner_iterations(&planner) - before;
        TEST_ASSERT_TRUE(work == TAPER_WORK_ITERATIONS ? done >= 1 && done <= 7 : done == 0);
    }
    TEST_ASSERT_EQUAL(TAPER_VERDICT_SOLVED, planner.verdict);
}

static void test_every_further_programme_comes_closer(void) {
    static double exact[8 * STEPS], plan[8 * STEPS];
    set_scene();
    start(TAPER_MAX_OUTER_ITERATIONS, 100000);
    solve(TAPER_MAX_ITERATIONS);
    read_plan(exact);
    double error[3] = {0};
    const uint8_t outer[3] = {1, 2, 6};
    for (unsigned k = 0; k < 3; k++) {
        start(outer[k], 100000);
        solve(TAPER_MAX_ITERATIONS);
        read_plan(plan);
        for (unsigned j = 0; j < 8 * STEPS; j++) {
            error[k] = fmax(error[k], fabs(plan[j] - exact[j]));
        }
    }
    TEST_ASSERT_TRUE(error[0] > error[2] && error[1] > error[2]);
    TEST_ASSERT_TRUE(error[2] < WITHIN);
}

static void test_a_usable_plan_keeps_every_limit_exactly(void) {
    set_scene();
    TEST_ASSERT_EQUAL(TAPER_VERDICT_SOLVED, solve(TAPER_MAX_ITERATIONS));
    for (uint8_t t = 0; t < STEPS; t++) {
        double sum = 0;
        for (uint8_t i = 0; i < 8; i++) {
            const double power = power_of(i, t);
            const bool there = (int32_t)t * 900 < snapshot.demand[i].departs_in_s;
            TEST_ASSERT_TRUE(power >= 0 && power <= (there ? 11000.0 / BASE_W + 1e-6 : 0));
            sum += power;
        }
        TEST_ASSERT_TRUE(sum <= 30000.0 / BASE_W + 1e-5);
    }
}

static void test_steps_beyond_a_shorter_horizon_are_not_planned(void) {
    plug_in(0, 6000);
    station.planning.horizon_steps = 12;
    TEST_ASSERT_EQUAL(TAPER_VERDICT_SOLVED, solve(TAPER_MAX_ITERATIONS));
    for (uint8_t t = 0; t < STEPS; t++) {
        assert_power_W(t < 12 ? 2000 : 0, 0, t);
    }
    station.planning.objective = TAPER_OBJECTIVE_THROUGHPUT;
    plug_in(0, 90000);
    TEST_ASSERT_EQUAL(TAPER_OK, taper_planner_init(&planner, solver, &station));
    TEST_ASSERT_EQUAL(TAPER_VERDICT_SOLVED, solve(TAPER_MAX_ITERATIONS));
    assert_power_W(11000, 0, 11);
    assert_power_W(0, 0, 12);
}

static void test_nobody_and_no_power_are_plans_too(void) {
    TEST_ASSERT_EQUAL(TAPER_VERDICT_SOLVED, solve(TAPER_MAX_ITERATIONS));
    assert_power_W(0, 0, 0);
    set_scene();
    set_limit(0);
    TEST_ASSERT_EQUAL(TAPER_VERDICT_SOLVED, solve(TAPER_MAX_ITERATIONS));
    for (uint8_t i = 0; i < 8; i++) {
        assert_power_W(0, i, 0);
    }
}

static void test_a_pause_of_the_limit_is_planned_around(void) {
    plug_in(0, 6000);
    for (unsigned t = 6; t < 12; t++) {
        course.limit_W[t] = 0;
    }
    TEST_ASSERT_EQUAL(TAPER_VERDICT_SOLVED, solve(TAPER_MAX_ITERATIONS));
    assert_power_W(6000 * 4 / 18.0, 0, 0);
    assert_power_W(0, 0, 6);
    assert_power_W(6000 * 4 / 18.0, 0, 12);
}

static void test_nearly_full_batteries_do_not_spoil_the_plan_of_the_others(void) {
    set_scene();
    for (uint8_t i = 0; i < 4; i++) {
        snapshot.demand[i].taper_W = 11000;
        snapshot.demand[i].stored_Wh = snapshot.demand[i].capacity_Wh - 20 * i; /* 0 and some 10 W */
        snapshot.demand[i].need_Wh = 20;
    }
    TEST_ASSERT_TRUE(taper_planner_is_usable(solve(TAPER_MAX_ITERATIONS)));
    for (uint8_t i = 0; i < 4; i++) {
        assert_power_W(0, i, 0);
    }
    TEST_ASSERT_TRUE(power_of(7, 0) > 0.1);
}

static void test_the_next_problem_begins_where_the_last_one_ended(void) {
    set_scene();
    solve(TAPER_MAX_ITERATIONS);
    const uint16_t cold = taper_planner_iterations(&planner);
    const double before = power_of(7, 1);
    snapshot.now_ms += 900000;
    for (uint8_t i = 0; i < 8; i++) {
        const int32_t charged_Wh = (int32_t)(power_of(i, 0) * BASE_W / 4);
        snapshot.demand[i].need_Wh -= charged_Wh;
        snapshot.demand[i].stored_Wh += charged_Wh;
        snapshot.demand[i].departs_in_s -= 900;
    }
    TEST_ASSERT_EQUAL(TAPER_VERDICT_SOLVED, solve(TAPER_MAX_ITERATIONS));
    TEST_ASSERT_LESS_THAN_UINT16(cold, taper_planner_iterations(&planner));
    TEST_ASSERT_DOUBLE_WITHIN(0.02, before, power_of(7, 0)); /* the horizon is one step further */
}

static void test_a_vehicle_that_comes_later_has_its_share_and_one_that_left_none(void) {
    plug_in(0, 90000);
    plug_in(1, 90000);
    set_limit(12000);
    solve(TAPER_MAX_ITERATIONS);
    assert_power_W(6000, 0, 0);
    plug_in(2, 90000);
    snapshot.demand[0] = (taper_demand_t){0};
    TEST_ASSERT_EQUAL(TAPER_VERDICT_SOLVED, solve(TAPER_MAX_ITERATIONS));
    assert_power_W(0, 0, 0);
    assert_power_W(6000, 1, 0);
    assert_power_W(6000, 2, 0);
}

static void test_values_that_are_not_finite_are_seen_and_forgotten(void) {
    set_scene();
    taper_planner_start(&planner, &snapshot, &course);
    while (planner.iterations < 5) {
        taper_planner_run(&planner, 1);
    }
    OSQPVectorf_data(solver->osqp->work->x)[3] = (OSQPFloat)NAN;
    while (taper_planner_run(&planner, 20) == TAPER_VERDICT_SOLVING) {
    }
    TEST_ASSERT_EQUAL(TAPER_VERDICT_NOT_FINITE, planner.verdict);
    TEST_ASSERT_EQUAL(TAPER_VERDICT_SOLVED, solve(TAPER_MAX_ITERATIONS));
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_equal_vehicles_share_a_scarce_limit_equally);
    RUN_TEST(test_what_one_cannot_take_goes_to_the_others_in_equal_parts);
    RUN_TEST(test_with_power_to_spare_the_need_is_met_at_an_even_power);
    RUN_TEST(test_the_logarithm_is_weighed_against_the_missing_energy);
    RUN_TEST(test_the_answer_does_not_depend_on_the_slices);
    RUN_TEST(test_there_are_as_many_programmes_as_are_of_use_and_no_more_than_were_asked_for);
    RUN_TEST(test_a_short_slice_holds_iterations_or_one_piece_of_other_work);
    RUN_TEST(test_every_further_programme_comes_closer);
    RUN_TEST(test_a_usable_plan_keeps_every_limit_exactly);
    RUN_TEST(test_steps_beyond_a_shorter_horizon_are_not_planned);
    RUN_TEST(test_nobody_and_no_power_are_plans_too);
    RUN_TEST(test_a_pause_of_the_limit_is_planned_around);
    RUN_TEST(test_nearly_full_batteries_do_not_spoil_the_plan_of_the_others);
    RUN_TEST(test_the_next_problem_begins_where_the_last_one_ended);
    RUN_TEST(test_a_vehicle_that_comes_later_has_its_share_and_one_that_left_none);
    RUN_TEST(test_values_that_are_not_finite_are_seen_and_forgotten);
    return UNITY_END();
}
