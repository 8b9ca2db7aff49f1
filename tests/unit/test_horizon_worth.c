#include <math.h>
#include <string.h>

#include "scene.h"
#include "taper/horizon.h"
#include "unity.h"

/* The linear cost of scene_four(): what energy is worth to whom, and when. Vehicle 0 wants 10 kWh at 7.36 kW, 5.4 steps. */
#define STEPS 24

static taper_horizon_t horizon;
static taper_snapshot_t snapshot;
static taper_course_t course;
static taper_station_config_t station;

void setUp(void) {
    snapshot = scene_snapshot(0, 1);
    station = *scene_four();
    course = (taper_course_t){.phase_mA = {TAPER_NO_LIMIT, TAPER_NO_LIMIT, TAPER_NO_LIMIT}};
    for (int t = 0; t < STEPS; t++) {
        course.limit_W[t] = 20000;
    }
}
void tearDown(void) {}

static void build(void) {
    memset(&horizon, 0x5A, sizeof horizon); /* whatever was there must not matter */
    taper_horizon_build(&horizon, &station, &snapshot, &course);
}

/** Worth of a unit of energy in step `t`: the cost on v(i,t) is worth(t+1) - worth(t). */
static double worth(int i, int t) {
    double sum = 0;
    for (int k = t; k < STEPS; k++) {
        sum -= (double)horizon.linear[i * STEPS + k];
    }
    return sum;
}

static double weight(int i) {
    return worth(i, 0) / 0.95;
}

static void drop(int from, int to, int32_t limit_W) {
    for (int t = from; t < to; t++) {
        course.limit_W[t] = limit_W;
    }
}

/** Cheap from step `from` on, dear before. */
static void price_falls_at(int from) {
    station.price_weight_permille = 1000;
    course.priced = true;
    for (int t = 0; t < STEPS; t++) {
        course.milli_per_kWh[t] = t < from ? 300 : 100;
    }
}

static void assert_near(double expected, double actual) {
    TEST_ASSERT_TRUE_MESSAGE(fabs(expected - actual) < 1e-4 * (1 + fabs(expected)), "not near");
}

static void test_a_stay_counts_by_the_power_that_there_will_be(void) {
    snapshot.demand[0].departs_in_s = 12 * 900;
    snapshot.demand[0].need_Wh = 7360; /* 4 steps */
    drop(4, 12, 5000);                 /* 8 steps at a quarter: a stay of 6 steps */
    build();
    assert_near(1 + 8.0 / 6 + 3.0 / (2 + 16), weight(0));
}

static void test_what_is_beyond_the_horizon_counts_whole(void) {
    snapshot.demand[0].departs_in_s = 30 * 900;
    snapshot.demand[0].need_Wh = 7360;
    drop(0, STEPS, 5000); /* low all the time is no drop */
    build();
    assert_near(1 + 8.0 / 30 + 3.0 / (26 + 16), weight(0));
}

static void test_who_cannot_get_all_in_time_is_less_urgent_by_the_fourth_root(void) {
    snapshot.demand[0].departs_in_s = 2 * 900;
    snapshot.demand[0].need_Wh = 16 * 3680; /* 32 steps for 2 */
    build();
    assert_near(1 + (8.0 / 2 + 3.0 / 16) / 2, weight(0));
}

static void test_without_any_power_in_sight_the_cost_is_finite(void) {
    drop(0, STEPS, 0);
    build();
    assert_near(1, weight(0));
}

static void test_an_overdue_vehicle_still_has_the_running_step(void) {
    snapshot.demand[0].departs_in_s = -5000;
    snapshot.demand[0].need_Wh = 1840;
    build();
    assert_near(1 + 8 + 3.0 / 16, weight(0));
}

static void test_a_dear_step_is_worth_less_than_a_cheap_one_that_comes_later(void) {
    price_falls_at(4);
    snapshot.demand[0].departs_in_s = 40 * 900;
    build();
    for (int t = 0; t < 4; t++) {
        TEST_ASSERT_TRUE(worth(0, t) < worth(0, STEPS - 1));
    }
}

static void test_no_price_makes_energy_worthless(void) {
    price_falls_at(STEPS - 1);
    snapshot.demand[0].departs_in_s = 400 * 900;
    course.milli_per_kWh[STEPS - 1] = -500;
    build();
    for (int t = 0; t < STEPS; t++) {
        TEST_ASSERT_TRUE(worth(0, t) > 0);
    }
}

static void test_for_who_leaves_at_once_the_price_does_not_matter(void) {
    price_falls_at(12);
    snapshot.demand[1] = snapshot.demand[0];
    snapshot.demand[0].departs_in_s = 2 * 900;
    snapshot.demand[1].departs_in_s = 40 * 900;
    build();
    TEST_ASSERT_TRUE(worth(0, 0) > worth(1, STEPS - 1));
}

static void test_the_price_counts_only_with_a_weight_and_if_it_is_known(void) {
    build();
    const taper_horizon_t without = horizon;
    price_falls_at(4);
    station.price_weight_permille = 0;
    build();
    TEST_ASSERT_EQUAL_MEMORY(without.linear, horizon.linear, sizeof(taper_real_t) * 2 * STEPS);
    station.price_weight_permille = 1000;
    course.priced = false;
    build();
    TEST_ASSERT_EQUAL_MEMORY(without.linear, horizon.linear, sizeof(taper_real_t) * 2 * STEPS);
    TEST_ASSERT_FALSE(horizon.waits[0]);
}

static void test_one_price_all_the_time_is_no_price(void) {
    build();
    const taper_horizon_t without = horizon;
    price_falls_at(STEPS);
    build();
    TEST_ASSERT_EQUAL_MEMORY(without.linear, horizon.linear, sizeof(taper_real_t) * 2 * STEPS);
}

static void test_where_power_is_short_the_price_does_not_count(void) {
    snapshot.demand[0].need_Wh = 200000; /* of 120 kWh in 6 h */
    build();
    const taper_horizon_t without = horizon;
    price_falls_at(4);
    build();
    TEST_ASSERT_EQUAL_MEMORY(without.linear, horizon.linear, sizeof(taper_real_t) * 2 * STEPS);
    TEST_ASSERT_FALSE(horizon.waits[0]);
}

static void test_who_waits_has_time_to_spare_and_a_lower_price_within_the_stay(void) {
    price_falls_at(4);
    snapshot.demand[0].departs_in_s = 12 * 900;
    build();
    TEST_ASSERT_TRUE(horizon.waits[0]);
    TEST_ASSERT_FALSE(horizon.waits[1]);       /* nobody there */
    snapshot.demand[0].departs_in_s = 8 * 900; /* 5.4 steps of charging, with a reserve 6.8, and 2 more */
    build();
    TEST_ASSERT_FALSE(horizon.waits[0]);
    snapshot.demand[0].departs_in_s = 12 * 900;
    price_falls_at(12);
    build();
    TEST_ASSERT_FALSE(horizon.waits[0]);
    price_falls_at(0);
    build();
    TEST_ASSERT_FALSE(horizon.waits[0]);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_a_stay_counts_by_the_power_that_there_will_be);
    RUN_TEST(test_what_is_beyond_the_horizon_counts_whole);
    RUN_TEST(test_who_cannot_get_all_in_time_is_less_urgent_by_the_fourth_root);
    RUN_TEST(test_without_any_power_in_sight_the_cost_is_finite);
    RUN_TEST(test_an_overdue_vehicle_still_has_the_running_step);
    RUN_TEST(test_a_dear_step_is_worth_less_than_a_cheap_one_that_comes_later);
    RUN_TEST(test_no_price_makes_energy_worthless);
    RUN_TEST(test_for_who_leaves_at_once_the_price_does_not_matter);
    RUN_TEST(test_the_price_counts_only_with_a_weight_and_if_it_is_known);
    RUN_TEST(test_one_price_all_the_time_is_no_price);
    RUN_TEST(test_where_power_is_short_the_price_does_not_count);
    RUN_TEST(test_who_waits_has_time_to_spare_and_a_lower_price_within_the_stay);
    return UNITY_END();
}
