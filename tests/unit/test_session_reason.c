/* Why a connector has no active demand: the first reason that applies, from the connector to the vehicle. */
#include "session_bench.h"
#include "unity.h"

static session_bench_t bench;

void setUp(void) {
    bench_start(&bench, BENCH_AC3);
    bench_plug_in(&bench);
}
void tearDown(void) {}

static void assert_reason(taper_reason_t reason) {
    const bool active = bench_demand(&bench)->active;
    TEST_ASSERT_EQUAL(reason, taper_session_idle_reason(&bench.table, BENCH_AC3, bench.now_ms));
    TEST_ASSERT_EQUAL(reason == TAPER_REASON_PLANNED, active); /* the two never disagree */
}

static void test_a_sound_vehicle_has_no_reason_to_be_idle(void) {
    assert_reason(TAPER_REASON_PLANNED);
}

static void test_a_silent_connector_is_offline_whatever_its_vehicle_said(void) {
    bench.ev.complete = true;
    bench_report_ev(&bench);
    bench.now_ms += TAPER_EVSE_STATUS_TIMEOUT_ms + 1;
    assert_reason(TAPER_REASON_OFFLINE);
}

static void test_a_connector_of_another_version_says_so_with_and_without_a_vehicle(void) {
    taper_message_t message = {.kind = TAPER_MESSAGE_EVSE_INFO, .bus = 0, .node = 1};
    message.as.evse_info.protocol_version = TAPER_PROTOCOL_VERSION + 1;
    TEST_ASSERT_TRUE(taper_session_apply(&bench.table, &message, bench.now_ms));
    assert_reason(TAPER_REASON_VERSION);
    bench_unplug(&bench);
    assert_reason(TAPER_REASON_VERSION);
}

static void test_an_empty_connector_has_no_vehicle(void) {
    bench_unplug(&bench);
    assert_reason(TAPER_REASON_NO_VEHICLE);
}

static void test_faults_of_connector_pilot_and_vehicle_are_faults(void) {
    bench.status.fault = true;
    bench_report_status(&bench);
    assert_reason(TAPER_REASON_FAULT);
    bench.status.fault = false;
    bench.status.pilot = TAPER_PILOT_E;
    bench_report_status(&bench);
    assert_reason(TAPER_REASON_FAULT);
    bench.status.pilot = TAPER_PILOT_C;
    bench_report_status(&bench);
    bench.ev.error = 3;
    bench_report_ev(&bench);
    assert_reason(TAPER_REASON_FAULT);
}

static void test_a_vehicle_that_says_complete_or_has_its_energy_is_complete(void) {
    bench.ev.complete = true;
    bench_report_ev(&bench);
    assert_reason(TAPER_REASON_COMPLETE);
    bench.ev.complete = false;
    bench_report_ev(&bench);
    bench.elec.energy_Wh = 20000;
    bench_report_elec(&bench);
    assert_reason(TAPER_REASON_COMPLETE);
}

static void test_a_vehicle_that_asks_for_a_pause_or_a_stop_has_a_pause(void) {
    bench.ev.pause_requested = true;
    bench_report_ev(&bench);
    assert_reason(TAPER_REASON_VEHICLE_PAUSE);
    bench.ev.pause_requested = false;
    bench.ev.stop_requested = true;
    bench_report_ev(&bench);
    assert_reason(TAPER_REASON_VEHICLE_PAUSE);
}

static void test_a_vehicle_without_parameters_says_so(void) {
    bench_start(&bench, BENCH_AC3);
    bench_report_status(&bench);
    bench_report_ev(&bench);
    assert_reason(TAPER_REASON_NO_PARAMETERS);
}

static void test_a_vehicle_that_takes_less_than_the_minimum_is_its_own_limit(void) {
    bench.ev.max_mA = 5900;
    bench_report_ev(&bench);
    assert_reason(TAPER_REASON_VEHICLE_LIMIT);
    bench.ev.max_mA = 0;
    bench_report_ev(&bench);
    assert_reason(TAPER_REASON_VEHICLE_LIMIT);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_a_sound_vehicle_has_no_reason_to_be_idle);
    RUN_TEST(test_a_silent_connector_is_offline_whatever_its_vehicle_said);
    RUN_TEST(test_a_connector_of_another_version_says_so_with_and_without_a_vehicle);
    RUN_TEST(test_an_empty_connector_has_no_vehicle);
    RUN_TEST(test_faults_of_connector_pilot_and_vehicle_are_faults);
    RUN_TEST(test_a_vehicle_that_says_complete_or_has_its_energy_is_complete);
    RUN_TEST(test_a_vehicle_that_asks_for_a_pause_or_a_stop_has_a_pause);
    RUN_TEST(test_a_vehicle_without_parameters_says_so);
    RUN_TEST(test_a_vehicle_that_takes_less_than_the_minimum_is_its_own_limit);
    return UNITY_END();
}
