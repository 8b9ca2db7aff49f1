#include <string.h>

#include "scene.h"
#include "taper/limits.h"
#include "unity.h"

static taper_limits_t limits;
static taper_limit_curve_t curve;

void setUp(void) {
    taper_limits_init(&limits, scene_four()); /* built for 25 kW, failsafe 4 kW, 24 steps of 900 s */
    memset(&curve, 0, sizeof curve);
}
void tearDown(void) {}

static void gateway_says(int32_t limit_W, uint32_t now_ms) {
    const taper_site_limit_t message = {
        .active = true, .limit_W = limit_W, .failsafe_W = TAPER_ABSENT, .validity_s = TAPER_ABSENT};
    taper_limits_apply(&limits, &message, now_ms);
}

static void point(uint32_t time_ms, int32_t limit_W) {
    curve.point[curve.count] = (taper_limit_point_t){time_ms, limit_W};
    curve.count++;
}

static void assert_now(int32_t site_W, taper_limit_source_t source, uint32_t now_ms) {
    const taper_limit_now_t now = taper_limits_now(&limits, now_ms);
    TEST_ASSERT_EQUAL_INT32(site_W, now.supply.site_W);
    TEST_ASSERT_EQUAL(source, now.source);
}

static void test_without_a_gateway_the_failsafe_limit_holds(void) {
    assert_now(4000, TAPER_LIMIT_FAILSAFE, 0);
}

static void test_the_gateway_lowers_but_never_raises_what_was_built(void) {
    gateway_says(20000, 0);
    assert_now(20000, TAPER_LIMIT_GATEWAY, 0);
    gateway_says(90000, 1000);
    assert_now(25000, TAPER_LIMIT_STATION, 1000);
}

static void test_a_silent_gateway_ends_in_failsafe_after_five_seconds(void) {
    gateway_says(20000, 1000);
    TEST_ASSERT_TRUE(taper_limits_gateway_alive(&limits, 6000));
    TEST_ASSERT_FALSE(taper_limits_gateway_alive(&limits, 6001));
    assert_now(4000, TAPER_LIMIT_FAILSAFE, 6001);
    gateway_says(20000, 7000);
    assert_now(20000, TAPER_LIMIT_GATEWAY, 7000);
}

static void test_a_shorter_validity_ends_earlier(void) {
    const taper_site_limit_t message = {
        .active = true, .limit_W = 20000, .failsafe_W = TAPER_ABSENT, .validity_s = 2};
    taper_limits_apply(&limits, &message, 0);
    TEST_ASSERT_TRUE(taper_limits_gateway_alive(&limits, 2000));
    TEST_ASSERT_FALSE(taper_limits_gateway_alive(&limits, 2001));
}

static void test_the_timeout_survives_the_wrap_of_the_clock(void) {
    gateway_says(20000, UINT32_MAX - 1000);
    TEST_ASSERT_TRUE(taper_limits_gateway_alive(&limits, 2000));
    TEST_ASSERT_FALSE(taper_limits_gateway_alive(&limits, 4000));
}

static void test_a_heartbeat_without_a_limit_does_not_keep_the_old_one_alive(void) {
    gateway_says(20000, 0);
    gateway_says(TAPER_ABSENT, 4000);
    TEST_ASSERT_FALSE(taper_limits_gateway_alive(&limits, 6000));
}

static void test_a_limit_of_zero_leaves_nothing_at_once(void) {
    gateway_says(20000, 0);
    gateway_says(0, 1000);
    assert_now(0, TAPER_LIMIT_GATEWAY, 1000);
    TEST_ASSERT_EQUAL_UINT32(0, limits.negative);
}

static void test_a_negative_limit_counts_as_zero_and_is_counted(void) {
    gateway_says(-100, 0);
    assert_now(0, TAPER_LIMIT_GATEWAY, 0);
    TEST_ASSERT_EQUAL_UINT32(1, limits.negative);
}

static void test_the_gateway_can_set_the_failsafe_limit_within_what_was_built(void) {
    const taper_site_limit_t message = {
        .active = true, .limit_W = 20000, .failsafe_W = 99000, .validity_s = TAPER_ABSENT};
    taper_limits_apply(&limits, &message, 0);
    assert_now(25000, TAPER_LIMIT_FAILSAFE, 10000);
}

static void test_the_curve_steps_at_its_points(void) {
    point(1000, 15000);
    point(2000, 10000);
    TEST_ASSERT_EQUAL(TAPER_OK, taper_limits_set_curve(&limits, TAPER_CURVE_OF_GATEWAY, &curve));
    gateway_says(25000, 500);
    assert_now(25000, TAPER_LIMIT_STATION, 999);
    assert_now(15000, TAPER_LIMIT_CURVE, 1000);
    assert_now(15000, TAPER_LIMIT_CURVE, 1999);
    assert_now(10000, TAPER_LIMIT_CURVE, 2000);
}

static void test_a_curve_out_of_order_is_refused_and_the_old_one_stays(void) {
    point(1000, 15000);
    TEST_ASSERT_EQUAL(TAPER_OK, taper_limits_set_curve(&limits, TAPER_CURVE_OF_GATEWAY, &curve));
    point(1000, 10000);
    TEST_ASSERT_EQUAL(TAPER_ERR_ARGUMENT, taper_limits_set_curve(&limits, TAPER_CURVE_OF_GATEWAY, &curve));
    curve.point[1] = (taper_limit_point_t){2000, -1};
    TEST_ASSERT_EQUAL(TAPER_ERR_ARGUMENT, taper_limits_set_curve(&limits, TAPER_CURVE_OF_GATEWAY, &curve));
    curve.point[1] = (taper_limit_point_t){1000 + TAPER_CURVE_SPAN_ms + 1, 10000};
    TEST_ASSERT_EQUAL(TAPER_ERR_ARGUMENT, taper_limits_set_curve(&limits, TAPER_CURVE_OF_GATEWAY, &curve));
    curve.count = TAPER_MAX_LIMIT_POINTS + 1;
    TEST_ASSERT_EQUAL(TAPER_ERR_ARGUMENT, taper_limits_set_curve(&limits, TAPER_CURVE_OF_GATEWAY, &curve));
    gateway_says(25000, 2000);
    assert_now(15000, TAPER_LIMIT_CURVE, 2000);
}

static void test_the_course_has_the_limit_of_now_first_and_then_means(void) {
    taper_course_t course;
    point(0, 20000);
    point(900000 + 450000, 10000); /* in the middle of the second step */
    TEST_ASSERT_EQUAL(TAPER_OK, taper_limits_set_curve(&limits, TAPER_CURVE_OF_GATEWAY, &curve));
    gateway_says(20000, 0);
    taper_limits_course(&limits, 0, &course);
    TEST_ASSERT_EQUAL_INT32(20000, course.limit_W[0]);
    TEST_ASSERT_EQUAL_INT32(15000, course.limit_W[1]);
    TEST_ASSERT_EQUAL_INT32(10000, course.limit_W[2]);
    TEST_ASSERT_EQUAL_INT32(10000, course.limit_W[23]);
}

static void test_the_course_knows_of_rises(void) {
    taper_course_t course;
    point(0, 5050);
    point(900000, 20000);
    TEST_ASSERT_EQUAL(TAPER_OK, taper_limits_set_curve(&limits, TAPER_CURVE_OF_GATEWAY, &curve));
    gateway_says(5000, 0); /* the curve's 5050 W in the wire's steps of 100 W */
    taper_limits_course(&limits, 0, &course);
    TEST_ASSERT_EQUAL_INT32(5000, course.limit_W[0]);
    TEST_ASSERT_EQUAL_INT32(20000, course.limit_W[1]);
}

static void test_a_limit_that_the_curve_does_not_explain_is_taken_to_last(void) {
    taper_course_t course;
    point(0, 20000);
    point(1800000, 2000);
    TEST_ASSERT_EQUAL(TAPER_OK, taper_limits_set_curve(&limits, TAPER_CURVE_OF_GATEWAY, &curve));
    gateway_says(5000, 0);
    taper_limits_course(&limits, 0, &course);
    TEST_ASSERT_EQUAL_INT32(5000, course.limit_W[0]);
    TEST_ASSERT_EQUAL_INT32(5000, course.limit_W[1]);
    TEST_ASSERT_EQUAL_INT32(2000, course.limit_W[2]);
}

static void test_an_old_limit_does_not_come_back_when_the_clock_has_gone_round(void) {
    gateway_says(20000, 1000);
    for (uint64_t now_ms = 1000; now_ms <= UINT64_C(0x100000000) + 2000; now_ms += 3600000) {
        taper_limits_update(&limits, (uint32_t)now_ms);
    }
    assert_now(4000, TAPER_LIMIT_FAILSAFE, 2000); /* 2^32 ms later */
}

static void test_the_last_point_of_a_curve_holds_for_months(void) {
    point(1000, 20000);
    point(5000, 10000);
    TEST_ASSERT_EQUAL(TAPER_OK, taper_limits_set_curve(&limits, TAPER_CURVE_OF_GATEWAY, &curve));
    uint32_t now_ms = 0;
    for (int hour = 0; hour < 24 * 100; hour++) {
        now_ms += 3600000;
        taper_limits_update(&limits, now_ms);
    }
    gateway_says(25000, now_ms);
    assert_now(10000, TAPER_LIMIT_CURVE, now_ms);
}

static void test_several_points_within_one_step_are_averaged(void) {
    taper_course_t course;
    point(900000, 9000);
    point(1200000, 6000);
    point(1500000, 3000);
    TEST_ASSERT_EQUAL(TAPER_OK, taper_limits_set_curve(&limits, TAPER_CURVE_OF_GATEWAY, &curve));
    gateway_says(25000, 0);
    taper_limits_course(&limits, 0, &course);
    TEST_ASSERT_EQUAL_INT32(6000, course.limit_W[1]);
    TEST_ASSERT_EQUAL_INT32(3000, course.limit_W[2]);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_without_a_gateway_the_failsafe_limit_holds);
    RUN_TEST(test_the_gateway_lowers_but_never_raises_what_was_built);
    RUN_TEST(test_a_silent_gateway_ends_in_failsafe_after_five_seconds);
    RUN_TEST(test_a_shorter_validity_ends_earlier);
    RUN_TEST(test_the_timeout_survives_the_wrap_of_the_clock);
    RUN_TEST(test_a_heartbeat_without_a_limit_does_not_keep_the_old_one_alive);
    RUN_TEST(test_a_limit_of_zero_leaves_nothing_at_once);
    RUN_TEST(test_a_negative_limit_counts_as_zero_and_is_counted);
    RUN_TEST(test_the_gateway_can_set_the_failsafe_limit_within_what_was_built);
    RUN_TEST(test_the_curve_steps_at_its_points);
    RUN_TEST(test_a_curve_out_of_order_is_refused_and_the_old_one_stays);
    RUN_TEST(test_the_course_has_the_limit_of_now_first_and_then_means);
    RUN_TEST(test_the_course_knows_of_rises);
    RUN_TEST(test_a_limit_that_the_curve_does_not_explain_is_taken_to_last);
    RUN_TEST(test_an_old_limit_does_not_come_back_when_the_clock_has_gone_round);
    RUN_TEST(test_the_last_point_of_a_curve_holds_for_months);
    RUN_TEST(test_several_points_within_one_step_are_averaged);
    return UNITY_END();
}
