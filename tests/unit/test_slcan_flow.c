/* Frames through the adapter: order, full queues, streams that take a byte at a time, extended frames in their place. */
#include <stdio.h>
#include <string.h>

#include "pipe_bench.h"
#include "taper/slcan.h"
#include "unity.h"

static pipe_bench_t wire;
static taper_slcan_t slcan;
static taper_port_t port;

void setUp(void) {
    pipe_bench_init(&wire);
    const taper_stream_t stream = pipe_bench_stream(&wire);
    taper_slcan_init(&slcan, &stream);
    port = taper_slcan_port(&slcan);
    pipe_bench_say(&wire, "O\r");
    taper_slcan_pump(&slcan, 0);
    TEST_ASSERT_EQUAL_STRING("\r", pipe_bench_heard(&wire));
}

void tearDown(void) {}

/** The station sends a frame with a number. */
static bool send_numbered(unsigned n) {
    const taper_frame_t frame = {.id = 0x123, .length = 2, .data = {(uint8_t)(n >> 8), (uint8_t)n}};
    return port.send(port.context, &frame);
}

static void say_numbered(unsigned n) {
    char line[20];
    snprintf(line, sizeof line, "t1232%04X\r", n);
    pipe_bench_say(&wire, line);
}

static void assert_received_numbered(unsigned n) {
    taper_frame_t frame;
    TEST_ASSERT_TRUE(port.receive(port.context, &frame));
    TEST_ASSERT_EQUAL_HEX16(0x123, frame.id);
    TEST_ASSERT_EQUAL_UINT8(2, frame.length);
    TEST_ASSERT_EQUAL_UINT(n, (unsigned)frame.data[0] << 8 | frame.data[1]);
}

static void assert_nothing_received(void) {
    taper_frame_t frame;
    TEST_ASSERT_FALSE(port.receive(port.context, &frame));
}

static void test_a_frame_arrives_with_all_its_fields_and_the_time_of_its_pump(void) {
    static const uint8_t data[TAPER_FRAME_LENGTH] = {0x01, 0x23, 0x45, 0x67, 0x89, 0xAB, 0xCD, 0xEF};
    taper_frame_t frame;
    pipe_bench_say(&wire, "t7fe80123456789abCDEF\r");
    taper_slcan_pump(&slcan, 0xFFFFFFFFu);
    pipe_bench_say(&wire, "t0000\r");
    taper_slcan_pump(&slcan, 5);
    TEST_ASSERT_TRUE(port.receive(port.context, &frame));
    TEST_ASSERT_EQUAL_HEX16(0x7FE, frame.id);
    TEST_ASSERT_EQUAL_UINT8(0, frame.bus);
    TEST_ASSERT_EQUAL_UINT8(8, frame.length);
    TEST_ASSERT_EQUAL_HEX8_ARRAY(data, frame.data, TAPER_FRAME_LENGTH);
    TEST_ASSERT_EQUAL_UINT32(0xFFFFFFFFu, frame.time_ms);
    TEST_ASSERT_TRUE(port.receive(port.context, &frame));
    TEST_ASSERT_EQUAL_UINT8(0, frame.length);
    TEST_ASSERT_EQUAL_UINT32(5, frame.time_ms);
    assert_nothing_received();
}

static void test_a_frame_leaves_with_all_its_fields_when_it_is_pumped(void) {
    const taper_frame_t frame = {
        .id = 0x7FE, .length = 8, .data = {0x01, 0x23, 0x45, 0x67, 0x89, 0xAB, 0xCD, 0xEF}};
    TEST_ASSERT_TRUE(port.send(port.context, &frame));
    TEST_ASSERT_FALSE(taper_slcan_is_drained(&slcan));
    taper_slcan_pump(&slcan, 0);
    TEST_ASSERT_EQUAL_STRING("t7FE80123456789ABCDEF\r", pipe_bench_heard(&wire));
    TEST_ASSERT_TRUE(taper_slcan_is_drained(&slcan));
}

static void test_frames_that_no_bus_carries_are_not_taken(void) {
    static const taper_frame_t bad[] = {{.id = 0x800}, {.id = 1, .length = 9}, {.id = 1, .bus = 1}};
    for (unsigned i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        TEST_ASSERT_FALSE(port.send(port.context, &bad[i]));
    }
    TEST_ASSERT_TRUE(taper_slcan_is_drained(&slcan));
}

static void test_frames_with_the_same_identifier_keep_their_order_both_ways(void) {
    for (unsigned n = 0; n < 200; n++) {
        say_numbered(n);
        TEST_ASSERT_TRUE(send_numbered(n));
    }
    taper_slcan_pump(&slcan, 0);
    const char *at = pipe_bench_heard(&wire);
    for (unsigned n = 0; n < 200; n++) {
        char line[20];
        assert_received_numbered(n);
        snprintf(line, sizeof line, "t1232%04X\r", n);
        at = strstr(at, line); /* answers to the frames of the other direction lie between */
        TEST_ASSERT_NOT_NULL_MESSAGE(at, line);
    }
    assert_nothing_received();
}

static void test_a_full_receive_queue_drops_the_oldest_and_counts_it(void) {
    const unsigned count = TAPER_SLCAN_RECEIVE_DEPTH + 7;
    for (unsigned n = 0; n < count; n++) {
        say_numbered(n);
        taper_slcan_pump(&slcan, 0);
    }
    TEST_ASSERT_EQUAL_UINT32(7, port.receive_overflows(port.context));
    for (unsigned n = 7; n < count; n++) {
        assert_received_numbered(n);
    }
    assert_nothing_received();
}

static void test_the_counts_do_not_wrap(void) {
    slcan.overflows = UINT32_MAX;
    slcan.bad_lines = UINT32_MAX;
    slcan.opens = UINT32_MAX;
    slcan.receive_head = slcan.receive_tail + TAPER_SLCAN_RECEIVE_DEPTH;
    pipe_bench_say(&wire, "t1230\rX\rC\rO\r");
    taper_slcan_pump(&slcan, 0);
    TEST_ASSERT_EQUAL_UINT32(UINT32_MAX, port.receive_overflows(port.context));
    TEST_ASSERT_EQUAL_UINT32(UINT32_MAX, slcan.bad_lines);
    TEST_ASSERT_EQUAL_UINT32(UINT32_MAX, slcan.opens);
}

static void test_a_full_send_queue_refuses_and_loses_nothing_that_it_took(void) {
    char expected[20];
    wire.write_room = 0;
    for (unsigned n = 0; n < TAPER_SLCAN_SEND_DEPTH; n++) {
        TEST_ASSERT_TRUE(send_numbered(n));
    }
    TEST_ASSERT_FALSE(send_numbered(0xFFFF));
    wire.write_room = SIZE_MAX;
    taper_slcan_pump(&slcan, 0);
    const char *at = pipe_bench_heard(&wire);
    for (unsigned n = 0; n < TAPER_SLCAN_SEND_DEPTH; n++, at += 10) {
        snprintf(expected, sizeof expected, "t1232%04X\r", n);
        TEST_ASSERT_EQUAL_MEMORY(expected, at, 10);
    }
    TEST_ASSERT_EQUAL_STRING("", at);
    TEST_ASSERT_TRUE(send_numbered(1));
}

static void test_order_is_kept_where_the_indices_wrap(void) {
    slcan.receive_head = slcan.receive_tail = UINT32_MAX - 2;
    slcan.send_head = slcan.send_tail = UINT32_MAX - 2;
    for (unsigned n = 0; n < 8; n++) {
        say_numbered(n);
        TEST_ASSERT_TRUE(send_numbered(n));
    }
    TEST_ASSERT_FALSE(taper_slcan_is_drained(&slcan));
    taper_slcan_pump(&slcan, 0);
    for (unsigned n = 0; n < 8; n++) {
        assert_received_numbered(n);
    }
    const char *heard = pipe_bench_heard(&wire);
    TEST_ASSERT_EQUAL_MEMORY("t12320000\r", heard, 10);
    TEST_ASSERT_NOT_NULL(strstr(heard, "t12320007\r"));
}

/** What the station's frames and the answers to some lines look like, if the stream takes it all at once. */
static void play(void) {
    for (unsigned n = 0; n < 6; n++) {
        say_numbered(n);
        TEST_ASSERT_TRUE(send_numbered(n));
    }
    pipe_bench_say(&wire, "V\rX\rF\r");
}

static void test_a_stream_that_stops_at_any_byte_gets_whole_lines_and_all_of_them(void) {
    static char whole[1000];
    play();
    taper_slcan_pump(&slcan, 0);
    strcpy(whole, pipe_bench_heard(&wire));
    TEST_ASSERT_TRUE(strlen(whole) > 6 * 10);
    for (size_t stop = 0; stop <= strlen(whole); stop++) {
        static char pieces[1000];
        setUp();
        wire.write_room = stop;
        play();
        taper_slcan_pump(&slcan, 0);
        strcpy(pieces, pipe_bench_heard(&wire));
        TEST_ASSERT_TRUE(strlen(pieces) <= stop);
        wire.write_room = SIZE_MAX;
        taper_slcan_pump(&slcan, 0);
        strcat(pieces, pipe_bench_heard(&wire));
        TEST_ASSERT_EQUAL_UINT(strlen(whole), strlen(pieces));
        for (unsigned n = 0; n < 6; n++) {
            char line[20];
            snprintf(line, sizeof line, "t1232%04X\r", n);
            TEST_ASSERT_NOT_NULL(strstr(pieces, line));
            assert_received_numbered(n);
        }
        TEST_ASSERT_NOT_NULL(strstr(pieces, "V1013\r"));
        TEST_ASSERT_NOT_NULL(strstr(strstr(pieces, "V1013\r"), "\a"));
        TEST_ASSERT_NOT_NULL(strstr(strstr(pieces, "\a"), "F00\r"));
    }
}

static void test_a_stream_of_single_bytes_carries_all(void) {
    static char whole[1000];
    play();
    taper_slcan_pump(&slcan, 0);
    strcpy(whole, pipe_bench_heard(&wire));
    setUp();
    wire.chunk = 1;
    play();
    taper_slcan_pump(&slcan, 0);
    TEST_ASSERT_EQUAL_UINT(strlen(whole), strlen(pipe_bench_heard(&wire)));
    for (unsigned n = 0; n < 6; n++) {
        assert_received_numbered(n);
    }
}

static void test_while_no_answer_is_taken_nothing_more_is_read_and_nothing_is_lost(void) {
    wire.write_room = 0;
    for (unsigned n = 0; n < 100; n++) {
        say_numbered(n);
    }
    taper_slcan_pump(&slcan, 0);
    TEST_ASSERT_TRUE(wire.to_adapter.head > wire.to_adapter.tail);
    wire.write_room = SIZE_MAX;
    taper_slcan_pump(&slcan, 0);
    for (unsigned n = 0; n < 100; n++) {
        assert_received_numbered(n);
    }
    TEST_ASSERT_EQUAL_UINT(200, strlen(pipe_bench_heard(&wire)));
}

static size_t endless_read(void *context, uint8_t *data, size_t size) {
    (void)context;
    memset(data, 'x', size);
    return size;
}

static void test_an_endless_flood_does_not_keep_a_pump(void) {
    slcan.stream.read = endless_read;
    taper_slcan_pump(&slcan, 0);
    TEST_ASSERT_TRUE(slcan.is_open);
}

static void test_an_extended_frame_stops_reading_until_it_is_taken(void) {
    taper_slcan_message_t message;
    taper_frame_t frame;
    pipe_bench_say(&wire, "t1110\rT1FFF0304401020304\rt2220\rT1FFF04000\rt3330\r");
    taper_slcan_pump(&slcan, 10);
    TEST_ASSERT_TRUE(port.receive(port.context, &frame));
    TEST_ASSERT_EQUAL_HEX16(0x111, frame.id);
    assert_nothing_received();
    TEST_ASSERT_TRUE(taper_slcan_take_extended(&slcan, &message));
    TEST_ASSERT_EQUAL_HEX32(0x1FFF0304, message.id);
    TEST_ASSERT_TRUE(message.is_extended);
    TEST_ASSERT_FALSE(taper_slcan_take_extended(&slcan, &message));

    taper_slcan_pump(&slcan, 20);
    TEST_ASSERT_TRUE(port.receive(port.context, &frame));
    TEST_ASSERT_EQUAL_HEX16(0x222, frame.id);
    TEST_ASSERT_EQUAL_UINT32(20, frame.time_ms);
    assert_nothing_received();
    TEST_ASSERT_TRUE(taper_slcan_take_extended(&slcan, &message));
    TEST_ASSERT_EQUAL_HEX32(0x1FFF0400, message.id);

    taper_slcan_pump(&slcan, 30);
    TEST_ASSERT_TRUE(port.receive(port.context, &frame));
    TEST_ASSERT_EQUAL_HEX16(0x333, frame.id);
    TEST_ASSERT_EQUAL_UINT32(30, frame.time_ms);
}

static void test_an_extended_frame_is_sent_behind_all_that_waits_even_byte_by_byte(void) {
    const taper_slcan_message_t message = {
        .id = 0x1FFF8104, .is_extended = true, .length = 1, .data = {0x5A}};
    for (size_t chunk = 1; chunk < 70; chunk++) {
        setUp();
        wire.chunk = chunk;
        for (unsigned n = 0; n < 4; n++) {
            TEST_ASSERT_TRUE(send_numbered(n));
        }
        taper_slcan_send_extended(&slcan, &message);
        TEST_ASSERT_EQUAL_STRING("t12320000\rt12320001\rt12320002\rt12320003\rT1FFF810415A\r",
                                 pipe_bench_heard(&wire));
        TEST_ASSERT_TRUE(taper_slcan_is_drained(&slcan));
    }
}

static void test_no_extended_frame_leaves_a_closed_channel(void) {
    const taper_slcan_message_t message = {.id = 1, .is_extended = true};
    pipe_bench_say(&wire, "C\r");
    taper_slcan_pump(&slcan, 0);
    taper_slcan_send_extended(&slcan, &message);
    TEST_ASSERT_EQUAL_STRING("\r", pipe_bench_heard(&wire));
    TEST_ASSERT_TRUE(taper_slcan_is_drained(&slcan));
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_a_frame_arrives_with_all_its_fields_and_the_time_of_its_pump);
    RUN_TEST(test_a_frame_leaves_with_all_its_fields_when_it_is_pumped);
    RUN_TEST(test_frames_that_no_bus_carries_are_not_taken);
    RUN_TEST(test_frames_with_the_same_identifier_keep_their_order_both_ways);
    RUN_TEST(test_a_full_receive_queue_drops_the_oldest_and_counts_it);
    RUN_TEST(test_the_counts_do_not_wrap);
    RUN_TEST(test_a_full_send_queue_refuses_and_loses_nothing_that_it_took);
    RUN_TEST(test_order_is_kept_where_the_indices_wrap);
    RUN_TEST(test_a_stream_that_stops_at_any_byte_gets_whole_lines_and_all_of_them);
    RUN_TEST(test_a_stream_of_single_bytes_carries_all);
    RUN_TEST(test_while_no_answer_is_taken_nothing_more_is_read_and_nothing_is_lost);
    RUN_TEST(test_an_endless_flood_does_not_keep_a_pump);
    RUN_TEST(test_an_extended_frame_stops_reading_until_it_is_taken);
    RUN_TEST(test_an_extended_frame_is_sent_behind_all_that_waits_even_byte_by_byte);
    RUN_TEST(test_no_extended_frame_leaves_a_closed_channel);
    return UNITY_END();
}
