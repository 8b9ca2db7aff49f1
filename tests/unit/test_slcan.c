/* The adapter as the attached side meets it: commands, answers, states of the channel. */
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
}

void tearDown(void) {}

/** What the adapter answers to `text`. */
static const char *ask(const char *text) {
    pipe_bench_say(&wire, text);
    taper_slcan_pump(&slcan, 1000);
    return pipe_bench_heard(&wire);
}

static void open_channel(void) {
    TEST_ASSERT_EQUAL_STRING("\r\r\r", ask("C\rS6\rO\r"));
}

static bool send_id(uint16_t id) {
    const taper_frame_t frame = {.id = id};
    return port.send(port.context, &frame);
}

static unsigned count_received(void) {
    taper_frame_t frame;
    unsigned count = 0;
    while (port.receive(port.context, &frame)) {
        count++;
    }
    return count;
}

static void test_the_channel_is_opened_as_slcand_and_python_can_do(void) {
    TEST_ASSERT_EQUAL_STRING("\r\r\r", ask("C\rS6\r\rO\r"));
    TEST_ASSERT_TRUE(slcan.is_open);
    TEST_ASSERT_EQUAL_UINT32(1, slcan.opens);
    TEST_ASSERT_EQUAL_UINT32(0, slcan.bad_lines);
}

static void test_every_bit_rate_is_taken_while_the_channel_is_closed(void) {
    TEST_ASSERT_EQUAL_STRING("\r\r\r\r\r\r\r\r\r", ask("S0\rS1\rS2\rS3\rS4\rS5\rS6\rS7\rS8\r"));
    TEST_ASSERT_EQUAL_STRING("\r\r", ask("s031C\rs1f2e\r"));
}

static void test_commands_are_refused_where_they_do_not_belong(void) {
    static const char *const only_open[] = {"t1230\r", "T000000000\r", "r1230\r", "R000000000\r", "F\r"};
    static const char *const only_closed[] = {"S6\r", "s031C\r", "O\r", "L\r"};
    for (unsigned i = 0; i < sizeof only_open / sizeof only_open[0]; i++) {
        TEST_ASSERT_EQUAL_STRING_MESSAGE("\a", ask(only_open[i]), only_open[i]);
    }
    open_channel();
    for (unsigned i = 0; i < sizeof only_closed / sizeof only_closed[0]; i++) {
        TEST_ASSERT_EQUAL_STRING_MESSAGE("\a", ask(only_closed[i]), only_closed[i]);
    }
    TEST_ASSERT_EQUAL_UINT32(9, slcan.bad_lines);
    TEST_ASSERT_EQUAL_UINT32(1, slcan.opens);
    TEST_ASSERT_EQUAL_UINT(0, count_received());
}

static void test_bad_lines_are_answered_by_bel_and_counted_in_either_state(void) {
    static const char *const bad[] = {"S9\r", "S/\r", "S\r",     "S66\r", "s031\r", "s031CC\r", "s031G\r",
                                      "OO\r", "C0\r", "Z1\r",    "Z\r",   "Z00\r",  "X\r",      "o\r",
                                      "\n\r", "V1\r", "t8000\r", "t\r",   "F0\r",   "\a\r"};
    const unsigned count = sizeof bad / sizeof bad[0];
    for (unsigned i = 0; i < 2 * count; i++) {
        TEST_ASSERT_EQUAL_STRING_MESSAGE("\a", ask(bad[i % count]), bad[i % count]);
        if (i + 1 == count) {
            open_channel();
        }
    }
    TEST_ASSERT_EQUAL_UINT32(2 * count, slcan.bad_lines);
    TEST_ASSERT_TRUE(slcan.is_open);
}

static void test_version_serial_number_and_timestamps_off_are_answered_in_either_state(void) {
    TEST_ASSERT_EQUAL_STRING("V1013\rNTAPR\r\r", ask("V\rN\rZ0\r"));
    open_channel();
    TEST_ASSERT_EQUAL_STRING("V1013\rNTAPR\r\r", ask("V\rN\rZ0\r"));
}

static void test_an_empty_line_ends_what_was_there_and_is_not_answered(void) {
    TEST_ASSERT_EQUAL_STRING("", ask("\r\r\r"));
    TEST_ASSERT_EQUAL_STRING("\aV1013\r", ask("noise\r\rV\r"));
}

static void test_a_line_that_is_too_long_is_refused_once_and_the_next_one_taken(void) {
    char line[5000];
    open_channel();
    for (size_t length = 27; length < sizeof line; length += 97) {
        memset(line, 't', length);
        line[length] = '\0';
        TEST_ASSERT_EQUAL_STRING("", ask(line));
        TEST_ASSERT_EQUAL_STRING("\az\r", ask("\rt1230\r"));
    }
    TEST_ASSERT_EQUAL_UINT(slcan.bad_lines, count_received());
}

static void test_the_longest_frame_with_one_more_character_is_refused(void) {
    open_channel();
    TEST_ASSERT_EQUAL_STRING("\a", ask("T1FFFFFFF800112233445566770\r"));
    TEST_ASSERT_EQUAL_STRING("Z\r", ask("T1FFFFFFF80011223344556677\r"));
}

static void test_a_closed_channel_loses_what_comes_and_refuses_what_should_go(void) {
    TEST_ASSERT_EQUAL_STRING("\a", ask("t1230\r"));
    TEST_ASSERT_EQUAL_UINT(0, count_received());
    TEST_ASSERT_FALSE(send_id(0x123));
    TEST_ASSERT_EQUAL_STRING("", ask(""));
}

static void test_closing_throws_away_what_waited_to_be_sent_and_keeps_what_was_received(void) {
    open_channel();
    TEST_ASSERT_EQUAL_STRING("z\r", ask("t1230\r"));
    for (uint16_t id = 0; id < 20; id++) {
        TEST_ASSERT_TRUE(send_id(id));
    }
    wire.write_room = 0;
    TEST_ASSERT_EQUAL_STRING("", ask("C\r"));
    wire.write_room = SIZE_MAX;
    /* Two were on their way already. The answer to a command passes frames that only wait. */
    TEST_ASSERT_EQUAL_STRING("t0000\rt0010\rt0020\rt0030\rt0040\rt0050\rt0060\r\r", ask(""));
    TEST_ASSERT_TRUE(taper_slcan_is_drained(&slcan));
    TEST_ASSERT_FALSE(send_id(0x321));
    TEST_ASSERT_EQUAL_STRING("\r", ask("O\r"));
    TEST_ASSERT_EQUAL_UINT(1, count_received());
}

static void test_who_only_listens_hears_the_station_and_is_mute(void) {
    TEST_ASSERT_EQUAL_STRING("\r", ask("L\r"));
    TEST_ASSERT_TRUE(send_id(0x42));
    TEST_ASSERT_EQUAL_STRING("t0420\r", ask(""));
    TEST_ASSERT_EQUAL_STRING("\a\a\a\a", ask("t1230\rT000000000\rr1230\rR000000000\r"));
    taper_slcan_message_t message;
    TEST_ASSERT_FALSE(taper_slcan_take_extended(&slcan, &message));
    TEST_ASSERT_EQUAL_UINT(0, count_received());
    TEST_ASSERT_EQUAL_STRING("\r\rz\r", ask("C\rO\rt1230\r"));
    TEST_ASSERT_EQUAL_UINT(1, count_received());
}

static void test_remote_frames_are_taken_and_dropped(void) {
    taper_slcan_message_t message;
    open_channel();
    TEST_ASSERT_EQUAL_STRING("z\rZ\r", ask("r1238\rR012345670\r"));
    TEST_ASSERT_EQUAL_UINT(0, count_received());
    TEST_ASSERT_FALSE(taper_slcan_take_extended(&slcan, &message));
}

static void test_status_flags_tell_what_was_lost_and_are_cleared_by_reading(void) {
    open_channel();
    TEST_ASSERT_EQUAL_STRING("F00\r", ask("F\r"));
    wire.write_room = 0;
    while (send_id(0x1)) {
    }
    wire.write_room = SIZE_MAX;
    (void)ask("");
    TEST_ASSERT_EQUAL_STRING("F01\rF00\r", ask("F\rF\r"));
    for (unsigned n = 0; n <= TAPER_SLCAN_RECEIVE_DEPTH; n++) {
        (void)ask("t1230\r");
    }
    TEST_ASSERT_EQUAL_STRING("F08\rF00\r", ask("F\rF\r"));
}

static void test_a_channel_that_is_opened_again_has_no_old_flags(void) {
    open_channel();
    wire.write_room = 0;
    while (send_id(0x1)) {
    }
    wire.write_room = SIZE_MAX;
    (void)ask("C\rO\r");
    TEST_ASSERT_EQUAL_STRING("F00\r", ask("F\r"));
}

static void test_a_board_may_open_its_channel_by_itself(void) {
    taper_slcan_open(&slcan);
    TEST_ASSERT_TRUE(send_id(0x42));
    TEST_ASSERT_EQUAL_STRING("t0420\rz\r", ask("t1230\r"));
    TEST_ASSERT_EQUAL_UINT32(0, slcan.opens);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_the_channel_is_opened_as_slcand_and_python_can_do);
    RUN_TEST(test_every_bit_rate_is_taken_while_the_channel_is_closed);
    RUN_TEST(test_commands_are_refused_where_they_do_not_belong);
    RUN_TEST(test_bad_lines_are_answered_by_bel_and_counted_in_either_state);
    RUN_TEST(test_version_serial_number_and_timestamps_off_are_answered_in_either_state);
    RUN_TEST(test_an_empty_line_ends_what_was_there_and_is_not_answered);
    RUN_TEST(test_a_line_that_is_too_long_is_refused_once_and_the_next_one_taken);
    RUN_TEST(test_the_longest_frame_with_one_more_character_is_refused);
    RUN_TEST(test_a_closed_channel_loses_what_comes_and_refuses_what_should_go);
    RUN_TEST(test_closing_throws_away_what_waited_to_be_sent_and_keeps_what_was_received);
    RUN_TEST(test_who_only_listens_hears_the_station_and_is_mute);
    RUN_TEST(test_remote_frames_are_taken_and_dropped);
    RUN_TEST(test_status_flags_tell_what_was_lost_and_are_cleared_by_reading);
    RUN_TEST(test_a_channel_that_is_opened_again_has_no_old_flags);
    RUN_TEST(test_a_board_may_open_its_channel_by_itself);
    return UNITY_END();
}
