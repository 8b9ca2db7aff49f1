/* What other load leaves of the current of each phase. */
#include "limits_bench.h"
#include "unity.h"

void setUp(void) {
    bench_start();
    config.other_load_W = 6000;
    config.other_load_mA = 10000;
}
void tearDown(void) {}

static void site_of(const taper_group_config_t *group) {
    config.groups = group;
    config.group_count = 1;
}

static void limit_phases(void) {
    static const taper_group_config_t site = {.limit_W = 25000, .limit_mA = 63000, .parent = TAPER_NO_GROUP};
    site_of(&site);
}

static void assert_phases(int32_t l1_mA, int32_t l2_mA, int32_t l3_mA, uint32_t now_ms) {
    const int32_t expected[] = {l1_mA, l2_mA, l3_mA};
    const taper_limit_now_t now = taper_limits_now(&limits, now_ms);
    TEST_ASSERT_EQUAL_INT32_ARRAY(expected, now.supply.phase_mA, 3);
    bench_course(now_ms);
    TEST_ASSERT_EQUAL_INT32_ARRAY(expected, course.phase_mA, 3);
}

static void test_without_a_limit_of_the_phases_they_are_free_whatever_is_metered(void) {
    assert_phases(TAPER_NO_LIMIT, TAPER_NO_LIMIT, TAPER_NO_LIMIT, 0);
    bench_meter(100000, 0, 0, 0);
    assert_phases(TAPER_NO_LIMIT, TAPER_NO_LIMIT, TAPER_NO_LIMIT, 0);
}

static void test_each_phase_has_what_is_metered_on_it_taken_off(void) {
    limit_phases();
    bench_meter(1000, 20000, 63000, 0);
    assert_phases(62000, 43000, 0, 0);
}

static void test_more_than_the_limit_leaves_nothing_and_feeding_in_gives_nothing(void) {
    limit_phases();
    bench_meter(63100, -40000, 3276700, 0);
    assert_phases(0, 63000, 0, 0);
}

static void test_a_meter_that_was_never_heard_leaves_the_configured_maximum(void) {
    limit_phases();
    assert_phases(53000, 53000, 53000, 0);
}

static void test_a_phase_without_a_value_counts_as_configured(void) {
    limit_phases();
    bench_meter(TAPER_ABSENT, 1000, 20000, 0);
    assert_phases(53000, 62000, 43000, 0);
}

static void test_a_silent_meter_counts_as_configured_or_as_it_was_if_that_is_more(void) {
    limit_phases();
    bench_meter(1000, 20000, 10000, 1000);
    assert_phases(62000, 43000, 53000, 1000 + TAPER_SITE_METER_TIMEOUT_ms);
    assert_phases(53000, 43000, 53000, 1001 + TAPER_SITE_METER_TIMEOUT_ms);
    taper_limits_update(&limits, 1001 + TAPER_SITE_METER_TIMEOUT_ms);
    assert_phases(53000, 43000, 53000, 1001 + TAPER_SITE_METER_TIMEOUT_ms);
    bench_meter(1000, 2000, 3000, 20000);
    assert_phases(62000, 61000, 60000, 20000);
}

static void test_power_and_current_of_other_load_are_taken_off_side_by_side(void) {
    limit_phases();
    bench_say(true, 20000, 0);
    bench_meter(10000, 20000, -5000, 0); /* 2300 + 4600 - 1150 W */
    bench_assert(20000 - 5750, TAPER_LIMIT_GATEWAY, 0);
    assert_phases(53000, 43000, 63000, 0);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_without_a_limit_of_the_phases_they_are_free_whatever_is_metered);
    RUN_TEST(test_each_phase_has_what_is_metered_on_it_taken_off);
    RUN_TEST(test_more_than_the_limit_leaves_nothing_and_feeding_in_gives_nothing);
    RUN_TEST(test_a_meter_that_was_never_heard_leaves_the_configured_maximum);
    RUN_TEST(test_a_phase_without_a_value_counts_as_configured);
    RUN_TEST(test_a_silent_meter_counts_as_configured_or_as_it_was_if_that_is_more);
    RUN_TEST(test_power_and_current_of_other_load_are_taken_off_side_by_side);
    return UNITY_END();
}
