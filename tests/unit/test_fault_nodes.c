/* Nodes that fall silent, come back, or should not be there: faults 11 to 15 and 20 of docs/protocol.md. */
#include "fault_bench.h"
#include "unity.h"

#define LIMIT_KW      30.0
#define TICK_ms       1000u
#define VALIDITY_ms   3000u
#define KW_PER_A      0.69
#define PLAN_ROUND_ms 9000u

void setUp(void) {
    fault_start(4, LIMIT_KW);
}

void tearDown(void) {
    live_bench_end();
}

/** Setpoints of all nodes but one, as the station told them [kW]. */
static double told_others_kw(uint8_t node) {
    double sum_kw = 0.0;
    for (uint8_t k = 1; k <= 8; k++) {
        sum_kw += k == node ? 0.0 : (double)fault_setpoint(k).current_mA / 1000.0 * KW_PER_A;
    }
    return sum_kw;
}

/** What the station would give the others once all have followed [kW]. */
static double meant_for_others_kw(uint8_t node) {
    double sum_kw = 0.0;
    for (uint8_t k = 1; k <= 8; k++) {
        sum_kw += k == node ? 0.0 : (double)live.station.target.current_mA[k - 1] / 1000.0 * KW_PER_A;
    }
    return sum_kw;
}

static void test_row_11_a_lost_connector_keeps_its_reservation_until_its_setpoint_has_expired(void) {
    sim_field_kill(&live.field, 0); /* its cable: it goes on drawing by its last setpoint */
    TEST_ASSERT_DOUBLE_WITHIN(0.2, 11.0, fault_drawn_kw(1));
    const uint32_t seen_ms =
        fault_wait_for(TAPER_EVENT_CONNECTOR_LOST, TAPER_EVSE_STATUS_TIMEOUT_ms + TICK_ms + 40);
    TEST_ASSERT_GREATER_OR_EQUAL_UINT32(TAPER_EVSE_STATUS_TIMEOUT_ms - 220u, seen_ms);
    while (live.field.evse[0].in_force) {
        TEST_ASSERT_TRUE(told_others_kw(1) + 11.0 < LIMIT_KW + 0.1);
        TEST_ASSERT_TRUE(meant_for_others_kw(1) + 11.0 <
                         LIMIT_KW + 0.1); /* nobody is put off with a hand-over */
        live_bench_run_ms(LIVE_POLL_ms);
    }
    TEST_ASSERT_LESS_OR_EQUAL_UINT32(VALIDITY_ms, fault_passed_ms()); /* then its fallback, which is 0 */
    TEST_ASSERT_EQUAL_DOUBLE(0.0, fault_drawn_kw(1));
    fault_assert_limits_held();
}

static void test_row_11_the_others_get_what_a_lost_connector_had_and_it_comes_back_by_itself(void) {
    TEST_ASSERT_LESS_OR_EQUAL_INT32(12000, fault_setpoint(4).current_mA);
    TEST_ASSERT_EQUAL(TAPER_REASON_SITE_LIMIT, fault_reason(4));
    sim_field_kill(&live.field, 0);
    live_bench_run_ms(TAPER_EVSE_STATUS_TIMEOUT_ms + TICK_ms + VALIDITY_ms + 1000 + FAULT_SWITCH_ms);
    TEST_ASSERT_DOUBLE_WITHIN(1.0, LIMIT_KW, live.field.tracker.drawn_kw);
    live_bench_run_ms(PLAN_ROUND_ms);
    TEST_ASSERT_EQUAL(TAPER_REASON_OFFLINE, fault_reason(1));
    sim_field_revive(&live.field, 0);
    fault_begins();
    fault_wait_for(TAPER_EVENT_CONNECTOR_BACK, 200 + 3 * LIVE_POLL_ms);
    live_bench_run_ms(FAULT_SWITCH_ms + PLAN_ROUND_ms);
    TEST_ASSERT_DOUBLE_WITHIN(0.2, 11.0, fault_drawn_kw(1));
    TEST_ASSERT_NOT_EQUAL(TAPER_REASON_OFFLINE, fault_reason(1));
    fault_assert_limits_held();
}

static void test_row_11_a_connector_that_lost_its_power_comes_back_with_a_new_session(void) {
    const uint8_t session = fault_setpoint(1).session;
    sim_field_power_off(&live.field, 0);
    TEST_ASSERT_EQUAL_DOUBLE(0.0, fault_drawn_kw(1));
    fault_wait_for(TAPER_EVENT_CONNECTOR_LOST, TAPER_EVSE_STATUS_TIMEOUT_ms + TICK_ms + 40);
    sim_field_revive(&live.field, 0);
    live_bench_run_ms(FAULT_SWITCH_ms + PLAN_ROUND_ms);
    TEST_ASSERT_EQUAL_UINT8(session + 1, fault_setpoint(1).session);
    TEST_ASSERT_DOUBLE_WITHIN(0.2, 11.0, fault_drawn_kw(1));
    fault_assert_limits_held();
}

static void test_row_12_connectors_that_lost_the_controller_fall_back_when_their_setpoints_expire(void) {
    const uint16_t status = taper_can_id(TAPER_MESSAGE_EVSE_STATUS, 1);
    taper_message_t message;
    bool bad_field = false;
    live_bench_kill_station();
    while (live.field.tracker.drawn_kw > 0.0) {
        TEST_ASSERT_LESS_THAN_UINT32(VALIDITY_ms + 40, fault_passed_ms());
        live_bench_run_ms(LIVE_POLL_ms);
    }
    live_bench_run_ms(400);
    TEST_ASSERT_TRUE(taper_decode(&fault.said[status].frame, &message, &bad_field));
    TEST_ASSERT_TRUE(message.as.evse_status.fallback_active); /* what the user sees at the connector */
    live_bench_revive_station();
    TEST_ASSERT_LESS_THAN_UINT32(10000, fault_wait_until_drawn(LIMIT_KW - 5.0, 10000));
    fault_assert_limits_held();
}

static void test_row_13_without_the_gateway_the_failsafe_limit_holds_within_a_tick(void) {
    sim_field_kill(&live.field, SIM_GATEWAY);
    const uint32_t seen_ms =
        fault_wait_for(TAPER_EVENT_GATEWAY_LOST, TAPER_SITE_LIMIT_TIMEOUT_ms + TICK_ms + 40);
    TEST_ASSERT_GREATER_OR_EQUAL_UINT32(TAPER_SITE_LIMIT_TIMEOUT_ms - TICK_ms, seen_ms);
    TEST_ASSERT_EQUAL_INT32(11000, fault_last_event(TAPER_EVENT_GATEWAY_LOST)->data);
    live_bench_run_ms(500 + LIVE_POLL_ms); /* setpoints are on the bus half a second later at most */
    TEST_ASSERT_TRUE(told_others_kw(0) <= 11.0);
    TEST_ASSERT_EQUAL(TAPER_MODE_FAILSAFE, fault_status().mode);
    TEST_ASSERT_EQUAL(TAPER_LIMIT_FAILSAFE, fault_status().limit_source);
    TEST_ASSERT_GREATER_THAN_UINT32(0, fault_count(TAPER_COUNTER_FALLBACK_TICKS));
    live_bench_run_ms(20000);
    TEST_ASSERT_DOUBLE_WITHIN(4.0, 9.0, live.field.tracker.drawn_kw); /* it is used, too */
    TEST_ASSERT_EQUAL_UINT(0, fault_events(TAPER_EVENT_CONNECTOR_LOST));
    fault_assert_limits_held();
}

static void test_row_13_the_gateway_is_back_with_its_next_limit(void) {
    sim_field_kill(&live.field, SIM_GATEWAY);
    live_bench_run_ms(10000);
    sim_field_revive(&live.field, SIM_GATEWAY);
    fault_begins();
    fault_wait_for(TAPER_EVENT_GATEWAY_BACK, 2 * TICK_ms + 40);
    live_bench_run_ms(FAULT_SWITCH_ms + 3000);
    TEST_ASSERT_NOT_EQUAL(TAPER_MODE_FAILSAFE, fault_status().mode);
    TEST_ASSERT_DOUBLE_WITHIN(1.0, LIMIT_KW, live.field.tracker.drawn_kw);
    fault_assert_limits_held();
}

/** For `seconds`, a SITE_LIMIT each second. */
static void gateway_says(int32_t limit_W, unsigned seconds) {
    taper_message_t message = {.kind = TAPER_MESSAGE_SITE_LIMIT, .node = TAPER_NODE_GATEWAY};
    message.as.site_limit = (taper_site_limit_t){
        .active = true, .limit_W = limit_W, .failsafe_W = TAPER_ABSENT, .validity_s = TAPER_ABSENT};
    for (unsigned k = 0; k < seconds; k++) {
        fault_say(&message);
        live_bench_run_ms(1000);
    }
}

static void test_row_14_a_gateway_that_only_beats_leaves_the_station_in_failsafe_for_120_s(void) {
    sim_field_kill(&live.field, SIM_GATEWAY);
    live_bench_run_ms(10000);
    gateway_says(TAPER_ABSENT, 2); /* the first two find their place in the sequence */
    gateway_says(TAPER_ABSENT, 117);
    TEST_ASSERT_EQUAL(TAPER_MODE_FAILSAFE, fault_status().mode);
    TEST_ASSERT_EQUAL_INT32(11000, taper_station_site_limit_W(&live.station));
    TEST_ASSERT_EQUAL_UINT(0, fault_events(TAPER_EVENT_GATEWAY_BACK));
    fault_assert_limits_held();
    gateway_says(TAPER_ABSENT, 4);
    TEST_ASSERT_EQUAL_UINT(1, fault_events(TAPER_EVENT_GATEWAY_BACK));
    TEST_ASSERT_NOT_EQUAL(TAPER_MODE_FAILSAFE, fault_status().mode);
    TEST_ASSERT_EQUAL_INT32(110000, taper_station_site_limit_W(&live.station));
}

static void test_row_14_a_limit_ends_failsafe_at_once(void) {
    sim_field_kill(&live.field, SIM_GATEWAY);
    live_bench_run_ms(10000);
    gateway_says(TAPER_ABSENT, 30);
    TEST_ASSERT_EQUAL(TAPER_MODE_FAILSAFE, fault_status().mode);
    gateway_says(20000, 2);
    TEST_ASSERT_NOT_EQUAL(TAPER_MODE_FAILSAFE, fault_status().mode);
    TEST_ASSERT_EQUAL_INT32(20000, taper_station_site_limit_W(&live.station));
}

/** For `seconds`, a SITE_METER each second: 10 A on each phase are 6.9 kW. */
static void meter_says_10_A(unsigned seconds) {
    taper_message_t message = {.kind = TAPER_MESSAGE_SITE_METER, .node = TAPER_NODE_GATEWAY};
    message.as.site_meter = (taper_site_meter_t){{10000, 10000, 10000}};
    for (unsigned k = 0; k < seconds; k++) {
        fault_say(&message);
        live_bench_run_ms(1000);
    }
}

static void test_row_15_without_its_meter_the_site_is_taken_to_draw_all_that_it_can(void) {
    live.config.other_load_W = 12000;
    meter_says_10_A(5);
    TEST_ASSERT_EQUAL_INT32(30000 - 6900, taper_station_site_limit_W(&live.station));
    fault_begins();
    fault_wait_for(TAPER_EVENT_METER_LOST, TAPER_SITE_METER_TIMEOUT_ms + TICK_ms);
    TEST_ASSERT_GREATER_OR_EQUAL_UINT32(TAPER_SITE_METER_TIMEOUT_ms - TICK_ms, fault_passed_ms());
    TEST_ASSERT_EQUAL_INT32(18000, taper_station_site_limit_W(&live.station));
    live_bench_run_ms(500 + LIVE_POLL_ms);
    TEST_ASSERT_TRUE(told_others_kw(0) <= 18.0);
    TEST_ASSERT_EQUAL_UINT(0, fault_events(TAPER_EVENT_GATEWAY_LOST)); /* the meter alone */
    meter_says_10_A(2);
    TEST_ASSERT_EQUAL_UINT(1, fault_events(TAPER_EVENT_METER_BACK));
    TEST_ASSERT_EQUAL_INT32(30000 - 6900, taper_station_site_limit_W(&live.station));
    fault_assert_limits_held();
}

static void test_row_20_a_second_controller_stops_all_charging_until_it_is_gone(void) {
    taper_message_t message = {.kind = TAPER_MESSAGE_CTRL_STATUS, .node = TAPER_NODE_CONTROLLER};
    for (unsigned k = 0; k < 10; k++) {
        fault_say(&message);
        live_bench_run_ms(1000);
        TEST_ASSERT_EQUAL_DOUBLE(0.0, k == 0 ? 0.0 : live.field.tracker.drawn_kw); /* within a tick */
    }
    TEST_ASSERT_EQUAL_UINT(1, fault_events(TAPER_EVENT_TWO_CONTROLLERS));
    fault_assert_emcy(TAPER_EVENT_TWO_CONTROLLERS, 0, 3);
    for (uint8_t node = 1; node <= 4; node++) {
        TEST_ASSERT_EQUAL(TAPER_REASON_STATION, fault_reason(node));
        TEST_ASSERT_EQUAL(TAPER_COMMAND_PAUSE, fault_setpoint(node).command);
    }
    TEST_ASSERT_EQUAL_UINT(0, fault_events(TAPER_EVENT_CONNECTOR_LOST)); /* they are not to blame */
    const uint32_t waited_ms = fault_wait_until_drawn(LIMIT_KW - 5.0, 30000);
    TEST_ASSERT_LESS_THAN_UINT32(5000 + FAULT_SWITCH_ms + 3000, waited_ms);
    live_bench_run_ms(3000);
    fault_begins();
    live_bench_run_ms(5000);
    fault_assert_no_emcy();
    fault_assert_limits_held();
}

static void test_row_20_a_setpoint_of_another_controller_is_enough_and_a_corrupt_one_is_not(void) {
    taper_frame_t frame = fault.told[taper_can_id(TAPER_MESSAGE_SETPOINT, 3)].frame;
    frame.data[3] ^= 1u;
    fault_say_frame(&frame);
    live_bench_run_ms(1000);
    TEST_ASSERT_EQUAL_UINT(0, fault_events(TAPER_EVENT_TWO_CONTROLLERS));
    TEST_ASSERT_EQUAL_UINT32(1, fault_count(TAPER_COUNTER_CRC_ERRORS));
    frame.data[3] ^= 1u;
    fault_say_frame(&frame);
    live_bench_run_ms(TICK_ms + 2 * LIVE_POLL_ms);
    TEST_ASSERT_EQUAL_UINT(1, fault_events(TAPER_EVENT_TWO_CONTROLLERS));
    TEST_ASSERT_EQUAL_DOUBLE(0.0, live.field.tracker.drawn_kw);
}

/** Hand what one station says to the other. */
static void carry(taper_membus_t *from, taper_membus_t *to) {
    taper_frame_t frame;
    while (taper_membus_world_receive(from, &frame)) {
        TEST_ASSERT_TRUE(taper_membus_world_send(to, &frame));
    }
}

static void test_row_20_of_two_controllers_both_stop(void) {
    static taper_membus_t bus[2];
    static taper_station_t station[2];
    taper_port_t port[2];
    for (unsigned k = 0; k < 2; k++) {
        taper_membus_init(&bus[k]);
        port[k] = taper_membus_station_port(&bus[k]);
        taper_station_options_t options = live.station_options;
        options.port = &port[k];
        TEST_ASSERT_EQUAL(TAPER_OK, taper_station_init(&station[k], &options));
    }
    for (uint32_t now_ms = 1000; now_ms <= 3000; now_ms += 1000) {
        for (unsigned k = 0; k < 2; k++) {
            taper_station_step(&station[k], now_ms);
            carry(&bus[k], &bus[1 - k]);
        }
    }
    for (unsigned k = 0; k < 2; k++) {
        TEST_ASSERT_TRUE(station[k].rival_heard);
    }
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_row_11_a_lost_connector_keeps_its_reservation_until_its_setpoint_has_expired);
    RUN_TEST(test_row_11_the_others_get_what_a_lost_connector_had_and_it_comes_back_by_itself);
    RUN_TEST(test_row_11_a_connector_that_lost_its_power_comes_back_with_a_new_session);
    RUN_TEST(test_row_12_connectors_that_lost_the_controller_fall_back_when_their_setpoints_expire);
    RUN_TEST(test_row_13_without_the_gateway_the_failsafe_limit_holds_within_a_tick);
    RUN_TEST(test_row_13_the_gateway_is_back_with_its_next_limit);
    RUN_TEST(test_row_14_a_gateway_that_only_beats_leaves_the_station_in_failsafe_for_120_s);
    RUN_TEST(test_row_14_a_limit_ends_failsafe_at_once);
    RUN_TEST(test_row_15_without_its_meter_the_site_is_taken_to_draw_all_that_it_can);
    RUN_TEST(test_row_20_a_second_controller_stops_all_charging_until_it_is_gone);
    RUN_TEST(test_row_20_a_setpoint_of_another_controller_is_enough_and_a_corrupt_one_is_not);
    RUN_TEST(test_row_20_of_two_controllers_both_stop);
    return UNITY_END();
}
