/* A bus that is off, queues that are full: faults 17, 18 and 19 of docs/protocol.md. */
#include "fault_bench.h"
#include "unity.h"

#define LIMIT_KW    30.0
#define TICK_ms     1000u
#define VALIDITY_ms 3000u
/** What a controller needs to come back, and the poll that finds that it did not [ms]. */
#define RESTART_ms 220u

void setUp(void) {
    fault_start(4, LIMIT_KW);
}

void tearDown(void) {
    live_bench_end();
}

/** @return time to the next request for a restart [ms]. */
static uint32_t next_restart_ms(void) {
    const uint32_t before = live.bus.controller[0].restart_requests;
    const uint32_t from_ms = live.now_ms;
    while (live.bus.controller[0].restart_requests == before) {
        TEST_ASSERT_LESS_THAN_UINT32(61000, taper_elapsed_ms(live.now_ms, from_ms));
        live_bench_run_ms(LIVE_POLL_ms);
    }
    return taper_elapsed_ms(live.now_ms, from_ms);
}

static void assert_all_charge_again(uint32_t within_ms) {
    TEST_ASSERT_LESS_THAN_UINT32(within_ms, fault_wait_until_drawn(LIMIT_KW - 5.0, within_ms));
    fault_assert_limits_held();
}

static void test_row_17_bus_off_is_followed_by_silence_a_restart_and_charging(void) {
    const uint32_t tried = fault_count(TAPER_COUNTER_SEND_REFUSED);
    taper_membus_bus_off(&live.bus, 0, 1);
    fault_wait_for(TAPER_EVENT_BUS_OFF, 2 * LIVE_POLL_ms);
    TEST_ASSERT_EQUAL_INT32(0, fault_last_event(TAPER_EVENT_BUS_OFF)->data);
    const uint32_t sent = fault_count(TAPER_COUNTER_FRAMES_SENT);
    live_bench_run_ms(900);
    TEST_ASSERT_EQUAL_UINT32(sent, fault_count(TAPER_COUNTER_FRAMES_SENT));
    TEST_ASSERT_EQUAL_UINT32(tried, fault_count(TAPER_COUNTER_SEND_REFUSED)); /* it was not even tried */
    TEST_ASSERT_UINT32_WITHIN(40, 100, next_restart_ms());
    TEST_ASSERT_EQUAL_UINT(1, fault_events(TAPER_EVENT_BUS_BACK));
    TEST_ASSERT_EQUAL_UINT32(1, fault_count(TAPER_COUNTER_BUS_OFF));
    assert_all_charge_again(2 * FAULT_SWITCH_ms);
}

static void test_row_17_while_the_bus_is_off_nobody_draws_and_the_station_says_why(void) {
    taper_membus_bus_off(&live.bus, 0, 0);
    live_bench_run_ms(200);
    TEST_ASSERT_EQUAL(TAPER_REASON_STATION, taper_station_reason(&live.station, 0));
    live_bench_run_ms(VALIDITY_ms);
    TEST_ASSERT_EQUAL_DOUBLE(0.0, live.field.tracker.drawn_kw); /* by the validity of the setpoints */
    TEST_ASSERT_EQUAL(TAPER_REASON_OFFLINE, taper_station_reason(&live.station, 0));
    live_bench_run_ms(10000);
    TEST_ASSERT_EQUAL(TAPER_MODE_FAILSAFE, taper_station_mode(&live.station));
    TEST_ASSERT_EQUAL_UINT(0, fault_events(TAPER_EVENT_BUS_BACK)); /* asked for is not back */
    TEST_ASSERT_EQUAL_UINT(1, fault_events(TAPER_EVENT_BUS_OFF));
    taper_membus_bus_on(&live.bus, 0);
    live_bench_run_ms(20000);
    TEST_ASSERT_EQUAL_UINT(1, fault_events(TAPER_EVENT_BUS_BACK));
    assert_all_charge_again(2 * FAULT_SWITCH_ms);
}

static void test_row_17_restarts_are_1_2_4_and_so_on_to_60_s_apart(void) {
    static const uint32_t pauses_ms[] = {1000, 2000, 4000, 8000, 16000, 32000, 60000, 60000};
    taper_membus_bus_off(&live.bus, 0, 8);
    for (unsigned k = 0; k < 8; k++) {
        const uint32_t found_ms = k == 0 ? 0 : RESTART_ms;
        TEST_ASSERT_UINT32_WITHIN(40, pauses_ms[k] + found_ms, next_restart_ms());
    }
    TEST_ASSERT_EQUAL_UINT32(8, fault_count(TAPER_COUNTER_BUS_OFF));
    assert_all_charge_again(3 * FAULT_SWITCH_ms);
}

static void test_row_17_after_a_minute_without_trouble_the_pause_is_short_again(void) {
    taper_membus_bus_off(&live.bus, 0, 4);
    for (unsigned k = 0; k < 4; k++) {
        (void)next_restart_ms();
    }
    live_bench_run_ms(30000);
    taper_membus_bus_off(&live.bus, 0, 1);
    TEST_ASSERT_UINT32_WITHIN(40, 16000, next_restart_ms()); /* not healthy yet: the series goes on */
    live_bench_run_ms(61000);
    taper_membus_bus_off(&live.bus, 0, 1);
    TEST_ASSERT_UINT32_WITHIN(40, 1000, next_restart_ms());
}

/** Nobody takes frames off the bus: the station's queue is full, and stays so. */
static void fill_send_queue(void) {
    taper_frame_t frame = {.id = taper_can_id(TAPER_MESSAGE_CTRL_DIAG, TAPER_NODE_CONTROLLER), .length = 8};
    while (live.station_port.send(live.station_port.context, &frame)) {
    }
}

static void test_row_18_when_the_queue_has_room_again_the_newest_setpoint_goes_out(void) {
    taper_message_t limit = {.kind = TAPER_MESSAGE_SITE_LIMIT, .node = TAPER_NODE_GATEWAY};
    limit.as.site_limit = (taper_site_limit_t){
        .active = true, .limit_W = 7000, .failsafe_W = TAPER_ABSENT, .validity_s = TAPER_ABSENT};
    const uint32_t before_ms = fault.told[taper_can_id(TAPER_MESSAGE_SETPOINT, 1)].last_ms;
    TEST_ASSERT_GREATER_THAN_UINT32(0, before_ms);
    fill_send_queue();
    taper_station_step(&live.station, live.now_ms);
    const uint32_t refused = fault_count(TAPER_COUNTER_SEND_REFUSED);
    TEST_ASSERT_GREATER_THAN_UINT32(8, refused);
    fault_say(
        &limit); /* decided while the old setpoints wait; the gateway's counter is picked up with the second */
    fault_say(&limit);
    taper_station_step(&live.station, live.now_ms + 500);
    TEST_ASSERT_EQUAL_INT32(7000, taper_station_site_limit_W(&live.station));
    live.next_tick_ms = live.now_ms + TICK_ms;
    live_bench_run_ms(LIVE_POLL_ms); /* the field empties the queue */
    live_bench_run_ms(LIVE_POLL_ms);
    double told_kw = 0.0;
    for (uint8_t node = 1; node <= 8; node++) {
        told_kw += (double)fault_setpoint(node).current_mA / 1000.0 * 0.69;
    }
    TEST_ASSERT_TRUE(told_kw <= 7.0);
    TEST_ASSERT_EQUAL_UINT(0, fault_events(TAPER_EVENT_SEND_BLOCKED));
}

static void test_row_18_a_queue_that_stays_full_for_a_second_is_as_bus_off(void) {
    uint32_t last_refused = 0;
    uint32_t quiet_ms = 0;
    fill_send_queue();
    for (uint32_t k = 0; k < 60 && fault_events(TAPER_EVENT_SEND_BLOCKED) == 0; k++) {
        taper_station_poll(&live.station, live.now_ms);
        live.now_ms += LIVE_POLL_ms;
    }
    TEST_ASSERT_EQUAL_UINT(1, fault_events(TAPER_EVENT_SEND_BLOCKED));
    TEST_ASSERT_EQUAL_UINT32(1, fault_count(TAPER_COUNTER_BUS_OFF));
    TEST_ASSERT_UINT32_WITHIN(600, 1000, fault_passed_ms());
    last_refused = fault_count(TAPER_COUNTER_SEND_REFUSED);
    while (fault_count(TAPER_COUNTER_SEND_REFUSED) == last_refused) {
        taper_station_poll(&live.station, live.now_ms);
        live.now_ms += LIVE_POLL_ms;
        quiet_ms += LIVE_POLL_ms;
    }
    TEST_ASSERT_UINT32_WITHIN(40, 1000, quiet_ms); /* no sending meanwhile */
    live_bench_run_ms(10000);
    TEST_ASSERT_GREATER_THAN_UINT(0, fault_events(TAPER_EVENT_BUS_BACK));
    assert_all_charge_again(2 * FAULT_SWITCH_ms);
}

static void test_row_19_of_too_many_frames_the_newest_are_used(void) {
    taper_message_t limit = {.kind = TAPER_MESSAGE_SITE_LIMIT, .node = TAPER_NODE_GATEWAY};
    limit.as.site_limit = (taper_site_limit_t){
        .active = true, .limit_W = 9000, .failsafe_W = TAPER_ABSENT, .validity_s = TAPER_ABSENT};
    const taper_frame_t unknown = {.id = taper_can_id(TAPER_MESSAGE_PLAN, 1), .length = 8};
    for (unsigned k = 0; k < 6; k++) { /* the first ones find the sequence */
        fault_say(&limit);
    }
    limit.as.site_limit.limit_W = 12000;
    for (unsigned k = 0; k < 2; k++) {
        fault_say(&limit);
    }
    for (unsigned k = 0; k < TAPER_MEMBUS_DEPTH; k++) {
        fault_say_frame(&unknown);
    }
    limit.as.site_limit.limit_W = 8000;
    for (unsigned k = 0; k < 3; k++) {
        fault_say(&limit);
    }
    live_bench_run_ms(LIVE_POLL_ms);
    live.next_tick_ms = live.now_ms;
    live_bench_run_ms(LIVE_POLL_ms);
    TEST_ASSERT_EQUAL_INT32(8000, taper_station_site_limit_W(&live.station));
    TEST_ASSERT_EQUAL_UINT32(live.bus.to_station.overflows, fault_count(TAPER_COUNTER_RECEIVE_OVERFLOWS));
    TEST_ASSERT_GREATER_THAN_UINT32(0, fault_count(TAPER_COUNTER_RECEIVE_OVERFLOWS));
    live_bench_run_ms(TAPER_FLAP_HOLD_ms); /* a limit that changes so fast flaps: its increase waits */
    TEST_ASSERT_EQUAL_UINT(0, fault_events(TAPER_EVENT_CONNECTOR_LOST));
    assert_all_charge_again(30000 + 2 * FAULT_SWITCH_ms); /* such a limit flaps: row 39 */
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_row_17_bus_off_is_followed_by_silence_a_restart_and_charging);
    RUN_TEST(test_row_17_while_the_bus_is_off_nobody_draws_and_the_station_says_why);
    RUN_TEST(test_row_17_restarts_are_1_2_4_and_so_on_to_60_s_apart);
    RUN_TEST(test_row_17_after_a_minute_without_trouble_the_pause_is_short_again);
    RUN_TEST(test_row_18_when_the_queue_has_room_again_the_newest_setpoint_goes_out);
    RUN_TEST(test_row_18_a_queue_that_stays_full_for_a_second_is_as_bus_off);
    RUN_TEST(test_row_19_of_too_many_frames_the_newest_are_used);
    return UNITY_END();
}
