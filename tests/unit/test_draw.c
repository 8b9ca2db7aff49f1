/* What vehicles draw against what they were told: every time and current of the table in draw.h, at its boundary. */
#include "taper/draw.h"

#include "unity.h"

#define START_ms (UINT32_MAX - 3000u) /* the clock wraps within every time that counts */

static taper_draw_t draw;
static taper_draw_report_t report;
static uint32_t now_ms;

void setUp(void) {
    now_ms = START_ms;
    taper_draw_init(&draw);
    report = (taper_draw_report_t){.plugged = true,
                                   .session = 1,
                                   .allowed_mA = 16000,
                                   .setpoint_mA = 16000,
                                   .measured_mA = 16000,
                                   .min_mA = 6000};
}
void tearDown(void) {}

static bool update(void) {
    return taper_draw_update(&draw, &report, now_ms);
}

static bool update_after(uint32_t ms) {
    now_ms += ms;
    return update();
}

static void draws(int32_t measured_mA) {
    report.measured_mA = measured_mA;
}

static void is_told(int32_t setpoint_mA, int32_t allowed_mA) {
    report.setpoint_mA = setpoint_mA;
    report.allowed_mA = allowed_mA;
}

/** It over-drew for 7 s, and is told to pause. */
static void over_draw(void) {
    draws(30000);
    TEST_ASSERT_FALSE(update());
    TEST_ASSERT_TRUE(update_after(TAPER_DRAW_OVER_ms));
    TEST_ASSERT_EQUAL_INT(TAPER_DRAW_OVER, draw.state);
    is_told(0, 0);
}

static void lock(void) {
    over_draw();
    TEST_ASSERT_TRUE(update_after(TAPER_DRAW_OPEN_ms));
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
        TEST_ASSERT_FALSE(update_after(1000));
    }
    TEST_ASSERT_EQUAL_INT(TAPER_DRAW_NORMAL, draw.state);
    TEST_ASSERT_EQUAL_INT32(TAPER_NO_LIMIT, draw.cap_mA);
}

static void test_over_draw_counts_after_seven_seconds_and_not_before(void) {
    draws(18151);
    TEST_ASSERT_FALSE(update());
    TEST_ASSERT_FALSE(update_after(TAPER_DRAW_OVER_ms - 1));
    TEST_ASSERT_EQUAL_INT(TAPER_DRAW_NORMAL, draw.state);
    TEST_ASSERT_TRUE(update_after(1));
    TEST_ASSERT_EQUAL_INT(TAPER_DRAW_OVER, draw.state);
    TEST_ASSERT_FALSE(update_after(1));
}

static void test_what_is_tolerated_is_no_over_draw(void) {
    draws(18150);
    update();
    TEST_ASSERT_FALSE(update_after(60000));
    TEST_ASSERT_EQUAL_INT(TAPER_DRAW_NORMAL, draw.state);
}

static void test_a_moment_within_the_tolerance_begins_the_seven_seconds_anew(void) {
    draws(20000);
    update();
    update_after(6999);
    draws(16000);
    update_after(1);
    draws(20000);
    update_after(1);
    TEST_ASSERT_FALSE(update_after(TAPER_DRAW_OVER_ms - 1));
    TEST_ASSERT_TRUE(update_after(1));
}

static void test_a_setpoint_that_was_lowered_binds_when_the_vehicle_had_its_time(void) {
    is_told(6000, 16000);
    update();
    TEST_ASSERT_FALSE(update_after(20000));
    is_told(6000, 6000);
    TEST_ASSERT_FALSE(update_after(1));
    TEST_ASSERT_FALSE(update_after(TAPER_DRAW_OVER_ms - 1));
    TEST_ASSERT_TRUE(update_after(1));
    TEST_ASSERT_EQUAL_INT(TAPER_DRAW_OVER, draw.state);
}

static void test_less_than_an_ampere_is_nobodys_over_draw(void) {
    is_told(0, 0);
    draws(1000);
    update();
    TEST_ASSERT_FALSE(update_after(60000));
    TEST_ASSERT_EQUAL_INT(TAPER_DRAW_NORMAL, draw.state);
}

static void test_who_still_draws_ten_seconds_after_over_draw_is_locked_out(void) {
    over_draw();
    draws(1001);
    TEST_ASSERT_FALSE(update_after(TAPER_DRAW_OPEN_ms - 1));
    TEST_ASSERT_EQUAL_INT(TAPER_DRAW_OVER, draw.state);
    TEST_ASSERT_TRUE(update_after(1));
    TEST_ASSERT_EQUAL_INT(TAPER_DRAW_LOCKED, draw.state);
}

static void test_who_stops_in_between_has_ten_seconds_again(void) {
    over_draw();
    update_after(9999);
    draws(1000);
    update_after(1);
    draws(1001);
    update_after(1);
    TEST_ASSERT_FALSE(update_after(TAPER_DRAW_OPEN_ms - 1));
    TEST_ASSERT_TRUE(update_after(1));
    TEST_ASSERT_EQUAL_INT(TAPER_DRAW_LOCKED, draw.state);
}

static void test_after_a_minute_of_calm_over_draw_is_forgiven(void) {
    over_draw();
    draws(1000);
    TEST_ASSERT_FALSE(update_after(1000));
    TEST_ASSERT_FALSE(update_after(TAPER_DRAW_CALM_ms - 1));
    TEST_ASSERT_EQUAL_INT(TAPER_DRAW_OVER, draw.state);
    TEST_ASSERT_TRUE(update_after(1));
    TEST_ASSERT_EQUAL_INT(TAPER_DRAW_NORMAL, draw.state);
    is_told(16000, 16000);
    draws(16000);
    TEST_ASSERT_FALSE(update_after(600000));
}

static void test_a_spark_begins_the_minute_of_calm_anew(void) {
    over_draw();
    draws(0);
    update_after(1000);
    update_after(TAPER_DRAW_CALM_ms - 1);
    draws(1001);
    update_after(1);
    draws(0);
    update_after(1);
    TEST_ASSERT_FALSE(update_after(TAPER_DRAW_CALM_ms - 1));
    TEST_ASSERT_TRUE(update_after(1));
    TEST_ASSERT_EQUAL_INT(TAPER_DRAW_NORMAL, draw.state);
}

static void test_after_calm_over_draw_takes_seven_seconds_again(void) {
    over_draw();
    draws(0);
    update_after(1);
    update_after(TAPER_DRAW_CALM_ms);
    is_told(16000, 16000);
    draws(30000);
    TEST_ASSERT_FALSE(update_after(1));
    TEST_ASSERT_FALSE(update_after(TAPER_DRAW_OVER_ms - 1));
    TEST_ASSERT_TRUE(update_after(1));
    TEST_ASSERT_EQUAL_INT(TAPER_DRAW_OVER, draw.state);
}

static void test_who_ignores_a_stop_is_locked_out_after_six_seconds(void) {
    update();
    is_told(0, 0);
    draws(1001);
    TEST_ASSERT_FALSE(update_after(1000));
    TEST_ASSERT_FALSE(update_after(TAPER_DRAW_IGNORES_ms - 1));
    TEST_ASSERT_EQUAL_INT(TAPER_DRAW_NORMAL, draw.state);
    TEST_ASSERT_TRUE(update_after(1));
    TEST_ASSERT_EQUAL_INT(TAPER_DRAW_LOCKED, draw.state);
}

static void test_one_ampere_ignores_no_stop(void) {
    is_told(0, 0);
    draws(1000);
    update();
    TEST_ASSERT_FALSE(update_after(TAPER_DRAW_IGNORES_ms * 2));
    TEST_ASSERT_EQUAL_INT(TAPER_DRAW_NORMAL, draw.state);
}

static void test_the_six_seconds_count_from_the_stop_and_bind_when_the_vehicle_had_its_time(void) {
    is_told(0, 16000);
    TEST_ASSERT_FALSE(update());
    TEST_ASSERT_FALSE(update_after(20000));
    is_told(0, 0);
    TEST_ASSERT_TRUE(update_after(1));
    TEST_ASSERT_EQUAL_INT(TAPER_DRAW_LOCKED, draw.state);
}

static void test_who_is_out_of_reach_and_draws_its_fallback_current_ignores_no_stop(void) {
    is_told(0, 6000);
    draws(7150);
    update();
    TEST_ASSERT_FALSE(update_after(60000));
    TEST_ASSERT_EQUAL_INT(TAPER_DRAW_NORMAL, draw.state);
    draws(7151);
    TEST_ASSERT_TRUE(update_after(1));
    TEST_ASSERT_EQUAL_INT(TAPER_DRAW_LOCKED, draw.state);
}

static void test_a_stop_that_was_taken_back_is_not_ignored(void) {
    is_told(0, 0);
    update();
    update_after(TAPER_DRAW_IGNORES_ms - 1);
    is_told(16000, 16000);
    update_after(1);
    is_told(0, 0);
    TEST_ASSERT_FALSE(update_after(1));
    TEST_ASSERT_FALSE(update_after(TAPER_DRAW_IGNORES_ms - 1));
    TEST_ASSERT_TRUE(update_after(1));
}

static void test_locked_stays_locked_whatever_it_draws_until_it_is_unplugged(void) {
    lock();
    draws(0);
    TEST_ASSERT_FALSE(update_after(600000));
    report.session = 2;
    TEST_ASSERT_FALSE(update_after(1));
    TEST_ASSERT_FALSE(update_after(600000));
    TEST_ASSERT_EQUAL_INT(TAPER_DRAW_LOCKED, draw.state);
    report.plugged = false;
    TEST_ASSERT_TRUE(update_after(1));
    TEST_ASSERT_EQUAL_INT(TAPER_DRAW_NORMAL, draw.state);
    report.plugged = true;
    TEST_ASSERT_FALSE(update_after(1));
}

static void test_unplugging_ends_over_draw_and_so_does_another_session(void) {
    over_draw();
    report.session = 2;
    draws(0);
    TEST_ASSERT_TRUE(update_after(1));
    TEST_ASSERT_EQUAL_INT(TAPER_DRAW_NORMAL, draw.state);
    is_told(16000, 16000);
    over_draw();
    report.plugged = false;
    TEST_ASSERT_TRUE(update_after(1));
    TEST_ASSERT_EQUAL_INT(TAPER_DRAW_NORMAL, draw.state);
}

static void test_times_do_not_pass_from_one_session_to_the_next(void) {
    draws(30000);
    update();
    update_after(TAPER_DRAW_OVER_ms - 1);
    report.session = 2;
    TEST_ASSERT_FALSE(update_after(1));
    TEST_ASSERT_FALSE(update_after(TAPER_DRAW_OVER_ms - 1));
    TEST_ASSERT_TRUE(update_after(1));
}

static void test_an_unplugged_connector_is_not_judged(void) {
    report.plugged = false;
    draws(30000);
    is_told(0, 0);
    for (int k = 0; k < 100; k++) {
        TEST_ASSERT_FALSE(update_after(1000));
    }
    TEST_ASSERT_EQUAL_INT(TAPER_DRAW_NORMAL, draw.state);
    TEST_ASSERT_EQUAL_INT32(TAPER_NO_LIMIT, draw.cap_mA);
}

static void test_what_is_not_used_for_a_minute_is_given_away(void) {
    draws(13999);
    TEST_ASSERT_FALSE(update());
    TEST_ASSERT_FALSE(update_after(TAPER_DRAW_UNUSED_ms - 1));
    TEST_ASSERT_EQUAL_INT32(TAPER_NO_LIMIT, draw.cap_mA);
    TEST_ASSERT_TRUE(update_after(1));
    TEST_ASSERT_EQUAL_INT32(15999, draw.cap_mA);
    TEST_ASSERT_EQUAL_INT(TAPER_DRAW_NORMAL, draw.state);
}

static void test_two_amperes_below_the_setpoint_are_left_to_the_vehicle(void) {
    draws(14000);
    update();
    TEST_ASSERT_FALSE(update_after(600000));
    TEST_ASSERT_EQUAL_INT32(TAPER_NO_LIMIT, draw.cap_mA);
}

static void test_a_moment_of_use_begins_the_minute_anew(void) {
    draws(8000);
    update();
    update_after(TAPER_DRAW_UNUSED_ms - 1);
    draws(14000);
    update_after(1);
    draws(8000);
    update_after(1);
    TEST_ASSERT_FALSE(update_after(TAPER_DRAW_UNUSED_ms - 1));
    TEST_ASSERT_TRUE(update_after(1));
    TEST_ASSERT_EQUAL_INT32(10000, draw.cap_mA);
}

static void test_its_maximum_goes_by_the_most_it_drew_in_that_minute(void) {
    draws(12000);
    update(); /* ends before the minute that counts */
    draws(16000);
    update_after(1000);
    draws(8000);
    update_after(1000);
    draws(9500);
    update_after(30000);
    draws(7000);
    TEST_ASSERT_TRUE(update_after(30000));
    TEST_ASSERT_EQUAL_INT32(11500, draw.cap_mA);
}

static void test_its_maximum_falls_further_when_it_takes_still_less(void) {
    draws(10000);
    update();
    update_after(TAPER_DRAW_UNUSED_ms);
    TEST_ASSERT_EQUAL_INT32(12000, draw.cap_mA);
    is_told(12000, 12000);
    TEST_ASSERT_FALSE(update_after(TAPER_DRAW_UNUSED_ms)); /* 2 A below is what it is to have */
    draws(8000);
    update_after(1);
    TEST_ASSERT_TRUE(update_after(TAPER_DRAW_UNUSED_ms));
    TEST_ASSERT_EQUAL_INT32(10000, draw.cap_mA);
}

static void test_each_minute_is_judged_by_itself(void) {
    draws(9000);
    update();
    draws(7000);
    TEST_ASSERT_TRUE(update_after(TAPER_DRAW_UNUSED_ms));
    TEST_ASSERT_EQUAL_INT32(11000, draw.cap_mA);
    TEST_ASSERT_FALSE(update_after(1)); /* the setpoint did not fall yet */
    TEST_ASSERT_FALSE(update_after(TAPER_DRAW_UNUSED_ms - 1));
    TEST_ASSERT_TRUE(update_after(1));
    TEST_ASSERT_EQUAL_INT32(9000, draw.cap_mA);
}

static void test_its_maximum_is_no_less_than_its_minimum(void) {
    draws(0);
    update();
    TEST_ASSERT_TRUE(update_after(TAPER_DRAW_UNUSED_ms));
    TEST_ASSERT_EQUAL_INT32(6000, draw.cap_mA);
    is_told(6000, 6000);
    draws(4999);
    TEST_ASSERT_FALSE(update_after(1000));
    draws(5000);
    TEST_ASSERT_TRUE(update_after(1000));
    TEST_ASSERT_EQUAL_INT32(TAPER_NO_LIMIT, draw.cap_mA);
}

static void test_who_comes_within_an_ampere_of_its_maximum_has_its_own_again_at_once(void) {
    draws(10000);
    update();
    update_after(TAPER_DRAW_UNUSED_ms);
    is_told(12000, 12000);
    draws(10999);
    TEST_ASSERT_FALSE(update_after(1000));
    TEST_ASSERT_EQUAL_INT32(12000, draw.cap_mA);
    draws(11000);
    TEST_ASSERT_TRUE(update_after(1));
    TEST_ASSERT_EQUAL_INT32(TAPER_NO_LIMIT, draw.cap_mA);
}

static void test_its_maximum_lasts_while_it_waits_and_ends_with_the_session(void) {
    draws(10000);
    update();
    update_after(TAPER_DRAW_UNUSED_ms);
    is_told(0, 0);
    draws(0);
    TEST_ASSERT_FALSE(update_after(600000));
    TEST_ASSERT_EQUAL_INT32(12000, draw.cap_mA);
    report.session = 2;
    TEST_ASSERT_TRUE(update_after(1));
    TEST_ASSERT_EQUAL_INT32(TAPER_NO_LIMIT, draw.cap_mA);
}

static void test_while_nothing_is_measured_nothing_is_judged(void) {
    draws(TAPER_ABSENT);
    is_told(0, 0);
    update();
    TEST_ASSERT_FALSE(update_after(600000));
    TEST_ASSERT_EQUAL_INT(TAPER_DRAW_NORMAL, draw.state);
    TEST_ASSERT_EQUAL_INT32(TAPER_NO_LIMIT, draw.cap_mA);
}

static void test_gaps_in_what_is_measured_hide_nothing(void) {
    draws(30000);
    update();
    draws(TAPER_ABSENT);
    TEST_ASSERT_FALSE(update_after(TAPER_DRAW_OVER_ms));
    draws(30000);
    TEST_ASSERT_TRUE(update_after(1));
    TEST_ASSERT_EQUAL_INT(TAPER_DRAW_OVER, draw.state);
}

static void test_with_ticks_of_a_quarter_of_an_hour_the_second_report_decides(void) {
    draws(8000);
    TEST_ASSERT_FALSE(update_after(900000));
    TEST_ASSERT_TRUE(update_after(900000));
    TEST_ASSERT_EQUAL_INT32(10000, draw.cap_mA);
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
    RUN_TEST(test_what_is_not_used_for_a_minute_is_given_away);
    RUN_TEST(test_two_amperes_below_the_setpoint_are_left_to_the_vehicle);
    RUN_TEST(test_a_moment_of_use_begins_the_minute_anew);
    RUN_TEST(test_its_maximum_goes_by_the_most_it_drew_in_that_minute);
    RUN_TEST(test_its_maximum_falls_further_when_it_takes_still_less);
    RUN_TEST(test_each_minute_is_judged_by_itself);
    RUN_TEST(test_its_maximum_is_no_less_than_its_minimum);
    RUN_TEST(test_who_comes_within_an_ampere_of_its_maximum_has_its_own_again_at_once);
    RUN_TEST(test_its_maximum_lasts_while_it_waits_and_ends_with_the_session);
    RUN_TEST(test_while_nothing_is_measured_nothing_is_judged);
    RUN_TEST(test_gaps_in_what_is_measured_hide_nothing);
    RUN_TEST(test_with_ticks_of_a_quarter_of_an_hour_the_second_report_decides);
    return UNITY_END();
}
