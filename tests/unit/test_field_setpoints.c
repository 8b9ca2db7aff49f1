/* The simulated connectors: what a setpoint does, how long, and for whom. The test is the station. */
#include "field_bench.h"
#include "unity.h"

#define KW_PER_A 0.69 /* of the hub: 3 x 230 V */

void setUp(void) {
    const sim_field_options_t options = field_options();
    const sim_session_t sessions[] = {field_vehicle(0.0)};
    field_start(&options, sessions, 1);
    field_run_ms(1000);
    field_forget();
}

void tearDown(void) {
    field_end();
}

static taper_evse_status_t status(uint8_t node) {
    return field_log(TAPER_MESSAGE_EVSE_STATUS, node)->message.as.evse_status;
}

static void test_a_setpoint_is_obeyed_and_echoed_at_once(void) {
    field_charge(1, 1, 16000, 3000);
    field_run_ms(POLL_ms);
    TEST_ASSERT_EQUAL_INT32(16000, field_evse(1)->setpoint_mA);
    TEST_ASSERT_EQUAL_DOUBLE(16.0 * KW_PER_A, field_evse(1)->power_kw);
    TEST_ASSERT_EQUAL_UINT32(1, field_log(TAPER_MESSAGE_EVSE_STATUS, 1)->count);
    TEST_ASSERT_EQUAL_UINT8(0, status(1).setpoint_echo);
    TEST_ASSERT_TRUE(status(1).contactor_closed);
    TEST_ASSERT_FALSE(status(1).fallback_active);
    TEST_ASSERT_EQUAL_INT32(16000, status(1).current_mA[2]);
    field_charge(1, 1, 16000, 3000);
    field_run_ms(POLL_ms);
    TEST_ASSERT_EQUAL_UINT8(1, status(1).setpoint_echo);
}

static void test_an_expired_setpoint_gives_way_to_its_fallback(void) {
    field_charge(1, 1, 16000, 3000);
    field_run_ms(3000);
    TEST_ASSERT_EQUAL_INT32(16000, field_evse(1)->setpoint_mA);
    field_run_ms(POLL_ms);
    TEST_ASSERT_EQUAL_INT32(6000, field_evse(1)->setpoint_mA);
    TEST_ASSERT_EQUAL_DOUBLE(6.0 * KW_PER_A, field_evse(1)->power_kw);
    TEST_ASSERT_TRUE(status(1).fallback_active);
}

static void test_a_setpoint_for_another_session_is_refused(void) {
    field_charge(1, 1, 10000, 3000);
    field_run_ms(POLL_ms);
    field_charge(1, 2, 16000, 3000);
    field_run_ms(POLL_ms);
    TEST_ASSERT_EQUAL_INT32(10000, field_evse(1)->setpoint_mA);
    TEST_ASSERT_EQUAL_UINT8(0, status(1).setpoint_echo);
}

static void test_a_connector_without_a_vehicle_takes_session_0_only(void) {
    field_charge(2, 1, 16000, 3000);
    field_run_ms(200);
    TEST_ASSERT_TRUE(status(2).fallback_active);
    field_charge(2, 0, 16000, 3000);
    field_run_ms(200);
    TEST_ASSERT_FALSE(status(2).fallback_active);
    TEST_ASSERT_EQUAL_UINT8(1, status(2).setpoint_echo);
    TEST_ASSERT_EQUAL_DOUBLE(0.0, at.field.tracker.may_kw);
}

static void test_a_corrupt_setpoint_is_refused(void) {
    field_charge(1, 1, 16000, 3000);
    at.bus.to_world.frame[at.bus.to_world.tail % TAPER_MEMBUS_DEPTH].data[2] ^= 0x10;
    field_run_ms(POLL_ms);
    TEST_ASSERT_EQUAL_INT32(0, field_evse(1)->setpoint_mA);
}

static void test_a_repeated_setpoint_does_not_last_longer(void) {
    field_charge(1, 1, 16000, 3000);
    field_run_ms(2000);
    at.counter[1] = 0;
    field_charge(1, 1, 16000, 3000);
    field_run_ms(1020);
    TEST_ASSERT_EQUAL_INT32(6000, field_evse(1)->setpoint_mA);
}

static void test_pause_gives_nothing_and_later_the_fallback(void) {
    const taper_setpoint_t pause = {.command = TAPER_COMMAND_PAUSE,
                                    .current_mA = 16000,
                                    .validity_ms = 3000,
                                    .fallback_mA = 6000,
                                    .session = 1};
    field_charge(1, 1, 16000, 3000);
    field_send(1, &pause);
    field_run_ms(3000);
    TEST_ASSERT_EQUAL_DOUBLE(0.0, field_evse(1)->power_kw);
    field_run_ms(POLL_ms);
    TEST_ASSERT_EQUAL_INT32(6000, field_evse(1)->setpoint_mA);
}

static void check_that_it_ends(taper_command_t command) {
    const taper_setpoint_t setpoint = {
        .command = command, .current_mA = 16000, .validity_ms = 3000, .fallback_mA = 6000, .session = 1};
    field_send(1, &setpoint);
    field_run_ms(4000);
    TEST_ASSERT_EQUAL_DOUBLE(0.0, field_evse(1)->power_kw);
    TEST_ASSERT_EQUAL_INT32(0, field_evse(1)->setpoint_mA);
}

static void test_stop_and_emergency_give_nothing_ever_after(void) {
    check_that_it_ends(TAPER_COMMAND_STOP);
    check_that_it_ends(TAPER_COMMAND_EMERGENCY);
}

static void test_a_current_below_the_minimum_gives_nothing(void) {
    field_charge(1, 1, 5900, 3000);
    field_run_ms(POLL_ms);
    TEST_ASSERT_EQUAL_INT32(5900, field_evse(1)->setpoint_mA);
    TEST_ASSERT_EQUAL_DOUBLE(0.0, field_evse(1)->power_kw);
    TEST_ASSERT_EQUAL_DOUBLE(0.0, at.field.tracker.may_kw);
    TEST_ASSERT_FALSE(status(1).contactor_closed);
}

static void test_a_current_above_the_hardware_gives_what_it_has(void) {
    field_charge(1, 1, 63000, 3000);
    field_run_ms(POLL_ms);
    TEST_ASSERT_EQUAL_DOUBLE(22.0, field_evse(1)->power_kw); /* the vehicle's own limit */
    TEST_ASSERT_EQUAL_DOUBLE(32.0 * KW_PER_A, at.field.tracker.may_kw);
}

static void test_the_next_vehicle_gets_nothing_before_its_own_setpoint(void) {
    const sim_field_options_t options = field_options();
    sim_session_t sessions[] = {field_vehicle(0.0), field_vehicle(0.0)};
    sessions[0].connector = 1;
    sessions[0].departure_s = WORLD_START_S + 2.0;
    sessions[1].connector = 1;
    field_start(&options, sessions, 2);
    field_run_ms(1000);
    field_charge(1, 1, 16000, 60000);
    field_run_ms(980);
    TEST_ASSERT_EQUAL_DOUBLE(16.0 * KW_PER_A, field_evse(1)->power_kw);
    field_run_ms(POLL_ms); /* the second vehicle waited for this connector */
    TEST_ASSERT_EQUAL_UINT8(2, field_evse(1)->session);
    TEST_ASSERT_EQUAL_DOUBLE(0.0, field_evse(1)->power_kw);
    TEST_ASSERT_EQUAL_INT32(0, field_evse(1)->setpoint_mA);
    field_charge(1, 2, 8000, 3000);
    field_run_ms(POLL_ms);
    TEST_ASSERT_EQUAL_DOUBLE(8.0 * KW_PER_A, field_evse(1)->power_kw);
}

static void test_a_slow_vehicle_follows_after_its_delay(void) {
    sim_field_options_t options = field_options();
    options.vehicle_delay_ms = 500;
    const sim_session_t sessions[] = {field_vehicle(0.0)};
    field_start(&options, sessions, 1);
    field_run_ms(1000);
    field_charge(1, 1, 16000, 3000);
    field_run_ms(500);
    TEST_ASSERT_EQUAL_DOUBLE(0.0, field_evse(1)->power_kw);
    field_run_ms(POLL_ms);
    TEST_ASSERT_EQUAL_DOUBLE(16.0 * KW_PER_A, field_evse(1)->power_kw);
    field_charge(1, 1, 0, 3000);
    field_run_ms(500);
    TEST_ASSERT_EQUAL_DOUBLE(16.0 * KW_PER_A, field_evse(1)->power_kw);
    TEST_ASSERT_EQUAL_DOUBLE(0.0, at.field.tracker.may_kw);
    field_run_ms(POLL_ms);
    TEST_ASSERT_EQUAL_DOUBLE(0.0, field_evse(1)->power_kw);
}

static void test_a_connector_whose_cable_broke_goes_on_until_its_setpoint_ends(void) {
    field_charge(1, 1, 16000, 3000);
    field_run_ms(POLL_ms);
    sim_field_kill(&at.field, 0);
    field_forget();
    field_charge(1, 1, 20000, 3000);
    field_run_ms(2980);
    TEST_ASSERT_EQUAL_DOUBLE(16.0 * KW_PER_A, field_evse(1)->power_kw);
    field_run_ms(POLL_ms);
    TEST_ASSERT_EQUAL_DOUBLE(6.0 * KW_PER_A, field_evse(1)->power_kw);
    TEST_ASSERT_EQUAL_UINT32(0, field_log(TAPER_MESSAGE_EVSE_STATUS, 1)->count);
    sim_field_revive(&at.field, 0);
    field_charge(1, 1, 20000, 3000);
    field_run_ms(POLL_ms);
    TEST_ASSERT_EQUAL_DOUBLE(20.0 * KW_PER_A, field_evse(1)->power_kw);
    TEST_ASSERT_EQUAL_UINT32(1, field_log(TAPER_MESSAGE_EVSE_STATUS, 1)->count);
    TEST_ASSERT_EQUAL_UINT32(1, field_log(TAPER_MESSAGE_EV_PARAM_A, 1)->count);
}

static void test_a_connector_that_restarts_has_forgotten_everything_but_its_vehicle(void) {
    field_charge(1, 1, 16000, 60000);
    field_run_ms(36000);
    const double charged_kwh = field_evse(1)->energy_kwh;
    const uint8_t revision = field_evse(1)->revision;
    sim_field_power_off(&at.field, 0);
    field_forget();
    field_run_ms(1000);
    TEST_ASSERT_EQUAL_DOUBLE(0.0, field_evse(1)->power_kw);
    sim_field_revive(&at.field, 0);
    field_run_ms(POLL_ms);
    TEST_ASSERT_EQUAL_DOUBLE(charged_kwh, field_evse(1)->energy_kwh);
    const field_log_t *a = field_log(TAPER_MESSAGE_EV_PARAM_A, 1);
    TEST_ASSERT_EQUAL_UINT8(0, a->counter);
    TEST_ASSERT_EQUAL_UINT8(2, a->message.as.ev_param_a.session);
    TEST_ASSERT_EQUAL_UINT8(revision + 1, a->message.as.ev_param_a.revision);
    TEST_ASSERT_EQUAL_INT32(0, field_log(TAPER_MESSAGE_EVSE_ELEC, 1)->message.as.evse_elec.energy_Wh);
    const int32_t asks_Wh = field_log(TAPER_MESSAGE_EV_PARAM_C, 1)->message.as.ev_param_c.target_Wh;
    TEST_ASSERT_INT32_WITHIN(20, (int32_t)((20.0 - charged_kwh) * 1000.0), asks_Wh);
    field_charge(1, 1, 16000, 3000);
    field_run_ms(POLL_ms);
    TEST_ASSERT_EQUAL_INT32(0, field_evse(1)->setpoint_mA);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_a_setpoint_is_obeyed_and_echoed_at_once);
    RUN_TEST(test_an_expired_setpoint_gives_way_to_its_fallback);
    RUN_TEST(test_a_setpoint_for_another_session_is_refused);
    RUN_TEST(test_a_connector_without_a_vehicle_takes_session_0_only);
    RUN_TEST(test_a_corrupt_setpoint_is_refused);
    RUN_TEST(test_a_repeated_setpoint_does_not_last_longer);
    RUN_TEST(test_pause_gives_nothing_and_later_the_fallback);
    RUN_TEST(test_stop_and_emergency_give_nothing_ever_after);
    RUN_TEST(test_a_current_below_the_minimum_gives_nothing);
    RUN_TEST(test_a_current_above_the_hardware_gives_what_it_has);
    RUN_TEST(test_the_next_vehicle_gets_nothing_before_its_own_setpoint);
    RUN_TEST(test_a_slow_vehicle_follows_after_its_delay);
    RUN_TEST(test_a_connector_whose_cable_broke_goes_on_until_its_setpoint_ends);
    RUN_TEST(test_a_connector_that_restarts_has_forgotten_everything_but_its_vehicle);
    return UNITY_END();
}
