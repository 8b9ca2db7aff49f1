/* The fallback current that a connector may have been told last. scene_four() with a reaction of 5 s. */
#include "ledger_bench.h"
#include "unity.h"

void setUp(void) {
    bench_begin();
}
void tearDown(void) {}

static void test_a_connector_out_of_reach_draws_its_fallback_current_for_ever(void) {
    bench_send(0, 16000, 6000);
    bench_hear_echo(0);
    TEST_ASSERT_EQUAL_INT32(6000, bench_fallback_mA());
    bench_wait_ms(EXPIRED_ms);
    bench_assert_changes_after(REACTION_ms, 16000, 6000);
    bench_wait_ms(UINT32_C(0x7fffffff));
    bench_wait_ms(UINT32_C(0x7fffffff));
    TEST_ASSERT_EQUAL_INT32(6000, bench_may_mA());
    TEST_ASSERT_EQUAL_INT32(6000, bench_fallback_mA());
}

static void test_a_connector_that_was_told_to_fall_back_to_nothing_counts_nothing(void) {
    bench_send(0, 16000, 0);
    bench_wait_ms(EXPIRED_ms);
    bench_wait_ms(REACTION_ms);
    TEST_ASSERT_EQUAL_INT32(0, bench_may_mA());
    TEST_ASSERT_EQUAL_INT32(0, bench_fallback_mA());
}

static void test_an_old_fallback_current_counts_until_a_later_setpoint_is_echoed(void) {
    bench_send(0, 16000, 10000);
    bench_wait_ms(EXPIRED_ms);
    bench_send(1, 6000, 6000);
    TEST_ASSERT_EQUAL_INT32(10000, bench_fallback_mA());
    bench_wait_ms(EXPIRED_ms); /* lost */
    TEST_ASSERT_EQUAL_INT32(10000, bench_fallback_mA());
    bench_send(2, 6000, 6000);
    bench_wait_ms(REACTION_ms);
    TEST_ASSERT_EQUAL_INT32(10000, bench_may_mA());
    bench_send(3, 6000, 0);
    bench_hear_echo(3);
    TEST_ASSERT_EQUAL_INT32(0, bench_fallback_mA());
    TEST_ASSERT_EQUAL_INT32(10000, bench_may_mA()); /* and the vehicle has its time to leave it */
    bench_wait_ms(2000);
    bench_send(4, 6000, 0);
    bench_assert_changes_after(REACTION_ms - 2000, 10000, 6000);
}

static void test_an_echo_that_is_lower_ends_the_fallback_currents_before_it_and_none_after(void) {
    bench_send(0, 16000, 10000);
    bench_wait_ms(1);
    bench_send(1, 16000, 8000);
    bench_wait_ms(1);
    bench_send(2, 16000, 9000);
    TEST_ASSERT_EQUAL_INT32(10000, bench_fallback_mA());
    bench_hear_echo(1);
    TEST_ASSERT_EQUAL_INT32(9000, bench_fallback_mA());
    bench_wait_ms(EXPIRED_ms);
    TEST_ASSERT_EQUAL_INT32(9000, bench_fallback_mA());
}

static void test_an_echo_of_what_expired_ends_no_fallback_current(void) {
    bench_send(0, 16000, 10000);
    bench_wait_ms(1);
    bench_send(1, 16000, 6000);
    bench_wait_ms(EXPIRED_ms);
    bench_hear_echo(1);
    TEST_ASSERT_EQUAL_INT32(10000, bench_fallback_mA());
}

static void test_a_fallback_current_ends_with_the_vehicle(void) {
    bench_send(0, 16000, 10000);
    bench_wait_ms(EXPIRED_ms);
    bench_hear_no_vehicle();
    TEST_ASSERT_EQUAL_INT32(0, bench_fallback_mA());
    TEST_ASSERT_EQUAL_INT32(0, bench_may_mA());
}

static void test_a_report_of_fallback_keeps_the_highest_that_may_be_meant(void) {
    bench_send(0, 16000, 10000);
    bench_wait_ms(1);
    bench_send(1, 6000, 6000);
    bench_wait_ms(2 * TAPER_LEDGER_LATE_ms);
    bench_hear_fallback();
    TEST_ASSERT_EQUAL_INT32(10000, bench_fallback_mA());
}

static void test_who_ran_out_of_setpoints_is_out_of_reach_until_it_is_heard_to_accept_one(void) {
    bench_send(0, 16000, 6000);
    bench_wait_ms(EXPIRED_ms - 1);
    TEST_ASSERT_EQUAL_INT32(0, taper_ledger_unreached_mA(&ledger, 0));
    bench_wait_ms(1);
    TEST_ASSERT_EQUAL_INT32(6000, taper_ledger_unreached_mA(&ledger, 0));
    TEST_ASSERT_EQUAL_INT32(0, taper_ledger_unreached_mA(&ledger, 1));
    bench_send(1, 8000, 8000);
    TEST_ASSERT_EQUAL_INT32(6000, taper_ledger_unreached_mA(&ledger, 0));
    bench_hear_echo(1);
    TEST_ASSERT_EQUAL_INT32(0, taper_ledger_unreached_mA(&ledger, 0));
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_a_connector_out_of_reach_draws_its_fallback_current_for_ever);
    RUN_TEST(test_a_connector_that_was_told_to_fall_back_to_nothing_counts_nothing);
    RUN_TEST(test_an_old_fallback_current_counts_until_a_later_setpoint_is_echoed);
    RUN_TEST(test_an_echo_that_is_lower_ends_the_fallback_currents_before_it_and_none_after);
    RUN_TEST(test_an_echo_of_what_expired_ends_no_fallback_current);
    RUN_TEST(test_a_fallback_current_ends_with_the_vehicle);
    RUN_TEST(test_a_report_of_fallback_keeps_the_highest_that_may_be_meant);
    RUN_TEST(test_who_ran_out_of_setpoints_is_out_of_reach_until_it_is_heard_to_accept_one);
    return UNITY_END();
}
