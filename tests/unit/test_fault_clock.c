/* A wall clock that jumps, or was never set, and frames of another time: faults 10 and 26 to 28 of docs/protocol.md. */
#include <string.h>

#include "station_bench.h"
#include "unity.h"

#define HOUR_s 3600

/** The wall clock is ahead of the bench's own by this [s]. */
static int32_t ahead_s;
static uint8_t quality;

/** Clock, limit, two vehicles; then a tick. Departures are told by the bench's own clock: 120 min after 600 000 s. */
static void tick(void) {
    taper_message_t message = {.kind = TAPER_MESSAGE_TIME_SYNC, .node = TAPER_NODE_GATEWAY};
    message.as.time_sync = (taper_time_sync_t){
        .unix_s = (uint32_t)(600000 + (int32_t)(bench.now_ms / 1000) + ahead_s), .quality = quality};
    bench_send(&message);
    bench_send_limit(50000);
    for (uint8_t node = 1; node <= 8; node++) {
        bench_send_status(node, node <= 2);
    }
    bench_send_vehicle(1, 7, 500);
    bench_send_vehicle(2, 8, 600);
    bench_step();
}

static void start(uint8_t with_quality) {
    const taper_station_options_t options = bench_options();
    bench_start(&options);
    ahead_s = 0;
    quality = with_quality;
    for (int k = 0; k < 5; k++) {
        tick();
    }
}

void setUp(void) {
    start(1);
}
void tearDown(void) {}

static const taper_event_t *last_event(void) {
    const taper_event_log_t *log = taper_station_events(&bench.station);
    return &log->event[(log->count - 1) % TAPER_EVENTS];
}

/** The clock jumps by `jump_s`: what control does is as before, tick by tick, and departures follow the new clock. */
static void assert_a_jump_moves_departures_only(int32_t jump_s) {
    const uint32_t setpoints = bench.setpoints;
    const taper_setpoint_t before = bench_setpoint_for(1);
    const int32_t departs_in_s = bench.station.snapshot.demand[0].departs_in_s;
    const uint32_t revision = bench.station.sessions.revision;
    ahead_s += jump_s;
    tick();
    TEST_ASSERT_EQUAL_INT32(departs_in_s - 1 - jump_s, bench.station.snapshot.demand[0].departs_in_s);
    TEST_ASSERT_GREATER_THAN_UINT32(revision, bench.station.sessions.revision); /* the planner thinks again */
    TEST_ASSERT_EQUAL_UINT8(TAPER_EVENT_CLOCK_SET, last_event()->code);
    TEST_ASSERT_EQUAL_INT32(jump_s, last_event()->data);
    TEST_ASSERT_EQUAL_UINT32(1, taper_station_counter(&bench.station, TAPER_COUNTER_CLOCK_JUMPS));
    for (int k = 0; k < 9; k++) {
        tick();
    }
    TEST_ASSERT_EQUAL_UINT32(setpoints + 10 * 8, bench.setpoints);
    TEST_ASSERT_EQUAL_MEMORY(&before, &bench.setpoint[1], sizeof before);
    TEST_ASSERT_EQUAL(TAPER_MODE_FALLBACK, taper_station_mode(&bench.station));
    TEST_ASSERT_EQUAL_UINT(0, bench_events(TAPER_EVENT_CONNECTOR_LOST));
    TEST_ASSERT_EQUAL_UINT(0, bench_events(TAPER_EVENT_GATEWAY_LOST));
    TEST_ASSERT_EQUAL_UINT32(1, taper_station_counter(&bench.station, TAPER_COUNTER_CLOCK_JUMPS)); /* once */
}

static void test_row_26_a_clock_that_jumps_ahead_by_an_hour_moves_departures_and_nothing_else(void) {
    assert_a_jump_moves_departures_only(HOUR_s);
}

static void test_row_27_a_clock_that_jumps_back_by_an_hour_moves_departures_and_nothing_else(void) {
    assert_a_jump_moves_departures_only(-HOUR_s);
}

static void test_row_26_drift_of_some_seconds_is_no_jump(void) {
    const uint32_t revision = bench.station.sessions.revision;
    ahead_s += TAPER_CLOCK_JUMP_s;
    tick();
    TEST_ASSERT_EQUAL_UINT32(revision, bench.station.sessions.revision);
    TEST_ASSERT_EQUAL_UINT32(0, taper_station_counter(&bench.station, TAPER_COUNTER_CLOCK_JUMPS));
    ahead_s += TAPER_CLOCK_JUMP_s + 1;
    tick();
    TEST_ASSERT_EQUAL_UINT32(1, taper_station_counter(&bench.station, TAPER_COUNTER_CLOCK_JUMPS));
}

static void test_row_27_timeouts_run_on_while_the_clock_goes_back(void) {
    ahead_s = -HOUR_s;
    tick();
    for (int k = 0; k < 7; k++) { /* everybody falls silent */
        bench_step();
    }
    TEST_ASSERT_EQUAL(TAPER_MODE_FAILSAFE, taper_station_mode(&bench.station));
    TEST_ASSERT_EQUAL_UINT(8, bench_events(TAPER_EVENT_CONNECTOR_LOST));
    TEST_ASSERT_EQUAL_INT32(0, bench_setpoint_for(1).current_mA);
}

static void test_row_28_without_a_clock_deadlines_count_from_plug_in(void) {
    start(0);
    TEST_ASSERT_EQUAL_INT32(TAPER_DEFAULT_STAY_s - 4, bench.station.snapshot.demand[0].departs_in_s);
    TEST_ASSERT_GREATER_THAN_INT32(0, bench_setpoint_for(1).current_mA);
    TEST_ASSERT_EQUAL_UINT(0, bench_events(TAPER_EVENT_CLOCK_SET));
    TEST_ASSERT_EQUAL_UINT32(0, last_event()->unix_s); /* no clock: events have no wall time */
    quality = 1;
    tick();
    TEST_ASSERT_EQUAL_INT32(7200 - 6,
                            bench.station.snapshot.demand[0].departs_in_s); /* as the vehicle told */
    TEST_ASSERT_EQUAL_UINT(1, bench_events(TAPER_EVENT_CLOCK_SET));
    quality = 0; /* a gateway that lost its own clock does not take ours away */
    tick();
    TEST_ASSERT_EQUAL_INT32(7200 - 7, bench.station.snapshot.demand[0].departs_in_s);
}

static void test_row_10_frames_that_waited_too_long_in_a_queue_are_no_sign_of_life(void) {
    bench_send_status(1, true);
    bench_send_vehicle(1, 7, 500);
    bench.now_ms += TAPER_EVSE_STATUS_TIMEOUT_ms + 1; /* nobody took them out */
    bench_send_limit(50000);
    for (uint8_t node = 2; node <= 8; node++) {
        bench_send_status(node, node == 2);
    }
    bench_send_vehicle(2, 8, 600);
    bench_step();
    TEST_ASSERT_EQUAL(TAPER_REASON_OFFLINE, taper_station_reason(&bench.station, 0));
    TEST_ASSERT_EQUAL_UINT(1, bench_events(TAPER_EVENT_CONNECTOR_LOST));
    TEST_ASSERT_EQUAL_INT32(0, bench_setpoint_for(1).current_mA);
    TEST_ASSERT_GREATER_THAN_INT32(0, bench_setpoint_for(2).current_mA);
    tick();
    TEST_ASSERT_EQUAL_UINT(1, bench_events(TAPER_EVENT_CONNECTOR_BACK));
}

static void test_row_10_a_limit_that_waited_too_long_in_a_queue_does_not_hold(void) {
    bench_send_limit(50000);
    bench.now_ms += TAPER_SITE_LIMIT_TIMEOUT_ms + 1;
    bench_step();
    TEST_ASSERT_EQUAL(TAPER_MODE_FAILSAFE, taper_station_mode(&bench.station));
    TEST_ASSERT_EQUAL_INT32(11000, taper_station_site_limit_W(&bench.station));
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_row_26_a_clock_that_jumps_ahead_by_an_hour_moves_departures_and_nothing_else);
    RUN_TEST(test_row_27_a_clock_that_jumps_back_by_an_hour_moves_departures_and_nothing_else);
    RUN_TEST(test_row_26_drift_of_some_seconds_is_no_jump);
    RUN_TEST(test_row_27_timeouts_run_on_while_the_clock_goes_back);
    RUN_TEST(test_row_28_without_a_clock_deadlines_count_from_plug_in);
    RUN_TEST(test_row_10_frames_that_waited_too_long_in_a_queue_are_no_sign_of_life);
    RUN_TEST(test_row_10_a_limit_that_waited_too_long_in_a_queue_does_not_hold);
    return UNITY_END();
}
