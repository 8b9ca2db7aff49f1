/* Fault 39: a limit of the gateway that changes again within 5 s comes down at once, and goes up after 30 s. */
#include "limits_bench.h"
#include "unity.h"

static uint32_t now_ms;

void setUp(void) {
    bench_start();
    now_ms = UINT32_MAX - 20000u; /* it wraps */
}
void tearDown(void) {}

/** The gateway repeats its limit each second, with a tick each. */
static void pass(uint32_t seconds, int32_t limit_W) {
    for (uint32_t k = 0; k < seconds; k++) {
        now_ms += 1000;
        bench_say(true, limit_W, now_ms);
        taper_limits_update(&limits, now_ms);
    }
}

static void assert_now(int32_t limit_W, taper_limit_source_t source) {
    bench_assert(limit_W, source, now_ms);
}

static void assert_episodes(unsigned episodes) {
    TEST_ASSERT_EQUAL_UINT32(episodes, limits.flaps);
    TEST_ASSERT_EQUAL_UINT(episodes, bench_noted(TAPER_EVENT_LIMIT_FLAPS));
}

static void test_single_changes_act_at_once_both_ways(void) {
    pass(5, 20000);
    for (unsigned k = 0; k < 5; k++) {
        pass(1, 5000);
        assert_now(5000, TAPER_LIMIT_GATEWAY);
        pass(4, 5000);
        pass(1, 20000); /* 5 s after the last change */
        assert_now(20000, TAPER_LIMIT_GATEWAY);
        pass(4, 20000);
    }
    assert_episodes(0);
}

static void test_an_increase_soon_after_a_change_waits_30_seconds(void) {
    pass(5, 20000);
    pass(4, 5000);
    pass(1, 20000);
    assert_now(5000, TAPER_LIMIT_HELD);
    assert_episodes(1);
    now_ms += 29999;
    bench_say(true, 20000, now_ms);
    assert_now(5000, TAPER_LIMIT_HELD);
    now_ms += 1;
    assert_now(20000, TAPER_LIMIT_GATEWAY);
}

static void test_five_seconds_to_the_millisecond_are_no_flapping(void) {
    bench_say(true, 20000, now_ms);
    bench_say(true, 5000, now_ms + 1000);
    bench_say(true, 20000, now_ms + 6000);
    bench_assert(20000, TAPER_LIMIT_GATEWAY, now_ms + 6000);
    bench_say(true, 5000, now_ms + 10999);
    bench_say(true, 20000, now_ms + 10999);
    bench_assert(5000, TAPER_LIMIT_HELD, now_ms + 10999);
    assert_episodes(1);
}

static void test_decreases_act_at_once_while_it_flaps(void) {
    pass(5, 20000);
    pass(1, 10000);
    pass(1, 20000);
    assert_now(10000, TAPER_LIMIT_HELD);
    pass(1, 3000);
    assert_now(3000, TAPER_LIMIT_GATEWAY);
    pass(1, 0);
    assert_now(0, TAPER_LIMIT_GATEWAY);
    assert_episodes(1);
}

static void test_the_first_change_of_a_row_leaves_what_was_before_it_behind(void) {
    pass(5, 0);
    pass(1, 20000);
    assert_now(20000, TAPER_LIMIT_GATEWAY);
    pass(1, 19000); /* flaps, and yet the increase is not taken back */
    assert_now(19000, TAPER_LIMIT_GATEWAY);
    pass(1, 20000);
    assert_now(19000, TAPER_LIMIT_HELD);
    assert_episodes(1);
}

static void test_every_lower_limit_counts_for_its_own_30_seconds(void) {
    pass(5, 20000);
    pass(1, 5000);
    pass(1, 8000); /* until now it was 5 kW */
    pass(1, 20000);
    assert_now(5000, TAPER_LIMIT_HELD);
    pass(28, 20000);
    assert_now(5000, TAPER_LIMIT_HELD);
    pass(1, 20000);
    assert_now(8000, TAPER_LIMIT_HELD);
    pass(1, 20000);
    assert_now(20000, TAPER_LIMIT_GATEWAY);
}

static void test_a_flap_that_never_ends_follows_the_lowest_of_the_last_30_seconds_only(void) {
    pass(5, 20000);
    pass(1, 0); /* once, long ago */
    for (unsigned k = 0; k < 50; k++) {
        pass(2, 20000);
        pass(2, 12000);
    }
    assert_now(12000, TAPER_LIMIT_GATEWAY);
    pass(2, 20000);
    assert_now(12000, TAPER_LIMIT_HELD);
    assert_episodes(1);
}

static void test_a_limit_that_rises_every_second_is_followed_30_seconds_later(void) {
    pass(1, 5000);
    pass(1, 5100);
    for (int32_t k = 2; k < 32; k++) {
        pass(1, 5000 + 100 * k);
        assert_now(5100, TAPER_LIMIT_HELD); /* the one between the first two changes */
    }
    for (int32_t k = 32; k < 200; k++) {
        pass(1, 5000 + 100 * k);
        const int32_t held_W = taper_limits_now(&limits, now_ms).supply.site_W;
        const int32_t least_W = 5000 + 100 * (k - 30); /* of the last 30 s */
        TEST_ASSERT_LESS_OR_EQUAL_INT32(least_W, held_W);
    }
    pass(30, 24900);
    assert_now(24900, TAPER_LIMIT_GATEWAY);
}

static void test_a_change_in_an_episode_prolongs_it_and_the_next_one_is_counted_anew(void) {
    pass(5, 20000);
    pass(1, 5000);
    pass(1, 20000);
    pass(20, 20000);
    pass(1, 15000); /* 21 s later, and still part of it */
    pass(7, 20000);
    assert_now(5000, TAPER_LIMIT_HELD);
    pass(3, 20000);
    assert_now(15000, TAPER_LIMIT_HELD);
    pass(20, 20000);
    assert_now(15000, TAPER_LIMIT_HELD);
    pass(1, 20000);
    assert_now(20000, TAPER_LIMIT_GATEWAY);
    assert_episodes(1);
    pass(1, 5000);
    pass(1, 20000);
    assert_now(5000, TAPER_LIMIT_HELD);
    assert_episodes(2);
}

static void test_repetitions_of_the_same_limit_are_no_changes(void) {
    pass(100, 20000);
    for (uint32_t k = 0; k < 50; k++) {
        now_ms += 20;
        bench_say(true, 20000, now_ms);
    }
    bench_say(true, 10000, now_ms);
    bench_say(true, 10000, now_ms + 20);
    bench_assert(10000, TAPER_LIMIT_GATEWAY, now_ms + 20);
    assert_episodes(0);
}

static void test_a_gateway_that_sets_a_limit_and_none_in_turn_flaps(void) {
    pass(5, 6000);
    now_ms += 1000;
    bench_say(false, TAPER_ABSENT, now_ms);
    assert_now(25000, TAPER_LIMIT_STATION);
    pass(1, 6000);
    now_ms += 1000;
    bench_say(false, TAPER_ABSENT, now_ms);
    assert_now(6000, TAPER_LIMIT_HELD);
    assert_episodes(1);
}

static void test_limits_below_zero_are_all_the_same(void) {
    for (int32_t k = 1; k < 20; k++) {
        pass(1, -100 * k);
    }
    assert_episodes(0);
    pass(1, 5000);
    pass(1, -100);
    pass(1, 5000);
    assert_now(0, TAPER_LIMIT_HELD);
    assert_episodes(1);
}

static void test_heartbeats_without_a_limit_are_no_changes(void) {
    pass(5, 20000);
    pass(1, 5000);
    now_ms += 1000;
    bench_say(true, TAPER_ABSENT, now_ms);
    pass(1, 5000);
    assert_now(5000, TAPER_LIMIT_GATEWAY);
    assert_episodes(0);
}

static void test_a_silent_gateway_ends_in_failsafe_and_comes_back_to_what_is_held(void) {
    pass(5, 20000);
    pass(1, 5000);
    pass(1, 20000);
    now_ms += 6000;
    taper_limits_update(&limits, now_ms);
    assert_now(4000, TAPER_LIMIT_FAILSAFE);
    pass(1, 20000);
    assert_now(5000, TAPER_LIMIT_HELD);
    pass(23, 20000);
    assert_now(20000, TAPER_LIMIT_GATEWAY);
}

static void test_the_seconds_are_those_of_the_world(void) {
    limits.time_scale = 600;
    pass(5, 20000);
    for (unsigned k = 0; k < 20; k++) { /* ten minutes from change to change */
        pass(1, 5000);
        assert_now(5000, TAPER_LIMIT_GATEWAY);
        pass(1, 20000);
        assert_now(20000, TAPER_LIMIT_GATEWAY);
    }
    assert_episodes(0);
    bench_say(true, 5000, now_ms + 2);
    bench_say(true, 20000, now_ms + 10); /* 4.8 s */
    bench_assert(5000, TAPER_LIMIT_HELD, now_ms + 59);
    bench_assert(20000, TAPER_LIMIT_GATEWAY, now_ms + 60); /* 30 s after it was last in force */
    assert_episodes(1);
}

static void test_a_curve_below_what_is_held_is_named(void) {
    bench_point(now_ms, 3000);
    bench_set(TAPER_CURVE_OF_FILE);
    pass(5, 20000);
    pass(1, 5000);
    pass(1, 20000);
    assert_now(3000, TAPER_LIMIT_FILE);
}

static void test_what_is_held_is_taken_to_last_in_the_course(void) {
    pass(5, 20000);
    pass(1, 5000);
    pass(1, 20000);
    bench_course(now_ms);
    bench_assert_step(0, 5000, TAPER_LIMIT_HELD);
    bench_assert_step(23, 5000, TAPER_LIMIT_HELD);
}

static void test_an_old_change_does_not_come_back_when_the_clock_has_gone_round(void) {
    pass(5, 20000);
    pass(1, 5000);
    const uint32_t then_ms = now_ms;
    for (uint64_t k = 0; k < UINT64_C(0x100000000) / 1000000 - 1; k++) {
        now_ms += 1000000;
        bench_say(true, 5000, now_ms);
        taper_limits_update(&limits, now_ms);
    }
    now_ms = then_ms + 1000; /* 2^32 ms later, and a second */
    bench_say(true, 20000, now_ms);
    assert_now(20000, TAPER_LIMIT_GATEWAY);
    assert_episodes(0);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_single_changes_act_at_once_both_ways);
    RUN_TEST(test_an_increase_soon_after_a_change_waits_30_seconds);
    RUN_TEST(test_five_seconds_to_the_millisecond_are_no_flapping);
    RUN_TEST(test_decreases_act_at_once_while_it_flaps);
    RUN_TEST(test_the_first_change_of_a_row_leaves_what_was_before_it_behind);
    RUN_TEST(test_every_lower_limit_counts_for_its_own_30_seconds);
    RUN_TEST(test_a_flap_that_never_ends_follows_the_lowest_of_the_last_30_seconds_only);
    RUN_TEST(test_a_limit_that_rises_every_second_is_followed_30_seconds_later);
    RUN_TEST(test_a_change_in_an_episode_prolongs_it_and_the_next_one_is_counted_anew);
    RUN_TEST(test_repetitions_of_the_same_limit_are_no_changes);
    RUN_TEST(test_a_gateway_that_sets_a_limit_and_none_in_turn_flaps);
    RUN_TEST(test_limits_below_zero_are_all_the_same);
    RUN_TEST(test_heartbeats_without_a_limit_are_no_changes);
    RUN_TEST(test_a_silent_gateway_ends_in_failsafe_and_comes_back_to_what_is_held);
    RUN_TEST(test_the_seconds_are_those_of_the_world);
    RUN_TEST(test_a_curve_below_what_is_held_is_named);
    RUN_TEST(test_what_is_held_is_taken_to_last_in_the_course);
    RUN_TEST(test_an_old_change_does_not_come_back_when_the_clock_has_gone_round);
    return UNITY_END();
}
