/* What an earlier life of the controller may have told, and how it ends. scene_four() with a reaction of 5 s. */
#include "ledger_bench.h"
#include "unity.h"

void setUp(void) {
    bench_begin();
}
void tearDown(void) {}

static void test_after_a_start_nobody_is_known_to_be_within_reach(void) {
    connectors[0].fallback_mA = 7000;
    bench_start(1);
    TEST_ASSERT_EQUAL_INT32(7000, taper_ledger_unreached_mA(&ledger, 0));
}

static void test_after_a_start_its_maximum_counts_until_it_is_left_and_then_its_fallback_current(void) {
    connectors[0].fallback_mA = 7000;
    bench_start(1);
    TEST_ASSERT_EQUAL_INT32(7000, bench_fallback_mA());
    TEST_ASSERT_EQUAL_INT32(32000, bench_told_mA());
    bench_assert_changes_after(EXPIRED_ms + REACTION_ms, 32000, 7000);
    bench_wait_ms(3600000);
    TEST_ASSERT_EQUAL_INT32(7000, bench_may_mA());
}

static void test_after_a_start_fallback_ends_it_sooner_and_only_once(void) {
    connectors[0].fallback_mA = 7000;
    bench_start(1);
    bench_wait_ms(100);
    bench_hear_fallback();
    TEST_ASSERT_EQUAL_INT32(32000, bench_may_mA());
    bench_wait_ms(200);
    bench_hear_fallback();
    bench_assert_changes_after(REACTION_ms - 200, 32000, 7000);
}

static void test_after_a_start_a_late_proof_makes_it_last_no_longer(void) {
    bench_start(1);
    bench_wait_ms(EXPIRED_ms - 1);
    bench_hear_fallback();
    bench_assert_changes_after(REACTION_ms, 32000, 0);
    bench_start(1);
    bench_wait_ms(EXPIRED_ms + 1);
    bench_hear_fallback();
    bench_assert_changes_after(REACTION_ms - 1, 32000, 0);
}

static void test_a_setpoint_is_accepted_when_its_echo_cannot_be_of_an_earlier_life(void) {
    bench_start(1);
    bench_send(0, 6000, 0);
    bench_send(1, 6000, 0);
    bench_hear_echo(0);
    bench_hear_echo(0);
    TEST_ASSERT_FALSE(taper_ledger_is_accepted(&ledger, 0));
    bench_hear_echo(7); /* of long ago */
    TEST_ASSERT_FALSE(taper_ledger_is_accepted(&ledger, 0));
    bench_hear_echo(1);
    TEST_ASSERT_TRUE(taper_ledger_is_accepted(&ledger, 0));
    bench_start(1);
    bench_hear_fallback(); /* what comes now is ours, but nothing came yet */
    TEST_ASSERT_FALSE(taper_ledger_is_accepted(&ledger, 0));
    bench_send(0, 6000, 0);
    bench_hear_echo(0);
    TEST_ASSERT_TRUE(taper_ledger_is_accepted(&ledger, 0));
}

static void test_a_start_is_over_when_nothing_of_an_earlier_life_is_in_force_anywhere(void) {
    bench_start(1);
    TEST_ASSERT_TRUE(taper_ledger_is_starting(&ledger));
    bench_wait_ms(EXPIRED_ms + REACTION_ms - 1);
    TEST_ASSERT_TRUE(taper_ledger_is_starting(&ledger));
    bench_wait_ms(1);
    TEST_ASSERT_FALSE(taper_ledger_is_starting(&ledger));
    const uint8_t count = ledger.config->connector_count;
    for (uint8_t i = 0; i <= count && i < TAPER_MAX_CONNECTORS; i++) {
        ledger.entry[i].unknown_mA = 1;
        TEST_ASSERT_EQUAL(i < count, taper_ledger_is_starting(&ledger)); /* any of them, and nobody else */
        ledger.entry[i].unknown_mA = 0;
    }
}

static void test_after_a_start_two_different_echoes_prove_ours(void) {
    connectors[0].fallback_mA = 7000;
    bench_start(1);
    bench_send(0, 6000, 0);
    bench_send(1, 6000, 0);
    bench_hear_echo(0);
    bench_hear_echo(0);
    TEST_ASSERT_EQUAL_INT32(7000, bench_fallback_mA());
    bench_hear_echo(1);
    TEST_ASSERT_EQUAL_INT32(0, bench_fallback_mA());
    TEST_ASSERT_EQUAL_INT32(32000, bench_may_mA());
    bench_wait_ms(3000);
    bench_send(2, 6000, 0);
    bench_assert_changes_after(REACTION_ms - 3000, 32000, 6000);
}

static void test_after_a_start_the_first_echo_is_ours_when_no_other_can_be_heard(void) {
    connectors[0].fallback_mA = 7000;
    bench_start(1);
    bench_wait_ms(EXPIRED_ms - 1);
    bench_send(0, 6000, 0);
    bench_hear_echo(0);
    TEST_ASSERT_EQUAL_INT32(7000, bench_fallback_mA());
    bench_wait_ms(1);
    bench_hear_echo(0);
    TEST_ASSERT_EQUAL_INT32(0, bench_fallback_mA());
}

static void test_after_a_start_an_echo_after_fallback_is_ours(void) {
    connectors[0].fallback_mA = 7000;
    bench_start(1);
    bench_hear_fallback();
    bench_send(0, 6000, 0);
    bench_hear_echo(0);
    TEST_ASSERT_EQUAL_INT32(0, bench_fallback_mA());
}

static void test_after_a_start_an_empty_connector_counts_nothing_and_its_first_echo_is_ours(void) {
    connectors[0].fallback_mA = 7000;
    bench_start(1);
    bench_hear_no_vehicle();
    TEST_ASSERT_EQUAL_INT32(0, bench_may_mA());
    TEST_ASSERT_EQUAL_INT32(0, bench_fallback_mA());
    bench_send(0, 16000, 8000);
    bench_send(1, 6000, 0);
    bench_hear_echo(1);
    TEST_ASSERT_EQUAL_INT32(0, bench_fallback_mA());
}

static void test_after_a_start_a_lower_setpoint_of_ours_hides_nothing(void) {
    bench_start(1);
    bench_send(0, 6000, 0);
    bench_wait_ms(EXPIRED_ms);
    TEST_ASSERT_EQUAL_INT32(32000, bench_may_mA());
    bench_assert_changes_after(REACTION_ms, 32000, 0);
}

static void test_who_is_not_there_is_left_alone(void) {
    bench_start(1);
    TEST_ASSERT_EQUAL_INT32(0, taper_ledger_told_mA(&ledger, 4));
    ledger.entry[4].unknown_mA = 777;
    bench_wait_ms(EXPIRED_ms + REACTION_ms);
    TEST_ASSERT_EQUAL_INT32(777, taper_ledger_told_mA(&ledger, 4));
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_after_a_start_nobody_is_known_to_be_within_reach);
    RUN_TEST(test_after_a_start_its_maximum_counts_until_it_is_left_and_then_its_fallback_current);
    RUN_TEST(test_after_a_start_fallback_ends_it_sooner_and_only_once);
    RUN_TEST(test_after_a_start_a_late_proof_makes_it_last_no_longer);
    RUN_TEST(test_a_setpoint_is_accepted_when_its_echo_cannot_be_of_an_earlier_life);
    RUN_TEST(test_a_start_is_over_when_nothing_of_an_earlier_life_is_in_force_anywhere);
    RUN_TEST(test_after_a_start_two_different_echoes_prove_ours);
    RUN_TEST(test_after_a_start_the_first_echo_is_ours_when_no_other_can_be_heard);
    RUN_TEST(test_after_a_start_an_echo_after_fallback_is_ours);
    RUN_TEST(test_after_a_start_an_empty_connector_counts_nothing_and_its_first_echo_is_ours);
    RUN_TEST(test_after_a_start_a_lower_setpoint_of_ours_hides_nothing);
    RUN_TEST(test_who_is_not_there_is_left_alone);
    return UNITY_END();
}
