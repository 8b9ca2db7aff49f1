#include <math.h>
#include <string.h>

#include "scene.h"
#include "taper/horizon.h"
#include "unity.h"

/* Rows of scene_four(): N = 4, T = 24, K = 3. Base power 7360 W, so energy counts in units of 1840 Wh. */
#define STEPS           24
#define RATE(i, t)      ((i) * STEPS + (t))
#define TAPER_ROW(i, t) (4 * STEPS + (i) * (STEPS - 1) + (t) - 1)
#define TARGET(i)       (4 * STEPS + 4 * (STEPS - 1) + (i))
#define SUM(k, t)       (8 * STEPS + (k) * STEPS + (t))

static taper_horizon_t horizon;
static taper_snapshot_t snapshot;
static taper_course_t course = {.phase_mA = {TAPER_NO_LIMIT, TAPER_NO_LIMIT, TAPER_NO_LIMIT}};

void setUp(void) {
    memset(&horizon, 0x5A, sizeof horizon); /* whatever was there must not matter */
    snapshot = scene_snapshot(0, 1);
    for (int t = 0; t < STEPS; t++) {
        course.limit_W[t] = 20000;
    }
}
void tearDown(void) {}

static void build(void) {
    taper_horizon_build(&horizon, scene_four(), &snapshot, &course);
}

static void assert_near(double expected, taper_real_t actual) {
    TEST_ASSERT_TRUE_MESSAGE(fabs(expected - (double)actual) < 1e-5 * (1 + fabs(expected)), "not near");
}

static void test_power_is_counted_in_the_strongest_connector(void) {
    build();
    assert_near(7360, horizon.base_W);
    assert_near(1, horizon.upper[RATE(0, 0)]);
}

static void test_after_the_departure_the_rate_is_zero_and_a_broken_step_counts_in_part(void) {
    snapshot.demand[0].departs_in_s = 2 * 900 + 300;
    build();
    assert_near(1, horizon.upper[RATE(0, 1)]);
    assert_near(1.0 / 3, horizon.upper[RATE(0, 2)]);
    assert_near(0, horizon.upper[RATE(0, 3)]);
    assert_near(0, horizon.upper[RATE(0, STEPS - 1)]);
}

static void test_a_departure_that_has_passed_leaves_the_running_step(void) {
    snapshot.demand[0].departs_in_s = -5000;
    build();
    assert_near(1, horizon.upper[RATE(0, 0)]);
    assert_near(0, horizon.upper[RATE(0, 1)]);
}

static void test_the_taper_bounds_rate_now_and_falls_with_energy_later(void) {
    snapshot.demand[0].taper_W = 6000; /* 4360 W at half charge, 0.1 W per Wh */
    build();
    assert_near(4360.0 / 7360, horizon.upper[RATE(0, 0)]);
    assert_near(4360.0 / 7360, horizon.upper[TAPER_ROW(0, 1)]);
    assert_near(1 - 0.1 * 0.25, horizon.taper_keep[0][0]);
}

static void test_without_a_taper_its_rows_are_free(void) {
    build();
    TEST_ASSERT_TRUE(horizon.upper[TAPER_ROW(0, 1)] >= TAPER_REAL_UNBOUNDED);
    assert_near(1, horizon.taper_keep[0][0]);
}

static void test_a_battery_smaller_than_a_step_keeps_its_factor_at_zero(void) {
    snapshot.demand[0].capacity_Wh = 100;
    snapshot.demand[0].stored_Wh = 0;
    snapshot.demand[0].taper_W = 7360;
    build();
    assert_near(0, horizon.taper_keep[0][0]);
}

static void test_the_target_is_the_need(void) {
    build();
    assert_near(10000.0 / 1840 * 0.58, horizon.upper[TARGET(0)]);
}

static void test_idle_connectors_stand_still_by_bounds_and_cost_nothing(void) {
    build();
    for (int t = 0; t < STEPS; t++) {
        assert_near(0, horizon.lower[RATE(2, t)]);
        assert_near(0, horizon.upper[RATE(2, t)]);
        assert_near(0, horizon.linear[RATE(2, t)]);
    }
    TEST_ASSERT_TRUE(horizon.upper[TARGET(2)] >= TAPER_REAL_UNBOUNDED);
}

static void test_sums_follow_the_course_for_the_site_and_the_table_below(void) {
    course.limit_W[3] = 10000;
    course.limit_W[4] = 90000; /* more than the site was built for */
    build();
    const double site = sqrt(5.0 / 4) / 7360;
    const double feeder = sqrt(5.0 / 2) / 7360;
    assert_near(20000 * site, horizon.upper[SUM(0, 0)]);
    assert_near(10000 * site, horizon.upper[SUM(0, 3)]);
    assert_near(25000 * site, horizon.upper[SUM(0, 4)]);
    assert_near(11960 * feeder, horizon.upper[SUM(1, 3)]);
    assert_near(11960 * feeder, horizon.upper[SUM(2, 4)]);
}

static void test_the_linear_cost_is_the_worth_of_power_step_by_step(void) {
    snapshot.demand[0].departs_in_s = 8 * 900;
    snapshot.demand[0].need_Wh = 7360; /* an hour: 4 of the 8 steps to spare */
    build();
    const double weight = 1 + 8.0 / 8 + 3.0 / (4 + 16);
    assert_near(-weight * (0.95 - 0.95 * 0.95), horizon.linear[RATE(0, 0)]);
    assert_near(-weight * pow(0.95, STEPS), horizon.linear[RATE(0, STEPS - 1)]);
}

static void test_the_hessian_is_that_of_the_squared_powers(void) {
    assert_near(0.1 * (0.95 + 0.95 * 0.95), taper_horizon_hessian_diagonal(STEPS, 0));
    assert_near(0.1 * pow(0.95, STEPS), taper_horizon_hessian_diagonal(STEPS, STEPS - 1));
    assert_near(-0.1 * pow(0.95, 2), taper_horizon_hessian_neighbour(1));
}

static void test_a_group_contains_what_hangs_below_it(void) {
    TEST_ASSERT_TRUE(taper_group_contains(scene_four(), 0, 3));
    TEST_ASSERT_TRUE(taper_group_contains(scene_four(), 2, 3));
    TEST_ASSERT_FALSE(taper_group_contains(scene_four(), 1, 3));
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_power_is_counted_in_the_strongest_connector);
    RUN_TEST(test_after_the_departure_the_rate_is_zero_and_a_broken_step_counts_in_part);
    RUN_TEST(test_a_departure_that_has_passed_leaves_the_running_step);
    RUN_TEST(test_the_taper_bounds_rate_now_and_falls_with_energy_later);
    RUN_TEST(test_without_a_taper_its_rows_are_free);
    RUN_TEST(test_a_battery_smaller_than_a_step_keeps_its_factor_at_zero);
    RUN_TEST(test_the_target_is_the_need);
    RUN_TEST(test_idle_connectors_stand_still_by_bounds_and_cost_nothing);
    RUN_TEST(test_sums_follow_the_course_for_the_site_and_the_table_below);
    RUN_TEST(test_the_linear_cost_is_the_worth_of_power_step_by_step);
    RUN_TEST(test_the_hessian_is_that_of_the_squared_powers);
    RUN_TEST(test_a_group_contains_what_hangs_below_it);
    return UNITY_END();
}
