/* What a link makes of frames that come in, good and bad. */
#include "isotp_bench.h"
#include "unity.h"

#define FF       "10 0A 01 02 03 04 05 06" /* of ten bytes */
#define CF       "21 07 08 09 0A CC CC CC" /* the rest of them */
#define CONTINUE "30 00 00 CC CC CC CC CC"
#define WAIT     "31 00 00 CC CC CC CC CC"
#define OVERFLOW "32 00 00 CC CC CC CC CC"

static const uint8_t TEN[] = {1, 2, 3, 4, 5, 6, 7, 8, 9, 10};
static uint8_t buffer[20 + 1];
static taper_isotp_t link;

static void open_with(taper_isotp_options_t options) {
    TEST_ASSERT_EQUAL(TAPER_OK, taper_isotp_init(&link, &options));
}

void setUp(void) {
    buffer[20] = 0xA5;
    open_with(bench_options(buffer, 20));
}
void tearDown(void) {
    TEST_ASSERT_EQUAL_HEX8(0xA5, buffer[20]); /* not ours */
}

static void assert_received(taper_isotp_state_t state) {
    TEST_ASSERT_EQUAL(state, bench_received(&link));
}

static void test_a_single_frame_is_a_message_padded_or_not(void) {
    bench_take(&link, "03 01 02 03 00 00 00 00", 0);
    bench_holds(&link, TEN, 3);
    bench_gives_nothing(&link, 0);
    taper_isotp_release(&link, 0);
    assert_received(TAPER_ISOTP_IDLE);
    bench_take(&link, "02 01 02", 0);
    bench_holds(&link, TEN, 2);
}

static void test_a_longer_message_is_taken_after_our_flow_control(void) {
    bench_take(&link, FF, 0);
    assert_received(TAPER_ISOTP_BUSY);
    bench_gives(&link, CONTINUE, 0);
    bench_gives_nothing(&link, 0);
    bench_take(&link, "21 07 08 09 0A", 1);
    bench_holds(&link, TEN, 10);
    TEST_ASSERT_FALSE(taper_isotp_busy(&link));
}

static void test_flow_control_says_block_size_and_separation(void) {
    taper_isotp_options_t options = bench_options(buffer, 20);
    options.block_size = 1;
    options.separation_ms = 127;
    open_with(options);
    bench_take(&link, "10 14 01 02 03 04 05 06", 0);
    bench_gives(&link, "30 01 7F CC CC CC CC CC", 0);
    bench_take(&link, "21 07 08 09 0A 0B 0C 0D", 1);
    bench_gives(&link, "30 01 7F CC CC CC CC CC", 1);
    bench_take(&link, "22 0E 0F 10 11 12 13 14", 2);
    assert_received(TAPER_ISOTP_DONE); /* no flow control after the last frame */
    bench_gives_nothing(&link, 2);
}

static void test_frames_of_others_are_left_alone(void) {
    taper_frame_t frame = bench_frame("01 01");
    frame.id = BENCH_SEND_ID;
    TEST_ASSERT_FALSE(taper_isotp_take(&link, &frame, 0));
    frame.id = BENCH_RECEIVE_ID;
    frame.bus = 1;
    TEST_ASSERT_FALSE(taper_isotp_take(&link, &frame, 0));
    assert_received(TAPER_ISOTP_IDLE);
}

static void test_a_message_that_fills_the_buffer_is_taken_and_one_more_byte_is_not(void) {
    bench_take(&link, "10 14 01 02 03 04 05 06", 0);
    bench_gives(&link, CONTINUE, 0);
    bench_take(&link, "21 07 08 09 0A 0B 0C 0D", 0);
    bench_take(&link, "22 0E 0F 10 11 12 13 14", 0);
    assert_received(TAPER_ISOTP_DONE);
    TEST_ASSERT_EQUAL_HEX8(0x14, buffer[19]);
    taper_isotp_release(&link, 0);
    bench_take(&link, "10 15 01 02 03 04 05 06", 0);
    assert_received(TAPER_ISOTP_OVERFLOW);
    bench_gives(&link, OVERFLOW, 0);
    bench_gives_nothing(&link, 0);
}

static void test_a_single_frame_longer_than_the_buffer_is_refused(void) {
    open_with(bench_options(buffer, 2));
    bench_take(&link, "03 01 02 03", 0);
    assert_received(TAPER_ISOTP_OVERFLOW);
    bench_gives_nothing(&link, 0);
}

static void test_a_link_without_a_buffer_takes_nothing(void) {
    open_with(bench_options(NULL, 0));
    bench_take(&link, "01 01", 0);
    assert_received(TAPER_ISOTP_OVERFLOW);
    bench_take(&link, FF, 0);
    bench_gives(&link, OVERFLOW, 0);
}

static void test_the_escape_to_longer_messages_is_refused(void) {
    bench_take(&link, "10 00 00 00 10 00 01 02", 0); /* 4096 bytes */
    assert_received(TAPER_ISOTP_OVERFLOW);
    bench_gives(&link, OVERFLOW, 0);
    taper_isotp_release(&link, 0);
    bench_take(&link, "00 0A 01 02 03 04 05 06", 0); /* of CAN FD */
    assert_received(TAPER_ISOTP_IDLE);
}

static void test_frames_that_contradict_their_length_are_ignored(void) {
    const char *const bad[] = {
        "08 01 02 03 04 05 06 07",
        "0F 01 02 03 04 05 06 07",
        "03 01 02",
        "10 07 01 02 03 04 05 06",
        "10 01 01 02 03 04 05 06",
        "10 0A 01 02 03 04 05",
        "40 00 00 00 00 00 00 00",
        "F1 01",
    };
    for (unsigned i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        bench_take(&link, bad[i], 0);
        TEST_ASSERT_EQUAL_MESSAGE(TAPER_ISOTP_IDLE, bench_received(&link), bad[i]);
    }
    bench_gives_nothing(&link, 0);
}

static void test_an_empty_frame_and_one_longer_than_can_be_are_ignored(void) {
    taper_frame_t frame = bench_frame("01 01");
    frame.length = 0;
    TEST_ASSERT_TRUE(taper_isotp_take(&link, &frame, 0));
    frame.length = 9;
    TEST_ASSERT_TRUE(taper_isotp_take(&link, &frame, 0));
    assert_received(TAPER_ISOTP_IDLE);
}

static void test_a_consecutive_frame_too_short_for_its_bytes_is_ignored(void) {
    bench_take(&link, FF, 0);
    bench_gives(&link, CONTINUE, 0);
    bench_take(&link, "21 07 08 09", 0);
    assert_received(TAPER_ISOTP_BUSY);
    bench_take(&link, CF, 0);
    bench_holds(&link, TEN, 10);
}

static void test_a_consecutive_frame_out_of_nothing_is_ignored(void) {
    bench_take(&link, CF, 0);
    assert_received(TAPER_ISOTP_IDLE);
    bench_take(&link, FF, 0);
    bench_take(&link, CF, 0); /* nobody told it to go on */
    bench_gives(&link, CONTINUE, 0);
    assert_received(TAPER_ISOTP_BUSY);
    bench_take(&link, CF, 0);
    bench_holds(&link, TEN, 10);
    bench_take(&link, CF, 0);
    bench_holds(&link, TEN, 10);
}

static void test_a_wrong_sequence_number_ends_the_message(void) {
    bench_take(&link, FF, 0);
    bench_gives(&link, CONTINUE, 0);
    bench_take(&link, "22 07 08 09 0A CC CC CC", 0);
    assert_received(TAPER_ISOTP_SEQUENCE);
    bench_take(&link, CF, 0);
    assert_received(TAPER_ISOTP_SEQUENCE);
    bench_take(&link, "01 01", 0);
    bench_holds(&link, TEN, 1);
}

static void test_a_new_message_ends_the_one_before(void) {
    bench_take(&link, FF, 0);
    bench_gives(&link, CONTINUE, 0);
    bench_take(&link, "10 08 11 12 13 14 15 16", 1);
    bench_gives(&link, CONTINUE, 1);
    bench_take(&link, "21 17 18", 1);
    const uint8_t expected[] = {0x11, 0x12, 0x13, 0x14, 0x15, 0x16, 0x17, 0x18};
    bench_holds(&link, expected, 8);
    taper_isotp_release(&link, 1);

    bench_take(&link, FF, 2);
    bench_take(&link, "02 01 02", 3);
    bench_holds(&link, TEN, 2);
    bench_gives_nothing(&link, 3); /* the flow control of the first is not sent any more */
}

static void test_flow_control_out_for_an_older_message_is_not_taken_for_the_newer(void) {
    taper_frame_t frame;
    bench_take(&link, FF, 0);
    TEST_ASSERT_TRUE(taper_isotp_next(&link, 0, &frame));
    bench_take(&link, "1F FF 01 02 03 04 05 06", 0);
    taper_isotp_sent(&link, 0);
    bench_gives(&link, OVERFLOW, 0);
}

static void test_silence_in_a_message_ends_it(void) {
    bench_take(&link, FF, 0);
    bench_gives(&link, CONTINUE, 100);
    bench_gives_nothing(&link, 100 + BENCH_TIMEOUT_ms);
    assert_received(TAPER_ISOTP_BUSY);
    bench_gives_nothing(&link, 101 + BENCH_TIMEOUT_ms);
    assert_received(TAPER_ISOTP_TIMEOUT);
}

static void test_a_frame_after_the_timeout_is_too_late_even_if_nobody_looked(void) {
    bench_take(&link, FF, 0);
    bench_gives(&link, CONTINUE, 0);
    bench_take(&link, CF, BENCH_TIMEOUT_ms + 1);
    assert_received(TAPER_ISOTP_TIMEOUT);
}

static void test_the_timeout_works_across_the_wrap_of_the_clock(void) {
    const uint32_t start_ms = UINT32_MAX - 10;
    bench_take(&link, FF, start_ms);
    bench_gives(&link, CONTINUE, start_ms);
    bench_gives_nothing(&link, start_ms + BENCH_TIMEOUT_ms);
    assert_received(TAPER_ISOTP_BUSY);
    bench_gives_nothing(&link, start_ms + BENCH_TIMEOUT_ms + 1);
    assert_received(TAPER_ISOTP_TIMEOUT);
}

static void test_a_frame_stamped_a_little_before_the_last_one_does_no_harm(void) {
    bench_take(&link, FF, 100);
    bench_gives(&link, CONTINUE, 100);
    bench_take(&link, CF, 98);
    bench_holds(&link, TEN, 10);
}

static void test_flow_control_that_cannot_leave_is_given_up(void) {
    taper_frame_t frame;
    bench_take(&link, FF, 0);
    TEST_ASSERT_TRUE(taper_isotp_next(&link, BENCH_TIMEOUT_ms, &frame));
    bench_gives_nothing(&link, BENCH_TIMEOUT_ms + 1);
    assert_received(TAPER_ISOTP_TIMEOUT);
    bench_take(&link, "1F FF 01 02 03 04 05 06", 5000);
    TEST_ASSERT_TRUE(taper_isotp_next(&link, 5000 + BENCH_TIMEOUT_ms, &frame));
    bench_gives_nothing(&link, 5001 + BENCH_TIMEOUT_ms);
    TEST_ASSERT_FALSE(taper_isotp_busy(&link));
}

static void test_a_message_waits_until_the_buffer_is_released(void) {
    bench_take(&link, "01 55", 0);
    bench_take(&link, FF, 0);
    bench_gives(&link, WAIT, 0);
    bench_gives_nothing(&link, BENCH_TIMEOUT_ms / 2 - 1);
    bench_gives(&link, WAIT, BENCH_TIMEOUT_ms / 2);
    bench_gives(&link, WAIT, BENCH_TIMEOUT_ms);
    TEST_ASSERT_TRUE(taper_isotp_busy(&link));
    assert_received(TAPER_ISOTP_DONE);
    TEST_ASSERT_EQUAL_HEX8(0x55, buffer[0]);
    taper_isotp_release(&link, 1100);
    assert_received(TAPER_ISOTP_BUSY);
    bench_gives(&link, CONTINUE, 1100);
    bench_take(&link, CF, 1100);
    bench_holds(&link, TEN, 10);
}

static void test_a_single_frame_waits_too_and_the_newest_is_kept(void) {
    bench_take(&link, "01 55", 0);
    bench_take(&link, FF, 0);
    bench_take(&link, "07 01 02 03 04 05 06 07", 0);
    bench_gives_nothing(&link, 0);
    bench_gives_nothing(&link, BENCH_TIMEOUT_ms);
    taper_isotp_release(&link, 0);
    bench_holds(&link, TEN, 7);
    taper_isotp_release(&link, 0);
    assert_received(TAPER_ISOTP_IDLE);
}

static void test_a_message_that_is_too_long_does_not_wait(void) {
    bench_take(&link, "01 55", 0);
    bench_take(&link, "10 14 01 02 03 04 05 06", 0); /* fits just so */
    bench_gives(&link, WAIT, 0);
    bench_take(&link, "10 15 01 02 03 04 05 06", 0);
    bench_gives(&link, OVERFLOW, 0);
    taper_isotp_release(&link, 0);
    assert_received(TAPER_ISOTP_IDLE);
}

static void test_a_message_under_way_is_not_released(void) {
    bench_take(&link, FF, 0);
    taper_isotp_release(&link, 0);
    assert_received(TAPER_ISOTP_BUSY);
    bench_gives(&link, CONTINUE, 0);
    bench_take(&link, CF, 0);
    bench_holds(&link, TEN, 10);
}

static void test_flow_control_goes_before_our_own_data(void) {
    TEST_ASSERT_EQUAL(TAPER_OK, taper_isotp_send(&link, TEN, 10, 0));
    bench_take(&link, FF, 0);
    bench_gives(&link, CONTINUE, 0);
    bench_gives(&link, FF, 0);
    bench_take(&link, CONTINUE, 0);
    bench_take(&link, CF, 0);
    bench_gives(&link, CF, 0);
    bench_holds(&link, TEN, 10);
    TEST_ASSERT_EQUAL(TAPER_ISOTP_DONE, taper_isotp_sending(&link));
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_a_single_frame_is_a_message_padded_or_not);
    RUN_TEST(test_a_longer_message_is_taken_after_our_flow_control);
    RUN_TEST(test_flow_control_says_block_size_and_separation);
    RUN_TEST(test_frames_of_others_are_left_alone);
    RUN_TEST(test_a_message_that_fills_the_buffer_is_taken_and_one_more_byte_is_not);
    RUN_TEST(test_a_single_frame_longer_than_the_buffer_is_refused);
    RUN_TEST(test_a_link_without_a_buffer_takes_nothing);
    RUN_TEST(test_the_escape_to_longer_messages_is_refused);
    RUN_TEST(test_frames_that_contradict_their_length_are_ignored);
    RUN_TEST(test_an_empty_frame_and_one_longer_than_can_be_are_ignored);
    RUN_TEST(test_a_consecutive_frame_too_short_for_its_bytes_is_ignored);
    RUN_TEST(test_a_consecutive_frame_out_of_nothing_is_ignored);
    RUN_TEST(test_a_wrong_sequence_number_ends_the_message);
    RUN_TEST(test_a_new_message_ends_the_one_before);
    RUN_TEST(test_flow_control_out_for_an_older_message_is_not_taken_for_the_newer);
    RUN_TEST(test_silence_in_a_message_ends_it);
    RUN_TEST(test_a_frame_after_the_timeout_is_too_late_even_if_nobody_looked);
    RUN_TEST(test_the_timeout_works_across_the_wrap_of_the_clock);
    RUN_TEST(test_a_frame_stamped_a_little_before_the_last_one_does_no_harm);
    RUN_TEST(test_flow_control_that_cannot_leave_is_given_up);
    RUN_TEST(test_a_message_waits_until_the_buffer_is_released);
    RUN_TEST(test_a_single_frame_waits_too_and_the_newest_is_kept);
    RUN_TEST(test_a_message_that_is_too_long_does_not_wait);
    RUN_TEST(test_a_message_under_way_is_not_released);
    RUN_TEST(test_flow_control_goes_before_our_own_data);
    return UNITY_END();
}
