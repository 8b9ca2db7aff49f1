/* The table of modes, row by row, and whom the controller trusts: its planner, itself. */
#include "taper/supervisor.h"
#include "unity.h"

static taper_supervisor_t supervisor;
static taper_health_t health;
static taper_self_t self;

void setUp(void) {
    taper_supervisor_init(&supervisor);
    health = (taper_health_t){0};
    self = (taper_self_t){0};
}
void tearDown(void) {}

static taper_mode_t update_with(taper_situation_t situation, uint32_t now_ms) {
    return taper_supervisor_update(&supervisor, &situation, now_ms);
}

static taper_mode_t update(bool alive, bool heard, bool ready, uint32_t now_ms) {
    return update_with(
        (taper_situation_t){.gateway_alive = alive, .gateway_heard = heard, .proposal_ready = ready}, now_ms);
}

static void test_it_waits_for_the_first_limit(void) {
    TEST_ASSERT_EQUAL(TAPER_MODE_INIT, update(false, false, true, 5000));
    TEST_ASSERT_EQUAL(TAPER_MODE_INIT, update(false, false, true, 14999));
    TEST_ASSERT_EQUAL(TAPER_MODE_PLAN, update(true, true, true, 15000));
}

static void test_a_gateway_that_never_speaks_ends_the_wait_in_failsafe(void) {
    TEST_ASSERT_EQUAL(TAPER_MODE_INIT, update(false, false, true, 5000));
    TEST_ASSERT_EQUAL(TAPER_MODE_FAILSAFE, update(false, false, true, 15000));
    TEST_ASSERT_EQUAL(TAPER_MODE_PLAN, update(true, true, true, 16000));
}

static void test_a_limit_that_ended_before_the_wait_did_is_a_silent_gateway(void) {
    TEST_ASSERT_EQUAL(TAPER_MODE_INIT, update(false, false, true, 5000));
    TEST_ASSERT_EQUAL(TAPER_MODE_FAILSAFE, update(false, true, true, 6000));
}

static void test_the_wait_survives_the_wrap_of_the_clock(void) {
    TEST_ASSERT_EQUAL(TAPER_MODE_INIT, update(false, false, true, UINT32_MAX - 4000));
    TEST_ASSERT_EQUAL(TAPER_MODE_INIT, update(false, false, true, 5998));
    TEST_ASSERT_EQUAL(TAPER_MODE_FAILSAFE, update(false, false, true, 5999));
}

static void test_the_wait_does_not_come_back_when_the_clock_has_gone_round(void) {
    TEST_ASSERT_EQUAL(TAPER_MODE_INIT, update(false, false, true, 5000));
    TEST_ASSERT_EQUAL(TAPER_MODE_FAILSAFE, update(false, false, true, 15000));
    TEST_ASSERT_EQUAL(TAPER_MODE_FAILSAFE, update(false, false, true, 6000));
}

static void test_it_falls_back_without_a_proposal_and_recovers(void) {
    TEST_ASSERT_EQUAL(TAPER_MODE_FALLBACK, update(true, true, false, 0));
    TEST_ASSERT_EQUAL(TAPER_MODE_PLAN, update(true, true, true, 1000));
    TEST_ASSERT_EQUAL(TAPER_MODE_FALLBACK, update(true, true, false, 2000));
}

static void test_a_silent_gateway_outranks_a_missing_plan(void) {
    TEST_ASSERT_EQUAL(TAPER_MODE_PLAN, update(true, true, true, 0));
    TEST_ASSERT_EQUAL(TAPER_MODE_FAILSAFE, update(false, true, false, 1000));
    TEST_ASSERT_EQUAL(TAPER_MODE_FALLBACK, update(true, true, false, 2000));
}

static void test_a_tick_that_took_too_long_is_followed_by_one_of_the_cheap_proposal(void) {
    taper_situation_t situation = {
        .gateway_alive = true, .gateway_heard = true, .proposal_ready = true, .tick_overran = true};
    TEST_ASSERT_EQUAL(TAPER_MODE_FALLBACK, update_with(situation, 0));
    situation.tick_overran = false;
    TEST_ASSERT_EQUAL(TAPER_MODE_PLAN, update_with(situation, 1000));
}

/** What each situation means, said once more and another way. */
static taper_mode_t expected(taper_situation_t now, bool waiting) {
    if (waiting && !now.gateway_heard) {
        return TAPER_MODE_INIT;
    }
    if (!now.gateway_alive) {
        return TAPER_MODE_FAILSAFE;
    }
    return now.proposal_ready && !now.tick_overran ? TAPER_MODE_PLAN : TAPER_MODE_FALLBACK;
}

static void test_every_situation_has_its_mode_whatever_was_before(void) {
    for (unsigned before = 0; before < 16; before++) {
        for (unsigned after = 0; after < 32; after++) {
            const taper_situation_t first = {before & 1, before & 2, before & 4, before & 8};
            const taper_situation_t second = {after & 1, after & 2, after & 4, after & 8};
            const uint32_t later_ms = after & 16 ? TAPER_INIT_ms : TAPER_INIT_ms - 1;
            taper_supervisor_init(&supervisor);
            TEST_ASSERT_EQUAL(expected(first, true), update_with(first, 7));
            const bool waiting = !first.gateway_heard && later_ms < TAPER_INIT_ms;
            TEST_ASSERT_EQUAL(expected(second, waiting), update_with(second, 7 + later_ms));
        }
    }
}

static bool judge_bad(uint32_t now_ms) {
    return taper_health_judge(&health, false, now_ms);
}

static void test_three_bad_plans_in_a_row_turn_the_planner_off(void) {
    TEST_ASSERT_TRUE(taper_health_may_plan(&health, 0));
    TEST_ASSERT_FALSE(judge_bad(1000));
    TEST_ASSERT_FALSE(judge_bad(2000));
    TEST_ASSERT_TRUE(taper_health_may_plan(&health, 2000));
    TEST_ASSERT_TRUE(judge_bad(3000));
    TEST_ASSERT_FALSE(taper_health_may_plan(&health, 3000));
}

static void test_a_good_plan_between_bad_ones_starts_the_count_anew(void) {
    for (unsigned k = 0; k < 20; k++) {
        TEST_ASSERT_FALSE(judge_bad(k));
        TEST_ASSERT_FALSE(judge_bad(k));
        TEST_ASSERT_FALSE(taper_health_judge(&health, true, k));
    }
    TEST_ASSERT_TRUE(taper_health_may_plan(&health, 20));
}

/** Off since `off_ms`. */
static void turn_off(uint32_t off_ms) {
    for (unsigned k = 0; k < TAPER_BAD_PLANS; k++) {
        (void)judge_bad(off_ms);
    }
}

static void test_the_planner_is_left_alone_for_ten_minutes_across_the_wrap_of_the_clock(void) {
    const uint32_t off_ms = UINT32_MAX - 299999;
    turn_off(off_ms);
    TEST_ASSERT_FALSE(taper_health_may_plan(&health, UINT32_MAX));
    TEST_ASSERT_FALSE(taper_health_may_plan(&health, 299999));
    TEST_ASSERT_TRUE(taper_health_may_plan(&health, 300000));
}

static void test_after_that_one_more_bad_plan_is_enough(void) {
    turn_off(0);
    TEST_ASSERT_TRUE(taper_health_may_plan(&health, TAPER_PLANNER_OFF_ms));
    TEST_ASSERT_TRUE(judge_bad(TAPER_PLANNER_OFF_ms + 1000));
    TEST_ASSERT_FALSE(taper_health_may_plan(&health, 2 * TAPER_PLANNER_OFF_ms + 999));
    TEST_ASSERT_TRUE(taper_health_may_plan(&health, 2 * TAPER_PLANNER_OFF_ms + 1000));
}

static void test_after_that_a_good_plan_makes_it_trusted_again(void) {
    turn_off(0);
    TEST_ASSERT_TRUE(taper_health_may_plan(&health, TAPER_PLANNER_OFF_ms));
    TEST_ASSERT_FALSE(taper_health_judge(&health, true, TAPER_PLANNER_OFF_ms));
    TEST_ASSERT_FALSE(judge_bad(TAPER_PLANNER_OFF_ms));
    TEST_ASSERT_FALSE(judge_bad(TAPER_PLANNER_OFF_ms));
    TEST_ASSERT_TRUE(judge_bad(TAPER_PLANNER_OFF_ms));
}

static void test_what_comes_while_the_planner_is_off_does_not_count(void) {
    turn_off(0);
    TEST_ASSERT_FALSE(judge_bad(1000));
    TEST_ASSERT_FALSE(taper_health_judge(&health, true, 2000));
    TEST_ASSERT_FALSE(taper_health_may_plan(&health, TAPER_PLANNER_OFF_ms - 1));
    TEST_ASSERT_TRUE(taper_health_may_plan(&health, TAPER_PLANNER_OFF_ms));
}

static void test_more_than_half_a_tick_is_too_long(void) {
    TEST_ASSERT_FALSE(taper_self_ticked(&self, 0, 1000));
    TEST_ASSERT_FALSE(taper_self_ticked(&self, 500, 1000));
    TEST_ASSERT_FALSE(self.overran);
    TEST_ASSERT_TRUE(taper_self_ticked(&self, 501, 1000));
    TEST_ASSERT_TRUE(self.overran);
    TEST_ASSERT_TRUE(taper_self_is_sound(&self));
}

static void test_two_long_ticks_in_a_row_end_the_trust_for_good(void) {
    for (unsigned k = 0; k < 10; k++) {
        (void)taper_self_ticked(&self, 900, 1000);
        TEST_ASSERT_TRUE(taper_self_is_sound(&self));
        TEST_ASSERT_FALSE(taper_self_ticked(&self, 10, 1000));
    }
    (void)taper_self_ticked(&self, 900, 1000);
    (void)taper_self_ticked(&self, UINT32_MAX, 1000);
    TEST_ASSERT_FALSE(taper_self_is_sound(&self));
    for (unsigned k = 0; k < 300; k++) {
        TEST_ASSERT_EQUAL(k % 2 == 1, taper_self_ticked(&self, k % 2 == 1 ? 900 : 10, 1000));
        TEST_ASSERT_FALSE(taper_self_is_sound(&self));
    }
}

static void test_two_flipped_setpoints_end_it_however_long_there_was_between_them(void) {
    taper_self_flipped(&self);
    TEST_ASSERT_TRUE(taper_self_is_sound(&self));
    for (unsigned k = 0; k < 1000; k++) {
        (void)taper_self_ticked(&self, 1, 1000);
    }
    for (unsigned k = 0; k < 300; k++) { /* more than a byte counts */
        taper_self_flipped(&self);
        TEST_ASSERT_FALSE(taper_self_is_sound(&self));
    }
    TEST_ASSERT_EQUAL_UINT8(TAPER_RESET_FLIPS, self.flips);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_it_waits_for_the_first_limit);
    RUN_TEST(test_a_gateway_that_never_speaks_ends_the_wait_in_failsafe);
    RUN_TEST(test_a_limit_that_ended_before_the_wait_did_is_a_silent_gateway);
    RUN_TEST(test_the_wait_survives_the_wrap_of_the_clock);
    RUN_TEST(test_the_wait_does_not_come_back_when_the_clock_has_gone_round);
    RUN_TEST(test_it_falls_back_without_a_proposal_and_recovers);
    RUN_TEST(test_a_silent_gateway_outranks_a_missing_plan);
    RUN_TEST(test_a_tick_that_took_too_long_is_followed_by_one_of_the_cheap_proposal);
    RUN_TEST(test_every_situation_has_its_mode_whatever_was_before);
    RUN_TEST(test_three_bad_plans_in_a_row_turn_the_planner_off);
    RUN_TEST(test_a_good_plan_between_bad_ones_starts_the_count_anew);
    RUN_TEST(test_the_planner_is_left_alone_for_ten_minutes_across_the_wrap_of_the_clock);
    RUN_TEST(test_after_that_one_more_bad_plan_is_enough);
    RUN_TEST(test_after_that_a_good_plan_makes_it_trusted_again);
    RUN_TEST(test_what_comes_while_the_planner_is_off_does_not_count);
    RUN_TEST(test_more_than_half_a_tick_is_too_long);
    RUN_TEST(test_two_long_ticks_in_a_row_end_the_trust_for_good);
    RUN_TEST(test_two_flipped_setpoints_end_it_however_long_there_was_between_them);
    return UNITY_END();
}
