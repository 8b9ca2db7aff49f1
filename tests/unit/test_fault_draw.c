/* Vehicles that draw too much, do not stop, or leave current unused: faults 41 to 43 of docs/protocol.md. */
#include <string.h>

#include "fault_bench.h"
#include "unity.h"

#define LIMIT_KW      30.0
#define TICK_ms       1000u
#define ON_BUS_ms     500u
#define STATUS_ms     TAPER_EVSE_STATUS_CYCLE_ms
#define REACTION_ms   5000u
#define PLAN_ROUND_ms 9000u
#define KW_PER_A      0.69
/* Of docs/protocol.md; not those of the code. */
#define OVER_ms    7000u
#define OPEN_ms    10000u
#define IGNORES_ms 6000u
#define UNUSED_ms  60000u
#define CALM_ms    60000u
#define TOO_MUCH_A 22.0

/** What vehicle 1 draws whatever it is told, until its contactor opens [A]; 0: it obeys. */
static double stubborn_A;
/** It takes a pause for an answer, though. */
static bool pauses;

static double stubborn_now_A(void) {
    const taper_command_t command = fault_setpoint(1).command;
    const bool open = command == TAPER_COMMAND_STOP || (pauses && command == TAPER_COMMAND_PAUSE);
    return live.field.evse[0].vehicle == NULL || open ? 0.0 : stubborn_A;
}

static void draw_stubbornly(taper_frame_t *frame) {
    taper_message_t message;
    if (stubborn_A <= 0.0 || !fault_read(frame, &message) || message.kind != TAPER_MESSAGE_EVSE_STATUS ||
        message.node != 1 || !message.as.evse_status.ev_present) {
        return;
    }
    for (unsigned phase = 0; phase < 3; phase++) {
        message.as.evse_status.current_mA[phase] = (int32_t)(stubborn_now_A() * 1000.0);
    }
    fault_rewrite(frame, &message);
}

/** What really flows [kW]. */
static double physical_kw(void) {
    const double obedient_kw = live.field.tracker.drawn_kw;
    return stubborn_A <= 0.0 ? obedient_kw : obedient_kw - fault_drawn_kw(1) + stubborn_now_A() * KW_PER_A;
}

void setUp(void) {
    stubborn_A = 0.0;
    pauses = false;
}

void tearDown(void) {
    live_bench_end();
}

/** Four vehicles; the first leaves after `stay_s`, and another one comes ten seconds later. */
static void start(const live_options_t *options, double stay_s) {
    sim_session_t sessions[5];
    for (unsigned i = 0; i < 4; i++) {
        sessions[i] = live_vehicle(0.0);
    }
    sessions[0].departure_s = LIVE_START_S + stay_s;
    sessions[4] = live_vehicle(stay_s + 10.0);
    fault_open(options, sessions, 5);
    fault_switch_soon();
    fault.alter = draw_stubbornly;
    live_bench_run_ms(options->as_described ? 60000 : 20000);
    TEST_ASSERT_DOUBLE_WITHIN(0.5, LIMIT_KW, live.field.tracker.drawn_kw);
    fault_begins();
}

/** Setpoints move freely, and vehicles follow at once. */
static void start_free(double stay_s) {
    const live_options_t options = live_options(LIMIT_KW);
    start(&options, stay_s);
}

/** As the hub is described: vehicles take their 5 s. */
static void start_described(void) {
    live_options_t options = live_options(LIMIT_KW);
    options.as_described = true;
    options.vehicle_delay_ms = REACTION_ms;
    start(&options, 3600.0);
}

/** @return how long it took until what flows was within the limit [ms]. */
static uint32_t wait_until_within_the_limit(uint32_t most_ms) {
    while (physical_kw() > LIMIT_KW + 1e-6) {
        TEST_ASSERT_LESS_THAN_UINT32(most_ms, fault_passed_ms());
        live_bench_run_ms(LIVE_POLL_ms);
    }
    return fault_passed_ms();
}

/** Let time pass, with what flows within the limit. */
static void run_within_the_limit_ms(uint32_t ms) {
    for (uint32_t passed_ms = 0; passed_ms < ms; passed_ms += LIVE_POLL_ms) {
        live_bench_run_ms(LIVE_POLL_ms);
        TEST_ASSERT_TRUE(physical_kw() <= LIMIT_KW + 1e-6);
    }
}

static void test_row_41_what_is_drawn_too_much_is_booked_at_once_and_others_make_room(void) {
    start_free(3600.0);
    stubborn_A = TOO_MUCH_A;
    TEST_ASSERT_TRUE(physical_kw() > LIMIT_KW + 3.0);
    wait_until_within_the_limit(STATUS_ms + TICK_ms + ON_BUS_ms);
    for (uint8_t node = 2; node <= 4; node++) {
        TEST_ASSERT_GREATER_OR_EQUAL_INT32(6000, fault_setpoint(node).current_mA); /* nobody is stopped */
    }
    run_within_the_limit_ms(3000);
    TEST_ASSERT_EQUAL_UINT(0, fault_events(TAPER_EVENT_OVER_DRAW)); /* 7 s are not over */
    stubborn_A = 0.0;
    TEST_ASSERT_LESS_THAN_UINT32(3 * TICK_ms, fault_wait_until_drawn(LIMIT_KW - 0.5, 3 * TICK_ms));
    TEST_ASSERT_EQUAL_UINT32(0, fault_count(TAPER_COUNTER_GUARD_VIOLATIONS));
}

static void test_row_41_after_7_s_it_has_to_pause_and_10_s_later_its_contactor_opens(void) {
    start_free(3600.0);
    stubborn_A = TOO_MUCH_A;
    const uint32_t over_ms = fault_wait_for(TAPER_EVENT_OVER_DRAW, OVER_ms + STATUS_ms + 2 * TICK_ms);
    TEST_ASSERT_GREATER_OR_EQUAL_UINT32(OVER_ms, over_ms);
    TEST_ASSERT_EQUAL_INT32(220, fault_last_event(TAPER_EVENT_OVER_DRAW)->data);
    TEST_ASSERT_EQUAL_UINT8(1, fault_last_event(TAPER_EVENT_OVER_DRAW)->node);
    TEST_ASSERT_EQUAL(TAPER_COMMAND_PAUSE, fault_setpoint(1).command);
    TEST_ASSERT_EQUAL_UINT32(1, fault_count(TAPER_COUNTER_OVER_DRAWS));
    run_within_the_limit_ms(PLAN_ROUND_ms);
    TEST_ASSERT_EQUAL(TAPER_REASON_OVER_DRAW, fault_reason(1));
    TEST_ASSERT_EQUAL(TAPER_COMMAND_PAUSE, fault_setpoint(1).command);
    const uint32_t open_ms = fault_wait_for(TAPER_EVENT_LOCKED_OUT, over_ms + OPEN_ms + 2 * TICK_ms);
    TEST_ASSERT_GREATER_OR_EQUAL_UINT32(over_ms + OPEN_ms, open_ms);
    TEST_ASSERT_EQUAL(TAPER_COMMAND_STOP, fault_setpoint(1).command);
    TEST_ASSERT_EQUAL_UINT32(1, fault_count(TAPER_COUNTER_LOCKOUTS));
    run_within_the_limit_ms(PLAN_ROUND_ms);
    TEST_ASSERT_EQUAL(TAPER_REASON_LOCKED_OUT, fault_reason(1));
    TEST_ASSERT_DOUBLE_WITHIN(0.5, LIMIT_KW, physical_kw()); /* the others have its share */
    fault_assert_emcy(TAPER_EVENT_OVER_DRAW, 1, 2);
    TEST_ASSERT_EQUAL_UINT32(0, fault_count(TAPER_COUNTER_GUARD_VIOLATIONS));
}

static void test_row_41_who_pauses_when_told_may_try_again_after_a_minute(void) {
    start_free(3600.0);
    stubborn_A = TOO_MUCH_A;
    pauses = true;
    fault_wait_for(TAPER_EVENT_OVER_DRAW, OVER_ms + STATUS_ms + 2 * TICK_ms);
    stubborn_A = 0.0; /* repaired */
    live_bench_run_ms(CALM_ms - TICK_ms);
    TEST_ASSERT_EQUAL(TAPER_COMMAND_PAUSE, fault_setpoint(1).command);
    live_bench_run_ms(5 * TICK_ms);
    TEST_ASSERT_EQUAL(TAPER_COMMAND_CHARGE, fault_setpoint(1).command);
    TEST_ASSERT_EQUAL_UINT(0, fault_events(TAPER_EVENT_LOCKED_OUT));
    TEST_ASSERT_EQUAL_UINT32(1, fault_count(TAPER_COUNTER_OVER_DRAWS));
    fault_assert_limits_held();
}

static void test_row_41_within_the_tolerance_nothing_is_said(void) {
    start_free(3600.0);
    stubborn_A = (fault_setpoint(1).current_mA / 1000.0 + 0.5) * 1.1 - 0.1;
    live_bench_run_ms(20000);
    TEST_ASSERT_EQUAL_UINT(0, fault_events(TAPER_EVENT_OVER_DRAW));
    TEST_ASSERT_EQUAL_UINT32(0, live.station.ledger.entry[0].drawn_mA);
    fault_assert_no_emcy();
}

static void test_row_41_vehicles_that_take_their_5_s_have_made_room_by_then(void) {
    start_described();
    stubborn_A = TOO_MUCH_A;
    wait_until_within_the_limit(STATUS_ms + TICK_ms + ON_BUS_ms + REACTION_ms);
    run_within_the_limit_ms(30000); /* it is paused, then opened, and others get more */
    TEST_ASSERT_EQUAL(TAPER_COMMAND_STOP, fault_setpoint(1).command);
    TEST_ASSERT_EQUAL_UINT32(0, fault_count(TAPER_COUNTER_GUARD_VIOLATIONS));
}

/** A limit of 0 from 80 s to 110 s; vehicle 1 is unplugged after 170 s. */
static void start_with_a_pause(const sim_course_t *limits, uint32_t vehicle_delay_ms) {
    live_options_t options = live_options(-1.0);
    options.limits = limits;
    options.as_described = true;
    options.vehicle_delay_ms = vehicle_delay_ms;
    options.grace_ms = SIM_GRACE_ms + vehicle_delay_ms;
    start(&options, 170.0);
    live_bench_run_ms(20000);
    TEST_ASSERT_EQUAL(TAPER_COMMAND_CHARGE, fault_setpoint(1).command);
    fault_begins();
}

static double pause_time_s[] = {0.0, LIVE_START_S + 80.0, LIVE_START_S + 110.0};
static double pause_limit_kw[] = {LIMIT_KW, 0.0, LIMIT_KW};
static const sim_course_t pause_limits = {.time_s = pause_time_s, .value = pause_limit_kw, .count = 3};

static void test_row_42_who_ignores_a_pause_is_opened_and_locked_out_until_it_is_unplugged(void) {
    start_with_a_pause(&pause_limits, REACTION_ms);
    stubborn_A = 10.0; /* it had 16 A */
    while (fault_setpoint(1).command != TAPER_COMMAND_PAUSE) {
        live_bench_run_ms(LIVE_POLL_ms);
        TEST_ASSERT_LESS_THAN_UINT32(3 * TICK_ms, fault_passed_ms());
    }
    fault_begins();
    const uint32_t locked_ms = fault_wait_for(TAPER_EVENT_LOCKED_OUT, IGNORES_ms + 2 * TICK_ms + ON_BUS_ms);
    TEST_ASSERT_GREATER_OR_EQUAL_UINT32(IGNORES_ms, locked_ms);
    TEST_ASSERT_EQUAL(TAPER_COMMAND_STOP, fault_setpoint(1).command);
    TEST_ASSERT_EQUAL_UINT32(1, fault_count(TAPER_COUNTER_LOCKOUTS));
    TEST_ASSERT_EQUAL_UINT32(0, fault_count(TAPER_COUNTER_OVER_DRAWS));
    live_bench_run_ms(80000 - fault_passed_ms()); /* there is a limit again, and the others charge */
    TEST_ASSERT_EQUAL(TAPER_COMMAND_STOP, fault_setpoint(1).command);
    TEST_ASSERT_EQUAL(TAPER_REASON_LOCKED_OUT, fault_reason(1));
    TEST_ASSERT_DOUBLE_WITHIN(0.5, LIMIT_KW, physical_kw());
    fault_assert_emcy(TAPER_EVENT_OVER_DRAW, 1, 2);
    stubborn_A = 0.0;
    live_bench_run_ms(60000); /* it leaves, and another one comes */
    TEST_ASSERT_EQUAL(TAPER_COMMAND_CHARGE, fault_setpoint(1).command);
    TEST_ASSERT_TRUE(fault_drawn_kw(1) > 4.0);
    fault_assert_limits_held();
}

static void test_row_42_who_takes_5_s_to_stop_is_not_locked_out(void) {
    start_with_a_pause(&pause_limits, REACTION_ms);
    live_bench_run_ms(60000);
    TEST_ASSERT_EQUAL_UINT(0, fault_events(TAPER_EVENT_LOCKED_OUT));
    TEST_ASSERT_EQUAL_UINT(0, fault_events(TAPER_EVENT_OVER_DRAW));
    TEST_ASSERT_DOUBLE_WITHIN(0.5, LIMIT_KW, physical_kw());
}

static void test_row_42_a_vehicle_described_as_slower_is_given_its_time(void) {
    static taper_connector_config_t connectors[8];
    start_with_a_pause(&pause_limits, 8000);
    memcpy(connectors, live.config.connectors, sizeof connectors);
    connectors[0].reaction_ms = 9000;
    live.config.connectors = connectors;
    live_bench_run_ms(60000);
    TEST_ASSERT_FALSE(live.station.draw[0].state == TAPER_DRAW_LOCKED);
    TEST_ASSERT_TRUE(live.station.draw[1].state == TAPER_DRAW_LOCKED);
}

/** The taper that makes it draw 5 kW of its 11 is not told. */
static void keep_the_taper_secret(taper_frame_t *frame) {
    taper_message_t message;
    if (fault_read(frame, &message) && message.kind == TAPER_MESSAGE_EV_PARAM_D) {
        message.as.ev_param_d.taper_W = 0;
        fault_rewrite(frame, &message);
    }
}

static void take(double kw) {
    live.session[0].taper_kw = (11.0 - kw) / sim_evse_soc(&live.field.evse[0]);
}

/** Vehicle 1 draws 5 kW, 7.2 A, of the 11 kW that it was given; before the minute is over nothing changes. */
static void leave_current_unused(void) {
    fault.alter = keep_the_taper_secret;
    TEST_ASSERT_DOUBLE_WITHIN(0.1, 11.0, fault_drawn_kw(1));
    take(5.0);
    fault_begins();
    live_bench_run_ms(UNUSED_ms - TICK_ms);
    TEST_ASSERT_DOUBLE_WITHIN(0.2, LIMIT_KW - 6.0, live.field.tracker.drawn_kw);
    TEST_ASSERT_GREATER_THAN_INT32(15000, fault_setpoint(1).current_mA);
}

static void test_row_43_what_a_vehicle_leaves_unused_for_a_minute_is_given_away(void) {
    start_free(3600.0);
    leave_current_unused();
    live_bench_run_ms(3 * TICK_ms);
    TEST_ASSERT_INT32_WITHIN(200, 9200, fault_setpoint(1).current_mA); /* 2 A above what it draws */
    TEST_ASSERT_DOUBLE_WITHIN(0.3, LIMIT_KW - 2.0 * KW_PER_A, live.field.tracker.drawn_kw);
    TEST_ASSERT_DOUBLE_WITHIN(0.1, 5.0, fault_drawn_kw(1));
    fault_assert_no_emcy();
    fault_assert_limits_held();
}

static void test_row_43_it_has_it_back_within_a_tick_when_it_asks_for_it(void) {
    start_free(3600.0);
    leave_current_unused();
    live_bench_run_ms(3 * TICK_ms);
    take(11.0); /* as much as it is told */
    fault_begins();
    while (fault_drawn_kw(1) < 10.9) {
        TEST_ASSERT_LESS_THAN_UINT32(STATUS_ms + TICK_ms + ON_BUS_ms, fault_passed_ms());
        live_bench_run_ms(LIVE_POLL_ms);
    }
    TEST_ASSERT_DOUBLE_WITHIN(0.5, LIMIT_KW, live.field.tracker.drawn_kw);
    fault_assert_limits_held();
}

static void test_row_43_with_vehicles_that_take_their_5_s_it_comes_back_as_others_make_room(void) {
    start_described();
    leave_current_unused();
    live_bench_run_ms(60000);
    TEST_ASSERT_INT32_WITHIN(200, 9200, fault_setpoint(1).current_mA);
    TEST_ASSERT_DOUBLE_WITHIN(0.6, LIMIT_KW - 2.0 * KW_PER_A, live.field.tracker.drawn_kw);
    take(11.0);
    fault_begins();
    live_bench_run_ms(STATUS_ms + TICK_ms + LIVE_POLL_ms);
    TEST_ASSERT_GREATER_THAN_INT32(15000, live.station.target.current_mA[0]); /* meant for it again */
    live_bench_run_ms(4 * REACTION_ms);
    TEST_ASSERT_DOUBLE_WITHIN(0.1, 11.0, fault_drawn_kw(1));
    fault_assert_limits_held();
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_row_41_what_is_drawn_too_much_is_booked_at_once_and_others_make_room);
    RUN_TEST(test_row_41_after_7_s_it_has_to_pause_and_10_s_later_its_contactor_opens);
    RUN_TEST(test_row_41_who_pauses_when_told_may_try_again_after_a_minute);
    RUN_TEST(test_row_41_within_the_tolerance_nothing_is_said);
    RUN_TEST(test_row_41_vehicles_that_take_their_5_s_have_made_room_by_then);
    RUN_TEST(test_row_42_who_ignores_a_pause_is_opened_and_locked_out_until_it_is_unplugged);
    RUN_TEST(test_row_42_who_takes_5_s_to_stop_is_not_locked_out);
    RUN_TEST(test_row_42_a_vehicle_described_as_slower_is_given_its_time);
    RUN_TEST(test_row_43_what_a_vehicle_leaves_unused_for_a_minute_is_given_away);
    RUN_TEST(test_row_43_it_has_it_back_within_a_tick_when_it_asks_for_it);
    RUN_TEST(test_row_43_with_vehicles_that_take_their_5_s_it_comes_back_as_others_make_room);
    return UNITY_END();
}
