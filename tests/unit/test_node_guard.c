/* A node that babbles (docs/protocol.md, fault 16), when the port's times are not in order. */
#include <string.h>

#include "station_bench.h"
#include "unity.h"

#define NODE         3
#define STATUS_CYCLE 200u

void setUp(void) {
    const taper_station_options_t options = bench_options();
    bench_start(&options);
    bench_send_all(NODE, 50000);
    bench_step();
}

void tearDown(void) {}

/** Ten frames in every 10 ms, whose times go back by a millisecond each, for `seconds`. */
static void babble(unsigned seconds) {
    const uint32_t end_ms = bench.now_ms + seconds * 1000u;
    while (bench.now_ms < end_ms) {
        const uint32_t now_ms = bench.now_ms;
        for (unsigned k = 0; k < 10; k++) {
            bench.now_ms = now_ms - k;
            bench_send_status(NODE, true);
        }
        bench.now_ms = now_ms;
        bench_poll(10);
    }
}

static void test_times_that_go_back_do_not_hide_a_node_that_babbles(void) {
    babble(2);
    TEST_ASSERT_EQUAL(1, bench_events(TAPER_EVENT_BABBLING));
    TEST_ASSERT_GREATER_THAN(1800, taper_station_counter(&bench.station, TAPER_COUNTER_FRAMES_BABBLED));
}

static void test_times_that_go_back_do_not_make_a_node_babble(void) {
    for (unsigned k = 0; k < 50; k++) {
        bench.now_ms += STATUS_CYCLE - 1;
        bench_send_status(NODE, true);
        bench.now_ms -= 1;
        bench_send_vehicle(NODE, 7, 500);
        bench_poll(1);
    }
    TEST_ASSERT_EQUAL(0, bench_events(TAPER_EVENT_BABBLING));
    TEST_ASSERT_EQUAL(0, taper_station_counter(&bench.station, TAPER_COUNTER_FRAMES_BABBLED));
}

static void test_a_node_with_several_lasting_conditions_does_not_fill_the_log(void) {
    taper_message_t message = {.kind = TAPER_MESSAGE_EMCY, .node = NODE};
    for (unsigned second = 0; second < 30; second++) {
        for (uint16_t code = 1; code <= 6; code++) { /* as EMCY is repeated */
            message.as.emcy = (taper_emcy_t){.severity = TAPER_SEVERITY_FAULT, .code = code};
            bench_send(&message);
        }
        bench_poll(1000);
    }
    TEST_ASSERT_EQUAL_UINT(TAPER_EMCYS_OF_NODE, bench_events(TAPER_EVENT_EMCY_HEARD));
    bench.now_ms += 60000;
    bench_send(&message); /* what is new, or lasts, is told again after a minute */
    bench_poll(1000);
    TEST_ASSERT_EQUAL_UINT(TAPER_EMCYS_OF_NODE + 1, bench_events(TAPER_EVENT_EMCY_HEARD));
}

static void test_a_node_that_comes_back_after_a_turn_of_the_clock_is_heard(void) {
    const uint32_t gone_ms = bench.now_ms;
    bench_send_status(NODE, true);
    bench_step();
    bench.now_ms = gone_ms - 30000u; /* 49.7 days later, less 30 s */
    bench_step();
    bench_send_status(NODE, true);
    bench_step();
    TEST_ASSERT_TRUE(taper_session_is_online(&bench.station.sessions, NODE - 1, bench.now_ms - 1000u));
}

static void test_frames_that_are_bad_now_and_then_do_not_fill_the_log(void) {
    for (unsigned k = 0; k < 150; k++) { /* three bad, four good: the node is lost, and is back */
        taper_frame_t frame = {.id = TAPER_MESSAGE_EVSE_ELEC << 6 | NODE, .length = TAPER_FRAME_LENGTH};
        taper_e2e_protect(&frame, (uint8_t)k);
        frame.data[7] ^= k % 7 < 3 ? 0x55u : 0u;
        taper_membus_set_time(&bench.bus, bench.now_ms);
        TEST_ASSERT_TRUE(taper_membus_world_send(&bench.bus, &frame));
        bench_poll(200);
    }
    TEST_ASSERT_EQUAL_UINT(1, bench_events(TAPER_EVENT_BAD_FRAMES));
}

static void test_transfers_that_are_refused_again_and_again_do_not_fill_the_log(void) {
    const taper_frame_t garbage = {.id = TAPER_MESSAGE_ISOTP_FROM << 6 | TAPER_NODE_GATEWAY,
                                   .length = TAPER_FRAME_LENGTH,
                                   .data = {4, 0xDE, 0xAD, 0xBE, 0xEF}};
    for (unsigned k = 0; k < 90; k++) {
        taper_membus_set_time(&bench.bus, bench.now_ms);
        TEST_ASSERT_TRUE(taper_membus_world_send(&bench.bus, &garbage));
        bench_poll(1000);
    }
    TEST_ASSERT_GREATER_OR_EQUAL_UINT32(
        90, taper_station_counter(&bench.station, TAPER_COUNTER_TRANSFERS_REFUSED));
    TEST_ASSERT_EQUAL_UINT(2, bench_events(TAPER_EVENT_TRANSFER_REFUSED));
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_times_that_go_back_do_not_hide_a_node_that_babbles);
    RUN_TEST(test_times_that_go_back_do_not_make_a_node_babble);
    RUN_TEST(test_a_node_with_several_lasting_conditions_does_not_fill_the_log);
    RUN_TEST(test_a_node_that_comes_back_after_a_turn_of_the_clock_is_heard);
    RUN_TEST(test_frames_that_are_bad_now_and_then_do_not_fill_the_log);
    RUN_TEST(test_transfers_that_are_refused_again_and_again_do_not_fill_the_log);
    return UNITY_END();
}
