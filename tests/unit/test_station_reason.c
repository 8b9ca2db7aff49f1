/* Why each connector has the current that it has, as taper_station_reason() and PLAN tell it. */
#include <string.h>

#include "station_bench.h"
#include "taper/codec.h"
#include "unity.h"

static taper_station_config_t config;
static taper_group_config_t groups[3];
static taper_connector_config_t connectors[8];

void setUp(void) {
    taper_station_options_t options = bench_options();
    config = *options.config;
    memcpy(groups, config.groups, sizeof groups);
    memcpy(connectors, config.connectors, sizeof connectors);
    config.groups = groups;
    config.connectors = connectors;
    options.config = &config;
    bench_start(&options);
}
void tearDown(void) {}

static void tick(uint8_t vehicles, int32_t limit_W) {
    bench_send_all(vehicles, limit_W);
    bench_step();
}

static void assert_reason(taper_reason_t reason, uint8_t node) {
    TEST_ASSERT_EQUAL(reason, taper_station_reason(&bench.station, (uint8_t)(node - 1)));
}

static void test_a_battery_that_takes_no_more_is_the_vehicles_limit(void) {
    tick(1, 50000); /* 8 kW by its taper, of 11 kW that the current would carry */
    assert_reason(TAPER_REASON_VEHICLE_LIMIT, 1);
    assert_reason(TAPER_REASON_NO_VEHICLE, 2);
}

static void test_a_connector_that_gives_all_it_can_is_its_own_limit(void) {
    connectors[0].max_mA = 10000;
    tick(1, 50000);
    assert_reason(TAPER_REASON_CONNECTOR_LIMIT, 1);
}

static void test_a_site_limit_that_leaves_no_more_is_told(void) {
    tick(1, 6000);
    assert_reason(TAPER_REASON_SITE_LIMIT, 1);
}

static void test_a_feeder_that_leaves_no_more_is_told_to_those_on_it(void) {
    groups[1].limit_W = 6000;
    tick(5, 50000); /* 1..4 on the first feeder, 5 on the second */
    assert_reason(TAPER_REASON_FEEDER_LIMIT, 1);
    assert_reason(TAPER_REASON_VEHICLE_LIMIT, 5);
}

static void test_without_room_for_its_minimum_a_vehicle_waits(void) {
    tick(2, 8200); /* twice the minimum is 8280 W */
    assert_reason(TAPER_REASON_VEHICLE_LIMIT, 1);
    assert_reason(TAPER_REASON_WAITING, 2);
}

static void test_at_a_limit_of_zero_the_grid_pauses_it(void) {
    tick(1, 0);
    assert_reason(TAPER_REASON_GRID_PAUSE, 1);
    TEST_ASSERT_EQUAL_INT32(0, bench_setpoint_for(1).current_mA);
}

static void test_a_vehicle_whose_current_others_have_yet_to_give_up_sees_a_hand_over(void) {
    config.min_off_ms = config.min_on_ms = 0;
    tick(1, 9000);
    tick(2, 9000);
    TEST_ASSERT_EQUAL_INT32(0, bench_setpoint_for(2).current_mA);
    bench_send_clock(); /* vehicle 1 is done, but its connector has not echoed the lower setpoint yet */
    bench_send_limit(9000);
    for (uint8_t node = 1; node <= 8; node++) {
        bench_send_status(node, node <= 2);
    }
    bench_send_vehicle(2, 7, 500);
    taper_message_t message = {.kind = TAPER_MESSAGE_EV_STATUS, .node = 1};
    message.as.ev_status = (taper_ev_status_t){
        .soc_permille = 500, .soc_age_s = 0, .max_mA = 16000, .complete = true, .ready = true};
    bench_send(&message);
    bench_step();
    assert_reason(TAPER_REASON_COMPLETE, 1);
    assert_reason(TAPER_REASON_HAND_OVER, 2);
    TEST_ASSERT_TRUE(taper_station_hands_over(&bench.station));
    bench_send_status(1, true);
    bench_poll(0);
    assert_reason(TAPER_REASON_VEHICLE_LIMIT, 2);
    TEST_ASSERT_FALSE(taper_station_hands_over(&bench.station));
}

static void test_a_vehicle_that_shares_with_others_is_planned(void) {
    tick(1, 50000);
    bench.station.target.current_mA[0] = 8000; /* as if a policy had wished for less */
    bench.station.setpoints.current_mA[0] = 8000;
    assert_reason(TAPER_REASON_PLANNED, 1);
}

static void test_a_station_that_starts_or_stops_says_that_it_is_not_the_vehicle(void) {
    bench_send_status(1, true);
    bench_send_vehicle(1, 7, 500);
    bench_step();
    assert_reason(TAPER_REASON_STATION, 1); /* no limit heard yet */
    tick(1, 50000);
    assert_reason(TAPER_REASON_VEHICLE_LIMIT, 1);
    taper_station_stop(&bench.station, bench.now_ms);
    assert_reason(TAPER_REASON_STATION, 1);
}

static void test_a_silent_connector_is_offline(void) {
    tick(1, 50000);
    bench_step();
    bench_step();
    assert_reason(TAPER_REASON_OFFLINE, 1);
}

static void test_plan_tells_the_reason_on_the_bus_and_every_connector_has_its_turn_in_8_s(void) {
    bool told[9] = {false};
    taper_frame_t frame;
    taper_message_t message;
    bool bad_field = false;
    bench.deaf = true;
    for (int k = 0; k < 8; k++) {
        tick(2, 8200);
    }
    while (taper_membus_world_receive(&bench.bus, &frame)) {
        if (frame.id >> 6 == TAPER_MESSAGE_OUTLOOK && taper_decode(&frame, &message, &bad_field)) {
            told[message.node] = true;
            TEST_ASSERT_EQUAL(message.node == 1   ? TAPER_REASON_VEHICLE_LIMIT
                              : message.node == 2 ? TAPER_REASON_WAITING
                                                  : TAPER_REASON_NO_VEHICLE,
                              message.as.outlook.reason);
        }
    }
    for (uint8_t node = 1; node <= 8; node++) {
        TEST_ASSERT_TRUE(told[node]);
    }
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_a_battery_that_takes_no_more_is_the_vehicles_limit);
    RUN_TEST(test_a_connector_that_gives_all_it_can_is_its_own_limit);
    RUN_TEST(test_a_site_limit_that_leaves_no_more_is_told);
    RUN_TEST(test_a_feeder_that_leaves_no_more_is_told_to_those_on_it);
    RUN_TEST(test_without_room_for_its_minimum_a_vehicle_waits);
    RUN_TEST(test_at_a_limit_of_zero_the_grid_pauses_it);
    RUN_TEST(test_a_vehicle_whose_current_others_have_yet_to_give_up_sees_a_hand_over);
    RUN_TEST(test_a_vehicle_that_shares_with_others_is_planned);
    RUN_TEST(test_a_station_that_starts_or_stops_says_that_it_is_not_the_vehicle);
    RUN_TEST(test_a_silent_connector_is_offline);
    RUN_TEST(test_plan_tells_the_reason_on_the_bus_and_every_connector_has_its_turn_in_8_s);
    return UNITY_END();
}
