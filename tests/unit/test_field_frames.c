/* The simulated field as bus nodes: which frames come when, and the time of the world. */
#include <math.h>

#include "field_bench.h"
#include "unity.h"

void setUp(void) {
    const sim_field_options_t options = field_options();
    const sim_session_t sessions[] = {field_vehicle(0.0)};
    field_start(&options, sessions, 1);
}

void tearDown(void) {
    field_end();
}

static void check_period(taper_message_kind_t kind, uint8_t node, uint32_t period_ms) {
    const field_log_t *log = field_log(kind, node);
    TEST_ASSERT_UINT32_WITHIN(1, 20000 / period_ms, log->count);
    TEST_ASSERT_UINT32_WITHIN(POLL_ms, period_ms, log->longest_gap_ms);
    TEST_ASSERT_UINT32_WITHIN(POLL_ms, period_ms, log->shortest_gap_ms);
}

static void test_without_a_change_every_frame_comes_at_its_period(void) {
    field_run_ms(1000);
    field_forget();
    field_run_ms(20000);
    for (uint8_t node = 1; node <= 8; node++) {
        check_period(TAPER_MESSAGE_EVSE_STATUS, node, 200);
        check_period(TAPER_MESSAGE_EVSE_INFO, node, 5000);
    }
    check_period(TAPER_MESSAGE_EV_STATUS, 1, 500);
    check_period(TAPER_MESSAGE_EVSE_ELEC, 1, 1000);
    check_period(TAPER_MESSAGE_EV_PARAM_A, 1, 2000);
    check_period(TAPER_MESSAGE_EV_PARAM_B, 1, 2000);
    check_period(TAPER_MESSAGE_EV_PARAM_C, 1, 2000);
    check_period(TAPER_MESSAGE_EV_PARAM_D, 1, 2000);
    check_period(TAPER_MESSAGE_TIME_SYNC, TAPER_NODE_GATEWAY, 1000);
    check_period(TAPER_MESSAGE_SITE_LIMIT, TAPER_NODE_GATEWAY, 1000);
    TEST_ASSERT_EQUAL_UINT32(0, field_log(TAPER_MESSAGE_EV_STATUS, 2)->count);
    TEST_ASSERT_EQUAL_UINT32(0, at.field.send_refused);
}

static void test_connectors_do_not_speak_all_at_once(void) {
    const sim_field_options_t options = field_options();
    sim_session_t sessions[8];
    for (unsigned i = 0; i < 8; i++) {
        sessions[i] = field_vehicle(0.0);
    }
    field_start(&options, sessions, 8);
    field_run_ms(1000);
    field_forget();
    field_run_ms(20000);
    TEST_ASSERT_LESS_OR_EQUAL_UINT32(10, at.most_in_a_poll); /* of 66 kinds of frame in all */
}

static void test_at_boot_a_connector_says_what_it_is(void) {
    field_run_ms(220);
    for (uint8_t node = 1; node <= 8; node++) {
        TEST_ASSERT_GREATER_OR_EQUAL_UINT32(1, field_log(TAPER_MESSAGE_EVSE_STATUS, node)->count);
        TEST_ASSERT_EQUAL_UINT32(1, field_log(TAPER_MESSAGE_EVSE_INFO, node)->count);
    }
    const taper_evse_info_t info = field_log(TAPER_MESSAGE_EVSE_INFO, 8)->message.as.evse_info;
    TEST_ASSERT_EQUAL_UINT8(TAPER_PROTOCOL_VERSION, info.protocol_version);
    TEST_ASSERT_EQUAL_INT32(32000, info.max_mA);
    TEST_ASSERT_EQUAL_INT32(6000, info.min_mA);
    TEST_ASSERT_EQUAL_UINT8(TAPER_KIND_AC3, info.kind);
    TEST_ASSERT_EQUAL_UINT8(TAPER_ROTATION_123, info.rotation);
    TEST_ASSERT_EQUAL_HEX16(0x0100, info.firmware);
}

static void test_who_plugs_in_is_announced_at_once(void) {
    const sim_field_options_t options = field_options();
    const sim_session_t sessions[] = {field_vehicle(3.0)};
    field_start(&options, sessions, 1);
    field_run_ms(2980);
    field_forget();
    field_run_ms(POLL_ms);
    const taper_evse_status_t status = field_log(TAPER_MESSAGE_EVSE_STATUS, 1)->message.as.evse_status;
    TEST_ASSERT_TRUE(status.ev_present);
    TEST_ASSERT_EQUAL(TAPER_PILOT_C, status.pilot);
    TEST_ASSERT_EQUAL_UINT32(1, field_log(TAPER_MESSAGE_EV_PARAM_A, 1)->count);
    TEST_ASSERT_EQUAL_UINT32(1, field_log(TAPER_MESSAGE_EV_PARAM_D, 1)->count);
    TEST_ASSERT_EQUAL_INT32(500, field_log(TAPER_MESSAGE_EV_STATUS, 1)->message.as.ev_status.soc_permille);
}

static void test_who_leaves_is_announced_at_once_and_its_energy_noted(void) {
    const sim_field_options_t options = field_options();
    sim_session_t sessions[] = {field_vehicle(0.0)};
    sessions[0].departure_s = WORLD_START_S + 12.0;
    field_start(&options, sessions, 1);
    field_run_ms(1000);
    field_charge(1, 1, 16000, 60000);
    field_run_ms(10980);
    field_forget();
    TEST_ASSERT_FALSE(sim_field_is_over(&at.field));
    field_run_ms(POLL_ms);
    TEST_ASSERT_FALSE(field_log(TAPER_MESSAGE_EVSE_STATUS, 1)->message.as.evse_status.ev_present);
    TEST_ASSERT_TRUE(sim_field_is_over(&at.field));
    TEST_ASSERT_EQUAL_UINT32(1, at.outcome[0].connector);
    /* from the poll that hears the setpoint */
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 11.04 * (11000 - POLL_ms) / 3.6e6, at.outcome[0].energy_kwh);
}

static void test_energy_is_told_as_it_moves_but_not_too_often(void) {
    sim_field_options_t options = field_options();
    options.time_scale = 600;
    const sim_session_t sessions[] = {field_vehicle(0.0)};
    field_start(&options, sessions, 1);
    field_run_ms(1000);
    field_forget();
    field_charge(1, 1, 16000, 60000);
    field_run_ms(2000); /* 1200 s of the world: 3.68 kWh, 368 steps of energy and 18 of SOC */
    TEST_ASSERT_UINT32_WITHIN(1, 20, field_log(TAPER_MESSAGE_EVSE_ELEC, 1)->count);
    TEST_ASSERT_UINT32_WITHIN(4, 20, field_log(TAPER_MESSAGE_EV_STATUS, 1)->count);
    TEST_ASSERT_GREATER_OR_EQUAL_UINT32(100, field_log(TAPER_MESSAGE_EVSE_ELEC, 1)->shortest_gap_ms);
    TEST_ASSERT_GREATER_OR_EQUAL_UINT32(100, field_log(TAPER_MESSAGE_EV_STATUS, 1)->shortest_gap_ms);
    TEST_ASSERT_DOUBLE_WITHIN(0.1, 3.68, field_evse(1)->energy_kwh);
}

static void test_a_full_vehicle_says_so_at_once(void) {
    sim_field_options_t options = field_options();
    options.time_scale = 600;
    sim_session_t sessions[] = {field_vehicle(0.0)};
    sessions[0].soc_target = 0.525; /* 1 kWh */
    field_start(&options, sessions, 1);
    field_run_ms(1000);
    field_charge(1, 1, 32000, 60000);
    field_run_ms(420);
    TEST_ASSERT_TRUE(field_log(TAPER_MESSAGE_EV_STATUS, 1)->message.as.ev_status.complete);
    TEST_ASSERT_EQUAL(TAPER_PILOT_B, field_log(TAPER_MESSAGE_EVSE_STATUS, 1)->message.as.evse_status.pilot);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 1.0, field_evse(1)->energy_kwh);
    TEST_ASSERT_EQUAL_DOUBLE(0.0, field_evse(1)->power_kw);
}

static void test_the_power_follows_the_taper(void) {
    sim_field_options_t options = field_options();
    options.time_scale = 60;
    sim_session_t sessions[] = {field_vehicle(0.0)};
    sessions[0].taper_kw = 20.0; /* 12 kW at 50 %, 2 kW at 100 % */
    field_start(&options, sessions, 1);
    field_run_ms(1000);
    field_charge(1, 1, 32000, 127000);
    field_run_ms(60000); /* an hour */
    /* dx/dt = p - a x with a = 20 kW / 40 kWh per hour, from x = 20 kWh */
    const double end_kwh = 44.0 - 24.0 * exp(-0.5);
    TEST_ASSERT_DOUBLE_WITHIN(0.01, end_kwh - 20.0, field_evse(1)->energy_kwh);
}

static void test_a_second_line_is_told_where_there_is_one_and_obeyed(void) {
    sim_field_options_t options = field_options();
    options.time_scale = 60;
    sim_session_t sessions[] = {field_vehicle(0.0), field_vehicle(0.0)};
    sessions[0].second_max_kw = 38.5;
    sessions[0].second_taper_kw = 37.0; /* 20 kW at 50 % */
    field_start(&options, sessions, 2);
    field_run_ms(1000);
    field_forget();
    field_run_ms(20000);
    check_period(TAPER_MESSAGE_EV_PARAM_E, 1, 2000);
    const taper_ev_param_e_t e = field_log(TAPER_MESSAGE_EV_PARAM_E, 1)->message.as.ev_param_e;
    TEST_ASSERT_EQUAL_INT32(38500, e.peak_W);
    TEST_ASSERT_EQUAL_INT32(37000, e.taper_W);
    TEST_ASSERT_EQUAL_UINT8(field_log(TAPER_MESSAGE_EV_PARAM_A, 1)->message.as.ev_param_a.session, e.session);
    TEST_ASSERT_EQUAL_UINT32(0, field_log(TAPER_MESSAGE_EV_PARAM_E, 2)->count);
    field_charge(1, 1, 32000, 127000);
    field_run_ms(40);
    TEST_ASSERT_DOUBLE_WITHIN(0.05, 20.0, field_evse(1)->power_kw);
}

static void test_who_keeps_its_taper_back_keeps_both_lines(void) {
    sim_field_options_t options = field_options();
    options.tells_taper = false;
    sim_session_t sessions[] = {field_vehicle(0.0)};
    sessions[0].second_max_kw = 38.5;
    field_start(&options, sessions, 1);
    field_run_ms(5000);
    TEST_ASSERT_EQUAL_UINT32(0, field_log(TAPER_MESSAGE_EV_PARAM_D, 1)->count);
    TEST_ASSERT_EQUAL_UINT32(0, field_log(TAPER_MESSAGE_EV_PARAM_E, 1)->count);
}

static void test_the_clock_tells_the_time_of_the_world(void) {
    sim_field_options_t options = field_options();
    options.time_scale = 600;
    const sim_session_t sessions[] = {field_vehicle(0.0)};
    field_start(&options, sessions, 1);
    field_run_ms(2020);
    const taper_time_sync_t clock =
        field_log(TAPER_MESSAGE_TIME_SYNC, TAPER_NODE_GATEWAY)->message.as.time_sync;
    TEST_ASSERT_UINT32_WITHIN(12, (uint32_t)WORLD_START_S + 1200, clock.unix_s);
    TEST_ASSERT_EQUAL_DOUBLE(WORLD_START_S + 1212.0, sim_field_world_s(&at.field));
}

static void test_a_change_of_the_limit_is_told_at_once(void) {
    double time_s[] = {0.0, WORLD_START_S + 5.32};
    double limit_kw[] = {50.0, 20.0};
    const sim_course_t limits = {.time_s = time_s, .value = limit_kw, .count = 2};
    sim_field_options_t options = field_options();
    options.limits = &limits;
    const sim_session_t sessions[] = {field_vehicle(0.0)};
    field_start(&options, sessions, 1);
    field_run_ms(5300);
    const field_log_t *log = field_log(TAPER_MESSAGE_SITE_LIMIT, TAPER_NODE_GATEWAY);
    TEST_ASSERT_TRUE(log->message.as.site_limit.active);
    TEST_ASSERT_EQUAL_INT32(50000, log->message.as.site_limit.limit_W);
    field_run_ms(POLL_ms);
    TEST_ASSERT_EQUAL_INT32(20000, log->message.as.site_limit.limit_W);
    TEST_ASSERT_EQUAL_INT32(TAPER_ABSENT, log->message.as.site_limit.failsafe_W);
    TEST_ASSERT_EQUAL_INT32(5, log->message.as.site_limit.validity_s);
}

static void test_a_gateway_without_a_limit_is_alive_only(void) {
    field_run_ms(1000);
    TEST_ASSERT_FALSE(field_log(TAPER_MESSAGE_SITE_LIMIT, TAPER_NODE_GATEWAY)->message.as.site_limit.active);
    TEST_ASSERT_TRUE(isinf(sim_field_limit_kw(&at.field)));
}

static void test_a_dead_gateway_leaves_the_failsafe_limit_behind(void) {
    double time_s = 0.0;
    double limit_kw = 50.0;
    const sim_course_t limits = {.time_s = &time_s, .value = &limit_kw, .count = 1};
    sim_field_options_t options = field_options();
    options.limits = &limits;
    const sim_session_t sessions[] = {field_vehicle(0.0)};
    field_start(&options, sessions, 1);
    field_run_ms(1500); /* one was just sent */
    sim_field_kill(&at.field, SIM_GATEWAY);
    field_forget();
    field_run_ms(5000);
    TEST_ASSERT_EQUAL_UINT32(0, field_log(TAPER_MESSAGE_TIME_SYNC, TAPER_NODE_GATEWAY)->count);
    TEST_ASSERT_EQUAL_DOUBLE(50.0, sim_field_limit_kw(&at.field));
    field_run_ms(POLL_ms);
    TEST_ASSERT_EQUAL_DOUBLE(11.0, sim_field_limit_kw(&at.field));
    sim_field_revive(&at.field, SIM_GATEWAY);
    field_run_ms(POLL_ms);
    TEST_ASSERT_EQUAL_DOUBLE(50.0, sim_field_limit_kw(&at.field));
}

static void test_nodes_that_others_play_stay_silent(void) {
    sim_field_options_t options = field_options();
    const bool closed[8] = {true, true, true, false, false, false, false, false};
    options.closed = closed;
    options.no_gateway = true;
    const sim_session_t sessions[] = {field_vehicle(0.0)};
    field_start(&options, sessions, 1);
    field_run_ms(3000);
    TEST_ASSERT_EQUAL_UINT32(0, field_log(TAPER_MESSAGE_EVSE_STATUS, 3)->count);
    TEST_ASSERT_EQUAL_UINT32(0, field_log(TAPER_MESSAGE_SITE_LIMIT, TAPER_NODE_GATEWAY)->count);
    TEST_ASSERT_TRUE(field_log(TAPER_MESSAGE_EVSE_STATUS, 4)->message.as.evse_status.ev_present);
}

static bool refuse(void *context, const taper_frame_t *frame) {
    (void)context;
    (void)frame;
    return false;
}

static void test_a_full_bus_loses_nothing_but_time(void) {
    field_run_ms(1000);
    const taper_port_t good = at.world_port;
    at.world_port.send = refuse;
    field_run_ms(1000);
    TEST_ASSERT_GREATER_THAN_UINT32(0, at.field.send_refused);
    at.world_port = good;
    field_run_ms(POLL_ms); /* counters go on without a gap, which field_run_ms() checks */
    TEST_ASSERT_EQUAL_UINT32(at.now_ms, field_log(TAPER_MESSAGE_EVSE_STATUS, 1)->last_ms);
    TEST_ASSERT_EQUAL_UINT32(at.now_ms, field_log(TAPER_MESSAGE_EVSE_ELEC, 1)->last_ms);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_without_a_change_every_frame_comes_at_its_period);
    RUN_TEST(test_connectors_do_not_speak_all_at_once);
    RUN_TEST(test_at_boot_a_connector_says_what_it_is);
    RUN_TEST(test_who_plugs_in_is_announced_at_once);
    RUN_TEST(test_who_leaves_is_announced_at_once_and_its_energy_noted);
    RUN_TEST(test_energy_is_told_as_it_moves_but_not_too_often);
    RUN_TEST(test_a_full_vehicle_says_so_at_once);
    RUN_TEST(test_the_power_follows_the_taper);
    RUN_TEST(test_a_second_line_is_told_where_there_is_one_and_obeyed);
    RUN_TEST(test_who_keeps_its_taper_back_keeps_both_lines);
    RUN_TEST(test_the_clock_tells_the_time_of_the_world);
    RUN_TEST(test_a_change_of_the_limit_is_told_at_once);
    RUN_TEST(test_a_gateway_without_a_limit_is_alive_only);
    RUN_TEST(test_a_dead_gateway_leaves_the_failsafe_limit_behind);
    RUN_TEST(test_nodes_that_others_play_stay_silent);
    RUN_TEST(test_a_full_bus_loses_nothing_but_time);
    return UNITY_END();
}
