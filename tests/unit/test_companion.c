/* The companion of a recording: there and back, and what is not one. */
#define _GNU_SOURCE // mkstemp

#include "companion.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "arguments.h"
#include "taper/stations.h"
#include "unity.h"

static const char good[] =
    "format=1\nversion=0.1.0\nstation=hub\nlimit_W=80000\nfailsafe_W=10500\ntick_ms=500\n"
    "time_scale=60\niterations=70\nplanner=no\nstart_us=1700000000123000\nbus_0=vcan0\n";

static taper_companion_t companion;
static char text[TAPER_COMPANION_TEXT];
static char reason[256];

void setUp(void) {
    reason[0] = '\0';
}

void tearDown(void) {}

/** `good`, with `old` replaced by `new`. */
static void change(const char *old, const char *new) {
    const char *at = strstr(good, old);
    TEST_ASSERT_NOT_NULL_MESSAGE(at, old);
    (void)snprintf(text, sizeof text, "%.*s%s%s", (int)(at - good), good, new, at + strlen(old));
}

static void assert_refused(const char *expected) {
    TEST_ASSERT_FALSE_MESSAGE(taper_companion_parse(text, &companion, reason, sizeof reason), expected);
    TEST_ASSERT_EQUAL_STRING(expected, reason);
}

static void test_all_that_a_replay_needs_is_read(void) {
    (void)snprintf(text, sizeof text, "%s", good);
    TEST_ASSERT_TRUE_MESSAGE(taper_companion_parse(text, &companion, reason, sizeof reason), reason);
    TEST_ASSERT_EQUAL_STRING("0.1.0", companion.version);
    TEST_ASSERT_EQUAL_STRING("hub", taper_stations[companion.station]->name);
    TEST_ASSERT_EQUAL_INT32(80000, companion.limit_W);
    TEST_ASSERT_EQUAL_INT32(10500, companion.failsafe_W);
    TEST_ASSERT_EQUAL_UINT32(500, companion.tick_ms);
    TEST_ASSERT_EQUAL_UINT16(60, companion.time_scale);
    TEST_ASSERT_EQUAL_UINT16(70, companion.iterations);
    TEST_ASSERT_FALSE(companion.planner);
    TEST_ASSERT_EQUAL_UINT64(UINT64_C(1700000000123000), companion.start_us);
    TEST_ASSERT_EQUAL_UINT(1, companion.buses);
    TEST_ASSERT_EQUAL_STRING("vcan0", companion.interface[0]);
}

static void test_what_is_read_is_written_alike(void) {
    char again[TAPER_COMPANION_TEXT];
    (void)snprintf(text, sizeof text, "%s", good);
    TEST_ASSERT_TRUE(taper_companion_parse(text, &companion, reason, sizeof reason));
    TEST_ASSERT_EQUAL_UINT64(sizeof good - 1, taper_companion_format(&companion, again));
    TEST_ASSERT_EQUAL_STRING(good, again);
}

static void test_the_order_of_the_keys_does_not_matter_nor_does_the_last_end_of_line(void) {
    (void)snprintf(text, sizeof text, "format=1\nbus_0=a=b\n%.*s", (int)(strstr(good, "bus_0") - good) - 10,
                   good + 9);
    TEST_ASSERT_TRUE_MESSAGE(taper_companion_parse(text, &companion, reason, sizeof reason), reason);
    TEST_ASSERT_EQUAL_STRING("a=b", companion.interface[0]);
}

static void test_it_tells_the_station_as_it_was_made(void) {
    static const char *const names[] = {"can0", "can1"};
    taper_setup_t setup = taper_setup_default(taper_argument_find_station("hub"));
    taper_made_t made;
    setup.limit_kw = 8.0;
    setup.time_scale = 60;
    TEST_ASSERT_TRUE(taper_setup_make(&setup, &made, reason, sizeof reason));
    companion = taper_companion_of(&made, setup.station, 42000, names, 2);
    TEST_ASSERT_EQUAL_INT32(8000, companion.limit_W);
    TEST_ASSERT_EQUAL_INT32(8000, companion.failsafe_W);
    TEST_ASSERT_EQUAL_UINT32(1000, companion.tick_ms);
    TEST_ASSERT_EQUAL_UINT16(TAPER_MAX_ITERATIONS, companion.iterations);
    TEST_ASSERT_EQUAL(taper_setup_solver(setup.station) != NULL, companion.planner);
    TEST_ASSERT_EQUAL_STRING("can1", companion.interface[1]);
    setup.no_planner = true;
    TEST_ASSERT_TRUE(taper_setup_make(&setup, &made, reason, sizeof reason));
    TEST_ASSERT_FALSE(taper_companion_of(&made, setup.station, 42000, names, 2).planner);
}

static void test_a_newer_format_is_refused_whatever_else_is_in_it(void) {
    (void)snprintf(text, sizeof text, "format=2\nsomething new\n");
    assert_refused("1: format: 2 is newer than what this program knows, 1: replay it with a newer one");
}

static void test_a_file_that_does_not_begin_with_its_format_is_refused(void) {
    text[0] = '\0';
    assert_refused("1: format: missing");
    change("format=1\n", "");
    assert_refused("1: format: missing: it is the first line");
    change("format=1", "format=one");
    assert_refused("1: format: not a whole number in 1..4294967295: 'one'");
}

static void test_each_line_is_a_known_key_once(void) {
    change("version", "colour=red\nversion");
    assert_refused("2: colour: unknown key");
    change("limit_W=80000", "limit_W");
    assert_refused("4: limit_W: not KEY=VALUE");
    change("tick_ms=500\n", "tick_ms=500\ntick_ms=500\n");
    assert_refused("7: tick_ms: given in line 6 before");
}

static void test_each_key_must_be_there(void) {
    static const char *const keys[] = {"version",    "station",    "limit_W", "failsafe_W", "tick_ms",
                                       "time_scale", "iterations", "planner", "start_us",   "bus_0"};
    for (size_t i = 0; i < sizeof keys / sizeof keys[0]; i++) {
        char line[80];
        char expected[80];
        const char *at = strstr(good, keys[i]);
        (void)snprintf(line, sizeof line, "%.*s", (int)strcspn(at, "\n") + 1, at);
        (void)snprintf(expected, sizeof expected, "11: %s: missing", keys[i]);
        change(line, "");
        assert_refused(expected);
    }
}

static void test_values_that_no_station_can_have_are_refused(void) {
    static const char *const changes[][3] = {
        {"version=0.1.0", "version=", "2: version: not a version: ''"},
        {"station=hub", "station=moon", NULL},
        {"limit_W=80000", "limit_W=110001", "4: limit_W: not a whole number in 0..110000: '110001'"},
        {"limit_W=80000", "limit_W=-1", "4: limit_W: not a whole number in 0..110000: '-1'"},
        {"limit_W=80000", "limit_W=9000", "5: failsafe_W: not a whole number in 0..9000: '10500'"},
        {"failsafe_W=10500", "failsafe_W=11001", "5: failsafe_W: not a whole number in 0..11000: '11001'"},
        {"tick_ms=500", "tick_ms=19", "6: tick_ms: not a whole number in 20..1000: '19'"},
        {"time_scale=60", "time_scale=0", "7: time_scale: not a whole number in 1..1000: '0'"},
        {"iterations=70", "iterations=70 ", "8: iterations: not a whole number in 1..500: '70 '"},
        {"planner=no", "planner=maybe", "9: planner: not yes or no: 'maybe'"},
        {"123000", "123456", "10: start_us: not a whole millisecond: '1700000000123456'"},
        {"bus_0=vcan0", "bus_0=a b", "11: bus_0: not the name of an interface: 'a b'"},
        {"bus_0=vcan0", "bus_0=sixteen-letters-",
         "11: bus_0: not the name of an interface: 'sixteen-letters-'"},
        {"bus_0=vcan0", "bus_0=vcan0\nbus_1=vcan1", "12: bus_1: station hub has no such bus"},
    };
    for (size_t i = 0; i < sizeof changes / sizeof changes[0]; i++) {
        change(changes[i][0], changes[i][1]);
        if (changes[i][2] != NULL) {
            assert_refused(changes[i][2]);
        } else {
            TEST_ASSERT_FALSE(taper_companion_parse(text, &companion, reason, sizeof reason));
            TEST_ASSERT_EQUAL_STRING_LEN("3: station: unknown station 'moon'; there are hub", reason, 49);
        }
    }
}

static void test_a_planner_that_this_build_lacks_is_refused(void) {
    change("planner=no", "planner=yes");
    if (taper_setup_solver(taper_argument_find_station("hub")) == NULL) {
        assert_refused("9: planner: this build has none");
    } else {
        TEST_ASSERT_TRUE(taper_companion_parse(text, &companion, reason, sizeof reason));
        TEST_ASSERT_TRUE(companion.planner);
    }
}

static void test_the_file_is_found_beside_the_recording(void) {
    char file[] = "/tmp/taper-companion-XXXXXX";
    char beside[sizeof file + 8];
    taper_companion_t again;
    (void)close(mkstemp(file));
    (void)snprintf(beside, sizeof beside, "%s.station", file);
    TEST_ASSERT_EQUAL(TAPER_COMPANION_NONE, taper_companion_read(file, &again, reason, sizeof reason));
    (void)snprintf(text, sizeof text, "%s", good);
    TEST_ASSERT_TRUE(taper_companion_parse(text, &companion, reason, sizeof reason));
    TEST_ASSERT_TRUE(taper_companion_write(&companion, file));
    TEST_ASSERT_EQUAL(TAPER_COMPANION_GOOD, taper_companion_read(file, &again, reason, sizeof reason));
    TEST_ASSERT_EQUAL_MEMORY(&companion, &again, sizeof again);
    companion.tick_ms = 7;
    TEST_ASSERT_TRUE(taper_companion_write(&companion, file));
    TEST_ASSERT_EQUAL(TAPER_COMPANION_BAD, taper_companion_read(file, &again, reason, sizeof reason));
    char expected[200];
    (void)snprintf(expected, sizeof expected, "%s:6: tick_ms: not a whole number in 20..1000: '7'", beside);
    TEST_ASSERT_EQUAL_STRING(expected, reason);
    (void)unlink(beside);
    (void)unlink(file);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_all_that_a_replay_needs_is_read);
    RUN_TEST(test_what_is_read_is_written_alike);
    RUN_TEST(test_the_order_of_the_keys_does_not_matter_nor_does_the_last_end_of_line);
    RUN_TEST(test_it_tells_the_station_as_it_was_made);
    RUN_TEST(test_a_newer_format_is_refused_whatever_else_is_in_it);
    RUN_TEST(test_a_file_that_does_not_begin_with_its_format_is_refused);
    RUN_TEST(test_each_line_is_a_known_key_once);
    RUN_TEST(test_each_key_must_be_there);
    RUN_TEST(test_values_that_no_station_can_have_are_refused);
    RUN_TEST(test_a_planner_that_this_build_lacks_is_refused);
    RUN_TEST(test_the_file_is_found_beside_the_recording);
    return UNITY_END();
}
