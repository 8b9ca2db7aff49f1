/* Sessions that come and go in odd ways: faults 35, 44, 45 and 46 of docs/protocol.md. */
#include "station_bench.h"
#include "unity.h"

static taper_station_config_t config;
/** Vehicles by node; 0: none. */
static uint8_t session[9];

static void start(void) {
    taper_station_options_t options = bench_options();
    config = *options.config;
    config.min_off_ms = 0;
    options.config = &config;
    bench_start(&options);
}

void setUp(void) {
    start();
    for (unsigned node = 0; node <= 8; node++) {
        session[node] = 0;
    }
}
void tearDown(void) {}

static void tick_with_limit(int32_t limit_W) {
    bench_send_clock();
    bench_send_limit(limit_W);
    for (uint8_t node = 1; node <= 8; node++) {
        bench_send_status(node, session[node] != 0);
        if (session[node] != 0) {
            bench_send_vehicle(node, session[node], 500);
        }
    }
    bench_step();
}

static void tick(void) {
    tick_with_limit(50000);
}

static int32_t last_data(taper_event_code_t code) {
    const taper_event_log_t *log = taper_station_events(&bench.station);
    for (uint32_t k = log->count; k-- > 0;) {
        if (log->event[k % TAPER_EVENTS].code == code) {
            return log->event[k % TAPER_EVENTS].data;
        }
    }
    TEST_FAIL_MESSAGE("no such event");
    return 0;
}

static void send_energies(uint8_t node, int32_t target_Wh, int32_t minimum_Wh, int32_t maximum_Wh) {
    taper_message_t message = {.kind = TAPER_MESSAGE_EV_PARAM_C, .node = node};
    message.as.ev_param_c = (taper_ev_param_c_t){.revision = session[node],
                                                 .target_Wh = target_Wh,
                                                 .maximum_Wh = maximum_Wh,
                                                 .minimum_Wh = minimum_Wh};
    bench_send_vehicle(node, session[node], 500);
    bench_send(&message);
}

static void test_row_35_a_target_outside_its_bounds_is_moved_into_them_and_people_are_told(void) {
    session[1] = 3;
    session[2] = 7;
    tick();
    const int32_t sound_mA = bench_setpoint_for(2).current_mA;
    TEST_ASSERT_EQUAL_UINT(0, bench_events(TAPER_EVENT_REPAIRED));
    session[1] = 4; /* a new session, and it contradicts itself */
    bench_send_clock();
    bench_send_limit(50000);
    for (uint8_t node = 1; node <= 8; node++) {
        bench_send_status(node, node <= 2);
    }
    taper_message_t message = {.kind = TAPER_MESSAGE_EV_PARAM_C, .node = 1};
    message.as.ev_param_c = (taper_ev_param_c_t){
        .revision = 4, .target_Wh = 20000, .maximum_Wh = 16000, .minimum_Wh = TAPER_ABSENT};
    bench_send(&message); /* before A and B, so that the set is never whole with another C */
    message = (taper_message_t){.kind = TAPER_MESSAGE_EV_PARAM_A, .node = 1};
    message.as.ev_param_a = (taper_ev_param_a_t){.revision = 4,
                                                 .session = 4,
                                                 .capacity_Wh = 60000,
                                                 .soc_target_permille = TAPER_ABSENT,
                                                 .soc_minimum_permille = TAPER_ABSENT,
                                                 .soc_plug_in_permille = 500};
    bench_send(&message);
    message = (taper_message_t){.kind = TAPER_MESSAGE_EV_PARAM_B, .node = 1};
    message.as.ev_param_b = (taper_ev_param_b_t){
        .revision = 4, .session = 4, .departure_min = 10120, .peak_W = 11000, .min_mA = TAPER_ABSENT};
    bench_send(&message);
    bench_send_vehicle(2, 7, 500);
    bench_step();
    TEST_ASSERT_EQUAL_INT32(16000, bench.station.snapshot.demand[0].need_Wh);
    TEST_ASSERT_EQUAL_UINT(1, bench_events(TAPER_EVENT_REPAIRED));
    TEST_ASSERT_EQUAL_INT32(4, last_data(TAPER_EVENT_REPAIRED));
    TEST_ASSERT_EQUAL_UINT32(1, taper_station_counter(&bench.station, TAPER_COUNTER_PARAMETERS_REPAIRED));
    TEST_ASSERT_GREATER_THAN_INT32(0, bench_setpoint_for(1).current_mA);
    TEST_ASSERT_EQUAL_INT32(sound_mA, bench_setpoint_for(2).current_mA);
}

static void test_row_35_parameters_that_agree_are_not_called_repaired(void) {
    session[1] = 3;
    tick();
    session[1] = 4;
    bench_send_status(1, true);
    send_energies(1, 16000, 16000, 16000);
    bench_step();
    TEST_ASSERT_EQUAL_UINT(0, bench_events(TAPER_EVENT_REPAIRED));
}

static void test_row_44_another_session_on_a_connector_replaces_the_one_before(void) {
    session[1] = 3;
    session[2] = 7;
    tick();
    const taper_setpoint_t other = bench_setpoint_for(2);
    TEST_ASSERT_EQUAL_UINT8(3, bench_setpoint_for(1).session);
    session[1] = 4; /* replugged: nobody told that session 3 ended */
    tick();
    TEST_ASSERT_EQUAL_UINT8(4, bench_setpoint_for(1).session);
    TEST_ASSERT_EQUAL_INT32(3, last_data(TAPER_EVENT_SESSION_ENDED));
    TEST_ASSERT_EQUAL_INT32(4, last_data(TAPER_EVENT_SESSION_BEGUN));
    TEST_ASSERT_EQUAL_UINT(1, bench_events(TAPER_EVENT_SESSION_ENDED));
    TEST_ASSERT_EQUAL_MEMORY(&other, &bench.setpoint[2], sizeof other);
    tick();
    TEST_ASSERT_GREATER_THAN_INT32(0, bench_setpoint_for(1).current_mA);
}

static void test_row_44_the_same_session_number_on_two_connectors_are_two_sessions(void) {
    session[1] = 7;
    session[2] = 7;
    tick();
    TEST_ASSERT_EQUAL_UINT(2, bench_events(TAPER_EVENT_SESSION_BEGUN));
    const taper_setpoint_t other = bench_setpoint_for(2);
    session[1] = 0;
    tick();
    TEST_ASSERT_EQUAL_UINT(1, bench_events(TAPER_EVENT_SESSION_ENDED));
    TEST_ASSERT_EQUAL_INT32(0, bench_setpoint_for(1).current_mA);
    TEST_ASSERT_EQUAL_MEMORY(&other, &bench.setpoint[2], sizeof other);
}

static void test_row_45_pilot_state_a_closes_the_session_within_a_tick_and_frees_its_power_at_once(void) {
    session[1] = 7;
    session[2] = 7;
    tick_with_limit(8000); /* room for one */
    tick_with_limit(8000);
    TEST_ASSERT_GREATER_THAN_INT32(11000, bench_setpoint_for(1).current_mA);
    TEST_ASSERT_EQUAL_INT32(0, bench_setpoint_for(2).current_mA);
    session[1] = 0;
    tick_with_limit(8000);
    TEST_ASSERT_EQUAL_INT32(0, bench_setpoint_for(1).current_mA);
    TEST_ASSERT_EQUAL_UINT8(0, bench_setpoint_for(1).session);
    TEST_ASSERT_EQUAL_UINT(1, bench_events(TAPER_EVENT_SESSION_ENDED));
    TEST_ASSERT_EQUAL(TAPER_REASON_NO_VEHICLE, taper_station_reason(&bench.station, 0));
    TEST_ASSERT_GREATER_THAN_INT32(11000,
                                   bench_setpoint_for(2).current_mA); /* a plug in the air draws nothing */
}

/** Vehicle 1 charges on one phase; its connector tells its wiring. */
static void tick_on_one_phase(uint8_t rotation) {
    taper_message_t message = {.kind = TAPER_MESSAGE_EVSE_INFO, .node = 1};
    message.as.evse_info = (taper_evse_info_t){.protocol_version = TAPER_PROTOCOL_VERSION,
                                               .max_mA = 32000,
                                               .min_mA = 6000,
                                               .kind = TAPER_KIND_AC3,
                                               .rotation = rotation};
    bench_send(&message);
    bench_send_clock();
    bench_send_limit(50000);
    for (uint8_t node = 3; node <= 8; node++) {
        bench_send_status(node, false);
    }
    bench_send_status(2, true);
    message = (taper_message_t){.kind = TAPER_MESSAGE_EVSE_STATUS, .node = 1};
    message.as.evse_status = (taper_evse_status_t){.pilot = TAPER_PILOT_C,
                                                   .ev_present = true,
                                                   .phases = 1,
                                                   .fallback_active = !bench.heard[1],
                                                   .setpoint_echo = bench.echo[1]};
    bench_send(&message);
    bench_send_vehicle(1, 7, 500);
    bench_send_vehicle(2, 7, 500);
    bench_step();
}

static void test_row_46_a_connector_of_unknown_rotation_counts_on_all_phases(void) {
    tick_on_one_phase(TAPER_ROTATION_231);
    const taper_demand_t *demand = &bench.station.snapshot.demand[0];
    TEST_ASSERT_EQUAL_INT32(230, demand->booking.W_per_A);
    TEST_ASSERT_EQUAL_UINT(0, bench_events(TAPER_EVENT_ROTATION));
    const int32_t sound_mA = bench_setpoint_for(2).current_mA;
    for (int k = 0; k < 3; k++) {
        tick_on_one_phase(TAPER_ROTATION_UNKNOWN);
    }
    TEST_ASSERT_EQUAL_INT32(690, demand->booking.W_per_A);
    TEST_ASSERT_EQUAL_UINT8(7, demand->booking.phases);
    TEST_ASSERT_EQUAL_UINT8(0, demand->booking.idle);
    TEST_ASSERT_EQUAL_UINT8(7, demand->booking.unsure); /* it balances nobody */
    TEST_ASSERT_EQUAL_INT32(230, demand->W_per_A);      /* planned as it draws */
    TEST_ASSERT_EQUAL_UINT(1, bench_events(TAPER_EVENT_ROTATION));
    TEST_ASSERT_GREATER_THAN_INT32(0, bench_setpoint_for(1).current_mA);
    TEST_ASSERT_EQUAL_INT32(sound_mA, bench_setpoint_for(2).current_mA);
    tick_on_one_phase(TAPER_ROTATION_123);
    TEST_ASSERT_EQUAL_INT32(230, demand->booking.W_per_A);
}

static void test_row_46_a_connector_that_never_told_its_rotation_counts_as_described(void) {
    session[1] = 7;
    tick();
    TEST_ASSERT_EQUAL_INT32(690, bench.station.snapshot.demand[0].booking.W_per_A);
    TEST_ASSERT_EQUAL_UINT(0, bench_events(TAPER_EVENT_ROTATION));
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_row_35_a_target_outside_its_bounds_is_moved_into_them_and_people_are_told);
    RUN_TEST(test_row_35_parameters_that_agree_are_not_called_repaired);
    RUN_TEST(test_row_44_another_session_on_a_connector_replaces_the_one_before);
    RUN_TEST(test_row_44_the_same_session_number_on_two_connectors_are_two_sessions);
    RUN_TEST(test_row_45_pilot_state_a_closes_the_session_within_a_tick_and_frees_its_power_at_once);
    RUN_TEST(test_row_46_a_connector_of_unknown_rotation_counts_on_all_phases);
    RUN_TEST(test_row_46_a_connector_that_never_told_its_rotation_counts_as_described);
    return UNITY_END();
}
