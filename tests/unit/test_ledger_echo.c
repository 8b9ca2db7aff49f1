/* What an echo proves when the counter of a setpoint was corrupted on its way. scene_four() with a reaction of 5 s. */
#include "ledger_bench.h"
#include "unity.h"

void setUp(void) {
    bench_begin();
}
void tearDown(void) {}

static void test_an_echo_that_came_before_its_setpoint_was_sent_does_not_prove_that_one(void) {
    bench_send(0, 16000, 0);
    bench_hear_echo(1); /* it took 0 for 1, and will take 1 for a repetition */
    bench_send(1, 6000, 0);
    bench_hear_echo(1);
    bench_wait_ms(REACTION_ms / 2);
    TEST_ASSERT_EQUAL_INT32(16000, bench_may_mA());
    bench_send(2, 6000, 0);
    bench_hear_echo(2);
    bench_assert_changes_after(REACTION_ms, 16000, 6000);
}

static void test_a_counter_that_was_echoed_too_soon_proves_again_when_it_is_used_again(void) {
    bench_hear_echo(1);
    bench_send(1, 16000, 0);
    bench_hear_echo(1);
    TEST_ASSERT_FALSE(taper_ledger_is_accepted(&ledger, 0));
    bench_send(2, 16000, 0);
    bench_hear_echo(2);
    bench_wait_ms(1000);
    bench_send(1, 0, 0);
    bench_hear_echo(1);
    bench_assert_changes_after(REACTION_ms, 16000, 0);
}

static void test_other_counters_prove_though_one_was_echoed_too_soon(void) {
    bench_hear_echo(3);
    bench_send(3, 16000, 0);
    bench_send(4, 6000, 0);
    bench_hear_echo(4);
    bench_assert_changes_after(REACTION_ms, 16000, 6000);
}

static void test_after_fallback_an_echo_is_news_whatever_it_was_before(void) {
    bench_hear_echo(1);
    bench_hear_fallback();
    bench_send(1, 6000, 0);
    bench_hear_echo(1);
    TEST_ASSERT_TRUE(taper_ledger_is_accepted(&ledger, 0));
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_an_echo_that_came_before_its_setpoint_was_sent_does_not_prove_that_one);
    RUN_TEST(test_a_counter_that_was_echoed_too_soon_proves_again_when_it_is_used_again);
    RUN_TEST(test_other_counters_prove_though_one_was_echoed_too_soon);
    RUN_TEST(test_after_fallback_an_echo_is_news_whatever_it_was_before);
    return UNITY_END();
}
