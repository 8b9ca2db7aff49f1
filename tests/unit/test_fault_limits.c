/* Limits that are odd: zero, negative, too small for all, never at rest. Faults 36 to 39 of docs/protocol.md. */
#include "fault_bench.h"
#include "unity.h"

#define TICK_ms       1000u
#define ON_BUS_ms     500u /* setpoints are out so long after a tick at the latest */
#define PLAN_ROUND_ms 9000u
#define HIGH_KW       60.0
#define NEGATIVE_W    (-5000)
#define MIN_KW        4.14 /* 6 A of the hub */
#define TURN_ms       900000u
#define SWITCH_ms     300000u
#define HAND_OVER_ms  10000u /* 5 s of a vehicle, ticks, and its way to the bus */

static double time_s[32];
static double limit_kw[32];
static sim_course_t limits;

static void add_limit(double after_s, double kw) {
    time_s[limits.count] = LIVE_START_S + after_s;
    limit_kw[limits.count] = kw;
    limits.count++;
}

void setUp(void) {
    limits = (sim_course_t){.time_s = time_s, .value = limit_kw, .count = 0};
    add_limit(-1000.0, HIGH_KW);
}

void tearDown(void) {
    live_bench_end();
}

/** `vehicles` that leave two hours after each other, the first in six. */
static void open_under_limits(unsigned vehicles, bool as_described) {
    live_options_t options = live_options(-1.0);
    sim_session_t sessions[8];
    for (unsigned i = 0; i < vehicles; i++) {
        sessions[i] = live_vehicle(0.0);
        sessions[i].told_s = sessions[i].arrival_s + 3600.0 * (6.0 + 2.0 * i);
    }
    options.limits = &limits;
    options.as_described = as_described;
    fault_open(&options, sessions, vehicles);
    sim_curve_init(&live.field.curve, NULL); /* nothing is told ahead */
}

static unsigned count_charging(uint8_t vehicles) {
    unsigned count = 0;
    for (uint8_t node = 1; node <= vehicles; node++) {
        count += fault_setpoint(node).command == TAPER_COMMAND_CHARGE ? 1u : 0u;
    }
    return count;
}

static void wait_until_all_pause(uint8_t vehicles) {
    while (count_charging(vehicles) > 0 || live.field.tracker.drawn_kw > 0.0) {
        TEST_ASSERT_LESS_THAN_UINT32(TICK_ms + ON_BUS_ms + 2 * LIVE_POLL_ms, fault_passed_ms());
        live_bench_run_ms(LIVE_POLL_ms);
    }
}

static void assert_all_told(taper_reason_t reason, uint8_t vehicles) {
    live_bench_run_ms(PLAN_ROUND_ms);
    for (uint8_t node = 1; node <= vehicles; node++) {
        TEST_ASSERT_EQUAL(reason, fault_reason(node));
        TEST_ASSERT_EQUAL(TAPER_COMMAND_PAUSE, fault_setpoint(node).command);
        TEST_ASSERT_EQUAL_INT32(0, fault_setpoint(node).current_mA);
        TEST_ASSERT_EQUAL_INT32(0, fault_setpoint(node).fallback_mA);
    }
}

/** HIGH_KW, and from 30.3 s to 60 s a limit of 0. */
static void start_with_a_limit_of_zero_ahead(void) {
    add_limit(30.3, 0.0);
    add_limit(60.0, HIGH_KW);
    open_under_limits(8, false);
    fault_switch_soon();
    live_bench_run_ms(30300);
    TEST_ASSERT_EQUAL_UINT(8, count_charging(8));
    fault_begins();
}

static void assert_all_resume(void) {
    live_bench_run_ms(29700 - fault_passed_ms());
    TEST_ASSERT_EQUAL_DOUBLE(0.0, live.field.tracker.drawn_kw);
    TEST_ASSERT_LESS_THAN_UINT32(4 * TICK_ms, fault_wait_until_drawn(HIGH_KW - 1.0, 4 * TICK_ms));
    TEST_ASSERT_EQUAL_UINT(8, count_charging(8));
    fault_assert_limits_held();
}

static void test_row_36_at_a_limit_of_zero_all_pause_within_a_tick_and_resume_with_the_next(void) {
    start_with_a_limit_of_zero_ahead();
    wait_until_all_pause(8);
    assert_all_told(TAPER_REASON_GRID_PAUSE, 8);
    TEST_ASSERT_EQUAL(TAPER_LIMIT_GATEWAY, fault_status().limit_source);
    TEST_ASSERT_EQUAL_UINT8(8, fault_status().waiting);
    TEST_ASSERT_EQUAL_UINT(0, fault_events(TAPER_EVENT_LIMIT_NEGATIVE));
    assert_all_resume();
}

static void test_row_36_minimum_on_times_do_not_stand_in_the_way_of_a_limit_of_zero(void) {
    add_limit(30.3, 0.0);
    open_under_limits(8, true); /* 300 s on, as described */
    live_bench_run_ms(30300);
    TEST_ASSERT_EQUAL_UINT(8, count_charging(8));
    fault_begins();
    wait_until_all_pause(8);
    assert_all_told(TAPER_REASON_GRID_PAUSE, 8);
    fault_assert_limits_held();
}

static void tell_zero_as_negative(taper_frame_t *frame) {
    taper_message_t message;
    if (fault_read(frame, &message) && message.kind == TAPER_MESSAGE_SITE_LIMIT &&
        message.as.site_limit.limit_W == 0) {
        message.as.site_limit.limit_W = NEGATIVE_W;
        fault_rewrite(frame, &message);
    }
}

static void test_row_37_a_negative_limit_counts_as_zero_and_people_are_told(void) {
    start_with_a_limit_of_zero_ahead();
    fault.alter = tell_zero_as_negative;
    wait_until_all_pause(8);
    assert_all_told(TAPER_REASON_GRID_PAUSE, 8);
    TEST_ASSERT_EQUAL_UINT(1, fault_events(TAPER_EVENT_LIMIT_NEGATIVE));
    TEST_ASSERT_EQUAL_INT32(NEGATIVE_W, fault_last_event(TAPER_EVENT_LIMIT_NEGATIVE)->data);
    TEST_ASSERT_GREATER_OR_EQUAL_UINT32(9, fault_count(TAPER_COUNTER_LIMITS_NEGATIVE)); /* one a second */
    fault_assert_emcy(TAPER_EVENT_LIMIT_NEGATIVE, TAPER_NODE_GATEWAY, 0);
    assert_all_resume();
    fault_begins();
    live_bench_run_ms(3000);
    fault_begins(); /* 2 s after it was last seen it is over */
    live_bench_run_ms(5000);
    fault_assert_no_emcy();
}

/** What is seen of one connector while connectors take turns. */
typedef struct {
    bool on;
    uint32_t since_ms;
    uint32_t longest_off_ms;
    unsigned switches;
} turns_t;

static turns_t turns[5];

/** A connector was switched on or off, not sooner than it may be. */
static void note_switch(uint8_t i, bool on) {
    const uint32_t lasted_ms = taper_elapsed_ms(live.now_ms, turns[i].since_ms);
    if (turns[i].switches > 0) {
        TEST_ASSERT_GREATER_OR_EQUAL_UINT32(SWITCH_ms, lasted_ms);
    }
    turns[i].longest_off_ms = on && lasted_ms > turns[i].longest_off_ms ? lasted_ms : turns[i].longest_off_ms;
    turns[i].on = on;
    turns[i].since_ms = live.now_ms;
    turns[i].switches++;
}

/** There is always one to charge. Nobody draws only while it is handed over. */
static void note_whether_any_charges(void) {
    static uint32_t dark_ms;
    unsigned meant = 0;
    for (uint8_t i = 0; i < 5; i++) {
        meant += live.station.target.current_mA[i] > 0 ? 1u : 0u;
    }
    TEST_ASSERT_EQUAL_UINT(2, meant);
    dark_ms = live.field.tracker.drawn_kw > MIN_KW - 0.01 ? 0 : dark_ms + LIVE_POLL_ms;
    TEST_ASSERT_LESS_THAN_UINT32(HAND_OVER_ms, dark_ms);
}

static void watch_turns_ms(uint32_t ms) {
    for (uint32_t passed_ms = 0; passed_ms < ms; passed_ms += LIVE_POLL_ms) {
        live_bench_run_ms(LIVE_POLL_ms);
        for (uint8_t i = 0; i < 5; i++) {
            const bool on = fault_setpoint((uint8_t)(i + 1)).command == TAPER_COMMAND_CHARGE;
            if (on != turns[i].on) {
                note_switch(i, on);
            }
        }
        note_whether_any_charges();
    }
}

/** Five vehicles charge for 400 s; then there is room for two minimum currents. */
static void start_with_room_for_two_of_five(void) {
    add_limit(400.0, 9.0);
    open_under_limits(5, true);
    live_bench_run_ms(400000);
    TEST_ASSERT_EQUAL_UINT(5, count_charging(5));
    fault_begins();
    for (uint8_t i = 0; i < 5; i++) {
        turns[i] = (turns_t){.on = true, .since_ms = live.now_ms};
    }
}

static void test_row_38_who_can_wait_longest_is_shed_and_told_his_place(void) {
    start_with_room_for_two_of_five();
    live_bench_run_ms(TICK_ms + ON_BUS_ms + LIVE_POLL_ms);
    TEST_ASSERT_EQUAL_UINT(2, count_charging(5));
    live_bench_run_ms(PLAN_ROUND_ms);
    for (uint8_t node = 1; node <= 5; node++) {
        const taper_outlook_t outlook = fault_outlook(node);
        const bool waits = node > 2; /* they leave last */
        TEST_ASSERT_EQUAL(waits ? TAPER_COMMAND_PAUSE : TAPER_COMMAND_CHARGE, fault_setpoint(node).command);
        TEST_ASSERT_EQUAL(waits, outlook.reason == TAPER_REASON_WAITING);
        TEST_ASSERT_EQUAL_UINT8(waits ? node - 2 : 0, outlook.waiting_place);
        TEST_ASSERT_EQUAL_UINT8(waits ? 3 : 0, outlook.waiting_of);
    }
    TEST_ASSERT_EQUAL_UINT8(3, fault_status().waiting);
    fault_assert_limits_held();
}

static void test_row_38_connectors_take_turns_and_nobody_waits_for_more_than_his(void) {
    start_with_room_for_two_of_five();
    live_bench_run_ms(TICK_ms + ON_BUS_ms + LIVE_POLL_ms);
    watch_turns_ms(5 * TURN_ms);
    for (uint8_t i = 0; i < 5; i++) {
        TEST_ASSERT_GREATER_OR_EQUAL_UINT(2, turns[i].switches);
        TEST_ASSERT_LESS_THAN_UINT32(3 * TURN_ms + SWITCH_ms + HAND_OVER_ms, turns[i].longest_off_ms);
    }
    fault_assert_limits_held();
}

/** 40 kW, and from 30.2 s on 30 and 40 kW in turn, `every_s` each; 40 kW at the end. */
static void start_under_a_limit_that_changes(unsigned changes, double every_s) {
    limits.count = 0;
    add_limit(-1000.0, 40.0);
    for (unsigned k = 0; k < changes; k++) {
        add_limit(30.2 + every_s * k, k % 2 == 0 ? 30.0 : 40.0);
    }
    open_under_limits(4, false);
    fault_switch_soon();
    live_bench_run_ms(30200);
    TEST_ASSERT_DOUBLE_WITHIN(1.0, 40.0, live.field.tracker.drawn_kw);
    fault_begins();
}

static void test_row_39_of_a_limit_that_flaps_decreases_act_at_once_and_increases_wait_for_30_s(void) {
    int32_t held_mA[4];
    start_under_a_limit_that_changes(10, 2.0); /* the last fall is 16 s after the first, the last rise 18 s */
    live_bench_run_ms(TICK_ms + ON_BUS_ms + LIVE_POLL_ms);
    TEST_ASSERT_TRUE(live.field.tracker.drawn_kw <= 30.0);
    for (uint8_t i = 0; i < 4; i++) {
        held_mA[i] = fault_setpoint((uint8_t)(i + 1)).current_mA;
    }
    while (fault_passed_ms() < 18000 + 30000 - TICK_ms) {
        for (uint8_t i = 0; i < 4; i++) {
            TEST_ASSERT_EQUAL_INT32(held_mA[i], fault_setpoint((uint8_t)(i + 1)).current_mA);
        }
        live_bench_run_ms(LIVE_POLL_ms);
    }
    TEST_ASSERT_EQUAL(TAPER_LIMIT_HELD, fault_status().limit_source);
    TEST_ASSERT_EQUAL_UINT(1, fault_events(TAPER_EVENT_LIMIT_FLAPS));
    TEST_ASSERT_EQUAL_UINT32(1, fault_count(TAPER_COUNTER_LIMIT_FLAPS));
    TEST_ASSERT_LESS_THAN_UINT32(4 * TICK_ms, fault_wait_until_drawn(39.0, 4 * TICK_ms));
    live_bench_run_ms(TICK_ms);
    TEST_ASSERT_EQUAL(TAPER_LIMIT_GATEWAY, fault_status().limit_source);
    fault_assert_limits_held();
}

static void test_row_39_a_limit_that_changes_more_slowly_is_followed_both_ways(void) {
    start_under_a_limit_that_changes(6, 6.0);
    for (unsigned k = 0; k < 6; k++) {
        live_bench_run_ms(4000);
        TEST_ASSERT_DOUBLE_WITHIN(1.0, k % 2 == 0 ? 30.0 : 40.0, live.field.tracker.drawn_kw);
        live_bench_run_ms(2000);
    }
    TEST_ASSERT_EQUAL_UINT(0, fault_events(TAPER_EVENT_LIMIT_FLAPS));
    fault_assert_limits_held();
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_row_36_at_a_limit_of_zero_all_pause_within_a_tick_and_resume_with_the_next);
    RUN_TEST(test_row_36_minimum_on_times_do_not_stand_in_the_way_of_a_limit_of_zero);
    RUN_TEST(test_row_37_a_negative_limit_counts_as_zero_and_people_are_told);
    RUN_TEST(test_row_38_who_can_wait_longest_is_shed_and_told_his_place);
    RUN_TEST(test_row_38_connectors_take_turns_and_nobody_waits_for_more_than_his);
    RUN_TEST(test_row_39_of_a_limit_that_flaps_decreases_act_at_once_and_increases_wait_for_30_s);
    RUN_TEST(test_row_39_a_limit_that_changes_more_slowly_is_followed_both_ways);
    return UNITY_END();
}
