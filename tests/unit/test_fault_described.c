/*
 * The hub as it is described: vehicles that take 5 s to follow, ramps, fallback currents. What faults and the hand-over are
 * like there.
 */
#include "fault_bench.h"
#include "unity.h"

#define TICK_ms     1000u
#define VALIDITY_ms 3000u
#define REACTION_ms 5000u
#define KW_PER_A    0.69
#define FAILSAFE_KW 11.0
#define MIN_KW      4.14 /* 6 A, which is also the fallback current */

void setUp(void) {}

void tearDown(void) {
    live_bench_end();
}

/** Vehicles that are there from the start, and `late_s` after it one more; 0: none. */
static void start(unsigned vehicles, double late_s, double limit_kw) {
    live_options_t options = live_options(limit_kw);
    sim_session_t sessions[8];
    for (unsigned i = 0; i < vehicles; i++) {
        sessions[i] = live_vehicle(0.0);
    }
    if (late_s > 0.0) {
        sessions[vehicles] = live_vehicle(late_s);
        sessions[vehicles].told_s = sessions[vehicles].arrival_s + 6.0 * 3600.0; /* it is in a hurry */
    }
    options.as_described = true;
    options.vehicle_delay_ms = REACTION_ms;
    fault_open(&options, sessions, vehicles + (late_s > 0.0 ? 1u : 0u));
    live_bench_run_ms(60000);
    fault_begins();
}

static double fallbacks_told_kw(void) {
    double sum_kw = 0.0;
    for (uint8_t node = 1; node <= 8; node++) {
        sum_kw += (double)fault_setpoint(node).fallback_mA / 1000.0 * KW_PER_A;
    }
    return sum_kw;
}

static void test_row_12_without_a_controller_connectors_draw_fallback_currents_within_the_failsafe_limit(
    void) {
    start(4, 0.0, 30.0);
    TEST_ASSERT_DOUBLE_WITHIN(0.5, 30.0, live.field.tracker.drawn_kw);
    TEST_ASSERT_DOUBLE_WITHIN(0.01, 2.0 * MIN_KW, fallbacks_told_kw()); /* there is room for two */
    live_bench_kill_station();
    live_bench_run_ms(VALIDITY_ms + REACTION_ms + 2 * LIVE_POLL_ms);
    for (unsigned s = 0; s < 300; s++) {
        TEST_ASSERT_DOUBLE_WITHIN(0.01, 2.0 * MIN_KW, live.field.tracker.drawn_kw);
        live_bench_run_ms(1000);
    }
    live_bench_revive_station();
    TEST_ASSERT_LESS_THAN_UINT32(60000, fault_wait_until_drawn(29.0, 60000));
    TEST_ASSERT_DOUBLE_WITHIN(0.01, 2.0 * MIN_KW, fallbacks_told_kw());
    fault_assert_limits_held();
}

static void test_row_12_fallback_currents_go_to_others_when_a_vehicle_leaves(void) {
    start(4, 0.0, 30.0);
    unsigned had_one = 0;
    for (uint8_t node = 1; node <= 4; node++) {
        had_one = fault_setpoint(node).fallback_mA > 0 ? node : had_one;
    }
    TEST_ASSERT_GREATER_THAN_UINT(0, had_one);
    live.session[had_one - 1].departure_s = sim_field_world_s(&live.field); /* now */
    for (unsigned k = 0; k < 1000; k++) {
        live_bench_run_ms(LIVE_POLL_ms);
        TEST_ASSERT_TRUE(fallbacks_told_kw() <= FAILSAFE_KW);
    }
    TEST_ASSERT_EQUAL_INT32(0, fault_setpoint((uint8_t)had_one).fallback_mA);
    TEST_ASSERT_DOUBLE_WITHIN(0.01, 2.0 * MIN_KW, fallbacks_told_kw());
    fault_assert_limits_held();
}

static void test_row_13_in_failsafe_all_that_vehicles_still_draw_is_gone_after_their_5_s(void) {
    start(4, 0.0, 30.0);
    sim_field_kill(&live.field, SIM_GATEWAY);
    fault_wait_for(TAPER_EVENT_GATEWAY_LOST, TAPER_SITE_LIMIT_TIMEOUT_ms + TICK_ms + 40);
    live_bench_run_ms(500 + REACTION_ms + 2 * LIVE_POLL_ms);
    for (unsigned s = 0; s < 60; s++) {
        TEST_ASSERT_TRUE(live.field.tracker.drawn_kw <= FAILSAFE_KW);
        TEST_ASSERT_TRUE(live.field.tracker.drawn_kw >= 2.0 * MIN_KW - 0.01); /* it is used */
        live_bench_run_ms(1000);
    }
    TEST_ASSERT_EQUAL_UINT32(0, fault_count(TAPER_COUNTER_GUARD_VIOLATIONS));
}

/** The setpoint that a connector last confirmed [mA]. */
static int32_t echoed_mA(uint8_t node, const taper_setpoint_t by_counter[16]) {
    taper_message_t message;
    TEST_ASSERT_TRUE(fault_read(&fault.said[taper_can_id(TAPER_MESSAGE_EVSE_STATUS, node)].frame, &message));
    return by_counter[message.as.evse_status.setpoint_echo].current_mA;
}

/** Times of the hand-over from vehicle 1 to vehicle 2, on the bus. */
typedef struct {
    uint32_t lowered_ms; /**< vehicle 1 was told less */
    uint32_t echoed_ms;  /**< and its connector had it */
    uint32_t raised_ms;  /**< vehicle 2 was told more than nothing */
} hand_over_t;

static hand_over_t watch_hand_over(uint32_t most_ms) {
    hand_over_t times = {0};
    taper_setpoint_t by_counter[16] = {{0}};
    const int32_t before_mA = fault_setpoint(1).current_mA;
    const fault_frames_t *told = &fault.told[taper_can_id(TAPER_MESSAGE_SETPOINT, 1)];
    while (times.raised_ms == 0) {
        TEST_ASSERT_LESS_THAN_UINT32(most_ms, fault_passed_ms());
        live_bench_run_ms(LIVE_POLL_ms);
        by_counter[told->frame.data[1] & 0x0Fu] = fault_setpoint(1);
        if (times.lowered_ms == 0 && fault_setpoint(1).current_mA < before_mA) {
            times.lowered_ms = live.now_ms;
        }
        if (times.lowered_ms != 0 && times.echoed_ms == 0 && echoed_mA(1, by_counter) < before_mA) {
            times.echoed_ms = live.now_ms;
        }
        times.raised_ms = fault_setpoint(2).current_mA > 0 ? live.now_ms : 0;
    }
    return times;
}

static void test_an_increase_reaches_the_bus_no_sooner_than_5_s_after_the_echo_of_its_decrease(void) {
    start(1, 70.0, 12.0);
    TEST_ASSERT_DOUBLE_WITHIN(0.1, 11.0, live.field.tracker.drawn_kw);
    live_bench_run_ms(9000); /* vehicle 2 comes in a second */
    const hand_over_t times = watch_hand_over(30000);
    TEST_ASSERT_GREATER_THAN_UINT32(0, times.echoed_ms);
    TEST_ASSERT_LESS_OR_EQUAL_UINT32(TAPER_EVSE_STATUS_CYCLE_ms + LIVE_POLL_ms,
                                     times.echoed_ms - times.lowered_ms);
    TEST_ASSERT_GREATER_OR_EQUAL_UINT32(REACTION_ms, times.raised_ms - times.echoed_ms);
    TEST_ASSERT_LESS_OR_EQUAL_UINT32(REACTION_ms + TICK_ms, times.raised_ms - times.echoed_ms);
    live_bench_run_ms(60000);
    TEST_ASSERT_DOUBLE_WITHIN(0.5, 12.0, live.field.tracker.drawn_kw);
    fault_assert_limits_held(); /* not by what they may draw, nor by what they draw, which is 5 s late */
}

static void test_a_setpoint_rises_no_more_than_every_5_s_and_no_steeper_than_the_ramp(void) {
    int32_t last_mA = 0;
    uint32_t changed_ms = 0;
    start(1, 70.0, 60.0);
    while (fault_passed_ms() < 60000) {
        live_bench_run_ms(LIVE_POLL_ms);
        const int32_t now_mA = fault_setpoint(2).current_mA;
        if (now_mA == last_mA) {
            continue;
        }
        TEST_ASSERT_GREATER_THAN_INT32(last_mA, now_mA); /* nothing makes it fall here */
        if (changed_ms != 0) {
            const uint32_t since_ms = live.now_ms - changed_ms;
            TEST_ASSERT_GREATER_OR_EQUAL_UINT32(REACTION_ms, since_ms);
            TEST_ASSERT_LESS_OR_EQUAL_INT32(2 * (int32_t)REACTION_ms, now_mA - last_mA); /* 2 A/s */
        }
        last_mA = now_mA;
        changed_ms = live.now_ms;
    }
    TEST_ASSERT_DOUBLE_WITHIN(0.1, 11.0, fault_drawn_kw(2));
    fault_assert_limits_held();
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_row_12_without_a_controller_connectors_draw_fallback_currents_within_the_failsafe_limit);
    RUN_TEST(test_row_12_fallback_currents_go_to_others_when_a_vehicle_leaves);
    RUN_TEST(test_row_13_in_failsafe_all_that_vehicles_still_draw_is_gone_after_their_5_s);
    RUN_TEST(test_an_increase_reaches_the_bus_no_sooner_than_5_s_after_the_echo_of_its_decrease);
    RUN_TEST(test_a_setpoint_rises_no_more_than_every_5_s_and_no_steeper_than_the_ramp);
    return UNITY_END();
}
