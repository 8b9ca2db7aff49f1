/* The accountant can fail a station: single setpoints, and the bus as he reads it. */
#include <string.h>

#include "account_bench.h"
#include "unity.h"

void setUp(void) {
    bench_start(0);
}

void tearDown(void) {}

static void test_a_setpoint_as_documented_is_no_violation(void) {
    const taper_frame_t lowest = bench_frame(0, 6000, 6000);
    const taper_frame_t highest = bench_frame(0, 32000, 0);
    account_sent(&account, &lowest);
    account_sent(&account, &highest);
    bench_content();
}

static void test_the_golden_frames_of_the_protocol_are_sound(void) {
    taper_frame_t charge = {
        .id = 0x0C1, .length = 8, .data = {0x76, 0x10, 0xa0, 0x00, 0x06, 0x0c, 0x07, 0x07}};
    taper_frame_t pause = {
        .id = 0x0C1, .length = 8, .data = {0x67, 0x0f, 0x00, 0x00, 0x06, 0x00, 0x07, 0x07}};
    const wire_setpoint_t setpoint = wire_setpoint(&charge);
    TEST_ASSERT_TRUE(wire_is_sound(&charge));
    TEST_ASSERT_TRUE(wire_is_sound(&pause));
    TEST_ASSERT_EQUAL_INT32(16000, setpoint.current_mA);
    TEST_ASSERT_EQUAL_INT32(6000, setpoint.fallback_mA);
    TEST_ASSERT_EQUAL_UINT32(3000, setpoint.validity_ms);
    TEST_ASSERT_EQUAL_UINT8(7, setpoint.session);
    charge.id = 0x0C2;
    TEST_ASSERT_FALSE(wire_is_sound(&charge));
}

static void test_a_receiver_takes_one_to_three_counters_on_and_no_repetition(void) {
    static const struct {
        uint8_t counter;
        bool accepted;
    } frames[] = {{0, true}, {0, false}, {1, true}, {4, true}, {8, false}, {9, true}};
    wire_receiver_t receiver = {.heard = false};
    for (unsigned k = 0; k < sizeof frames / sizeof frames[0]; k++) {
        taper_frame_t frame = wire_frame(WIRE_SITE_LIMIT, WIRE_GATEWAY);
        wire_seal(&frame, frames[k].counter);
        TEST_ASSERT_EQUAL_MESSAGE(frames[k].accepted, wire_accepts(&receiver, &frame), "by counter");
    }
}

static void test_a_receiver_trusts_nobody_with_three_bad_frames_in_five(void) {
    wire_receiver_t receiver = {.heard = false};
    for (uint8_t counter = 0; counter < 6; counter++) {
        taper_frame_t frame = wire_frame(WIRE_SITE_LIMIT, WIRE_GATEWAY);
        wire_seal(&frame, counter);
        frame.data[0] ^= (counter >= 1 && counter <= 3) ? 1u : 0u;
        TEST_ASSERT_EQUAL(counter == 0, wire_accepts(&receiver, &frame));
    }
}

static void expect_objection(taper_frame_t frame, rule_t rule) {
    account_sent(&account, &frame);
    bench_objects(rule);
}

static void test_a_setpoint_with_a_wrong_crc_is_a_violation(void) {
    taper_frame_t frame = bench_frame(0, 6000, 0);
    frame.data[0] ^= 1;
    expect_objection(frame, RULE_FRAME);
}

static void test_a_counter_that_does_not_move_by_one_is_a_violation(void) {
    (void)bench_frame(0, 6000, 0);
    expect_objection(bench_frame(0, 6000, 0), RULE_FRAME);
}

static void test_a_pause_with_a_current_is_a_violation(void) {
    expect_objection(bench_frame_with(0, 6000, 12, 4, WIRE_PAUSE), RULE_COMMAND);
}

static void test_a_stop_with_a_current_is_a_violation(void) {
    expect_objection(bench_frame_with(0, 6000, 12, 4, WIRE_STOP), RULE_COMMAND);
}

static void test_a_command_to_charge_nothing_is_a_violation(void) {
    expect_objection(bench_frame_with(0, 0, 12, 4, WIRE_CHARGE), RULE_COMMAND);
}

static void test_an_unknown_command_is_a_violation(void) {
    expect_objection(bench_frame_with(0, 0, 12, 4, 5), RULE_COMMAND);
}

static void test_a_current_below_the_minimum_is_a_violation(void) {
    expect_objection(bench_frame(0, 5900, 0), RULE_CURRENT);
}

static void test_a_current_above_the_maximum_is_a_violation(void) {
    expect_objection(bench_frame(0, 32100, 0), RULE_CURRENT);
}

static void test_a_validity_of_four_seconds_is_a_violation(void) {
    expect_objection(bench_frame_with(0, 6000, 32, 8, 8), RULE_VALIDITY);
}

static void test_a_fallback_current_above_the_setpoint_is_a_violation(void) {
    expect_objection(bench_frame(0, 0, 6000), RULE_TOLD_FALLBACK);
}

static void test_a_fallback_current_below_the_minimum_is_a_violation(void) {
    expect_objection(bench_frame(0, 10000, 5000), RULE_TOLD_FALLBACK);
}

static void test_a_fallback_current_that_the_description_does_not_allow_is_a_violation(void) {
    expect_objection(bench_frame(2, 10000, 6000), RULE_TOLD_FALLBACK);
}

static void test_a_phase_mask_that_is_not_the_connectors_is_a_violation(void) {
    expect_objection(bench_frame_with(0, 6000, 48, 3, 2), RULE_PHASES); /* L2 alone */
}

static void test_current_for_a_session_that_nobody_told_is_a_violation(void) {
    expect_objection(bench_frame_with(0, 6000, 56, 8, 9), RULE_SESSION);
}

static void test_current_for_a_session_of_which_a_part_was_told_is_a_violation(void) {
    bench_param(0, 0, 1, 9);
    bench_param(0, 1, 1, 9);
    expect_objection(bench_frame_with(0, 6000, 56, 8, 9), RULE_SESSION);
}

static void test_current_for_a_session_whose_parts_differ_is_a_violation(void) {
    bench_param(0, 0, 1, 9);
    bench_param(0, 1, 1, 8);
    bench_param(0, 2, 1, 0);
    expect_objection(bench_frame_with(0, 6000, 56, 8, 9), RULE_SESSION);
    setUp();
    bench_param(0, 0, 1, 9);
    bench_param(0, 1, 1, 9);
    bench_param(0, 2, 2, 0);
    expect_objection(bench_frame_with(0, 6000, 56, 8, 9), RULE_SESSION);
}

static void test_a_session_holds_until_another_one_was_told_whole(void) {
    for (uint8_t session = 8; session < 11;
         session++) { /* connectors that begin anew, and frames that get lost */
        bench_param(0, 0, session, session);
        bench_param(0, 1, session, session);
    }
    taper_frame_t frame = bench_frame(0, 6000, 0);
    account_sent(&account, &frame);
    bench_content();
    bench_param(0, 2, 10, 0);
    frame = bench_frame_with(0, 6000, 56, 8, 10);
    account_sent(&account, &frame);
    bench_content();
}

static void test_current_for_nobody_is_a_violation(void) {
    expect_objection(bench_frame_with(0, 6000, 56, 8, 0), RULE_SESSION);
}

static void test_current_longer_than_a_tick_after_the_vehicle_left_is_a_violation(void) {
    bench_vehicle(0, false);
    bench_pass(1000);
    taper_frame_t frame = bench_frame(0, 6000, 0);
    account_sent(&account, &frame);
    bench_content();
    bench_pass(250);
    frame = bench_frame(0, 6000, 0);
    account_sent(&account, &frame);
    bench_objects(RULE_SESSION);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_a_setpoint_as_documented_is_no_violation);
    RUN_TEST(test_the_golden_frames_of_the_protocol_are_sound);
    RUN_TEST(test_a_receiver_takes_one_to_three_counters_on_and_no_repetition);
    RUN_TEST(test_a_receiver_trusts_nobody_with_three_bad_frames_in_five);
    RUN_TEST(test_a_setpoint_with_a_wrong_crc_is_a_violation);
    RUN_TEST(test_a_counter_that_does_not_move_by_one_is_a_violation);
    RUN_TEST(test_a_pause_with_a_current_is_a_violation);
    RUN_TEST(test_a_stop_with_a_current_is_a_violation);
    RUN_TEST(test_a_command_to_charge_nothing_is_a_violation);
    RUN_TEST(test_an_unknown_command_is_a_violation);
    RUN_TEST(test_a_current_below_the_minimum_is_a_violation);
    RUN_TEST(test_a_current_above_the_maximum_is_a_violation);
    RUN_TEST(test_a_validity_of_four_seconds_is_a_violation);
    RUN_TEST(test_a_fallback_current_above_the_setpoint_is_a_violation);
    RUN_TEST(test_a_fallback_current_below_the_minimum_is_a_violation);
    RUN_TEST(test_a_fallback_current_that_the_description_does_not_allow_is_a_violation);
    RUN_TEST(test_a_phase_mask_that_is_not_the_connectors_is_a_violation);
    RUN_TEST(test_current_for_a_session_that_nobody_told_is_a_violation);
    RUN_TEST(test_current_for_a_session_of_which_a_part_was_told_is_a_violation);
    RUN_TEST(test_current_for_a_session_whose_parts_differ_is_a_violation);
    RUN_TEST(test_a_session_holds_until_another_one_was_told_whole);
    RUN_TEST(test_current_for_nobody_is_a_violation);
    RUN_TEST(test_current_longer_than_a_tick_after_the_vehicle_left_is_a_violation);
    return UNITY_END();
}
