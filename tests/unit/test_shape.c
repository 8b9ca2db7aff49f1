/* How setpoints may move, golden case by golden case. scene_four(): 6..32 A; changes 5 s apart, 1 A/s, deadband 1 A. */
#include "taper/shape.h"

#include <string.h>

#include "scene.h"
#include "unity.h"

#define START_ms  (UINT32_MAX - 2000u) /* the clock wraps on the way */
#define CHANGE_ms 5000u

static taper_connector_config_t connectors[4];
static taper_station_config_t config;
static taper_snapshot_t snapshot;
static taper_shape_t shape;
static taper_setpoints_t target, shaped;
static uint32_t now_ms;

void setUp(void) {
    now_ms = START_ms;
    memcpy(connectors, scene_four()->connectors, sizeof connectors);
    config = *scene_four();
    config.connectors = connectors;
    config.change_ms = CHANGE_ms;
    config.ramp_mA_per_s = 1000;
    config.deadband_mA = 1000;
    snapshot = scene_snapshot(now_ms, 4);
    memset(&target, 0, sizeof target);
    taper_shape_init(&shape);
}
void tearDown(void) {}

static void sent(int32_t current_mA) {
    taper_shape_sent(&shape, 0, current_mA, false, now_ms);
}

/** What connector 0 gets of `target_mA` now. */
static int32_t shaped_mA(int32_t target_mA) {
    target.current_mA[0] = target_mA;
    taper_shape_bound(&shape, &config, &snapshot, &target, now_ms, &shaped);
    return shaped.current_mA[0];
}

static int32_t shaped_after_mA(uint32_t ms, int32_t target_mA) {
    now_ms += ms;
    return shaped_mA(target_mA);
}

static void test_decreases_go_through_at_once(void) {
    sent(20000);
    TEST_ASSERT_EQUAL_INT32(20000, shaped_mA(20000));
    TEST_ASSERT_EQUAL_INT32(19900, shaped_mA(19900));
    TEST_ASSERT_EQUAL_INT32(6000, shaped_mA(6000));
    TEST_ASSERT_EQUAL_INT32(0, shaped_mA(0));
}

static void test_an_increase_waits_for_the_time_between_changes(void) {
    sent(10000);
    TEST_ASSERT_EQUAL_INT32(10000, shaped_after_mA(CHANGE_ms - 1, 13000));
    TEST_ASSERT_EQUAL_INT32(13000, shaped_after_mA(1, 13000));
}

static void test_a_decrease_is_a_change_too(void) {
    sent(20000);
    now_ms += 60000;
    sent(10000);
    TEST_ASSERT_EQUAL_INT32(10000, shaped_after_mA(CHANGE_ms - 1, 20000));
    TEST_ASSERT_EQUAL_INT32(15000, shaped_after_mA(1, 20000));
}

static void test_the_same_setpoint_again_is_no_change(void) {
    sent(10000);
    now_ms += CHANGE_ms - 1;
    sent(10000);
    TEST_ASSERT_EQUAL_INT32(13000, shaped_after_mA(1, 13000));
}

static void test_direct_current_does_not_wait_but_follows_the_ramp(void) {
    connectors[0].is_dc = true;
    sent(10000);
    TEST_ASSERT_EQUAL_INT32(10000, shaped_mA(20000));
    TEST_ASSERT_EQUAL_INT32(10000, shaped_after_mA(99, 20000));
    TEST_ASSERT_EQUAL_INT32(10100, shaped_after_mA(1, 20000));
    TEST_ASSERT_EQUAL_INT32(12000, shaped_after_mA(1900, 20000));
}

static void test_the_ramp_counts_no_longer_rest_than_the_time_between_changes(void) {
    sent(10000);
    TEST_ASSERT_EQUAL_INT32(15000, shaped_after_mA(CHANGE_ms, 32000));
    TEST_ASSERT_EQUAL_INT32(15000, shaped_after_mA(3600000, 32000));
}

static void test_the_ramp_counts_a_whole_tick_where_ticks_are_longer(void) {
    config.tick_ms = 8000;
    sent(10000);
    TEST_ASSERT_EQUAL_INT32(17000, shaped_after_mA(7000, 32000));
    TEST_ASSERT_EQUAL_INT32(18000, shaped_after_mA(1000, 32000));
    TEST_ASSERT_EQUAL_INT32(18000, shaped_after_mA(1000, 32000));
}

static void test_with_ticks_of_a_quarter_of_an_hour_an_increase_takes_one_tick(void) {
    config.tick_ms = 900000;
    sent(6000);
    TEST_ASSERT_EQUAL_INT32(32000, shaped_after_mA(900000, 32000));
}

static void test_with_ticks_of_a_tenth_of_a_second_the_ramp_is_the_same(void) {
    config.tick_ms = 100;
    config.change_ms = 0;
    sent(10000);
    for (int k = 0; k < 50; k++) {
        now_ms += 100;
        sent(shaped_mA(32000));
    }
    TEST_ASSERT_EQUAL_INT32(15000, shape.sent_mA[0]);
}

static void test_a_ramp_too_slow_for_a_step_of_the_wire_gets_there_all_the_same(void) {
    config.ramp_mA_per_s = 3; /* a step in 33.334 s */
    sent(10000);
    TEST_ASSERT_EQUAL_INT32(10000, shaped_after_mA(33333, 32000));
    TEST_ASSERT_EQUAL_INT32(10100, shaped_after_mA(1, 32000));
    TEST_ASSERT_EQUAL_INT32(10100, shaped_after_mA(600000, 32000));
}

static void test_without_a_ramp_an_increase_takes_one_step(void) {
    config.ramp_mA_per_s = 0;
    sent(10000);
    TEST_ASSERT_EQUAL_INT32(32000, shaped_after_mA(CHANGE_ms, 32000));
}

static void test_what_the_ramp_leaves_is_rounded_down_to_a_step_of_the_wire(void) {
    config.ramp_mA_per_s = 1039; /* 5195 mA */
    sent(10000);
    TEST_ASSERT_EQUAL_INT32(15100, shaped_after_mA(CHANGE_ms, 32000));
}

static void test_the_step_from_nothing_to_the_minimum_is_always_allowed(void) {
    config.ramp_mA_per_s = 100;
    TEST_ASSERT_EQUAL_INT32(6000, shaped_mA(32000));
    TEST_ASSERT_EQUAL_INT32(6000, shaped_mA(6000));
    sent(6000);
    TEST_ASSERT_EQUAL_INT32(6500, shaped_after_mA(CHANGE_ms, 32000));
}

static void test_from_nothing_a_ramp_that_leads_beyond_the_minimum_is_followed(void) {
    config.ramp_mA_per_s = 2000;
    TEST_ASSERT_EQUAL_INT32(10000, shaped_mA(32000));
}

static void test_without_a_minimum_the_ramp_begins_at_nothing(void) {
    config.ramp_mA_per_s = 100;
    snapshot.demand[0].min_mA = 0;
    TEST_ASSERT_EQUAL_INT32(500, shaped_mA(32000));
}

static void test_the_first_increase_waits_for_nothing_and_the_one_after_a_stop_does(void) {
    TEST_ASSERT_EQUAL_INT32(6000, shaped_mA(6000));
    sent(6000);
    now_ms += 60000;
    sent(0);
    TEST_ASSERT_EQUAL_INT32(0, shaped_after_mA(CHANGE_ms - 1, 6000));
    TEST_ASSERT_EQUAL_INT32(6000, shaped_after_mA(1, 6000));
}

static void test_small_increases_wait_until_the_setpoint_stood_still_for_a_while(void) {
    sent(10000);
    TEST_ASSERT_EQUAL_INT32(10000, shaped_after_mA(TAPER_SHAPE_SETTLE_ms - 1, 10900));
    TEST_ASSERT_EQUAL_INT32(10900, shaped_after_mA(1, 10900));
}

static void test_an_increase_of_the_deadband_is_not_small(void) {
    sent(10000);
    TEST_ASSERT_EQUAL_INT32(11000, shaped_after_mA(CHANGE_ms, 11000));
}

static void test_small_steps_of_the_ramp_are_made_when_the_target_is_far(void) {
    config.ramp_mA_per_s = 100;
    sent(10000);
    TEST_ASSERT_EQUAL_INT32(10500, shaped_after_mA(CHANGE_ms, 32000));
}

static void test_what_the_ramp_leaves_to_the_end_is_small_and_waits(void) {
    sent(10000);
    TEST_ASSERT_EQUAL_INT32(15000, shaped_after_mA(CHANGE_ms, 15900));
    sent(15000);
    TEST_ASSERT_EQUAL_INT32(15000, shaped_after_mA(TAPER_SHAPE_SETTLE_ms - 1, 15900));
    TEST_ASSERT_EQUAL_INT32(15900, shaped_after_mA(1, 15900));
}

static void test_small_decreases_are_made_at_once(void) {
    sent(10000);
    TEST_ASSERT_EQUAL_INT32(9900, shaped_mA(9900));
}

static void test_the_deadband_keeps_nobody_off(void) {
    config.deadband_mA = 10000;
    sent(10000);
    sent(0);
    TEST_ASSERT_EQUAL_INT32(6000, shaped_after_mA(CHANGE_ms, 6000));
    snapshot.demand[0].min_mA = 0;
    TEST_ASSERT_EQUAL_INT32(100, shaped_mA(100));
}

static void test_without_a_deadband_the_smallest_step_is_made(void) {
    config.deadband_mA = 0;
    sent(10000);
    TEST_ASSERT_EQUAL_INT32(10100, shaped_after_mA(CHANGE_ms, 10100));
}

static void test_another_session_is_held_back_by_nothing_of_the_one_before(void) {
    sent(10000);
    taper_shape_sent(&shape, 0, 0, true, now_ms);
    TEST_ASSERT_EQUAL_INT32(6000, shaped_mA(6000));
    taper_shape_sent(&shape, 0, 10000, true, now_ms);
    TEST_ASSERT_EQUAL_INT32(10000, shaped_after_mA(CHANGE_ms - 1, 20000)); /* its own first counts */
    TEST_ASSERT_EQUAL_INT32(15000, shaped_after_mA(1, 20000));
}

static void test_the_same_setpoint_for_another_session_is_a_change(void) {
    sent(10000);
    now_ms += 60000;
    taper_shape_sent(&shape, 0, 10000, true, now_ms);
    TEST_ASSERT_EQUAL_INT32(10000, shaped_after_mA(CHANGE_ms - 1, 20000));
}

static void test_between_nothing_and_the_minimum_there_is_nothing(void) {
    sent(6000);
    snapshot.demand[0].min_mA = 8000;
    TEST_ASSERT_EQUAL_INT32(0, shaped_mA(20000)); /* neither what it has nor more than that yet */
    TEST_ASSERT_EQUAL_INT32(11000, shaped_after_mA(CHANGE_ms, 20000));
    TEST_ASSERT_EQUAL_INT32(0, shaped_mA(7999));
    config.ramp_mA_per_s = 100;
    TEST_ASSERT_EQUAL_INT32(8000, shaped_mA(20000));
}

static void test_each_connector_by_itself(void) {
    taper_shape_sent(&shape, 1, 10000, false, now_ms);
    taper_shape_sent(&shape, 3, 12000, false, now_ms - 60000);
    target.current_mA[1] = target.current_mA[2] = target.current_mA[3] = 30000;
    shaped.current_mA[4] = 777; /* there is none */
    TEST_ASSERT_EQUAL_INT32(6000, shaped_mA(6000));
    TEST_ASSERT_EQUAL_INT32(777, shaped.current_mA[4]);
    TEST_ASSERT_EQUAL_INT32(10000, shaped.current_mA[1]);
    TEST_ASSERT_EQUAL_INT32(6000, shaped.current_mA[2]);
    TEST_ASSERT_EQUAL_INT32(17000, shaped.current_mA[3]);
}

static void test_the_greatest_numbers_of_a_description_overflow_nothing(void) {
    config.ramp_mA_per_s = INT32_MAX;
    config.change_ms = UINT32_MAX;
    connectors[0].is_dc = true;
    sent(10000);
    TEST_ASSERT_EQUAL_INT32(32000, shaped_after_mA(600000, 32000));
}

/** Whatever is asked for: never above the target, at least the minimum or nothing, never steeper than the ramp. */
static void test_whatever_is_asked_for_the_rules_hold(void) {
    uint32_t state = 0x5a1e;
    int32_t last_mA = 0;
    uint32_t changed_ms = now_ms;
    bool changed = false;
    for (int k = 0; k < 200000; k++) {
        now_ms += scene_random(&state) % 3000;
        const int32_t target_mA = (int32_t)(scene_random(&state) % 321) * 100;
        const int32_t wanted_mA = target_mA < 6000 ? 0 : target_mA;
        const int32_t now_mA = shaped_mA(wanted_mA);
        TEST_ASSERT_LESS_OR_EQUAL_INT32(wanted_mA, now_mA);
        TEST_ASSERT_TRUE(now_mA == 0 || now_mA >= 6000);
        if (now_mA > last_mA) {
            const uint32_t rest_ms = now_ms - changed_ms;
            TEST_ASSERT_TRUE(!changed || rest_ms >= CHANGE_ms);
            TEST_ASSERT_TRUE(now_mA - last_mA <= 5000 || now_mA == 6000);
        } else {
            TEST_ASSERT_EQUAL_INT32(now_mA < last_mA ? wanted_mA : last_mA, now_mA);
        }
        if (now_mA != last_mA) {
            changed = true;
            changed_ms = now_ms;
        }
        last_mA = now_mA;
        sent(now_mA);
    }
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_decreases_go_through_at_once);
    RUN_TEST(test_an_increase_waits_for_the_time_between_changes);
    RUN_TEST(test_a_decrease_is_a_change_too);
    RUN_TEST(test_the_same_setpoint_again_is_no_change);
    RUN_TEST(test_direct_current_does_not_wait_but_follows_the_ramp);
    RUN_TEST(test_the_ramp_counts_no_longer_rest_than_the_time_between_changes);
    RUN_TEST(test_the_ramp_counts_a_whole_tick_where_ticks_are_longer);
    RUN_TEST(test_with_ticks_of_a_quarter_of_an_hour_an_increase_takes_one_tick);
    RUN_TEST(test_with_ticks_of_a_tenth_of_a_second_the_ramp_is_the_same);
    RUN_TEST(test_a_ramp_too_slow_for_a_step_of_the_wire_gets_there_all_the_same);
    RUN_TEST(test_without_a_ramp_an_increase_takes_one_step);
    RUN_TEST(test_what_the_ramp_leaves_is_rounded_down_to_a_step_of_the_wire);
    RUN_TEST(test_the_step_from_nothing_to_the_minimum_is_always_allowed);
    RUN_TEST(test_from_nothing_a_ramp_that_leads_beyond_the_minimum_is_followed);
    RUN_TEST(test_without_a_minimum_the_ramp_begins_at_nothing);
    RUN_TEST(test_the_first_increase_waits_for_nothing_and_the_one_after_a_stop_does);
    RUN_TEST(test_small_increases_wait_until_the_setpoint_stood_still_for_a_while);
    RUN_TEST(test_an_increase_of_the_deadband_is_not_small);
    RUN_TEST(test_small_steps_of_the_ramp_are_made_when_the_target_is_far);
    RUN_TEST(test_what_the_ramp_leaves_to_the_end_is_small_and_waits);
    RUN_TEST(test_small_decreases_are_made_at_once);
    RUN_TEST(test_the_deadband_keeps_nobody_off);
    RUN_TEST(test_without_a_deadband_the_smallest_step_is_made);
    RUN_TEST(test_another_session_is_held_back_by_nothing_of_the_one_before);
    RUN_TEST(test_the_same_setpoint_for_another_session_is_a_change);
    RUN_TEST(test_between_nothing_and_the_minimum_there_is_nothing);
    RUN_TEST(test_each_connector_by_itself);
    RUN_TEST(test_the_greatest_numbers_of_a_description_overflow_nothing);
    RUN_TEST(test_whatever_is_asked_for_the_rules_hold);
    return UNITY_END();
}
