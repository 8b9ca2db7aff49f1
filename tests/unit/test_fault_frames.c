/* Frames that are wrong, old, too many or somebody else's: faults 6 to 10, 16 and 19 of docs/protocol.md. */
#include "fault_bench.h"
#include "unity.h"

#define LIMIT_KW 30.0

/** EVSE_STATUS lost for its timeout, and the control tick that judges it [ms]. */
#define LOST_ms (TAPER_EVSE_STATUS_TIMEOUT_ms + 1000u + 2u * LIVE_POLL_ms)
/** PLAN goes round in this time [ms]. */
#define PLAN_ROUND_ms 9000u

void setUp(void) {
    fault_start(4, LIMIT_KW);
}

void tearDown(void) {
    live_bench_end();
}

static taper_membus_faults_t status_of_node_1(void) {
    return (taper_membus_faults_t){
        .seed = 1, .id = taper_can_id(TAPER_MESSAGE_EVSE_STATUS, 1), .mask = TAPER_MEMBUS_MASK_ID};
}

/** Node 1 is offline for everybody to see, and the others have what it had. */
static void assert_node_1_is_off_and_others_charge(void) {
    live_bench_run_ms(PLAN_ROUND_ms);
    TEST_ASSERT_EQUAL(TAPER_REASON_OFFLINE, fault_reason(1));
    TEST_ASSERT_EQUAL_INT32(0, fault_setpoint(1).current_mA);
    TEST_ASSERT_DOUBLE_WITHIN(1.0, LIMIT_KW, live.field.tracker.drawn_kw - fault_drawn_kw(1));
    TEST_ASSERT_EQUAL_UINT(1, fault_events(TAPER_EVENT_CONNECTOR_LOST));
    TEST_ASSERT_EQUAL_UINT8(1, fault_last_event(TAPER_EVENT_CONNECTOR_LOST)->node);
    fault_assert_limits_held();
}

static void assert_node_1_comes_back(void) {
    fault_inject(NULL);
    fault_begins();
    TEST_ASSERT_LESS_OR_EQUAL_UINT32(LOST_ms, fault_wait_for(TAPER_EVENT_CONNECTOR_BACK, LOST_ms));
    live_bench_run_ms(FAULT_SWITCH_ms + PLAN_ROUND_ms);
    TEST_ASSERT_NOT_EQUAL(TAPER_REASON_OFFLINE, fault_reason(1));
    TEST_ASSERT_DOUBLE_WITHIN(1.0, LIMIT_KW, live.field.tracker.drawn_kw);
    fault_assert_limits_held();
}

static void test_row_6_a_corrupt_frame_now_and_then_is_dropped_counted_and_harms_nobody(void) {
    taper_membus_faults_t faults = {.seed = 3, .flip_permille = 30, .bits = 2};
    fault_inject(&faults);
    live_bench_run_ms(30000);
    TEST_ASSERT_GREATER_THAN_UINT32(50, fault.injector.counts.flipped);
    /* a flipped counter is found as a wrong sequence where the CRC happens to be good */
    TEST_ASSERT_UINT32_WITHIN(5, fault.injector.counts.flipped, fault_count(TAPER_COUNTER_CRC_ERRORS));
    TEST_ASSERT_EQUAL_UINT(0, fault_events(TAPER_EVENT_CONNECTOR_LOST));
    TEST_ASSERT_EQUAL_UINT(0, fault_events(TAPER_EVENT_GATEWAY_LOST));
    TEST_ASSERT_DOUBLE_WITHIN(1.0, LIMIT_KW, live.field.tracker.drawn_kw);
    fault_assert_limits_held();
}

static void test_row_6_a_node_with_more_than_two_bad_frames_in_five_is_lost_until_they_are_good(void) {
    taper_membus_faults_t faults = status_of_node_1();
    faults.flip_permille = 1000;
    faults.bits = 1;
    fault_inject(&faults);
    fault_wait_for(TAPER_EVENT_BAD_FRAMES, 1000);
    TEST_ASSERT_LESS_OR_EQUAL_UINT32(LOST_ms, fault_wait_for(TAPER_EVENT_CONNECTOR_LOST, LOST_ms));
    assert_node_1_is_off_and_others_charge();
    fault_assert_emcy(TAPER_EVENT_BAD_FRAMES, 1, 1);
    TEST_ASSERT_GREATER_THAN_UINT32(40, fault_count(TAPER_COUNTER_CRC_ERRORS));
    assert_node_1_comes_back();
    TEST_ASSERT_GREATER_THAN_UINT32(0, fault_count(TAPER_COUNTER_FRAMES_UNTRUSTED));
}

static void test_row_7_frames_that_arrive_twice_are_counted_and_used_once(void) {
    taper_membus_faults_t faults = {.seed = 1, .repeat_permille = 1000};
    fault_inject(&faults);
    live_bench_run_ms(10000);
    fault_inject(NULL);
    live_bench_run_ms(LIVE_POLL_ms); /* the last of them is taken */
    TEST_ASSERT_EQUAL_UINT32(fault.injector.counts.repeated, fault_count(TAPER_COUNTER_FRAMES_REPEATED) +
                                                                 fault_count(TAPER_COUNTER_FRAMES_BABBLED));
    TEST_ASSERT_EQUAL_UINT32(0, fault_count(TAPER_COUNTER_FRAMES_BABBLED));
    TEST_ASSERT_EQUAL_UINT(0, fault_events(TAPER_EVENT_CONNECTOR_LOST));
    TEST_ASSERT_DOUBLE_WITHIN(1.0, LIMIT_KW, live.field.tracker.drawn_kw);
    fault_assert_limits_held();
}

static void test_row_7_a_replayed_frame_is_no_sign_of_life(void) {
    const taper_frame_t last = fault.said[taper_can_id(TAPER_MESSAGE_EVSE_STATUS, 1)].frame;
    sim_field_kill(&live.field, 0);
    while (fault_events(TAPER_EVENT_CONNECTOR_LOST) == 0 && fault_passed_ms() < LOST_ms) {
        live_bench_run_ms(200);
        fault_say_frame(&last);
    }
    TEST_ASSERT_LESS_THAN_UINT32(LOST_ms, fault_passed_ms());
    for (int k = 0; k < 20; k++) {
        live_bench_run_ms(200);
        fault_say_frame(&last);
    }
    TEST_ASSERT_EQUAL_UINT(0, fault_events(TAPER_EVENT_CONNECTOR_BACK));
    TEST_ASSERT_GREATER_THAN_UINT32(20, fault_count(TAPER_COUNTER_FRAMES_REPEATED));
    assert_node_1_is_off_and_others_charge();
    sim_field_revive(&live.field, 0);
    assert_node_1_comes_back();
}

static void test_row_8_a_lost_frame_or_two_are_counted_and_the_next_is_used(void) {
    taper_membus_faults_t faults = status_of_node_1();
    faults.drop_permille = 200;
    fault_inject(&faults);
    live_bench_run_ms(20000);
    TEST_ASSERT_GREATER_THAN_UINT32(10, fault_count(TAPER_COUNTER_FRAMES_LOST));
    TEST_ASSERT_EQUAL_UINT(0, fault_events(TAPER_EVENT_CONNECTOR_LOST));
    TEST_ASSERT_DOUBLE_WITHIN(1.0, LIMIT_KW, live.field.tracker.drawn_kw);
    fault_assert_limits_held();
}

static void test_row_8_after_more_than_three_lost_frames_the_station_resynchronises(void) {
    taper_membus_faults_t faults = status_of_node_1();
    faults.drop_permille = 1000;
    fault_inject(&faults);
    live_bench_run_ms(600);
    fault_inject(NULL);
    live_bench_run_ms(400);
    TEST_ASSERT_EQUAL_UINT32(1, fault_count(TAPER_COUNTER_FRAMES_LOST));
    live_bench_run_ms(5000);
    TEST_ASSERT_EQUAL_UINT32(1, fault_count(TAPER_COUNTER_FRAMES_LOST));
    TEST_ASSERT_EQUAL_UINT(0, fault_events(TAPER_EVENT_CONNECTOR_LOST));
    fault_assert_limits_held();
}

static void test_row_9_frames_of_another_node_are_bad_frames_and_emcy_tells_it(void) {
    const uint16_t id = taper_can_id(TAPER_MESSAGE_EVSE_STATUS, 1);
    while (fault_passed_ms() < 5000) {
        taper_frame_t frame = fault.said[taper_can_id(TAPER_MESSAGE_EVSE_STATUS, 2)].frame;
        frame.id = id;
        fault_say_frame(&frame);
        live_bench_run_ms(60);
    }
    TEST_ASSERT_GREATER_THAN_UINT32(40, fault_count(TAPER_COUNTER_CRC_ERRORS));
    TEST_ASSERT_EQUAL_UINT8(1, fault_last_event(TAPER_EVENT_BAD_FRAMES)->node);
    fault_assert_emcy(TAPER_EVENT_BAD_FRAMES, 1, 1);
    TEST_ASSERT_GREATER_THAN_UINT(0,
                                  fault_events(TAPER_EVENT_CONNECTOR_LOST)); /* two of three frames are bad */
    fault_assert_limits_held();
    assert_node_1_comes_back();
    live_bench_run_ms(3000);
    fault_begins();
    live_bench_run_ms(3000);
    fault_assert_no_emcy();
}

static void test_row_9_whatever_identifiers_a_node_takes_its_frames_are_used_by_nobody(void) {
    taper_membus_faults_t faults = {
        .seed = 5, .id = 1, .mask = TAPER_MEMBUS_MASK_NODE, .masquerade_permille = 1000, .bits = 1};
    fault_inject(&faults);
    TEST_ASSERT_LESS_OR_EQUAL_UINT32(LOST_ms, fault_wait_for(TAPER_EVENT_CONNECTOR_LOST, LOST_ms));
    assert_node_1_is_off_and_others_charge();
    assert_node_1_comes_back();
}

static void test_row_10_frames_held_up_on_the_way_count_as_missing(void) {
    taper_membus_faults_t faults = status_of_node_1();
    faults.delay_permille = 1000;
    faults.delay_ms = 5000;
    fault_inject(&faults);
    TEST_ASSERT_LESS_OR_EQUAL_UINT32(LOST_ms, fault_wait_for(TAPER_EVENT_CONNECTOR_LOST, LOST_ms));
    fault_assert_limits_held();
    assert_node_1_comes_back();
}

static void test_row_10_late_echoes_never_let_the_sum_exceed_the_limit(void) {
    taper_membus_faults_t faults = {.seed = 1,
                                    .id = taper_can_id(TAPER_MESSAGE_EVSE_STATUS, 1),
                                    .mask = TAPER_MEMBUS_MASK_FUNCTION,
                                    .delay_permille = 500,
                                    .delay_ms = 400,
                                    .reorder_permille = 200,
                                    .drop_permille = 100};
    fault_inject(&faults);
    for (unsigned k = 0; k < 20; k++) { /* room is handed over and back */
        sim_field_power_off(&live.field, k % 4);
        live_bench_run_ms(3000);
        sim_field_revive(&live.field, k % 4);
        live_bench_run_ms(9000);
    }
    TEST_ASSERT_GREATER_THAN_UINT32(100, fault.injector.counts.delayed);
    fault_assert_limits_held();
}

/** Node 1 floods the bus with `frame`: it is off within two seconds and a tick, and back when it is quiet. */
static void assert_babbling_is_stopped(const taper_frame_t *frame, uint32_t per_ms, bool is_garbage) {
    const taper_membus_faults_t none = {.seed = 9};
    fault_inject(&none);
    taper_membus_flood(&live.bus, frame, per_ms, is_garbage);
    const uint32_t seen_ms = fault_wait_for(TAPER_EVENT_BABBLING, 1500);
    TEST_ASSERT_GREATER_THAN_UINT32(1000, seen_ms); /* more than a second of it */
    TEST_ASSERT_EQUAL_UINT8(1, fault_last_event(TAPER_EVENT_BABBLING)->node);
    if (fault_events(TAPER_EVENT_CONNECTOR_LOST) == 0) { /* garbage may have made it untrusted before */
        fault_wait_for(TAPER_EVENT_CONNECTOR_LOST, seen_ms + LOST_ms);
    }
    assert_node_1_is_off_and_others_charge();
    fault_assert_emcy(TAPER_EVENT_BABBLING, 1, 2);
    TEST_ASSERT_GREATER_THAN_UINT32(5000, fault_count(TAPER_COUNTER_FRAMES_BABBLED));
    assert_node_1_comes_back();
}

static void test_row_16_a_node_that_repeats_itself_without_end_is_dropped_until_it_is_quiet(void) {
    const taper_frame_t frame = fault.said[taper_can_id(TAPER_MESSAGE_EVSE_STATUS, 1)].frame;
    assert_babbling_is_stopped(&frame, 1, false);
}

static void test_row_16_a_node_that_fills_the_bus_with_garbage_is_dropped_until_it_is_quiet(void) {
    const taper_frame_t frame = {.id = taper_can_id(TAPER_MESSAGE_EVSE_ELEC, 1), .length = 8};
    assert_babbling_is_stopped(&frame, 4, true);
}

static void test_row_16_a_gateway_that_babbles_is_lost_and_the_failsafe_limit_holds(void) {
    const taper_membus_faults_t none = {.seed = 9};
    const taper_frame_t frame = fault.said[taper_can_id(TAPER_MESSAGE_SITE_LIMIT, TAPER_NODE_GATEWAY)].frame;
    fault_inject(&none);
    taper_membus_flood(&live.bus, &frame, 1, false);
    fault_wait_for(TAPER_EVENT_BABBLING, 1500);
    fault_wait_for(TAPER_EVENT_GATEWAY_LOST, 1500 + TAPER_SITE_LIMIT_TIMEOUT_ms + 1000);
    fault_assert_emcy(TAPER_EVENT_BABBLING, TAPER_NODE_GATEWAY, 2);
    TEST_ASSERT_EQUAL_INT32(11000, taper_station_site_limit_W(&live.station));
    fault_inject(NULL);
    fault_begins();
    fault_wait_for(TAPER_EVENT_GATEWAY_BACK, 4000);
    TEST_ASSERT_EQUAL_UINT(0, fault_events(TAPER_EVENT_CONNECTOR_LOST));
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_row_6_a_corrupt_frame_now_and_then_is_dropped_counted_and_harms_nobody);
    RUN_TEST(test_row_6_a_node_with_more_than_two_bad_frames_in_five_is_lost_until_they_are_good);
    RUN_TEST(test_row_7_frames_that_arrive_twice_are_counted_and_used_once);
    RUN_TEST(test_row_7_a_replayed_frame_is_no_sign_of_life);
    RUN_TEST(test_row_8_a_lost_frame_or_two_are_counted_and_the_next_is_used);
    RUN_TEST(test_row_8_after_more_than_three_lost_frames_the_station_resynchronises);
    RUN_TEST(test_row_9_frames_of_another_node_are_bad_frames_and_emcy_tells_it);
    RUN_TEST(test_row_9_whatever_identifiers_a_node_takes_its_frames_are_used_by_nobody);
    RUN_TEST(test_row_10_frames_held_up_on_the_way_count_as_missing);
    RUN_TEST(test_row_10_late_echoes_never_let_the_sum_exceed_the_limit);
    RUN_TEST(test_row_16_a_node_that_repeats_itself_without_end_is_dropped_until_it_is_quiet);
    RUN_TEST(test_row_16_a_node_that_fills_the_bus_with_garbage_is_dropped_until_it_is_quiet);
    RUN_TEST(test_row_16_a_gateway_that_babbles_is_lost_and_the_failsafe_limit_holds);
    return UNITY_END();
}
