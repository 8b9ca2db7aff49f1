/* Frames of ISO 15765-2 by hand: what a link sends, what it takes, and when. */
#include "isotp_bench.h"
#include "taper/crc32.h"
#include "unity.h"

#define FF "10 0A 01 02 03 04 05 06" /* of ten bytes */
#define CF "21 07 08 09 0A CC CC CC" /* the rest of them */

static const uint8_t TEN[] = {1, 2, 3, 4, 5, 6, 7, 8, 9, 10};
static uint8_t buffer[64];
static taper_isotp_t link;

static void open_with(taper_isotp_options_t options) {
    TEST_ASSERT_EQUAL(TAPER_OK, taper_isotp_init(&link, &options));
}

void setUp(void) {
    open_with(bench_options(buffer, sizeof buffer));
}
void tearDown(void) {}

static void send(const uint8_t *data, uint16_t length, uint32_t now_ms) {
    TEST_ASSERT_EQUAL(TAPER_OK, taper_isotp_send(&link, data, length, now_ms));
}

static void assert_sending(taper_isotp_state_t state) {
    TEST_ASSERT_EQUAL(state, taper_isotp_sending(&link));
}

static void assert_received(taper_isotp_state_t state) {
    TEST_ASSERT_EQUAL(state, bench_received(&link));
}

static void test_the_crc_32_is_that_of_ieee_802_3(void) {
    TEST_ASSERT_EQUAL_HEX32(0xCBF43926, taper_crc32((const uint8_t *)"123456789", 9));
    TEST_ASSERT_EQUAL_HEX32(0, taper_crc32(NULL, 0));
}

static void test_init_refuses_options_out_of_range(void) {
    taper_isotp_t other;
    taper_isotp_options_t options = bench_options(NULL, 0);
    TEST_ASSERT_EQUAL(TAPER_OK, taper_isotp_init(&other, &options));
    options.send_id = 0x7FF;
    options.receive_id = 0;
    TEST_ASSERT_EQUAL(TAPER_OK, taper_isotp_init(&other, &options));
    options.send_id = 0;
    options.receive_id = 0x7FF;
    TEST_ASSERT_EQUAL(TAPER_OK, taper_isotp_init(&other, &options));
    options = bench_options(NULL, 1);
    TEST_ASSERT_EQUAL(TAPER_ERR_ARGUMENT, taper_isotp_init(&other, &options));
    options = bench_options(buffer, 4096);
    TEST_ASSERT_EQUAL(TAPER_ERR_ARGUMENT, taper_isotp_init(&other, &options));
    options = bench_options(buffer, 1);
    options.send_id = options.receive_id;
    TEST_ASSERT_EQUAL(TAPER_ERR_ARGUMENT, taper_isotp_init(&other, &options));
    options.send_id = 0x800;
    TEST_ASSERT_EQUAL(TAPER_ERR_ARGUMENT, taper_isotp_init(&other, &options));
    options = bench_options(buffer, 1);
    options.receive_id = 0x800;
    TEST_ASSERT_EQUAL(TAPER_ERR_ARGUMENT, taper_isotp_init(&other, &options));
    options = bench_options(buffer, 1);
    options.separation_ms = 128;
    TEST_ASSERT_EQUAL(TAPER_ERR_ARGUMENT, taper_isotp_init(&other, &options));
    options = bench_options(buffer, 1);
    options.timeout_ms = 0;
    TEST_ASSERT_EQUAL(TAPER_ERR_ARGUMENT, taper_isotp_init(&other, &options));
}

static void test_a_new_link_is_idle(void) {
    assert_received(TAPER_ISOTP_IDLE);
    assert_sending(TAPER_ISOTP_IDLE);
    TEST_ASSERT_FALSE(taper_isotp_busy(&link));
    bench_gives_nothing(&link, 0);
}

static void test_up_to_seven_bytes_are_one_frame(void) {
    send(TEN, 1, 0);
    bench_gives(&link, "01 01 CC CC CC CC CC CC", 0);
    assert_sending(TAPER_ISOTP_DONE);
    send(TEN, 7, 0);
    bench_gives(&link, "07 01 02 03 04 05 06 07", 0);
    assert_sending(TAPER_ISOTP_DONE);
    bench_gives_nothing(&link, 0);
}

static void test_a_longer_message_waits_for_flow_control_after_its_first_frame(void) {
    send(TEN, 10, 0);
    bench_gives(&link, FF, 0);
    bench_gives_nothing(&link, 10);
    bench_take(&link, "30 00 00 CC CC CC CC CC", 10);
    bench_gives(&link, CF, 10);
    assert_sending(TAPER_ISOTP_DONE);
}

static void test_the_length_of_4095_fills_its_twelve_bits(void) {
    static uint8_t data[TAPER_ISOTP_LONGEST];
    send(data, TAPER_ISOTP_LONGEST, 0);
    bench_gives(&link, "1F FF 00 00 00 00 00 00", 0);
}

static void test_messages_of_no_bytes_or_too_many_are_not_sent(void) {
    TEST_ASSERT_EQUAL(TAPER_ERR_ARGUMENT, taper_isotp_send(&link, TEN, 0, 0));
    TEST_ASSERT_EQUAL(TAPER_ERR_ARGUMENT, taper_isotp_send(&link, TEN, 4096, 0));
    send(TEN, 10, 0);
    TEST_ASSERT_EQUAL(TAPER_ERR_ARGUMENT, taper_isotp_send(&link, TEN, 1, 0));
}

static void test_a_frame_is_given_until_it_is_out(void) {
    taper_frame_t frame;
    send(TEN, 10, 0);
    for (int i = 0; i < 5; i++) {
        TEST_ASSERT_TRUE(taper_isotp_next(&link, 100, &frame));
        TEST_ASSERT_EQUAL_HEX8(0x10, frame.data[0]);
    }
    taper_isotp_sent(&link, 100);
    bench_take(&link, "30 00 00", 100);
    for (int i = 0; i < 5; i++) {
        TEST_ASSERT_TRUE(taper_isotp_next(&link, 200, &frame));
        TEST_ASSERT_EQUAL_HEX8(0x21, frame.data[0]);
    }
    taper_isotp_sent(&link, 200);
    assert_sending(TAPER_ISOTP_DONE);
    taper_isotp_sent(&link, 200);
    assert_sending(TAPER_ISOTP_DONE);
}

static void test_a_frame_that_never_leaves_ends_in_a_timeout(void) {
    send(TEN, 3, 0);
    taper_frame_t frame;
    TEST_ASSERT_TRUE(taper_isotp_next(&link, BENCH_TIMEOUT_ms, &frame));
    bench_gives_nothing(&link, BENCH_TIMEOUT_ms + 1);
    assert_sending(TAPER_ISOTP_TIMEOUT);
}

static void test_the_timeout_of_a_frame_begins_after_its_gap(void) {
    uint8_t data[20] = {0};
    send(data, 20, 0);
    bench_gives(&link, "10 14 00 00 00 00 00 00", 0);
    bench_take(&link, "30 00 7F", 1);
    bench_gives(&link, "21 00 00 00 00 00 00 00", 1);
    taper_frame_t frame;
    TEST_ASSERT_TRUE(taper_isotp_next(&link, 1 + 128 + BENCH_TIMEOUT_ms, &frame));
    bench_gives_nothing(&link, 1 + 128 + BENCH_TIMEOUT_ms + 1);
    assert_sending(TAPER_ISOTP_TIMEOUT);
}

static void test_a_block_ends_in_another_wait_for_flow_control(void) {
    uint8_t data[40] = {0};
    send(data, 40, 0);
    bench_gives(&link, "10 28 00 00 00 00 00 00", 0);
    bench_take(&link, "30 02 00", 1);
    bench_gives(&link, "21 00 00 00 00 00 00 00", 1);
    bench_gives(&link, "22 00 00 00 00 00 00 00", 1);
    bench_gives_nothing(&link, 2);
    bench_take(&link, "30 00 00", 2); /* another block size now: all */
    bench_gives(&link, "23 00 00 00 00 00 00 00", 2);
    bench_gives(&link, "24 00 00 00 00 00 00 00", 2);
    bench_gives(&link, "25 00 00 00 00 00 00 CC", 2);
    assert_sending(TAPER_ISOTP_DONE);
}

static void assert_gap(const char *flow, uint32_t gap_ms) {
    uint8_t data[20] = {0};
    setUp();
    send(data, 20, 0);
    bench_gives(&link, "10 14 00 00 00 00 00 00", 0);
    bench_take(&link, flow, 1);
    bench_gives(&link, "21 00 00 00 00 00 00 00", 5);
    if (gap_ms > 0) {
        bench_gives_nothing(&link, 5 + gap_ms - 1);
    }
    bench_gives(&link, "22 00 00 00 00 00 00 00", 5 + gap_ms);
}

static void test_the_separation_is_kept_and_one_millisecond_that_the_clock_may_hide(void) {
    assert_gap("30 00 00", 0);
    assert_gap("30 00 01", 2);
    assert_gap("30 00 7F", 128);
    assert_gap("30 00 F1", 2);
    assert_gap("30 00 F9", 2);
}

static void test_reserved_separations_count_as_the_longest(void) {
    assert_gap("30 00 80", 128);
    assert_gap("30 00 F0", 128);
    assert_gap("30 00 FA", 128);
    assert_gap("30 00 FF", 128);
}

static void test_silence_instead_of_flow_control_ends_the_message(void) {
    send(TEN, 10, 0);
    bench_gives(&link, FF, 100);
    bench_gives_nothing(&link, 100 + BENCH_TIMEOUT_ms);
    assert_sending(TAPER_ISOTP_BUSY);
    bench_gives_nothing(&link, 101 + BENCH_TIMEOUT_ms);
    assert_sending(TAPER_ISOTP_TIMEOUT);
    bench_take(&link, "30 00 00", 101 + BENCH_TIMEOUT_ms); /* too late */
    bench_gives_nothing(&link, 101 + BENCH_TIMEOUT_ms);
}

static void test_flow_control_after_the_timeout_is_too_late_even_if_nobody_looked(void) {
    send(TEN, 10, 0);
    bench_gives(&link, FF, 0);
    bench_take(&link, "30 00 00", BENCH_TIMEOUT_ms + 1);
    assert_sending(TAPER_ISOTP_TIMEOUT);
}

static void test_wait_prolongs_the_wait_up_to_the_limit(void) {
    send(TEN, 10, 0);
    bench_gives(&link, FF, 0);
    bench_take(&link, "31 00 00", 900);
    bench_take(&link, "31 00 00", 1800);
    bench_take(&link, "31 00 00", 2700);
    bench_gives_nothing(&link, 3600);
    assert_sending(TAPER_ISOTP_BUSY);
    bench_take(&link, "31 00 00", 3600);
    assert_sending(TAPER_ISOTP_REFUSED);
}

static void test_waits_are_counted_in_a_row(void) {
    uint8_t data[20] = {0};
    send(data, 20, 0);
    bench_gives(&link, "10 14 00 00 00 00 00 00", 0);
    for (int i = 0; i < 3; i++) {
        bench_take(&link, "31 00 00", 1);
    }
    bench_take(&link, "30 01 00", 1);
    bench_gives(&link, "21 00 00 00 00 00 00 00", 1);
    for (int i = 0; i < 3; i++) {
        bench_take(&link, "31 00 00", 1);
    }
    bench_take(&link, "30 00 00", 1);
    bench_gives(&link, "22 00 00 00 00 00 00 00", 1);
    assert_sending(TAPER_ISOTP_DONE);
}

static void test_a_peer_without_room_ends_the_message(void) {
    send(TEN, 10, 0);
    bench_gives(&link, FF, 0);
    bench_take(&link, "32 00 00", 1);
    assert_sending(TAPER_ISOTP_OVERFLOW);
    bench_gives_nothing(&link, 1);
}

static void test_a_flow_status_without_a_meaning_ends_the_message(void) {
    for (unsigned status = 3; status < 16; status++) {
        taper_frame_t flow = bench_frame("30 00 00");
        flow.data[0] = (uint8_t)(flow.data[0] | status);
        setUp();
        send(TEN, 10, 0);
        bench_gives(&link, FF, 0);
        TEST_ASSERT_TRUE(taper_isotp_take(&link, &flow, 1));
        assert_sending(TAPER_ISOTP_REFUSED);
    }
}

static void test_flow_control_that_nobody_waits_for_is_ignored(void) {
    uint8_t data[20] = {0};
    bench_take(&link, "32 00 00", 0);
    assert_sending(TAPER_ISOTP_IDLE);
    send(data, 20, 0);
    bench_take(&link, "32 00 00", 0);
    bench_gives(&link, "10 14 00 00 00 00 00 00", 0);
    bench_take(&link, "30 00 05", 1);
    bench_gives(&link, "21 00 00 00 00 00 00 00", 1);
    bench_take(&link, "32 00 00", 2);
    bench_take(&link, "3F 00 00", 2);
    bench_gives(&link, "22 00 00 00 00 00 00 00", 7);
    assert_sending(TAPER_ISOTP_DONE);
}

static void test_flow_control_shorter_than_three_bytes_is_ignored(void) {
    send(TEN, 10, 0);
    bench_gives(&link, FF, 0);
    bench_take(&link, "30 00", 1);
    bench_gives_nothing(&link, 1);
    assert_sending(TAPER_ISOTP_BUSY);
}

static void test_a_cancelled_message_stops_and_another_can_go(void) {
    taper_frame_t frame;
    send(TEN, 10, 0);
    TEST_ASSERT_TRUE(taper_isotp_next(&link, 0, &frame));
    taper_isotp_cancel(&link);
    assert_sending(TAPER_ISOTP_IDLE);
    send(TEN, 2, 0);
    taper_isotp_sent(&link, 0); /* of the old one */
    bench_gives(&link, "02 01 02 CC CC CC CC CC", 0);
    assert_sending(TAPER_ISOTP_DONE);
    taper_isotp_cancel(&link);
    assert_sending(TAPER_ISOTP_DONE);
}

static void test_sending_goes_on_across_the_wrap_of_the_clock(void) {
    uint8_t data[20] = {0};
    const uint32_t start_ms = UINT32_MAX - 10;
    send(data, 20, start_ms);
    bench_gives(&link, "10 14 00 00 00 00 00 00", start_ms);
    bench_take(&link, "30 00 14", UINT32_MAX);
    bench_gives(&link, "21 00 00 00 00 00 00 00", UINT32_MAX);
    bench_gives_nothing(&link, 19);
    bench_gives(&link, "22 00 00 00 00 00 00 00", 20);
    send(TEN, 10, UINT32_MAX - 10);
    bench_gives(&link, FF, UINT32_MAX - 10);
    bench_gives_nothing(&link, BENCH_TIMEOUT_ms - 11);
    assert_sending(TAPER_ISOTP_BUSY);
    bench_gives_nothing(&link, BENCH_TIMEOUT_ms - 10);
    assert_sending(TAPER_ISOTP_TIMEOUT);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_the_crc_32_is_that_of_ieee_802_3);
    RUN_TEST(test_init_refuses_options_out_of_range);
    RUN_TEST(test_a_new_link_is_idle);
    RUN_TEST(test_up_to_seven_bytes_are_one_frame);
    RUN_TEST(test_a_longer_message_waits_for_flow_control_after_its_first_frame);
    RUN_TEST(test_the_length_of_4095_fills_its_twelve_bits);
    RUN_TEST(test_messages_of_no_bytes_or_too_many_are_not_sent);
    RUN_TEST(test_a_frame_is_given_until_it_is_out);
    RUN_TEST(test_a_frame_that_never_leaves_ends_in_a_timeout);
    RUN_TEST(test_the_timeout_of_a_frame_begins_after_its_gap);
    RUN_TEST(test_a_block_ends_in_another_wait_for_flow_control);
    RUN_TEST(test_the_separation_is_kept_and_one_millisecond_that_the_clock_may_hide);
    RUN_TEST(test_reserved_separations_count_as_the_longest);
    RUN_TEST(test_silence_instead_of_flow_control_ends_the_message);
    RUN_TEST(test_flow_control_after_the_timeout_is_too_late_even_if_nobody_looked);
    RUN_TEST(test_wait_prolongs_the_wait_up_to_the_limit);
    RUN_TEST(test_waits_are_counted_in_a_row);
    RUN_TEST(test_a_peer_without_room_ends_the_message);
    RUN_TEST(test_a_flow_status_without_a_meaning_ends_the_message);
    RUN_TEST(test_flow_control_that_nobody_waits_for_is_ignored);
    RUN_TEST(test_flow_control_shorter_than_three_bytes_is_ignored);
    RUN_TEST(test_a_cancelled_message_stops_and_another_can_go);
    RUN_TEST(test_sending_goes_on_across_the_wrap_of_the_clock);
    return UNITY_END();
}
