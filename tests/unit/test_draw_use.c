/* Who draws less than it was told (fault 43): every time and current of the table in draw.h, at its boundary. */
#include "draw_bench.h"
#include "unity.h"

void setUp(void) {
    bench_start();
}
void tearDown(void) {}

static void test_what_is_not_used_for_a_minute_is_given_away(void) {
    bench_draws(13999);
    TEST_ASSERT_FALSE(bench_update());
    TEST_ASSERT_FALSE(bench_update_after(TAPER_DRAW_UNUSED_ms - 1));
    TEST_ASSERT_EQUAL_INT32(TAPER_NO_LIMIT, draw.cap_mA);
    TEST_ASSERT_TRUE(bench_update_after(1));
    TEST_ASSERT_EQUAL_INT32(15999, draw.cap_mA);
    TEST_ASSERT_EQUAL_INT(TAPER_DRAW_NORMAL, draw.state);
}

static void test_two_amperes_below_the_setpoint_are_left_to_the_vehicle(void) {
    bench_draws(14000);
    bench_update();
    TEST_ASSERT_FALSE(bench_update_after(600000));
    TEST_ASSERT_EQUAL_INT32(TAPER_NO_LIMIT, draw.cap_mA);
}

static void test_a_moment_of_use_begins_the_minute_anew(void) {
    bench_draws(8000);
    bench_update();
    bench_update_after(TAPER_DRAW_UNUSED_ms - 1);
    bench_draws(14000);
    bench_update_after(1);
    bench_draws(8000);
    bench_update_after(1);
    TEST_ASSERT_FALSE(bench_update_after(TAPER_DRAW_UNUSED_ms - 1));
    TEST_ASSERT_TRUE(bench_update_after(1));
    TEST_ASSERT_EQUAL_INT32(10000, draw.cap_mA);
}

static void test_its_maximum_goes_by_the_most_it_drew_in_that_minute(void) {
    bench_draws(12000);
    bench_update(); /* ends before the minute that counts */
    bench_draws(16000);
    bench_update_after(1000);
    bench_draws(8000);
    bench_update_after(1000);
    bench_draws(9500);
    bench_update_after(30000);
    bench_draws(7000);
    TEST_ASSERT_TRUE(bench_update_after(30000));
    TEST_ASSERT_EQUAL_INT32(11500, draw.cap_mA);
}

static void test_its_maximum_falls_further_when_it_takes_still_less(void) {
    bench_draws(10000);
    bench_update();
    bench_update_after(TAPER_DRAW_UNUSED_ms);
    TEST_ASSERT_EQUAL_INT32(12000, draw.cap_mA);
    bench_is_told(12000, 12000);
    TEST_ASSERT_FALSE(bench_update_after(TAPER_DRAW_UNUSED_ms)); /* 2 A below is what it is to have */
    bench_draws(8000);
    bench_update_after(1);
    TEST_ASSERT_TRUE(bench_update_after(TAPER_DRAW_UNUSED_ms));
    TEST_ASSERT_EQUAL_INT32(10000, draw.cap_mA);
}

static void test_each_minute_is_judged_by_itself(void) {
    bench_draws(9000);
    bench_update();
    bench_draws(7000);
    TEST_ASSERT_TRUE(bench_update_after(TAPER_DRAW_UNUSED_ms));
    TEST_ASSERT_EQUAL_INT32(11000, draw.cap_mA);
    TEST_ASSERT_FALSE(bench_update_after(1)); /* the setpoint did not fall yet */
    TEST_ASSERT_FALSE(bench_update_after(TAPER_DRAW_UNUSED_ms - 1));
    TEST_ASSERT_TRUE(bench_update_after(1));
    TEST_ASSERT_EQUAL_INT32(9000, draw.cap_mA);
}

static void test_its_maximum_is_no_less_than_its_minimum(void) {
    bench_draws(0);
    bench_update();
    TEST_ASSERT_TRUE(bench_update_after(TAPER_DRAW_UNUSED_ms));
    TEST_ASSERT_EQUAL_INT32(6000, draw.cap_mA);
    bench_is_told(6000, 6000);
    bench_draws(4999);
    TEST_ASSERT_FALSE(bench_update_after(1000));
    bench_draws(5000);
    TEST_ASSERT_TRUE(bench_update_after(1000));
    TEST_ASSERT_EQUAL_INT32(TAPER_NO_LIMIT, draw.cap_mA);
}

static void test_who_comes_within_an_ampere_of_its_maximum_has_its_own_again_at_once(void) {
    bench_draws(10000);
    bench_update();
    bench_update_after(TAPER_DRAW_UNUSED_ms);
    bench_is_told(12000, 12000);
    bench_draws(10999);
    TEST_ASSERT_FALSE(bench_update_after(1000));
    TEST_ASSERT_EQUAL_INT32(12000, draw.cap_mA);
    bench_draws(11000);
    TEST_ASSERT_TRUE(bench_update_after(1));
    TEST_ASSERT_EQUAL_INT32(TAPER_NO_LIMIT, draw.cap_mA);
}

static void test_its_maximum_lasts_while_it_waits_and_ends_with_the_session(void) {
    bench_draws(10000);
    bench_update();
    bench_update_after(TAPER_DRAW_UNUSED_ms);
    bench_is_told(0, 0);
    bench_draws(0);
    TEST_ASSERT_FALSE(bench_update_after(600000));
    TEST_ASSERT_EQUAL_INT32(12000, draw.cap_mA);
    report.session = 2;
    TEST_ASSERT_TRUE(bench_update_after(1));
    TEST_ASSERT_EQUAL_INT32(TAPER_NO_LIMIT, draw.cap_mA);
}

static void test_with_ticks_of_a_quarter_of_an_hour_the_second_report_decides(void) {
    bench_draws(8000);
    TEST_ASSERT_FALSE(bench_update_after(900000));
    TEST_ASSERT_TRUE(bench_update_after(900000));
    TEST_ASSERT_EQUAL_INT32(10000, draw.cap_mA);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_what_is_not_used_for_a_minute_is_given_away);
    RUN_TEST(test_two_amperes_below_the_setpoint_are_left_to_the_vehicle);
    RUN_TEST(test_a_moment_of_use_begins_the_minute_anew);
    RUN_TEST(test_its_maximum_goes_by_the_most_it_drew_in_that_minute);
    RUN_TEST(test_its_maximum_falls_further_when_it_takes_still_less);
    RUN_TEST(test_each_minute_is_judged_by_itself);
    RUN_TEST(test_its_maximum_is_no_less_than_its_minimum);
    RUN_TEST(test_who_comes_within_an_ampere_of_its_maximum_has_its_own_again_at_once);
    RUN_TEST(test_its_maximum_lasts_while_it_waits_and_ends_with_the_session);
    RUN_TEST(test_with_ticks_of_a_quarter_of_an_hour_the_second_report_decides);
    return UNITY_END();
}
