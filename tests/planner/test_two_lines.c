/* Horizon and planner of a station that plans with two lines of the taper, against numbers worked out by hand. */
#include <math.h>
#include <string.h>

#include "matrices.h"
#include "project.h"
#include "residual.h"
#include "taper/planner.h"
#include "taper/solvers.h"
#include "taper/stations.h"
#include "unity.h"

#define BASE_W 150000.0 /* 375 A x 400 V */
#define STEP_H (300.0 / 3600.0)
#define STEPS  16

static const taper_station_config_t *config;
static const taper_solver_t *solver;
static taper_planner_t planner;
static taper_horizon_t horizon;
static taper_snapshot_t snapshot;
static taper_course_t course;
static double pattern_error; /* of the values that the generator wrote */

/** 60 kWh at SOC 0.25; flat 120 kW, then 160 - 80 SOC (from 0.5), then 360 - 340 SOC (from 0.769) to 20 kW. */
static taper_demand_t three_pieces(void) {
    return (taper_demand_t){.active = true,
                            .session = 3,
                            .conductors = 1,
                            .stored_Wh = 15000,
                            .capacity_Wh = 60000,
                            .need_Wh = 45000,
                            .peak_W = 160000,
                            .taper_W = 80000,
                            .second_peak_W = 360000,
                            .second_taper_W = 340000,
                            .max_mA = 300000,
                            .W_per_A = 400,
                            .departs_in_s = 7200};
}

void setUp(void) {
    snapshot = (taper_snapshot_t){.count = config->connector_count};
    course = (taper_course_t){.phase_mA = {TAPER_NO_LIMIT, TAPER_NO_LIMIT, TAPER_NO_LIMIT}};
    for (unsigned t = 0; t < config->steps; t++) {
        course.limit_W[t] = 400000;
    }
    TEST_ASSERT_EQUAL(TAPER_OK, taper_planner_init(&planner, solver, config));
}

void tearDown(void) {}

static void build(void) {
    taper_horizon_build(&horizon, config, &snapshot, &course);
}

static void assert_near(double expected, taper_real_t value) {
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, expected, (double)value);
}

static void test_the_solver_was_generated_for_these_rows(void) {
    TEST_ASSERT_EQUAL_UINT(2, taper_lines_planned(config));
    TEST_ASSERT_EQUAL_INT(6 * (16 + 15 + 15 + 1) + 2 * 16, solver->rows);
    TEST_ASSERT_EQUAL_UINT(6 * (16 + 15 + 15), taper_first_target_row(config));
    TEST_ASSERT_EQUAL_UINT(6 * (16 + 15 + 15 + 1), taper_first_sum_row(config));
    TEST_ASSERT_TRUE(pattern_error >= 0 && pattern_error < 1e-6);
}

static void test_a_description_with_one_line_does_not_fit_this_solver(void) {
    taper_station_config_t one = *config;
    one.planning.taper_lines = 1;
    TEST_ASSERT_EQUAL(TAPER_ERR_CONFIG, taper_planner_init(&planner, solver, &one));
}

static void test_each_line_has_its_rows(void) {
    snapshot.demand[2] = three_pieces();
    build();
    const size_t first = taper_first_taper_row(config, 0, 2), second = taper_first_taper_row(config, 1, 2);
    TEST_ASSERT_EQUAL_UINT(6 * 16 + 2 * 15, first);
    TEST_ASSERT_EQUAL_UINT(6 * 16 + 6 * 15 + 2 * 15, second);
    assert_near(120000 / BASE_W, horizon.upper[2 * STEPS]); /* flat, in the running step too */
    for (unsigned t = 0; t < 15; t++) {
        assert_near(140000 / BASE_W, horizon.upper[first + t]);  /* 160 - 80/4 */
        assert_near(275000 / BASE_W, horizon.upper[second + t]); /* 360 - 340/4 */
    }
    assert_near(1 - 80.0 / 60 * STEP_H, horizon.taper_keep[0][2]);
    assert_near(1 - 340.0 / 60 * STEP_H, horizon.taper_keep[1][2]);
}

static void test_the_running_step_keeps_to_the_lower_line(void) {
    snapshot.demand[0] = three_pieces();
    snapshot.demand[0].stored_Wh = 54000; /* 0.9: 88 and 54 kW */
    build();
    assert_near(54000 / BASE_W, horizon.upper[0]);
}

static void test_without_a_second_line_its_rows_say_nothing(void) {
    snapshot.demand[0] = three_pieces();
    snapshot.demand[0].second_peak_W = 0;
    build();
    for (uint8_t i = 0; i < 2; i++) { /* nobody is on connector 1 */
        const size_t row = taper_first_taper_row(config, 1, i);
        for (unsigned t = 0; t < 15; t++) {
            TEST_ASSERT_TRUE(horizon.upper[row + t] >= TAPER_REAL_UNBOUNDED);
            TEST_ASSERT_TRUE(horizon.lower[row + t] <= -TAPER_REAL_UNBOUNDED);
        }
        assert_near(1, horizon.taper_keep[1][i]);
    }
}

static double least_line_W(double stored_Wh) {
    const double soc = stored_Wh / 60000;
    return fmin(120000, fmin(160000 - 80000 * soc, 360000 - 340000 * soc));
}

static void test_alone_a_vehicle_is_planned_along_its_three_pieces(void) {
    snapshot.demand[0] = three_pieces();
    taper_planner_start(&planner, &snapshot, &course);
    TEST_ASSERT_EQUAL(TAPER_VERDICT_SOLVED, taper_planner_run(&planner, TAPER_MAX_ITERATIONS));
    double stored_Wh = 15000;
    unsigned on_the_second = 0;
    for (uint8_t t = 0; t < 8; t++) {
        const double exact_W = fmin(least_line_W(stored_Wh), (60000 - stored_Wh) / STEP_H);
        TEST_ASSERT_DOUBLE_WITHIN(TAPER_REAL_IS_DOUBLE ? 150 : 1500, exact_W,
                                  (double)taper_planner_power(&planner, 0, t) * BASE_W);
        on_the_second += exact_W < 160000 - 80000 * stored_Wh / 60000 - 1 && exact_W < 119999 ? 1U : 0U;
        stored_Wh += exact_W * STEP_H;
    }
    TEST_ASSERT_GREATER_OR_EQUAL_UINT(3, on_the_second);
}

static void test_the_next_plan_begins_where_the_last_one_ended(void) {
    for (uint8_t i = 0; i < 4; i++) {
        snapshot.demand[i] = three_pieces();
        snapshot.demand[i].stored_Wh += 6000 * i;
        snapshot.demand[i].need_Wh -= 6000 * i;
    }
    taper_planner_start(&planner, &snapshot, &course);
    TEST_ASSERT_EQUAL(TAPER_VERDICT_SOLVED, taper_planner_run(&planner, TAPER_MAX_ITERATIONS));
    const uint16_t cold = taper_planner_iterations(&planner);
    taper_planner_start(&planner, &snapshot, &course);
    TEST_ASSERT_EQUAL(TAPER_VERDICT_SOLVED, taper_planner_run(&planner, TAPER_MAX_ITERATIONS));
    TEST_ASSERT_LESS_THAN_UINT(cold, taper_planner_iterations(&planner));
}

static void test_projection_keeps_to_both_lines_and_the_residual_sees_them(void) {
    static OSQPFloat x[6 * STEPS];
    snapshot.demand[0] = three_pieces();
    snapshot.demand[0].stored_Wh = 48000; /* 0.8: 96 and 88 kW */
    snapshot.demand[0].need_Wh = 12000;
    build();
    memset(x, 0, sizeof x);
    for (unsigned t = 0; t < STEPS; t++) {
        x[t] = (OSQPFloat)(t + 1);
    }
    taper_project(&horizon, x);
    double stored_Wh = 48000;
    for (unsigned t = 0; t < STEPS; t++) {
        const double power_W = (double)(t > 0 ? x[t] - x[t - 1] : x[0]) * BASE_W;
        TEST_ASSERT_TRUE(power_W <= least_line_W(stored_Wh) + 1);
        stored_Wh += power_W * STEP_H;
    }
    TEST_ASSERT_TRUE(taper_residual(&horizon, x).worst < (taper_real_t)1e-5);
    horizon.upper[taper_first_taper_row(config, 1, 0)] -=
        (taper_real_t)0.1; /* now step 1 has more than the second line */
    TEST_ASSERT_TRUE(taper_residual(&horizon, x).worst > (taper_real_t)0.09);
}

/** To be called before any planner is tied to the solver: that writes over the generator's values. */
static void compare_patterns(void) {
    static OSQPFloat ours[20000];
    taper_solver_t copy = *solver;
    copy.a_values = ours;
    taper_horizon_shape(&horizon, config);
    for (uint8_t i = 0; i < config->connector_count; i++) {
        horizon.taper_keep[0][i] = horizon.taper_keep[1][i] =
            (taper_real_t)0.97; /* the generator's example */
    }
    const bool fits = solver->a_count <= (OSQPInt)(sizeof ours / sizeof ours[0]) &&
                      taper_write_constraints(&copy, &horizon).count == solver->a_count;
    pattern_error = fits ? 0 : -1;
    for (OSQPInt at = 0; fits && at < solver->a_count; at++) {
        pattern_error = fmax(pattern_error, fabs((double)ours[at] - (double)solver->a_values[at]));
    }
}

int main(void) {
    for (unsigned k = 0; k < taper_station_count; k++) {
        if (strcmp(taper_stations[k]->name, "tapered") == 0) {
            config = taper_stations[k];
            solver = taper_solvers[k];
        }
    }
    compare_patterns();
    UNITY_BEGIN();
    RUN_TEST(test_the_solver_was_generated_for_these_rows);
    RUN_TEST(test_a_description_with_one_line_does_not_fit_this_solver);
    RUN_TEST(test_each_line_has_its_rows);
    RUN_TEST(test_the_running_step_keeps_to_the_lower_line);
    RUN_TEST(test_without_a_second_line_its_rows_say_nothing);
    RUN_TEST(test_alone_a_vehicle_is_planned_along_its_three_pieces);
    RUN_TEST(test_the_next_plan_begins_where_the_last_one_ended);
    RUN_TEST(test_projection_keeps_to_both_lines_and_the_residual_sees_them);
    return UNITY_END();
}
