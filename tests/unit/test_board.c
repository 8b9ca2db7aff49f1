/* The daemon's port: frames by their times, and the recording of them. */
#define _GNU_SOURCE // mkstemp

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/stat.h>
#include <unistd.h>

#include "board.h"
#include "taper/membus.h"
#include "unity.h"

static const taper_companion_t companion = {.version = "0.1.0",
                                            .limit_W = 5000,
                                            .failsafe_W = 4000,
                                            .tick_ms = 1000,
                                            .time_scale = 1,
                                            .iterations = 50,
                                            .start_us = UINT64_C(1700000000123000),
                                            .interface = {"can0", "can1"},
                                            .buses = 2};
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
    TEST_ASSERT_TRUE(taper_record_open(&record, file, &companion));
    taper_board_init(&board, &can, &record, &notify, NULL);
    port = taper_board_port(&board);
}

/** The path of something beside the recording. */
static const char *beside(const char *suffix) {
    static char path[sizeof file + 20];
    (void)snprintf(path, sizeof path, "%s%s", file, suffix);
    return path;
}

void tearDown(void) {
    taper_record_close(&record);
    (void)unlink(beside(".old"));
    (void)unlink(beside(".station"));
    (void)unlink(beside(".station.old"));
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

static void assert_holds(const char *path, const char *expected) {
    static char text[1000];
    FILE *stream = fopen(path, "r");
    TEST_ASSERT_NOT_NULL(stream);
    const size_t length = fread(text, 1, sizeof text - 1, stream);
    (void)fclose(stream);
    text[length] = '\0';
    TEST_ASSERT_EQUAL_STRING(expected, text);
}

static void assert_recorded(const char *expected) {
    taper_record_flush(&record);
    assert_holds(file, expected);
}

static void assert_missing(const char *path) {
    TEST_ASSERT_NOT_EQUAL(0, access(path, F_OK));
}

static void put_text(const char *path, const char *text) {
    FILE *stream = fopen(path, "w");
    TEST_ASSERT_NOT_NULL(stream);
    TEST_ASSERT_TRUE(fputs(text, stream) >= 0);
    TEST_ASSERT_EQUAL_INT(0, fclose(stream));
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
    assert_recorded("(1704294967.411000) can1 101#AB01\n(1704294967.427000) can1 102#AB02\n");
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
    assert_recorded("(1700000000.126000) can1 101#AB01\n"
                    "(1700000000.143000) can0 0C1#010203\n"
                    "(1700000000.153000) can1 102#AB02\n");
}

static void test_what_the_bus_refused_is_not_recorded(void) {
    const taper_frame_t setpoint = {.id = 0x0C1, .length = 8};
    while (can.send(can.context, &setpoint)) {
    }
    TEST_ASSERT_FALSE(port.send(port.context, &setpoint));
    assert_recorded("");
}

static void test_the_recording_has_a_companion_from_its_beginning(void) {
    char text[TAPER_COMPANION_TEXT];
    (void)taper_companion_format(&companion, text);
    assert_holds(beside(".station"), text);
    assert_missing(beside(".station.new"));
}

static void test_the_recording_of_the_run_before_is_kept_with_its_companion(void) {
    taper_companion_t next = companion;
    char text[TAPER_COMPANION_TEXT];
    arrive(0x101, 0);
    assert_takes(0x101, 0);
    taper_record_close(&record);
    next.start_us += 7000000;
    TEST_ASSERT_TRUE(taper_record_open(&record, file, &next));
    assert_recorded("");
    assert_holds(beside(".old"), "(1700000000.123000) can1 101#AB01\n");
    (void)taper_companion_format(&companion, text);
    assert_holds(beside(".station.old"), text);
    (void)taper_companion_format(&next, text);
    assert_holds(beside(".station"), text);
}

static void test_a_log_without_a_companion_is_not_kept_with_that_of_another(void) {
    taper_record_close(&record);
    put_text(file, "of candump");
    TEST_ASSERT_EQUAL_INT(0, unlink(beside(".station")));
    put_text(beside(".station.old"), "of the recording before");
    TEST_ASSERT_TRUE(taper_record_open(&record, file, &companion));
    assert_holds(beside(".old"), "of candump");
    assert_missing(beside(".station.old"));
}

static void test_a_keeping_that_was_broken_off_goes_on_at_the_next_start(void) {
    taper_record_close(&record);
    TEST_ASSERT_EQUAL_INT(0, unlink(file));
    put_text(beside(".old"), "the recording");
    put_text(beside(".station"), "its companion");
    TEST_ASSERT_TRUE(taper_record_open(&record, file, &companion));
    assert_holds(beside(".old"), "the recording");
    assert_holds(beside(".station.old"), "its companion");
}

static void test_a_companion_that_cannot_be_written_ends_the_recording_and_not_the_station(void) {
    taper_record_close(&record);
    TEST_ASSERT_EQUAL_INT(0, mkdir(beside(".station.new"), 0700));
    TEST_ASSERT_TRUE(taper_record_open(&record, file, &companion));
    TEST_ASSERT_EQUAL_INT(0, rmdir(beside(".station.new")));
    TEST_ASSERT_EQUAL_INT(EISDIR, record.error);
    arrive(0x101, 0);
    assert_takes(0x101, 0);
    assert_recorded("");
    assert_missing(beside(".station"));
}

static void test_a_device_has_no_companion(void) {
    char shown[] = "/tmp/taper-device-XXXXXX";
    char path[sizeof shown + 10];
    TEST_ASSERT_NOT_NULL(mkdtemp(shown));
    (void)snprintf(path, sizeof path, "%s/null", shown);
    TEST_ASSERT_EQUAL_INT(0, symlink("/dev/null", path));
    taper_record_close(&record);
    TEST_ASSERT_TRUE(taper_record_open(&record, path, &companion));
    TEST_ASSERT_EQUAL_INT(0, record.error);
    TEST_ASSERT_EQUAL_INT(0, unlink(path));
    TEST_ASSERT_EQUAL_INT(0, rmdir(shown)); // nothing else is there
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
    RUN_TEST(test_the_recording_has_a_companion_from_its_beginning);
    RUN_TEST(test_the_recording_of_the_run_before_is_kept_with_its_companion);
    RUN_TEST(test_a_log_without_a_companion_is_not_kept_with_that_of_another);
    RUN_TEST(test_a_keeping_that_was_broken_off_goes_on_at_the_next_start);
    RUN_TEST(test_a_companion_that_cannot_be_written_ends_the_recording_and_not_the_station);
    RUN_TEST(test_a_device_has_no_companion);
    RUN_TEST(test_without_a_store_the_station_is_not_given_one);
    const int failures = UNITY_END();
    (void)close(made);
    (void)unlink(file);
    return failures;
}
