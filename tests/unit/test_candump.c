/* Lines of a CAN log, there and back, and what is not one. */
#include "candump.h"

#include <string.h>

#include "unity.h"

static taper_candump_line_t line;

void setUp(void) {
    memset(&line, 0, sizeof line);
}

void tearDown(void) {}

static void test_a_line_of_candump_is_read(void) {
    TEST_ASSERT_EQUAL(TAPER_CANDUMP_FRAME,
                      taper_candump_parse("(1436509052.249713) vcan0 044#2A366C2BBA\n", &line));
    TEST_ASSERT_EQUAL_UINT64(UINT64_C(1436509052249713), line.time_us);
    TEST_ASSERT_EQUAL_STRING("vcan0", line.interface);
    TEST_ASSERT_EQUAL_HEX16(0x044, line.frame.id);
    TEST_ASSERT_EQUAL_UINT8(5, line.frame.length);
    TEST_ASSERT_EQUAL_HEX8_ARRAY("\x2A\x36\x6C\x2B\xBA", line.frame.data, 5);
}

static void test_the_word_that_python_can_adds_is_passed_over(void) {
    static const char *const texts[] = {"(12.5) can1 7FF# T", "(12.5) can1 7FF# R\n",
                                        "(12.5) can1 7FF# t\r\n"};
    for (size_t i = 0; i < sizeof texts / sizeof texts[0]; i++) {
        TEST_ASSERT_EQUAL_MESSAGE(TAPER_CANDUMP_FRAME, taper_candump_parse(texts[i], &line), texts[i]);
        TEST_ASSERT_EQUAL_UINT64(12500000, line.time_us);
        TEST_ASSERT_EQUAL_HEX16(0x7FF, line.frame.id);
        TEST_ASSERT_EQUAL_UINT8(0, line.frame.length);
    }
}

static void test_a_line_is_written_as_candump_writes_it(void) {
    const taper_candump_line_t written = {
        .time_us = UINT64_C(1436509052249713),
        .interface = "vcan0",
        .frame = {.id = 0x044, .length = 5, .data = {0x2A, 0x36, 0x6C, 0x2B, 0xBA}},
    };
    char text[TAPER_CANDUMP_LINE];
    TEST_ASSERT_EQUAL_UINT64(strlen("(1436509052.249713) vcan0 044#2A366C2BBA\n"),
                             taper_candump_format(&written, text));
    TEST_ASSERT_EQUAL_STRING("(1436509052.249713) vcan0 044#2A366C2BBA\n", text);
}

static void test_what_is_written_is_read_back(void) {
    const taper_candump_line_t written = {
        .time_us = UINT64_C(1700000000000042),
        .interface = "a-name-of-15-ch",
        .frame = {.id = 0x0C1, .length = 8, .data = {0x76, 0x10, 0xA0, 0, 6, 0x0C, 7, 7}},
    };
    char text[TAPER_CANDUMP_LINE];
    TEST_ASSERT_EQUAL_UINT64(strlen("(1700000000.000042) a-name-of-15-ch 0C1#7610A000060C0707\n"),
                             taper_candump_format(&written, text));
    TEST_ASSERT_EQUAL_STRING("(1700000000.000042) a-name-of-15-ch 0C1#7610A000060C0707\n", text);
    TEST_ASSERT_EQUAL(TAPER_CANDUMP_FRAME, taper_candump_parse(text, &line));
    TEST_ASSERT_EQUAL_MEMORY(&written, &line, sizeof line);
}

static void test_frames_of_another_kind_are_left_out(void) {
    static const char *const texts[] = {
        "",
        "\n",
        "  \r\n",
        "(1.0) can0 12345678#00",
        "(1.0) can0 20000004#0000000000000000",
        "(1.0) can0 123##100",
        "(1.0) can0 123#R",
        "(1.0) can0 123#R8",
        "(1.0) can0 800#00",
    };
    for (size_t i = 0; i < sizeof texts / sizeof texts[0]; i++) {
        TEST_ASSERT_EQUAL_MESSAGE(TAPER_CANDUMP_OTHER, taper_candump_parse(texts[i], &line), texts[i]);
    }
}

static void test_what_is_no_line_of_a_log_is_refused(void) {
    static const char *const texts[] = {
        "can0 123#00",
        "(1.0 can0 123#00",
        "(x.0) can0 123#00",
        "(1.) can0 123#00",
        "(1) can0 123#00",
        "(1.0)can0 123#00",
        "(1.0) can0",
        "(1.0) can0 123",
        "(1.0) can0 #00",
        "(1.0) can0 12G#00",
        "(1.0) can0 123#0",
        "(1.0) can0 123#0G",
        "(1.0) can0 123#00 X",
        "(1.0) can0 123456789#00",
        "(-1.0) can0 123#00",
        "(1.1234567) can0 123#00",
        "(1.0) can0 123#001122334455667788",
        "(99999999999999999999.0) can0 123#00",
    };
    for (size_t i = 0; i < sizeof texts / sizeof texts[0]; i++) {
        TEST_ASSERT_EQUAL_MESSAGE(TAPER_CANDUMP_BAD, taper_candump_parse(texts[i], &line), texts[i]);
    }
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_a_line_of_candump_is_read);
    RUN_TEST(test_the_word_that_python_can_adds_is_passed_over);
    RUN_TEST(test_a_line_is_written_as_candump_writes_it);
    RUN_TEST(test_what_is_written_is_read_back);
    RUN_TEST(test_frames_of_another_kind_are_left_out);
    RUN_TEST(test_what_is_no_line_of_a_log_is_refused);
    return UNITY_END();
}
