/* Who draws more than it was told (faults 41 and 42): every time and current of the table in draw.h, at its boundary. */
#include "draw_bench.h"
#include "unity.h"

void setUp(void) {
    bench_start();
}
void tearDown(void) {}

/** It over-drew for 7 s, and is told to pause. */
static void over_draw(void) {
    bench_draws(30000);
    TEST_ASSERT_FALSE(bench_update());
    TEST_ASSERT_TRUE(bench_update_after(TAPER_DRAW_OVER_ms));
    TEST_ASSERT_EQUAL_INT(TAPER_DRAW_OVER, draw.state);
    bench_is_told(0, 0);
}

static void lock(void) {
    over_draw();
    TEST_ASSERT_TRUE(bench_update_after(TAPER_DRAW_OPEN_ms));
    TEST_ASSERT_EQUAL_INT(TAPER_DRAW_LOCKED, draw.state);
}

static void test_the_tolerance_is_half_an_ampere_and_ten_percent(void) {
    TEST_ASSERT_EQUAL_INT32(550, taper_draw_tolerated_mA(0));
    TEST_ASSERT_EQUAL_INT32(7150, taper_draw_tolerated_mA(6000));
    TEST_ASSERT_EQUAL_INT32(18150, taper_draw_tolerated_mA(16000));
    TEST_ASSERT_EQUAL_INT32(661, taper_draw_tolerated_mA(101)); /* 661.1 */
    TEST_ASSERT_EQUAL_INT32(INT32_MAX, taper_draw_tolerated_mA(INT32_MAX));
}

static void test_who_draws_what_it_was_told_is_normal_for_ever(void) {
    for (int k = 0; k < 1000; k++) {
        TEST_ASSERT_FALSE(bench_update_after(1000));
    }
    TEST_ASSERT_EQUAL_INT(TAPER_DRAW_NORMAL, draw.state);
    TEST_ASSERT_EQUAL_INT32(TAPER_NO_LIMIT, draw.cap_mA);
}

static void test_over_draw_counts_after_seven_seconds_and_not_before(void) {
    bench_draws(18151);
    TEST_ASSERT_FALSE(bench_update());
    TEST_ASSERT_FALSE(bench_update_after(TAPER_DRAW_OVER_ms - 1));
    TEST_ASSERT_EQUAL_INT(TAPER_DRAW_NORMAL, draw.state);
    TEST_ASSERT_TRUE(bench_update_after(1));
    TEST_ASSERT_EQUAL_INT(TAPER_DRAW_OVER, draw.state);
    TEST_ASSERT_FALSE(bench_update_after(1));
}

static void test_what_is_tolerated_is_no_over_draw(void) {
    bench_draws(18150);
    bench_update();
    TEST_ASSERT_FALSE(bench_update_after(60000));
    TEST_ASSERT_EQUAL_INT(TAPER_DRAW_NORMAL, draw.state);
}

static void test_a_moment_within_the_tolerance_begins_the_seven_seconds_anew(void) {
    bench_draws(20000);
    bench_update();
    bench_update_after(6999);
    bench_draws(16000);
    bench_update_after(1);
    bench_draws(20000);
    bench_update_after(1);
    TEST_ASSERT_FALSE(bench_update_after(TAPER_DRAW_OVER_ms - 1));
    TEST_ASSERT_TRUE(bench_update_after(1));
}

static void test_a_setpoint_that_was_lowered_binds_when_the_vehicle_had_its_time(void) {
    bench_is_told(6000, 16000);
    bench_update();
    TEST_ASSERT_FALSE(bench_update_after(20000));
    bench_is_told(6000, 6000);
    TEST_ASSERT_FALSE(bench_update_after(1));
    TEST_ASSERT_FALSE(bench_update_after(TAPER_DRAW_OVER_ms - 1));
    TEST_ASSERT_TRUE(bench_update_after(1));
    TEST_ASSERT_EQUAL_INT(TAPER_DRAW_OVER, draw.state);
}

static void test_less_than_an_ampere_is_nobodys_over_draw(void) {
    bench_is_told(0, 0);
    bench_draws(1000);
    bench_update();
    TEST_ASSERT_FALSE(bench_update_after(60000));
    TEST_ASSERT_EQUAL_INT(TAPER_DRAW_NORMAL, draw.state);
}

static void test_who_still_draws_ten_seconds_after_over_draw_is_locked_out(void) {
    over_draw();
    bench_draws(1001);
    TEST_ASSERT_FALSE(bench_update_after(TAPER_DRAW_OPEN_ms - 1));
    TEST_ASSERT_EQUAL_INT(TAPER_DRAW_OVER, draw.state);
    TEST_ASSERT_TRUE(bench_update_after(1));
    TEST_ASSERT_EQUAL_INT(TAPER_DRAW_LOCKED, draw.state);
}

static void test_who_stops_in_between_has_ten_seconds_again(void) {
    over_draw();
    bench_update_after(9999);
    bench_draws(1000);
    bench_update_after(1);
    bench_draws(1001);
    bench_update_after(1);
    TEST_ASSERT_FALSE(bench_update_after(TAPER_DRAW_OPEN_ms - 1));
    TEST_ASSERT_TRUE(bench_update_after(1));
    TEST_ASSERT_EQUAL_INT(TAPER_DRAW_LOCKED, draw.state);
}

static void test_after_a_minute_of_calm_over_draw_is_forgiven(void) {
    over_draw();
    bench_draws(1000);
    TEST_ASSERT_FALSE(bench_update_after(1000));
    TEST_ASSERT_FALSE(bench_update_after(TAPER_DRAW_CALM_ms - 1));
    TEST_ASSERT_EQUAL_INT(TAPER_DRAW_OVER, draw.state);
    TEST_ASSERT_TRUE(bench_update_after(1));
    TEST_ASSERT_EQUAL_INT(TAPER_DRAW_NORMAL, draw.state);
    bench_is_told(16000, 16000);
    bench_draws(16000);
    TEST_ASSERT_FALSE(bench_update_after(600000));
}

static void test_a_spark_begins_the_minute_of_calm_anew(void) {
    over_draw();
    bench_draws(0);
    bench_update_after(1000);
    bench_update_after(TAPER_DRAW_CALM_ms - 1);
    bench_draws(1001);
    bench_update_after(1);
    bench_draws(0);
    bench_update_after(1);
    TEST_ASSERT_FALSE(bench_update_after(TAPER_DRAW_CALM_ms - 1));
    TEST_ASSERT_TRUE(bench_update_after(1));
    TEST_ASSERT_EQUAL_INT(TAPER_DRAW_NORMAL, draw.state);
}

static void test_after_calm_over_draw_takes_seven_seconds_again(void) {
    over_draw();
    bench_draws(0);
    bench_update_after(1);
    bench_update_after(TAPER_DRAW_CALM_ms);
    bench_is_told(16000, 16000);
    bench_draws(30000);
    TEST_ASSERT_FALSE(bench_update_after(1));
    TEST_ASSERT_FALSE(bench_update_after(TAPER_DRAW_OVER_ms - 1));
    TEST_ASSERT_TRUE(bench_update_after(1));
    TEST_ASSERT_EQUAL_INT(TAPER_DRAW_OVER, draw.state);
}

static void test_who_ignores_a_stop_is_locked_out_after_six_seconds(void) {
    bench_update();
    bench_is_told(0, 0);
    bench_draws(1001);
    TEST_ASSERT_FALSE(bench_update_after(1000));
    TEST_ASSERT_FALSE(bench_update_after(TAPER_DRAW_IGNORES_ms - 1));
    TEST_ASSERT_EQUAL_INT(TAPER_DRAW_NORMAL, draw.state);
    TEST_ASSERT_TRUE(bench_update_after(1));
    TEST_ASSERT_EQUAL_INT(TAPER_DRAW_LOCKED, draw.state);
}

static void test_one_ampere_ignores_no_stop(void) {
    bench_is_told(0, 0);
    bench_draws(1000);
    bench_update();
    TEST_ASSERT_FALSE(bench_update_after(TAPER_DRAW_IGNORES_ms * 2));
    TEST_ASSERT_EQUAL_INT(TAPER_DRAW_NORMAL, draw.state);
}

static void test_the_six_seconds_count_from_the_stop_and_bind_when_the_vehicle_had_its_time(void) {
    bench_is_told(0, 16000);
    TEST_ASSERT_FALSE(bench_update());
    TEST_ASSERT_FALSE(bench_update_after(20000));
    bench_is_told(0, 0);
    TEST_ASSERT_TRUE(bench_update_after(1));
    TEST_ASSERT_EQUAL_INT(TAPER_DRAW_LOCKED, draw.state);
}

static void test_who_is_out_of_reach_and_draws_its_fallback_current_ignores_no_stop(void) {
    bench_is_told(0, 6000);
    bench_draws(7150);
    bench_update();
    TEST_ASSERT_FALSE(bench_update_after(60000));
    TEST_ASSERT_EQUAL_INT(TAPER_DRAW_NORMAL, draw.state);
    bench_draws(7151);
    TEST_ASSERT_TRUE(bench_update_after(1));
    TEST_ASSERT_EQUAL_INT(TAPER_DRAW_LOCKED, draw.state);
}

static void test_a_stop_that_was_taken_back_is_not_ignored(void) {
    bench_is_told(0, 0);
    bench_update();
    bench_update_after(TAPER_DRAW_IGNORES_ms - 1);
    bench_is_told(16000, 16000);
    bench_update_after(1);
    bench_is_told(0, 0);
    TEST_ASSERT_FALSE(bench_update_after(1));
    TEST_ASSERT_FALSE(bench_update_after(TAPER_DRAW_IGNORES_ms - 1));
    TEST_ASSERT_TRUE(bench_update_after(1));
}

static void test_locked_stays_locked_whatever_it_draws_until_it_is_unplugged(void) {
    lock();
    bench_draws(0);
    TEST_ASSERT_FALSE(bench_update_after(600000));
    report.session = 2;
    TEST_ASSERT_FALSE(bench_update_after(1));
    TEST_ASSERT_FALSE(bench_update_after(600000));
    TEST_ASSERT_EQUAL_INT(TAPER_DRAW_LOCKED, draw.state);
    report.plugged = false;
    TEST_ASSERT_TRUE(bench_update_after(1));
    TEST_ASSERT_EQUAL_INT(TAPER_DRAW_NORMAL, draw.state);
    report.plugged = true;
    TEST_ASSERT_FALSE(bench_update_after(1));
}

static void test_unplugging_ends_over_draw_and_so_does_another_session(void) {
    over_draw();
    report.session = 2;
    bench_draws(0);
    TEST_ASSERT_TRUE(bench_update_after(1));
    TEST_ASSERT_EQUAL_INT(TAPER_DRAW_NORMAL, draw.state);
    bench_is_told(16000, 16000);
    over_draw();
    report.plugged = false;
    TEST_ASSERT_TRUE(bench_update_after(1));
    TEST_ASSERT_EQUAL_INT(TAPER_DRAW_NORMAL, draw.state);
}

static void test_times_do_not_pass_from_one_session_to_the_next(void) {
    bench_draws(30000);
    bench_update();
    bench_update_after(TAPER_DRAW_OVER_ms - 1);
    report.session = 2;
    TEST_ASSERT_FALSE(bench_update_after(1));
    TEST_ASSERT_FALSE(bench_update_after(TAPER_DRAW_OVER_ms - 1));
    TEST_ASSERT_TRUE(bench_update_after(1));
}

static void test_an_unplugged_connector_is_not_judged(void) {
    report.plugged = false;
    bench_draws(30000);
    bench_is_told(0, 0);
    for (int k = 0; k < 100; k++) {
        TEST_ASSERT_FALSE(bench_update_after(1000));
    }
    TEST_ASSERT_EQUAL_INT(TAPER_DRAW_NORMAL, draw.state);
    TEST_ASSERT_EQUAL_INT32(TAPER_NO_LIMIT, draw.cap_mA);
}

static void test_while_nothing_is_measured_nothing_is_judged(void) {
    bench_draws(TAPER_ABSENT);
    bench_is_told(0, 0);
    bench_update();
    TEST_ASSERT_FALSE(bench_update_after(600000));
    TEST_ASSERT_EQUAL_INT(TAPER_DRAW_NORMAL, draw.state);
    TEST_ASSERT_EQUAL_INT32(TAPER_NO_LIMIT, draw.cap_mA);
}

static void test_gaps_in_what_is_measured_hide_nothing(void) {
    bench_draws(30000);
    bench_update();
    bench_draws(TAPER_ABSENT);
    TEST_ASSERT_FALSE(bench_update_after(TAPER_DRAW_OVER_ms));
    bench_draws(30000);
    TEST_ASSERT_TRUE(bench_update_after(1));
    TEST_ASSERT_EQUAL_INT(TAPER_DRAW_OVER, draw.state);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_the_tolerance_is_half_an_ampere_and_ten_percent);
    RUN_TEST(test_who_draws_what_it_was_told_is_normal_for_ever);
    RUN_TEST(test_over_draw_counts_after_seven_seconds_and_not_before);
    RUN_TEST(test_what_is_tolerated_is_no_over_draw);
    RUN_TEST(test_a_moment_within_the_tolerance_begins_the_seven_seconds_anew);
    RUN_TEST(test_a_setpoint_that_was_lowered_binds_when_the_vehicle_had_its_time);
    RUN_TEST(test_less_than_an_ampere_is_nobodys_over_draw);
    RUN_TEST(test_who_still_draws_ten_seconds_after_over_draw_is_locked_out);
    RUN_TEST(test_who_stops_in_between_has_ten_seconds_again);
    RUN_TEST(test_after_a_minute_of_calm_over_draw_is_forgiven);
    RUN_TEST(test_a_spark_begins_the_minute_of_calm_anew);
    RUN_TEST(test_after_calm_over_draw_takes_seven_seconds_again);
    RUN_TEST(test_who_ignores_a_stop_is_locked_out_after_six_seconds);
    RUN_TEST(test_one_ampere_ignores_no_stop);
    RUN_TEST(test_the_six_seconds_count_from_the_stop_and_bind_when_the_vehicle_had_its_time);
    RUN_TEST(test_who_is_out_of_reach_and_draws_its_fallback_current_ignores_no_stop);
    RUN_TEST(test_a_stop_that_was_taken_back_is_not_ignored);
    RUN_TEST(test_locked_stays_locked_whatever_it_draws_until_it_is_unplugged);
    RUN_TEST(test_unplugging_ends_over_draw_and_so_does_another_session);
    RUN_TEST(test_times_do_not_pass_from_one_session_to_the_next);
    RUN_TEST(test_an_unplugged_connector_is_not_judged);
    RUN_TEST(test_while_nothing_is_measured_nothing_is_judged);
    RUN_TEST(test_gaps_in_what_is_measured_hide_nothing);
    return UNITY_END();
}
