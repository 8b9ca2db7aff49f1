/* The daemon's port: frames by their times, and the recording of them. */
#define _GNU_SOURCE // mkstemp

#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

#include "board.h"
#include "taper/membus.h"
#include "unity.h"

static const char *const names[] = {"can0", "can1"};
static char file[] = "/tmp/taper-board-XXXXXX";
static taper_membus_t bus;
static taper_port_t can, port;
static taper_notify_t notify;
static taper_record_t record;
static taper_board_t board;
static taper_frame_t frame;

void setUp(void) {
    taper_membus_init(&bus);
    can = taper_membus_station_port(&bus);
    notify.fd = -1;
    TEST_ASSERT_TRUE(taper_record_open(&record, file, names, UINT64_C(1700000000123000)));
    taper_board_init(&board, &can, &record, &notify, NULL);
    port = taper_board_port(&board);
}

void tearDown(void) {
    char old[sizeof file + 4];
    taper_record_close(&record);
    (void)snprintf(old, sizeof old, "%s.old", file);
    (void)unlink(old);
}

static void arrive(uint16_t id, uint32_t time_ms) {
    const taper_frame_t sent = {
        .id = id, .bus = 1, .length = 2, .data = {0xAB, (uint8_t)id}, .time_ms = time_ms};
    TEST_ASSERT_TRUE(can.context == &bus);
    TEST_ASSERT_TRUE(taper_membus_world_send(&bus, &sent));
}

/** The next frame is that with `id`, and the station sees it as received at `time_ms`. */
static void assert_takes(uint16_t id, uint32_t time_ms) {
    TEST_ASSERT_TRUE(port.receive(port.context, &frame));
    TEST_ASSERT_EQUAL_HEX16(id, frame.id);
    TEST_ASSERT_EQUAL_UINT32(time_ms, frame.time_ms);
}

static void assert_takes_nothing(void) {
    TEST_ASSERT_FALSE(port.receive(port.context, &frame));
}

static void assert_recorded(const char *expected) {
    static char text[1000];
    taper_record_flush(&record);
    FILE *stream = fopen(file, "r");
    TEST_ASSERT_NOT_NULL(stream);
    const size_t length = fread(text, 1, sizeof text - 1, stream);
    (void)fclose(stream);
    text[length] = '\0';
    TEST_ASSERT_EQUAL_STRING(expected, text);
}

static void test_a_frame_that_came_after_the_call_waits_for_the_next(void) {
    arrive(0x101, 20);
    arrive(0x102, 21);
    taper_board_set_time(&board, 20);
    assert_takes(0x101, 20);
    assert_takes_nothing();
    assert_takes_nothing();
    taper_board_set_time(&board, 40);
    assert_takes(0x102, 21);
    assert_takes_nothing();
}

static void test_a_frame_that_an_earlier_call_should_have_seen_counts_as_just_after_it(void) {
    taper_board_set_time(&board, 20);
    assert_takes_nothing();
    arrive(0x101, 15);
    arrive(0x102, 20);
    assert_takes(0x101, 15); // the call is still on
    taper_board_set_time(&board, 40);
    assert_takes(0x102, 21);
}

static void test_a_frame_from_before_the_start_counts_as_of_the_start(void) {
    arrive(0x101, (uint32_t)-5);
    assert_takes(0x101, 0);
}

static void test_times_go_on_when_the_stations_clock_wraps(void) {
    taper_board_set_time(&board, UINT64_C(0xFFFFFFF0));
    taper_board_set_time(&board, UINT64_C(0x100000010));
    arrive(0x101, UINT32_C(0xFFFFFFF8));
    arrive(0x102, 8);
    arrive(0x103, 0x11);
    assert_takes(0x101, UINT32_C(0xFFFFFFF8));
    assert_takes(0x102, 8);
    assert_takes_nothing();
    assert_recorded("(1704294967.411000) can1 101#AB01 R\n(1704294967.427000) can1 102#AB02 R\n");
}

static void test_the_recording_has_what_was_taken_and_sent_in_the_stations_order(void) {
    const taper_frame_t setpoint = {.id = 0x0C1, .length = 3, .data = {1, 2, 3}};
    arrive(0x101, 3);
    arrive(0x102, 30);
    taper_board_set_time(&board, 20);
    assert_takes(0x101, 3);
    assert_takes_nothing();
    TEST_ASSERT_TRUE(port.send(port.context, &setpoint));
    taper_board_set_time(&board, 40);
    assert_takes(0x102, 30);
    assert_recorded("(1700000000.126000) can1 101#AB01 R\n"
                    "(1700000000.143000) can0 0C1#010203 T\n"
                    "(1700000000.153000) can1 102#AB02 R\n");
}

static void test_what_the_bus_refused_is_not_recorded(void) {
    const taper_frame_t setpoint = {.id = 0x0C1, .length = 8};
    while (can.send(can.context, &setpoint)) {
    }
    TEST_ASSERT_FALSE(port.send(port.context, &setpoint));
    assert_recorded("");
}

static void test_the_recording_of_the_run_before_is_kept(void) {
    arrive(0x101, 0);
    assert_takes(0x101, 0);
    taper_record_close(&record);
    TEST_ASSERT_TRUE(taper_record_open(&record, file, names, 0));
    assert_recorded("");
    char old[sizeof file + 4];
    (void)snprintf(old, sizeof old, "%s.old", file);
    TEST_ASSERT_EQUAL_INT(0, access(old, R_OK));
}

static void test_without_a_store_the_station_is_not_given_one(void) {
    TEST_ASSERT_NULL(port.store_read);
    TEST_ASSERT_NULL(port.store_write);
}

int main(void) {
    const int made = mkstemp(file);
    UNITY_BEGIN();
    RUN_TEST(test_a_frame_that_came_after_the_call_waits_for_the_next);
    RUN_TEST(test_a_frame_that_an_earlier_call_should_have_seen_counts_as_just_after_it);
    RUN_TEST(test_a_frame_from_before_the_start_counts_as_of_the_start);
    RUN_TEST(test_times_go_on_when_the_stations_clock_wraps);
    RUN_TEST(test_the_recording_has_what_was_taken_and_sent_in_the_stations_order);
    RUN_TEST(test_what_the_bus_refused_is_not_recorded);
    RUN_TEST(test_the_recording_of_the_run_before_is_kept);
    RUN_TEST(test_without_a_store_the_station_is_not_given_one);
    const int failures = UNITY_END();
    (void)close(made);
    (void)unlink(file);
    return failures;
}
