/* The accountant can fail a station: sums. Every rule is broken once, and kept just so once. */
#include <math.h>

#include "account_bench.h"
#include "phasor.h"
#include "unity.h"

enum { HUB = 0, SOCKETS = 1, LINES = 3 };

void setUp(void) {
    bench_start(HUB);
}

void tearDown(void) {}

static void test_currents_that_fill_a_feeder_to_the_watt_are_no_violation(void) {
    bench_setpoint(0, 32000, 0);
    bench_setpoint(1, 28000, 0); /* 60 A of three phases: 41.4 kW */
    bench_pass(20000);
    bench_content();
}

static void test_a_tenth_of_an_ampere_more_than_a_feeder_carries_is_one(void) {
    bench_setpoint(0, 32000, 0);
    bench_setpoint(1, 28100, 0);
    bench_objects(RULE_GROUP_W);
}

static void test_currents_of_one_phase_are_held_against_the_limit_of_a_phase(void) {
    account_plugged(&account, 0, 7, 1);
    account_plugged(&account, 1, 7, 1);
    bench_setpoint(0, 32000, 0);        /* on L1 */
    bench_setpoint(1, 32000, 0);        /* on L2 */
    account_plugged(&account, 2, 7, 2); /* on L3 and L1 */
    bench_setpoint(2, 31000, 0);
    bench_content();
    bench_setpoint(2, 31100, 0);
    bench_objects(RULE_GROUP_A);
}

static void test_what_one_gives_up_may_be_given_on_after_its_vehicles_reaction(void) {
    bench_setpoint(0, 32000, 0);
    bench_pass(3000);
    bench_setpoint(0, 6000, 0);
    bench_pass(5000);
    bench_setpoint(1, 32000, 0);
    bench_content();
}

static void test_what_one_gives_up_may_not_be_given_on_before(void) {
    bench_setpoint(0, 32000, 0);
    bench_pass(3000);
    bench_setpoint(0, 6000, 0);
    bench_pass(4750);
    bench_setpoint(1, 32000, 0);
    bench_objects_also(RULE_GROUP_W);
}

static void test_a_setpoint_that_expired_counts_until_its_vehicle_has_followed(void) {
    bench_setpoint(0, 32000, 0);
    bench_deaf(0);
    bench_pass(7750);
    bench_setpoint(1, 28000, 0);
    bench_content();
    bench_setpoint(1, 32000, 0);
    bench_objects_also(RULE_GROUP_W);
}

static void test_a_setpoint_that_expired_is_free_when_its_vehicle_has_followed(void) {
    bench_setpoint(0, 32000, 0);
    bench_deaf(0);
    bench_pass(8000);
    bench_setpoint(1, 32000, 0);
    bench_content();
}

static void test_the_fallback_current_of_a_connector_that_nobody_reaches_counts_for_ever(void) {
    bench_setpoint(0, 6000, 6000);
    bench_deaf(0);
    bench_pass(60000);
    bench_setpoint(1, 32000, 0);
    bench_setpoint(2, 22000, 0);
    bench_content();
    bench_setpoint(2, 22100, 0);
    bench_objects(RULE_GROUP_W);
}

static void test_an_unplugged_vehicle_draws_nothing(void) {
    bench_setpoint(0, 32000, 0);
    account_unplugged(&account, 0);
    bench_setpoint(1, 32000, 0);
    bench_content();
}

static void test_a_setpoint_that_the_connector_cannot_accept_changes_nothing(void) {
    bench_setpoint(0, 32000, 0);
    bench_pass(1000);
    taper_frame_t lower = bench_frame(0, 6000, 0);
    lower.data[2] ^= 1;
    account_delivered(&account, &lower); /* its CRC is wrong, so 32 A stay */
    bench_pass(0);
    TEST_ASSERT_EQUAL_INT32(32000, account.book[0].level_mA);
    const taper_frame_t foreign = bench_frame_with(0, 6000, 56, 8, 9);
    account_delivered(&account, &foreign); /* another session */
    TEST_ASSERT_EQUAL_INT32(32000, account.book[0].level_mA);
}

static void test_a_site_limit_that_fell_has_to_be_kept_after_9_5_seconds(void) {
    bench_setpoint(0, 32000, 0);
    bench_pass(20000);
    bench_limit(10000, 10000);
    bench_pass(9500);
    bench_content();
    bench_pass(250);
    bench_objects(RULE_SITE_W);
}

static void test_other_load_that_rose_has_to_be_made_room_for(void) {
    bench_setpoint(0, 32000, 0);
    bench_pass(20000);
    bench_other_load(70000); /* 48.3 kW of 66 kW, 70 A of 100 A */
    bench_pass(9500);
    bench_content();
    bench_pass(250);
    bench_objects_also(RULE_SITE_W);
    bench_objects_also(RULE_SITE_A);
}

static void test_a_silent_gateway_leaves_the_failsafe_limit_less_the_greatest_other_load(void) {
    bench_setpoint(0, 6000, 0);
    account_time(&account, account.now_ms + 5000);
    account_check(&account);
    account_time(&account, account.now_ms + 1);
    for (unsigned k = 0; k < 11; k++) { /* of 11 kW, 2 kW are left */
        account_time(&account, account.now_ms + 1000);
        const taper_frame_t frame = bench_frame(0, 6000, 0);
        account_delivered(&account, &frame);
        account_check(&account);
    }
    bench_objects(RULE_SITE_W);
}

/** Connectors 1 and 2 draw 4.14 kW each, and the site has 5 kW. */
static void fall_back_above_the_site_limit(void) {
    bench_setpoint(0, 6000, 6000);
    bench_setpoint(1, 6000, 6000);
    bench_deaf(0);
    bench_deaf(1);
    bench_pass(20000);
    bench_limit(5000, 11000);
    bench_pass(20000);
    bench_content();
}

static void test_who_fell_back_above_the_site_limit_may_be_told_nothing_in_whatever_order(void) {
    fall_back_above_the_site_limit();
    bench_setpoint(1, 0, 0);
    bench_pass(2000);
    bench_setpoint(0, 0, 0);
    bench_pass(20000);
    bench_content();
}

static void test_who_fell_back_above_the_site_limit_may_not_be_told_the_same_again(void) {
    fall_back_above_the_site_limit();
    bench_setpoint(1, 6000, 6000);
    bench_objects(RULE_SITE_W);
}

static void test_beside_who_fell_back_above_the_site_limit_nobody_gets_more(void) {
    fall_back_above_the_site_limit();
    bench_setpoint(1, 6100, 6000);
    bench_objects(RULE_SITE_W);
}

static void test_who_falls_back_after_the_site_limit_fell_has_to_be_made_room_for_within_9_5_seconds(void) {
    bench_setpoint(0, 6000, 6000); /* 4.14 kW */
    bench_setpoint(1, 6000, 6000);
    bench_pass(20000);
    bench_deaf(0);
    bench_limit(5000, 11000);
    bench_pass(12500); /* it fell back after 3 s */
    bench_content();
    bench_pass(250);
    bench_objects(RULE_SITE_W);
}

static void test_who_falls_back_excuses_nobody_from_a_site_limit_that_did_not_fall(void) {
    bench_limit(8000, 11000);
    bench_pass(20000);
    bench_setpoint(0, 6000, 6000);
    bench_deaf(0);
    bench_pass(3250);
    bench_content();
    bench_setpoint(1, 6000, 0);
    bench_objects(RULE_SITE_W);
}

static void test_who_falls_back_excuses_no_more_than_his_fallback_current(void) {
    bench_setpoint(0, 6000, 6000);
    bench_setpoint(1, 14000, 0); /* 9.66 kW */
    bench_pass(20000);
    bench_deaf(0);
    bench_limit(10000, 11000);
    bench_pass(9500);
    bench_content();
    bench_setpoint(1, 14500, 0); /* with the fallback current 14.145 kW */
    bench_pass(250);
    bench_objects(RULE_SITE_W);
}

static void test_fallback_currents_within_the_failsafe_limit_are_no_violation(void) {
    bench_setpoint(0, 6000, 6000);
    bench_setpoint(1, 6000, 6000);
    bench_pass(20000);
    bench_content();
}

static void test_fallback_currents_beyond_the_failsafe_limit_are_one(void) {
    bench_setpoint(0, 6000, 6000);
    bench_setpoint(1, 6000, 6000);
    bench_setpoint(3, 6000, 6000); /* 12.42 kW of 11 kW */
    bench_objects(RULE_FALLBACK_W);
}

static void test_a_failsafe_limit_that_fell_leaves_five_seconds_to_who_can_be_reached(void) {
    bench_setpoint(0, 6000, 6000);
    bench_setpoint(1, 6000, 6000);
    bench_deaf(1); /* keeps its fallback current, so the other has to give up his */
    bench_pass(5000);
    bench_limit(66000, 5000);
    bench_pass(5000);
    bench_content();
    bench_pass(250);
    bench_objects(RULE_FALLBACK_W);
}

static void test_setpoints_of_phases_that_differ_too_much_are_a_violation(void) {
    bench_start(SOCKETS);
    bench_setpoint(0, 16000, 0);
    account_tick(&account, true);
    bench_content();
    bench_setpoint(0, 16100, 0); /* on L1, none on L2 */
    account_tick(&account, false);
    bench_content();
    account_tick(&account, true);
    bench_objects(RULE_IMBALANCE_A);
}

static void test_a_setpoint_for_one_of_three_phases_is_held_against_the_other_two(void) {
    bench_start(SOCKETS);
    taper_frame_t frame = bench_frame_with(6, 20000, 48, 3, 1); /* on L2: its wiring is 213 */
    account_sent(&account, &frame);
    account_tick(&account, true);
    bench_content();
    frame = bench_frame_with(6, 20100, 48, 3, 7); /* on all three */
    account_sent(&account, &frame);
    account_tick(&account, true);
    bench_content();
    frame = bench_frame_with(6, 20100, 48, 3, 1);
    account_sent(&account, &frame);
    account_tick(&account, true);
    bench_objects(RULE_IMBALANCE_A);
}

static void test_pairs_load_the_delta_side_of_their_transformer(void) {
    bench_start(LINES);
    bench_setpoint(0, 32000, 0); /* L1-L2 */
    bench_setpoint(2, 31000,
                   0); /* L3-L1: line L1 of the delta side carries up to sqrt(32^2 + 62^2 + 32 * 62) = 83 A */
    bench_content();
    bench_setpoint(3, 40000, 0); /* L1-L2 */
    bench_objects_also(RULE_DELTA_A);
}

static void test_what_is_really_drawn_has_to_come_back_within_25_seconds(void) {
    const double drawn_mA[3] = {62000.0, 62000.0, 62000.0}; /* 42.78 kW of 41.4 kW */
    account.watches_physical = true;
    bench_setpoint(0, 32000, 0);
    account_drawn(&account, 0, drawn_mA, true);
    bench_pass(25250);
    bench_content();
    bench_pass(250);
    bench_objects(RULE_OVER_DRAW);
}

static void test_over_draw_that_nobody_can_see_is_not_held_against_the_station(void) {
    const double drawn_mA[3] = {62000.0, 62000.0, 62000.0};
    account.watches_physical = true;
    bench_setpoint(0, 32000, 0);
    account_drawn(&account, 0, drawn_mA, false);
    bench_pass(60000);
    bench_content();
}

static void test_who_waits_longer_than_is_fair_is_a_violation(void) {
    account_wants(&account, 0, true);
    account_wants(&account, 1, true);
    account_fair(&account, 30000);
    bench_setpoint(1, 6000, 0);
    bench_pass(30000);
    bench_content();
    bench_pass(250);
    bench_objects(RULE_FAIRNESS);
    TEST_ASSERT_EQUAL_INT(0, account.verdict.connector);
}

static void test_lines_carry_the_phasor_sum_of_pairs_and_phases(void) {
    const load_t load = {.neutral_mA = {10.0, 0.0, 0.0}, .pair_mA = {20.0, 0.0, 20.0}};
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 10.0 + 20.0 * sqrt(3.0), load_line_mA(&load, 0));
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 20.0, load_line_mA(&load, 1));
}

static void test_balanced_load_is_1_732_times_as_much_on_the_delta_side_and_a_pair_is_once_or_twice(void) {
    const load_t balanced = {.neutral_mA = {10.0, 10.0, 10.0}};
    const load_t pair = {.pair_mA = {10.0, 0.0, 0.0}};
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 10.0 * sqrt(3.0), load_delta_mA(&balanced, 1));
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 10.0, load_delta_mA(&pair, 0));
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 20.0, load_delta_mA(&pair, 1));
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 10.0, load_delta_mA(&pair, 2));
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_currents_that_fill_a_feeder_to_the_watt_are_no_violation);
    RUN_TEST(test_a_tenth_of_an_ampere_more_than_a_feeder_carries_is_one);
    RUN_TEST(test_currents_of_one_phase_are_held_against_the_limit_of_a_phase);
    RUN_TEST(test_what_one_gives_up_may_be_given_on_after_its_vehicles_reaction);
    RUN_TEST(test_what_one_gives_up_may_not_be_given_on_before);
    RUN_TEST(test_a_setpoint_that_expired_counts_until_its_vehicle_has_followed);
    RUN_TEST(test_a_setpoint_that_expired_is_free_when_its_vehicle_has_followed);
    RUN_TEST(test_the_fallback_current_of_a_connector_that_nobody_reaches_counts_for_ever);
    RUN_TEST(test_an_unplugged_vehicle_draws_nothing);
    RUN_TEST(test_a_setpoint_that_the_connector_cannot_accept_changes_nothing);
    RUN_TEST(test_a_site_limit_that_fell_has_to_be_kept_after_9_5_seconds);
    RUN_TEST(test_other_load_that_rose_has_to_be_made_room_for);
    RUN_TEST(test_a_silent_gateway_leaves_the_failsafe_limit_less_the_greatest_other_load);
    RUN_TEST(test_who_fell_back_above_the_site_limit_may_be_told_nothing_in_whatever_order);
    RUN_TEST(test_who_fell_back_above_the_site_limit_may_not_be_told_the_same_again);
    RUN_TEST(test_beside_who_fell_back_above_the_site_limit_nobody_gets_more);
    RUN_TEST(test_who_falls_back_after_the_site_limit_fell_has_to_be_made_room_for_within_9_5_seconds);
    RUN_TEST(test_who_falls_back_excuses_nobody_from_a_site_limit_that_did_not_fall);
    RUN_TEST(test_who_falls_back_excuses_no_more_than_his_fallback_current);
    RUN_TEST(test_fallback_currents_within_the_failsafe_limit_are_no_violation);
    RUN_TEST(test_fallback_currents_beyond_the_failsafe_limit_are_one);
    RUN_TEST(test_a_failsafe_limit_that_fell_leaves_five_seconds_to_who_can_be_reached);
    RUN_TEST(test_setpoints_of_phases_that_differ_too_much_are_a_violation);
    RUN_TEST(test_a_setpoint_for_one_of_three_phases_is_held_against_the_other_two);
    RUN_TEST(test_pairs_load_the_delta_side_of_their_transformer);
    RUN_TEST(test_what_is_really_drawn_has_to_come_back_within_25_seconds);
    RUN_TEST(test_over_draw_that_nobody_can_see_is_not_held_against_the_station);
    RUN_TEST(test_who_waits_longer_than_is_fair_is_a_violation);
    RUN_TEST(test_lines_carry_the_phasor_sum_of_pairs_and_phases);
    RUN_TEST(test_balanced_load_is_1_732_times_as_much_on_the_delta_side_and_a_pair_is_once_or_twice);
    return UNITY_END();
}
