/* What vehicles say of their state of charge, or do not: faults 1 to 5 and 21 of docs/protocol.md. */
#include <string.h>

#include "station_bench.h"
#include "taper/codec.h"
#include "taper/membus_faults.h"
#include "unity.h"

/** Vehicle 1, whose reports the tests spoil. Vehicle 2 is sound, and must not notice. */
static taper_ev_status_t ev;
static taper_evse_elec_t elec;
static int32_t sound_mA;

/** Everybody reports, but not vehicle 1 of itself; then a tick. */
static void report_all(void) {
    bench_send_clock();
    bench_send_limit(50000);
    for (uint8_t node = 1; node <= 8; node++) {
        bench_send_status(node, node <= 2);
    }
    bench_send_vehicle(2, 7, 500);
}

static void tick(void) {
    taper_message_t message = {.kind = TAPER_MESSAGE_EV_STATUS, .node = 1, .as.ev_status = ev};
    report_all();
    bench_send(&message);
    message = (taper_message_t){.kind = TAPER_MESSAGE_EVSE_ELEC, .node = 1, .as.evse_elec = elec};
    bench_send(&message);
    bench_step();
}

/** A sound start of both. */
static void start(int32_t soc_permille) {
    const taper_station_options_t options = bench_options();
    bench_start(&options);
    ev = (taper_ev_status_t){.soc_permille = soc_permille, .soc_age_s = 0, .max_mA = 16000, .ready = true};
    elec = (taper_evse_elec_t){.voltage_mV = 230000, .power_W = 0, .energy_Wh = 0};
    report_all();
    bench_send_vehicle(1, 7, soc_permille);
    bench_step();
    tick();
    sound_mA = bench_setpoint_for(2).current_mA;
}

void setUp(void) {
    start(500);
}
void tearDown(void) {}

static const taper_demand_t *demand_of(uint8_t node) {
    return &bench.station.snapshot.demand[node - 1];
}

static void assert_the_other_is_undisturbed(void) {
    TEST_ASSERT_FALSE(demand_of(2)->soc_estimated);
    TEST_ASSERT_EQUAL_INT32(30000, demand_of(2)->stored_Wh);
    TEST_ASSERT_EQUAL_INT32(sound_mA, bench_setpoint_for(2).current_mA);
    TEST_ASSERT_EQUAL_UINT32(0, taper_station_counter(&bench.station, TAPER_COUNTER_GUARD_VIOLATIONS));
}

static void test_row_1_an_old_soc_is_estimated_from_energy_in_the_same_tick(void) {
    TEST_ASSERT_FALSE(demand_of(1)->soc_estimated);
    ev.soc_age_s = TAPER_SOC_STALE_s + 1;
    elec.energy_Wh = 3000;
    tick();
    TEST_ASSERT_TRUE(demand_of(1)->soc_estimated);
    TEST_ASSERT_EQUAL_INT32(33000, demand_of(1)->stored_Wh);
    TEST_ASSERT_EQUAL_INT32(17000, demand_of(1)->need_Wh);
    TEST_ASSERT_GREATER_THAN_INT32(0, bench_setpoint_for(1).current_mA);
    assert_the_other_is_undisturbed();
    ev.soc_age_s = 0;
    ev.soc_permille = 550;
    tick();
    TEST_ASSERT_FALSE(demand_of(1)->soc_estimated);
    TEST_ASSERT_EQUAL_INT32(33000, demand_of(1)->stored_Wh);
}

static void test_row_1_without_ev_status_for_2500_ms_the_soc_is_estimated(void) {
    static taper_membus_injector_t injector;
    const taper_membus_faults_t faults = {.seed = 1,
                                          .id = taper_can_id(TAPER_MESSAGE_EV_STATUS, 1),
                                          .mask = TAPER_MEMBUS_MASK_ID,
                                          .drop_permille = 1000};
    taper_membus_inject(&bench.bus, &bench.bus.to_station, &injector, &faults);
    tick();
    tick();
    TEST_ASSERT_FALSE(demand_of(1)->soc_estimated); /* 2 s */
    elec.energy_Wh = 1000;
    tick();
    TEST_ASSERT_TRUE(demand_of(1)->soc_estimated);
    TEST_ASSERT_EQUAL_INT32(31000, demand_of(1)->stored_Wh);
    TEST_ASSERT_GREATER_THAN_INT32(0, bench_setpoint_for(1).current_mA);
    assert_the_other_is_undisturbed();
    taper_membus_inject(&bench.bus, &bench.bus.to_station, &injector, NULL);
    for (int k = 0; k < 3; k++) { /* the gap in its counter is one error in the window */
        tick();
    }
    TEST_ASSERT_FALSE(demand_of(1)->soc_estimated);
}

static void test_row_2_a_vehicle_that_never_told_a_soc_is_charged_by_the_energy_it_asked_for(void) {
    start(TAPER_ABSENT);
    elec.energy_Wh = 5000;
    tick();
    TEST_ASSERT_TRUE(demand_of(1)->active);
    TEST_ASSERT_TRUE(demand_of(1)->soc_estimated);
    TEST_ASSERT_EQUAL_INT32(15000, demand_of(1)->need_Wh);
    TEST_ASSERT_EQUAL_INT32(TAPER_MODE_FALLBACK, taper_station_mode(&bench.station));
    TEST_ASSERT_GREATER_THAN_INT32(0, bench_setpoint_for(1).current_mA);
    assert_the_other_is_undisturbed();
    elec.energy_Wh = 20000;
    tick();
    TEST_ASSERT_FALSE(demand_of(1)->active); /* it has what it asked for */
    TEST_ASSERT_EQUAL_INT32(0, bench_setpoint_for(1).current_mA);
}

static void test_row_3_a_soc_that_jumps_is_believed_when_three_reports_agree(void) {
    ev.soc_permille = 900;
    for (int k = 0; k < 2; k++) {
        tick();
        TEST_ASSERT_TRUE(demand_of(1)->soc_estimated);
        TEST_ASSERT_INT32_WITHIN(150, 30000, demand_of(1)->stored_Wh);
    }
    TEST_ASSERT_EQUAL_UINT(1, bench_events(TAPER_EVENT_SOC_JUMP)); /* once, not per report */
    TEST_ASSERT_EQUAL_UINT32(1, taper_station_counter(&bench.station, TAPER_COUNTER_SOC_JUMPS));
    assert_the_other_is_undisturbed();
    tick();
    TEST_ASSERT_FALSE(demand_of(1)->soc_estimated);
    TEST_ASSERT_EQUAL_INT32(54000, demand_of(1)->stored_Wh);
    TEST_ASSERT_EQUAL_UINT(1, bench_events(TAPER_EVENT_SOC_JUMP));
}

/** An EV_STATUS of vehicle 1 with a byte that the codec would not have made. */
static void send_with_byte(unsigned byte, uint8_t value) {
    static uint8_t counter;
    const taper_message_t message = {.kind = TAPER_MESSAGE_EV_STATUS, .node = 1, .as.ev_status = ev};
    taper_frame_t frame;
    TEST_ASSERT_TRUE(taper_encode(&message, &frame));
    counter = bench.counters[frame.id];
    frame.data[byte] = value;
    taper_e2e_protect(&frame, counter);
    bench.counters[frame.id] = (uint8_t)((counter + 1) & 0x0F);
    TEST_ASSERT_TRUE(taper_membus_world_send(&bench.bus, &frame));
}

static void test_row_4_a_value_out_of_range_is_absent_and_the_rest_of_its_frame_counts(void) {
    ev.max_mA = 10000;
    report_all();
    send_with_byte(2, 201); /* SOC 100.5 % */
    bench_step();
    TEST_ASSERT_EQUAL_INT32(TAPER_ABSENT, bench.station.sessions.session[0].ev.soc_permille);
    TEST_ASSERT_TRUE(demand_of(1)->soc_estimated);
    TEST_ASSERT_EQUAL_INT32(30000, demand_of(1)->stored_Wh); /* not clamped to 100 % */
    TEST_ASSERT_EQUAL_INT32(10000, demand_of(1)->max_mA);
    TEST_ASSERT_EQUAL_UINT(1, bench_events(TAPER_EVENT_BAD_FIELD));
    assert_the_other_is_undisturbed();
    for (int k = 0; k < 10; k++) {
        report_all();
        send_with_byte(2, 254);
        bench_step();
    }
    TEST_ASSERT_EQUAL_UINT32(11, taper_station_counter(&bench.station, TAPER_COUNTER_BAD_FIELDS));
    TEST_ASSERT_EQUAL_UINT(1, bench_events(TAPER_EVENT_BAD_FIELD)); /* the log is not for every frame */
    tick();
    TEST_ASSERT_FALSE(demand_of(1)->soc_estimated);
}

/** Every number that vehicle 1 can say is the greatest, or the least, that the wire carries. */
static void send_extreme(bool most) {
    taper_message_t message = {.kind = TAPER_MESSAGE_EV_PARAM_A, .node = 1};
    message.as.ev_param_a = (taper_ev_param_a_t){.revision = 9,
                                                 .session = 7,
                                                 .capacity_Wh = most ? 6553400 : 100,
                                                 .soc_target_permille = most ? 1000 : 0,
                                                 .soc_minimum_permille = TAPER_ABSENT,
                                                 .soc_plug_in_permille = TAPER_ABSENT};
    bench_send(&message);
    message = (taper_message_t){.kind = TAPER_MESSAGE_EV_PARAM_B, .node = 1};
    message.as.ev_param_b = (taper_ev_param_b_t){.revision = 9,
                                                 .session = 7,
                                                 .departure_min = most ? 65534 : 0,
                                                 .peak_W = most ? 655340 : 0,
                                                 .min_mA = 0};
    bench_send(&message);
    message = (taper_message_t){.kind = TAPER_MESSAGE_EV_PARAM_C, .node = 1};
    message.as.ev_param_c = (taper_ev_param_c_t){.revision = 9,
                                                 .target_Wh = most ? 655340 : -655340,
                                                 .maximum_Wh = TAPER_ABSENT,
                                                 .minimum_Wh = TAPER_ABSENT};
    bench_send(&message);
    ev.max_mA = most ? 6553400 : 0;
    elec.voltage_mV = most ? 6553400 : 0;
    elec.power_W = most ? 655340 : 0;
}

static void test_row_5_the_greatest_and_least_values_of_the_wire_break_nothing(void) {
    send_extreme(true);
    tick();
    tick();
    TEST_ASSERT_EQUAL_INT32(0, demand_of(1)->capacity_Wh); /* absurd: as unknown */
    TEST_ASSERT_LESS_OR_EQUAL_INT32(32000, bench_setpoint_for(1).current_mA);
    assert_the_other_is_undisturbed();
    send_extreme(false);
    tick();
    tick();
    TEST_ASSERT_FALSE(demand_of(1)->active);
    TEST_ASSERT_EQUAL_INT32(0, bench_setpoint_for(1).current_mA);
    assert_the_other_is_undisturbed();
}

static void send_version(uint8_t version) {
    taper_message_t message = {.kind = TAPER_MESSAGE_EVSE_INFO, .node = 1};
    message.as.evse_info = (taper_evse_info_t){.protocol_version = version,
                                               .max_mA = 32000,
                                               .min_mA = 6000,
                                               .kind = TAPER_KIND_AC3,
                                               .rotation = TAPER_ROTATION_123};
    bench_send(&message);
}

static void test_row_21_a_connector_of_another_version_gets_no_current_until_it_is_updated(void) {
    taper_station_config_t config = *bench_options().config;
    config.min_off_ms = 0;
    bench.station.options.config = bench.station.sessions.config = &config;
    send_version(TAPER_PROTOCOL_VERSION);
    tick();
    TEST_ASSERT_GREATER_THAN_INT32(0, bench_setpoint_for(1).current_mA);
    send_version(TAPER_PROTOCOL_VERSION + 1);
    tick();
    const taper_setpoint_t setpoint = bench_setpoint_for(1);
    TEST_ASSERT_EQUAL(TAPER_COMMAND_PAUSE, setpoint.command);
    TEST_ASSERT_EQUAL_INT32(0, setpoint.current_mA);
    TEST_ASSERT_EQUAL_INT32(0, setpoint.fallback_mA);
    TEST_ASSERT_EQUAL(TAPER_REASON_VERSION, taper_station_reason(&bench.station, 0));
    TEST_ASSERT_EQUAL_UINT(1, bench_events(TAPER_EVENT_VERSION));
    send_version(TAPER_PROTOCOL_VERSION + 1);
    tick();
    TEST_ASSERT_EQUAL_UINT(1, bench_events(TAPER_EVENT_VERSION));
    assert_the_other_is_undisturbed();
    send_version(TAPER_PROTOCOL_VERSION);
    tick();
    tick();
    TEST_ASSERT_GREATER_THAN_INT32(0, bench_setpoint_for(1).current_mA);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_row_1_an_old_soc_is_estimated_from_energy_in_the_same_tick);
    RUN_TEST(test_row_1_without_ev_status_for_2500_ms_the_soc_is_estimated);
    RUN_TEST(test_row_2_a_vehicle_that_never_told_a_soc_is_charged_by_the_energy_it_asked_for);
    RUN_TEST(test_row_3_a_soc_that_jumps_is_believed_when_three_reports_agree);
    RUN_TEST(test_row_4_a_value_out_of_range_is_absent_and_the_rest_of_its_frame_counts);
    RUN_TEST(test_row_5_the_greatest_and_least_values_of_the_wire_break_nothing);
    RUN_TEST(test_row_21_a_connector_of_another_version_gets_no_current_until_it_is_updated);
    return UNITY_END();
}
