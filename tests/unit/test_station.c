/* The station without a planner: frames in at one end of an in-memory bus, setpoint frames out at the other. */
#include <string.h>

#include "station_bench.h"
#include "taper/codec.h"
#include "unity.h"

void setUp(void) {
    const taper_station_options_t options = bench_options();
    bench_start(&options);
}
void tearDown(void) {}

static void test_without_a_planner_a_soc_frame_still_gives_a_setpoint_frame(void) {
    bench_send_all(1, 50000);
    bench_step();
    bench_assert_one_vehicle_in_the_snapshot();
    TEST_ASSERT_EQUAL(TAPER_MODE_FALLBACK, taper_station_mode(&bench.station));
    /* 8000 W / 690 V = 11.594 A, up to the step */
    TEST_ASSERT_EQUAL_INT32(11600, bench_setpoint_for(1).current_mA);
}

static void test_nothing_charges_before_a_limit_was_heard(void) {
    bench_send_clock();
    bench_send_status(1, true);
    bench_send_vehicle(1, 7, 500);
    bench_step();
    TEST_ASSERT_EQUAL(TAPER_MODE_INIT, taper_station_mode(&bench.station));
    TEST_ASSERT_TRUE(bench.station.snapshot.demand[0].active);
    TEST_ASSERT_EQUAL_INT32(0, bench_setpoint_for(1).current_mA);
}

static void test_a_lower_limit_acts_in_the_same_tick(void) {
    bench_send_all(8, 50000);
    bench_step();
    bench_send_all(8, 6000);
    bench_step();
    int32_t sum_W = 0;
    for (uint8_t i = 0; i < 8; i++) {
        sum_W += bench.station.setpoints.current_mA[i] * 690 / 1000;
    }
    TEST_ASSERT_LESS_OR_EQUAL_INT32(6000, sum_W);
    TEST_ASSERT_GREATER_THAN_INT32(4000, sum_W);
}

static void test_a_silent_gateway_ends_in_failsafe(void) {
    bench_send_all(8, 50000);
    bench_step();
    for (int tick = 0; tick < 6; tick++) {
        for (uint8_t node = 1; node <= 8; node++) {
            bench_send_status(node, true);
            bench_send_vehicle(node, 7, 500);
        }
        bench_step();
    }
    TEST_ASSERT_EQUAL(TAPER_MODE_FAILSAFE, taper_station_mode(&bench.station));
    TEST_ASSERT_EQUAL_INT32(11000, taper_station_site_limit_W(&bench.station));
    TEST_ASSERT_GREATER_THAN_UINT32(0, taper_station_counter(&bench.station, TAPER_COUNTER_FALLBACK_TICKS));
}

static void test_a_silent_connector_loses_its_current_and_the_others_go_on(void) {
    bench_send_all(2, 50000);
    bench_step();
    bench_send_clock();
    bench_send_limit(50000);
    bench.now_ms += 1000;
    bench_send_status(2, true);
    bench_send_vehicle(2, 7, 500);
    bench_step();
    TEST_ASSERT_EQUAL_INT32(0, bench.station.setpoints.current_mA[0]);
    TEST_ASSERT_GREATER_THAN_INT32(0, bench.station.setpoints.current_mA[1]);
}

static void test_a_corrupt_frame_is_dropped_and_counted(void) {
    taper_frame_t frame = {.id = taper_can_id(TAPER_MESSAGE_SITE_LIMIT, TAPER_NODE_GATEWAY), .length = 8};
    TEST_ASSERT_TRUE(taper_membus_world_send(&bench.bus, &frame));
    bench_step();
    TEST_ASSERT_EQUAL_UINT32(1, taper_station_counter(&bench.station, TAPER_COUNTER_CRC_ERRORS));
    TEST_ASSERT_EQUAL(TAPER_MODE_INIT, taper_station_mode(&bench.station));
}

/** Steps of a station whose frames nobody takes, until the queue is full and some were refused. */
static void step_until_refused(void) {
    bench.deaf = true;
    for (int tick = 0; tick < 400 && taper_station_counter(&bench.station, TAPER_COUNTER_SEND_REFUSED) == 0;
         tick++) {
        bench_send_status(1, true);
        bench_send_limit(50000);
        bench_step();
    }
    TEST_ASSERT_GREATER_THAN_UINT32(0, taper_station_counter(&bench.station, TAPER_COUNTER_SEND_REFUSED));
}

static void test_a_full_send_queue_is_counted_and_nothing_breaks(void) {
    bench_send_all(1, 50000);
    step_until_refused();
    TEST_ASSERT_EQUAL_UINT32(0, taper_station_counter(&bench.station, TAPER_COUNTER_GUARD_VIOLATIONS));
}

static void test_refused_setpoints_leave_no_gap_in_the_counter(void) {
    bench_send_all(1, 50000);
    step_until_refused();
    bench.deaf = false;
    bench_listen();
    const uint8_t next = bench.station.setpoint_counter[0];
    bench_poll(0); /* a refused setpoint is tried again with the next call */
    TEST_ASSERT_EQUAL_UINT8(next, bench.echo[1]);
}

static void test_options_that_make_no_sense_are_refused(void) {
    taper_station_options_t with = bench_options();
    with.port = NULL;
    TEST_ASSERT_EQUAL(TAPER_ERR_ARGUMENT, taper_station_init(&bench.station, &with));
    with = bench_options();
    with.iterations_per_tick = 0;
    TEST_ASSERT_EQUAL(TAPER_ERR_ARGUMENT, taper_station_init(&bench.station, &with));
    taper_station_config_t config = *bench_options().config;
    with = bench_options();
    with.config = &config;
    with.time_scale = 1000;
    TEST_ASSERT_EQUAL(TAPER_OK, taper_station_init(&bench.station, &with));
    config.tick_ms = 999; /* of the world: less than a millisecond of the bus */
    TEST_ASSERT_EQUAL(TAPER_ERR_ARGUMENT, taper_station_init(&bench.station, &with));
    config.connector_count = 0;
    with = bench_options();
    with.config = &config;
    TEST_ASSERT_EQUAL(TAPER_ERR_CONFIG, taper_station_init(&bench.station, &with));
}

static void test_a_description_out_of_range_is_refused_at_boot(void) {
    taper_connector_config_t connectors[8];
    const taper_station_config_t good = *bench_options().config;
    memcpy(connectors, good.connectors, sizeof connectors);
    taper_station_config_t bad[6] = {good, good, good, good, good, good};
    bad[0].tick_ms = 0;
    bad[1].tick_ms = 3600001;
    bad[2].step_s = 59;
    bad[3].step_s = 3601;
    bad[4].failsafe_W = good.groups[0].limit_W + 1;
    bad[5].connectors = connectors;
    connectors[7].bus = TAPER_MAX_BUSES;
    for (size_t k = 0; k < sizeof bad / sizeof bad[0]; k++) {
        taper_station_options_t with = bench_options();
        with.config = &bad[k];
        TEST_ASSERT_EQUAL(TAPER_ERR_CONFIG, taper_station_init(&bench.station, &with));
    }
}

static void test_a_feeder_tree_that_is_none_is_refused_at_boot(void) {
    taper_group_config_t groups[3];
    taper_station_config_t config = *bench_options().config;
    memcpy(groups, config.groups, sizeof groups);
    groups[1].parent = 2; /* not before its child */
    config.groups = groups;
    taper_station_options_t with = bench_options();
    with.config = &config;
    TEST_ASSERT_EQUAL(TAPER_ERR_CONFIG, taper_station_init(&bench.station, &with));
}

/** A second of two vehicles under 13 kW, the first on a grid of 253 V, and perhaps `silent`. */
static void pass_at_253_V(bool silent) {
    const taper_message_t high = {.kind = TAPER_MESSAGE_EVSE_ELEC,
                                  .node = 1,
                                  .as.evse_elec = {.voltage_mV = 253000, .power_W = 0, .energy_Wh = 0}};
    bench_send_limit(13000);
    bench_send_status(2, true);
    bench_send_vehicle(2, 7, 500);
    if (!silent) {
        bench_send_status(1, true);
        bench_send_vehicle(1, 7, 500);
        bench_send(&high);
    }
    bench_step();
}

static void test_a_connector_that_falls_silent_stays_booked_by_its_measured_voltage(void) {
    bench_send_all(0, 13000);
    bench_step();
    for (int tick = 0; tick < 8; tick++) {
        pass_at_253_V(tick >= 4);
        const int64_t silent_mW = (int64_t)taper_ledger_may_mA(&bench.station.ledger, 0) * 3 * 253;
        const int64_t other_mW = (int64_t)taper_ledger_may_mA(&bench.station.ledger, 1) * 3 * 230;
        TEST_ASSERT_TRUE(tick == 0 || tick > 5 || silent_mW > 0);
        TEST_ASSERT_LESS_OR_EQUAL_INT64(INT64_C(13000000), silent_mW + other_mW);
    }
}

/** What eight connectors, clock and gateway say, and a control tick; the rest of it in polls. Connector 1 still echoes `echo`. */
static void pass_slow_tick(uint8_t echo, int32_t limit_W, unsigned polls) {
    bench.echo[1] = echo;
    bench_send_all(1, limit_W);
    bench_step();
    for (unsigned k = 0; k < polls; k++) {
        bench.echo[1] = echo;
        bench_send_status(1, true);
        bench_poll(500);
    }
}

static void test_who_does_not_echo_is_told_less_at_once_however_long_setpoints_last(void) {
    taper_station_options_t options = bench_options();
    taper_station_config_t slow = *options.config;
    slow.tick_ms = 10000; /* so a setpoint lasts for 30 s */
    options.config = &slow;
    bench_start(&options);
    for (int k = 0; k < 5; k++) {
        pass_slow_tick(bench.echo[1], 50000, 18);
    }
    TEST_ASSERT_GREATER_THAN_INT32(10000, bench_setpoint_for(1).current_mA);
    const uint8_t echo = bench.echo[1];
    for (int k = 0; k < 5; k++) {
        pass_slow_tick(echo, 50000, 18);
    }
    TEST_ASSERT_GREATER_OR_EQUAL_INT32(6000, bench_setpoint_for(1).current_mA);
    pass_slow_tick(echo, 0, 0);
    TEST_ASSERT_EQUAL_INT32(0, bench_setpoint_for(1).current_mA);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_without_a_planner_a_soc_frame_still_gives_a_setpoint_frame);
    RUN_TEST(test_nothing_charges_before_a_limit_was_heard);
    RUN_TEST(test_a_lower_limit_acts_in_the_same_tick);
    RUN_TEST(test_a_silent_gateway_ends_in_failsafe);
    RUN_TEST(test_a_silent_connector_loses_its_current_and_the_others_go_on);
    RUN_TEST(test_a_corrupt_frame_is_dropped_and_counted);
    RUN_TEST(test_a_full_send_queue_is_counted_and_nothing_breaks);
    RUN_TEST(test_refused_setpoints_leave_no_gap_in_the_counter);
    RUN_TEST(test_options_that_make_no_sense_are_refused);
    RUN_TEST(test_a_description_out_of_range_is_refused_at_boot);
    RUN_TEST(test_a_feeder_tree_that_is_none_is_refused_at_boot);
    RUN_TEST(test_a_connector_that_falls_silent_stays_booked_by_its_measured_voltage);
    RUN_TEST(test_who_does_not_echo_is_told_less_at_once_however_long_setpoints_last);
    return UNITY_END();
}
