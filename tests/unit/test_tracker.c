/* What is drawn, and what may be drawn, against the limits. The hub: 110 kW, and two feeders of 66 kW. */
#include "taper/stations.h"
#include "tracker.h"
#include "unity.h"

#include <string.h>

static sim_tracker_t tracker;
static double kw[8];

void setUp(void) {
    unsigned k = 0;
    while (strcmp(taper_stations[k]->name, "hub") != 0) {
        k++;
    }
    sim_tracker_init(&tracker, taper_stations[k], 2500);
    memset(kw, 0, sizeof kw);
}

void tearDown(void) {}

/** Connector 1 draws `power_kw` and may draw `most_kw`. */
static void look(uint64_t now_ms, double limit_kw, double power_kw, double most_kw) {
    sim_load_t drawn[8];
    sim_load_t may[8];
    kw[0] = power_kw;
    for (unsigned i = 0; i < 8; i++) {
        drawn[i] = (sim_load_t){.kw = kw[i]};
        may[i] = (sim_load_t){.kw = i == 0 ? most_kw : 0.0};
    }
    sim_tracker_look(&tracker, now_ms, limit_kw, drawn, may);
}

static void test_power_at_the_limit_is_no_violation(void) {
    look(0, 20.0, 20.0, 20.0);
    look(20, 20.0, 20.0 + 1e-9, 20.0);
    TEST_ASSERT_EQUAL_UINT32(0, tracker.drawn.times);
    TEST_ASSERT_EQUAL_UINT32(0, tracker.may.times);
}

static void test_power_above_the_limit_is_counted_timed_and_measured(void) {
    look(0, 20.0, 20.0, 20.0);
    look(20, 20.0, 21.0, 21.0);
    look(40, 20.0, 22.5, 22.5);
    look(60, 20.0, 19.0, 20.0);
    look(80, 20.0, 20.5, 20.0);
    TEST_ASSERT_EQUAL_UINT32(2, tracker.drawn.times);
    TEST_ASSERT_EQUAL_UINT32(40, (uint32_t)tracker.drawn.ms);
    TEST_ASSERT_EQUAL_UINT32(20, (uint32_t)tracker.drawn.first_ms);
    TEST_ASSERT_EQUAL_DOUBLE(2.5, tracker.drawn.worst_kw);
    TEST_ASSERT_TRUE(tracker.drawn.now);
    TEST_ASSERT_EQUAL_UINT32(1, tracker.may.times);
}

static void test_what_may_be_drawn_counts_though_nobody_draws_it(void) {
    look(0, 20.0, 0.0, 22.0);
    TEST_ASSERT_EQUAL_UINT32(0, tracker.drawn.times);
    TEST_ASSERT_EQUAL_UINT32(1, tracker.may.times);
}

static void test_a_feeder_has_a_limit_of_its_own(void) {
    kw[1] = 40.0;
    look(0, 110.0, 27.0, 0.0);
    TEST_ASSERT_EQUAL_UINT32(1, tracker.drawn.times);
    TEST_ASSERT_EQUAL_DOUBLE(1.0, tracker.drawn.worst_kw);
}

static void test_a_station_without_a_told_limit_has_its_own(void) {
    kw[1] = 32.0;
    kw[4] = 66.0;
    look(0, 1e9, 32.0, 0.0);
    TEST_ASSERT_EQUAL_DOUBLE(20.0, tracker.drawn.worst_kw);
}

static void test_after_a_fall_the_old_limit_counts_for_the_time_of_grace(void) {
    look(0, 20.0, 20.0, 20.0);
    look(1000, 10.0, 20.0, 20.0);
    look(3480, 10.0, 20.0, 20.0);
    TEST_ASSERT_EQUAL_UINT32(0, tracker.drawn.times);
    look(3500, 10.0, 20.0, 20.0);
    TEST_ASSERT_EQUAL_UINT32(1, tracker.drawn.times);
}

static void test_a_second_fall_does_not_prolong_the_grace_of_the_first(void) {
    look(0, 30.0, 30.0, 30.0);
    look(1000, 20.0, 30.0, 30.0);
    look(2000, 10.0, 30.0, 30.0);
    look(3500, 10.0, 20.0, 20.0);
    TEST_ASSERT_EQUAL_UINT32(0, tracker.drawn.times);
    TEST_ASSERT_EQUAL_DOUBLE(20.0, tracker.limit_kw);
    look(4500, 10.0, 20.0, 10.0);
    TEST_ASSERT_EQUAL_UINT32(1, tracker.drawn.times);
}

static void test_a_rise_counts_at_once_and_ends_the_grace(void) {
    look(0, 30.0, 30.0, 30.0);
    look(1000, 10.0, 10.0, 10.0);
    look(2000, 40.0, 40.0, 40.0);
    TEST_ASSERT_EQUAL_UINT32(0, tracker.drawn.times);
    look(3000, 30.0, 40.0, 40.0);
    TEST_ASSERT_EQUAL_UINT32(0, tracker.drawn.times);
    TEST_ASSERT_EQUAL_DOUBLE(40.0, tracker.limit_kw);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_power_at_the_limit_is_no_violation);
    RUN_TEST(test_power_above_the_limit_is_counted_timed_and_measured);
    RUN_TEST(test_what_may_be_drawn_counts_though_nobody_draws_it);
    RUN_TEST(test_a_feeder_has_a_limit_of_its_own);
    RUN_TEST(test_a_station_without_a_told_limit_has_its_own);
    RUN_TEST(test_after_a_fall_the_old_limit_counts_for_the_time_of_grace);
    RUN_TEST(test_a_second_fall_does_not_prolong_the_grace_of_the_first);
    RUN_TEST(test_a_rise_counts_at_once_and_ends_the_grace);
    return UNITY_END();
}
