/* Two known courses, the gateway's and the site's own: the least counts, and is said to be its owner's. */
#include "limits_bench.h"
#include "unity.h"

void setUp(void) {
    bench_start();
}
void tearDown(void) {}

static void test_the_least_of_both_curves_counts_and_is_said_to_be_its_owners(void) {
    bench_point(1000, 20000);
    bench_point(3000, 5000);
    bench_set(TAPER_CURVE_OF_GATEWAY);
    bench_point(2000, 10000);
    bench_set(TAPER_CURVE_OF_FILE);
    bench_say(true, 90000, 0);
    bench_assert(25000, TAPER_LIMIT_STATION, 999);
    bench_assert(20000, TAPER_LIMIT_CURVE, 1000);
    bench_assert(10000, TAPER_LIMIT_FILE, 2000);
    bench_assert(10000, TAPER_LIMIT_FILE, 2999);
    bench_assert(5000, TAPER_LIMIT_CURVE, 3000);
}

static void test_the_gateways_present_limit_counts_beside_both(void) {
    bench_point(0, 20000);
    bench_set(TAPER_CURVE_OF_GATEWAY);
    bench_point(0, 10000);
    bench_set(TAPER_CURVE_OF_FILE);
    bench_say(true, 9999, 0);
    bench_assert(9999, TAPER_LIMIT_GATEWAY, 0);
    bench_say(true, 10000, 6000);
    bench_assert(10000, TAPER_LIMIT_FILE, 6000);
}

static void test_of_equal_curves_the_gateways_is_named(void) {
    bench_point(0, 10000);
    bench_set(TAPER_CURVE_OF_GATEWAY);
    bench_point(0, 10000);
    bench_set(TAPER_CURVE_OF_FILE);
    bench_say(true, 10000, 0);
    bench_assert(10000, TAPER_LIMIT_CURVE, 0);
}

static void test_a_curve_above_what_was_built_says_nothing(void) {
    bench_point(0, 25001);
    bench_set(TAPER_CURVE_OF_GATEWAY);
    bench_point(0, 25000);
    bench_set(TAPER_CURVE_OF_FILE);
    bench_say(false, TAPER_ABSENT, 0);
    bench_assert(25000, TAPER_LIMIT_STATION, 0);
}

static void test_each_owner_replaces_and_forgets_his_own_curve_only(void) {
    bench_point(0, 20000);
    bench_set(TAPER_CURVE_OF_GATEWAY);
    bench_point(0, 10000);
    bench_set(TAPER_CURVE_OF_FILE);
    bench_say(true, 90000, 0);
    bench_set(TAPER_CURVE_OF_FILE); /* without points */
    bench_assert(20000, TAPER_LIMIT_CURVE, 0);
    bench_set(TAPER_CURVE_OF_GATEWAY);
    bench_assert(25000, TAPER_LIMIT_STATION, 0);
}

static void test_nobody_elses_curve_is_taken(void) {
    bench_point(0, 20000);
    TEST_ASSERT_EQUAL(TAPER_ERR_ARGUMENT, taper_limits_set_curve(&limits, TAPER_CURVE_OWNERS, &curve));
}

static void test_a_refused_curve_leaves_the_old_one_to_its_end(void) {
    bench_point(1000, 20000);
    bench_point(2000, 10000);
    bench_point(3000, 25000);
    bench_set(TAPER_CURVE_OF_FILE);
    bench_point(1000, 1);
    bench_point(1000, 2);
    TEST_ASSERT_EQUAL(TAPER_ERR_ARGUMENT, taper_limits_set_curve(&limits, TAPER_CURVE_OF_FILE, &curve));
    bench_say(false, TAPER_ABSENT, 0);
    bench_assert(20000, TAPER_LIMIT_FILE, 1000);
    bench_assert(10000, TAPER_LIMIT_FILE, 2999);
    bench_assert(25000, TAPER_LIMIT_STATION, 3000);
}

static void test_a_curve_below_the_failsafe_limit_holds_while_the_gateway_is_silent(void) {
    bench_point(0, 3000);
    bench_point(1000, 4000);
    bench_point(2000, 5000);
    bench_set(TAPER_CURVE_OF_FILE);
    bench_assert(3000, TAPER_LIMIT_FILE, 0);
    bench_assert(4000, TAPER_LIMIT_FAILSAFE, 1000);
    bench_assert(4000, TAPER_LIMIT_FAILSAFE, 2000);
}

static void test_both_curves_go_across_the_wrap_of_the_clock(void) {
    bench_point(UINT32_MAX - 999, 20000);
    bench_point(1000, 10000);
    bench_set(TAPER_CURVE_OF_GATEWAY);
    bench_point(UINT32_MAX, 15000);
    bench_set(TAPER_CURVE_OF_FILE);
    bench_say(false, TAPER_ABSENT, UINT32_MAX - 2000);
    bench_assert(25000, TAPER_LIMIT_STATION, UINT32_MAX - 1000);
    bench_assert(20000, TAPER_LIMIT_CURVE, UINT32_MAX - 999);
    bench_assert(15000, TAPER_LIMIT_FILE, UINT32_MAX);
    taper_limits_update(&limits, 500);
    bench_assert(15000, TAPER_LIMIT_FILE, 999);
    bench_assert(10000, TAPER_LIMIT_CURVE, 1000);
}

static void test_at_time_scale_600_curves_run_600_times_faster_than_the_bus(void) {
    limits.time_scale = 600;
    bench_point(600000, 20000);
    bench_set(TAPER_CURVE_OF_GATEWAY);
    bench_point(1200000, 10000);
    bench_set(TAPER_CURVE_OF_FILE);
    bench_say(false, TAPER_ABSENT, 0);
    bench_assert(25000, TAPER_LIMIT_STATION, 999);
    bench_assert(20000, TAPER_LIMIT_CURVE, 1000);
    bench_assert(10000, TAPER_LIMIT_FILE, 2000);
    bench_course(1500); /* the world is at 900 s: its first step has both points */
    bench_assert_step(0, 20000, TAPER_LIMIT_CURVE);
    bench_assert_step(1, 10000, TAPER_LIMIT_FILE);
}

/** Gateway 20 kW, then 5 kW from the middle of step 1; file 25 kW, then 10 kW from the first third of it. */
static void set_crossing_curves(void) {
    bench_point(0, 20000);
    bench_point(STEP_ms + STEP_ms / 2, 5000);
    bench_set(TAPER_CURVE_OF_GATEWAY);
    bench_point(0, 25000);
    bench_point(STEP_ms + STEP_ms / 3, 10000);
    bench_point(3 * STEP_ms, 2000);
    bench_set(TAPER_CURVE_OF_FILE);
    bench_say(true, 20000, 0);
}

static void test_a_step_has_the_mean_of_the_least_and_the_owner_of_the_lowest(void) {
    set_crossing_curves();
    bench_course(0);
    bench_assert_step(0, 20000, TAPER_LIMIT_CURVE);
    bench_assert_step(1, (20000 * 2 + 10000 + 5000 * 3) / 6, TAPER_LIMIT_CURVE); /* sixths of a step */
    bench_assert_step(2, 5000, TAPER_LIMIT_CURVE);
    bench_assert_step(3, 2000, TAPER_LIMIT_FILE);
    bench_assert_step(23, 2000, TAPER_LIMIT_FILE);
}

static void test_other_load_goes_off_before_the_mean_is_taken(void) {
    set_crossing_curves();
    bench_meter(30435, 0, 0, 0); /* 7000 W: nothing is left of 5 kW */
    bench_course(0);
    bench_assert_step(0, 13000, TAPER_LIMIT_CURVE);
    bench_assert_step(1, (13000 * 2 + 3000 + 0 * 3) / 6, TAPER_LIMIT_CURVE);
    bench_assert_step(2, 0, TAPER_LIMIT_CURVE);
}

static void test_a_lasting_limit_bounds_every_instant_and_is_the_gateways(void) {
    set_crossing_curves();
    bench_say(true, 8000, 6000);
    bench_course(6000); /* 6 s into the course: all points are 6 s nearer */
    bench_assert_step(0, 8000, TAPER_LIMIT_GATEWAY);
    bench_assert_step(1, (8000 * (450 - 6) + 5000 * (450 + 6)) / 900, TAPER_LIMIT_CURVE);
    bench_assert_step(2, 5000 + (2000 - 5000) * 6 / 900, TAPER_LIMIT_FILE);
    bench_assert_step(3, 2000, TAPER_LIMIT_FILE);
}

static void test_a_gateway_100_W_below_the_curve_is_not_explained_by_it(void) {
    bench_point(0, 10000);
    bench_point(STEP_ms, 20000);
    bench_set(TAPER_CURVE_OF_FILE);
    bench_say(true, 9901, 0);
    bench_course(0);
    bench_assert_step(0, 9901, TAPER_LIMIT_GATEWAY);
    bench_assert_step(1, 20000, TAPER_LIMIT_FILE);
    bench_say(true, 9900, 6000);
    bench_course(6000);
    bench_assert_step(1, 9900, TAPER_LIMIT_GATEWAY);
}

static void test_failsafe_is_taken_to_last(void) {
    bench_point(STEP_ms, 3000);
    bench_set(TAPER_CURVE_OF_FILE);
    bench_course(0);
    bench_assert_step(0, 4000, TAPER_LIMIT_FAILSAFE);
    bench_assert_step(1, 3000, TAPER_LIMIT_FILE);
    bench_set(TAPER_CURVE_OF_FILE);
    bench_course(0);
    bench_assert_step(23, 4000, TAPER_LIMIT_FAILSAFE);
}

static void test_before_the_first_point_of_a_curve_what_was_built_holds(void) {
    bench_point(2 * STEP_ms + STEP_ms / 2, 5000);
    bench_set(TAPER_CURVE_OF_FILE);
    bench_say(false, TAPER_ABSENT, 0);
    bench_course(0);
    bench_assert_step(1, 25000, TAPER_LIMIT_STATION);
    bench_assert_step(2, 15000, TAPER_LIMIT_FILE);
    bench_assert_step(3, 5000, TAPER_LIMIT_FILE);
}

static void test_a_change_at_the_border_of_two_steps_belongs_to_the_later_one(void) {
    bench_point(STEP_ms, 10000);
    bench_point(2 * STEP_ms - 1, 900);
    bench_set(TAPER_CURVE_OF_FILE);
    bench_say(false, TAPER_ABSENT, 0);
    bench_course(0);
    bench_assert_step(0, 25000, TAPER_LIMIT_STATION);
    bench_assert_step(1, 9999, TAPER_LIMIT_FILE); /* the last ms has 900 W, and means are rounded down */
    bench_assert_step(2, 900, TAPER_LIMIT_FILE);
}

static void test_steps_without_a_length_have_the_limit_of_now(void) {
    config.step_s = 0;
    bench_point(0, 10000);
    bench_set(TAPER_CURVE_OF_FILE);
    bench_say(false, TAPER_ABSENT, 0);
    bench_course(0);
    bench_assert_step(23, 10000, TAPER_LIMIT_FILE);
}

static void test_the_longest_curves_are_taken_and_walked(void) {
    for (uint32_t k = 0; k < TAPER_MAX_LIMIT_POINTS; k++) {
        bench_point(k * 10000, 10000 + (int32_t)k);
    }
    const taper_limit_curve_t longest = curve;
    bench_set(TAPER_CURVE_OF_GATEWAY);
    curve = longest;
    bench_set(TAPER_CURVE_OF_FILE);
    bench_say(false, TAPER_ABSENT, 0);
    bench_course(0);
    bench_assert_step(1, 10000 + 90 + 89 / 2, TAPER_LIMIT_CURVE); /* points 90..179 */
    bench_assert_step(23, 10383, TAPER_LIMIT_CURVE);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_the_least_of_both_curves_counts_and_is_said_to_be_its_owners);
    RUN_TEST(test_the_gateways_present_limit_counts_beside_both);
    RUN_TEST(test_of_equal_curves_the_gateways_is_named);
    RUN_TEST(test_a_curve_above_what_was_built_says_nothing);
    RUN_TEST(test_each_owner_replaces_and_forgets_his_own_curve_only);
    RUN_TEST(test_nobody_elses_curve_is_taken);
    RUN_TEST(test_a_refused_curve_leaves_the_old_one_to_its_end);
    RUN_TEST(test_a_curve_below_the_failsafe_limit_holds_while_the_gateway_is_silent);
    RUN_TEST(test_both_curves_go_across_the_wrap_of_the_clock);
    RUN_TEST(test_at_time_scale_600_curves_run_600_times_faster_than_the_bus);
    RUN_TEST(test_a_step_has_the_mean_of_the_least_and_the_owner_of_the_lowest);
    RUN_TEST(test_other_load_goes_off_before_the_mean_is_taken);
    RUN_TEST(test_a_lasting_limit_bounds_every_instant_and_is_the_gateways);
    RUN_TEST(test_a_gateway_100_W_below_the_curve_is_not_explained_by_it);
    RUN_TEST(test_failsafe_is_taken_to_last);
    RUN_TEST(test_before_the_first_point_of_a_curve_what_was_built_holds);
    RUN_TEST(test_a_change_at_the_border_of_two_steps_belongs_to_the_later_one);
    RUN_TEST(test_steps_without_a_length_have_the_limit_of_now);
    RUN_TEST(test_the_longest_curves_are_taken_and_walked);
    return UNITY_END();
}
