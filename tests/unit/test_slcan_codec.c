/* A frame and its line, by golden lines written by hand. */
#include <stdio.h>
#include <string.h>

#include "taper/slcan.h"
#include "unity.h"

void setUp(void) {}

void tearDown(void) {}

typedef struct {
    const char *line; /* without its CR */
    taper_slcan_message_t message;
} golden_t;

static const golden_t golden[] = {
    {"t0000", {.id = 0}},
    {"t7FF0", {.id = 0x7FF}},
    {"t1230", {.id = 0x123}},
    {"t1231AA", {.id = 0x123, .length = 1, .data = {0xAA}}},
    {"t0818123456789ABCDEF0",
     {.id = 0x081, .length = 8, .data = {0x12, 0x34, 0x56, 0x78, 0x9A, 0xBC, 0xDE, 0xF0}}},
    {"T000000000", {.id = 0, .is_extended = true}},
    {"T1FFFFFFF200FF", {.id = 0x1FFFFFFF, .is_extended = true, .length = 2, .data = {0x00, 0xFF}}},
    {"T1FFF030440C3C9001",
     {.id = 0x1FFF0304, .is_extended = true, .length = 4, .data = {0x0C, 0x3C, 0x90, 0x01}}},
    {"r7018", {.id = 0x701, .is_remote = true, .length = 8}},
    {"R0ABCDEF03", {.id = 0x0ABCDEF0, .is_extended = true, .is_remote = true, .length = 3}},
};
#define GOLDEN (sizeof golden / sizeof golden[0])

static void assert_message(const taper_slcan_message_t *expected, const taper_slcan_message_t *message,
                           const char *line) {
    TEST_ASSERT_EQUAL_HEX32_MESSAGE(expected->id, message->id, line);
    TEST_ASSERT_EQUAL_MESSAGE(expected->is_extended, message->is_extended, line);
    TEST_ASSERT_EQUAL_MESSAGE(expected->is_remote, message->is_remote, line);
    TEST_ASSERT_EQUAL_UINT8_MESSAGE(expected->length, message->length, line);
    TEST_ASSERT_EQUAL_HEX8_ARRAY_MESSAGE(expected->data, message->data, TAPER_FRAME_LENGTH, line);
}

static void test_golden_lines_are_written(void) {
    for (unsigned i = 0; i < GOLDEN; i++) {
        char line[TAPER_SLCAN_LINE];
        const size_t length = taper_slcan_encode(&golden[i].message, line);
        TEST_ASSERT_EQUAL_UINT_MESSAGE(strlen(golden[i].line) + 1, length, golden[i].line);
        TEST_ASSERT_EQUAL_MEMORY_MESSAGE(golden[i].line, line, length - 1, golden[i].line);
        TEST_ASSERT_EQUAL_INT('\r', line[length - 1]);
    }
}

static void test_golden_lines_are_read(void) {
    for (unsigned i = 0; i < GOLDEN; i++) {
        taper_slcan_message_t message;
        TEST_ASSERT_TRUE_MESSAGE(taper_slcan_decode(golden[i].line, strlen(golden[i].line), &message),
                                 golden[i].line);
        assert_message(&golden[i].message, &message, golden[i].line);
    }
}

static void test_digits_may_be_lower_case(void) {
    static const taper_slcan_message_t expected = {.id = 0x7AB, .length = 2, .data = {0xCD, 0xEF}};
    taper_slcan_message_t message;
    TEST_ASSERT_TRUE(taper_slcan_decode("t7ab2cdEf", 9, &message));
    assert_message(&expected, &message, "t7ab2cdEf");
}

static void test_a_line_that_is_not_whole_or_too_long_is_refused_at_every_length(void) {
    static const char line[] = "T1FFFFFFF8001122334455667788";
    taper_slcan_message_t message;
    for (size_t length = 0; length < sizeof line; length++) {
        TEST_ASSERT_EQUAL(length == 26, taper_slcan_decode(line, length, &message));
    }
}

static void test_lines_that_are_no_frames_are_refused(void) {
    static const char *const bad[] = {
        "x1230",      /* no such letter */
        "1230",       /* none at all */
        "t8000",      /* 12 bits */
        "tFFF0",      /**/
        "T200000000", /* 30 bits */
        "TFFFFFFFF0", /**/
        "t1239",      /* nine bytes */
        "t123A",      /**/
        "t12G0",      /* no digit */
        "t-120",      /**/
        "t1231G0",    /**/
        "t12310/",    /* the characters around the digits and letters */
        "t1231:0",    /**/
        "t12310@",    /**/
        "t1231`0",    /**/
        "t1231 A",    /**/
        "r7011FF",    /* a remote frame has no data */
        "r701G",      /**/
        "t12320",     /* half a byte */
        "t1230\n",    /**/
    };
    taper_slcan_message_t message;
    for (unsigned i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        TEST_ASSERT_FALSE_MESSAGE(taper_slcan_decode(bad[i], strlen(bad[i]), &message), bad[i]);
    }
    TEST_ASSERT_FALSE(taper_slcan_decode("\0001230", 5, &message));
}

static void test_messages_out_of_range_are_not_written(void) {
    static const taper_slcan_message_t bad[] = {
        {.id = 0x800}, {.id = 0x20000000, .is_extended = true}, {.id = 1, .length = 9}, {.id = UINT32_MAX}};
    char line[TAPER_SLCAN_LINE];
    for (unsigned i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        TEST_ASSERT_EQUAL_UINT(0, taper_slcan_encode(&bad[i], line));
    }
}

static void test_each_value_of_each_byte_comes_back(void) {
    for (unsigned value = 0; value < 256; value++) {
        for (unsigned at = 0; at < TAPER_FRAME_LENGTH; at++) {
            taper_slcan_message_t message = {
                .id = value * 0x00800001u & 0x1FFFFFFFu, .is_extended = true, .length = TAPER_FRAME_LENGTH};
            taper_slcan_message_t back;
            char line[TAPER_SLCAN_LINE];
            message.data[at] = (uint8_t)value;
            const size_t length = taper_slcan_encode(&message, line);
            TEST_ASSERT_TRUE(taper_slcan_decode(line, length - 1, &back));
            assert_message(&message, &back, "round trip");
        }
    }
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_golden_lines_are_written);
    RUN_TEST(test_golden_lines_are_read);
    RUN_TEST(test_digits_may_be_lower_case);
    RUN_TEST(test_a_line_that_is_not_whole_or_too_long_is_refused_at_every_length);
    RUN_TEST(test_lines_that_are_no_frames_are_refused);
    RUN_TEST(test_messages_out_of_range_are_not_written);
    RUN_TEST(test_each_value_of_each_byte_comes_back);
    return UNITY_END();
}
