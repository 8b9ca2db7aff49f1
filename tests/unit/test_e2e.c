/* End-to-end protection: golden frames of docs/protocol.md, the receiver's window. */
#include "taper/e2e.h"

#include <string.h>

#include "unity.h"

#define SETPOINT_NODE_1 0x0C1u
#define COUNTERS        16u

/* SETPOINT to node 1, counter 0: charge 16.0 A, valid 3 s, fallback 6 A, phases 7, session 7. */
static const taper_frame_t golden_charge = {
    .id = SETPOINT_NODE_1,
    .length = TAPER_FRAME_LENGTH,
    .data = {0x76, 0x10, 0xa0, 0x00, 0x06, 0x0c, 0x07, 0x07},
};
/* The same, counter 15: pause, fallback 0. */
static const taper_frame_t golden_pause = {
    .id = SETPOINT_NODE_1,
    .length = TAPER_FRAME_LENGTH,
    .data = {0x67, 0x0f, 0x00, 0x00, 0x06, 0x00, 0x07, 0x07},
};

static taper_e2e_receiver_t receiver;

void setUp(void) {
    memset(&receiver, 0, sizeof receiver);
}

void tearDown(void) {}

static taper_frame_t frame_with_counter(unsigned counter) {
    taper_frame_t frame = golden_charge;
    taper_e2e_protect(&frame, (uint8_t)(counter % COUNTERS));
    return frame;
}

static taper_e2e_check_t receive(unsigned counter) {
    const taper_frame_t frame = frame_with_counter(counter);
    return taper_e2e_check(&receiver, &frame);
}

static taper_e2e_check_t receive_corrupt(unsigned counter) {
    taper_frame_t frame = frame_with_counter(counter);
    frame.data[3] ^= 0x01u;
    return taper_e2e_check(&receiver, &frame);
}

static taper_e2e_check_t check_alone(const taper_frame_t *frame) {
    taper_e2e_receiver_t fresh = {.counter = 0};
    return taper_e2e_check(&fresh, frame);
}

/* The CRC bit by bit, from its definition. */
static uint8_t slow_crc(const uint8_t *data, size_t length) {
    unsigned crc = 0xFFu;
    for (size_t i = 0; i < length; i++) {
        crc ^= data[i];
        for (int bit = 0; bit < 8; bit++) {
            crc = (crc & 0x80u) != 0u ? (crc << 1) ^ 0x2Fu : crc << 1;
        }
        crc &= 0xFFu;
    }
    return (uint8_t)(crc ^ 0xFFu);
}

static void test_the_crc_gives_the_check_value_of_the_catalogue(void) {
    TEST_ASSERT_EQUAL_HEX8(0xDF, taper_crc8_8h2f((const uint8_t *)"123456789", 9));
}

static void test_the_crc_of_nothing_is_zero(void) {
    const uint8_t nothing = 0;
    TEST_ASSERT_EQUAL_HEX8(0x00, taper_crc8_8h2f(&nothing, 0));
}

static void test_the_table_equals_the_polynomial(void) {
    for (unsigned byte = 0; byte < 256; byte++) {
        const uint8_t data[2] = {(uint8_t)byte, (uint8_t)(byte * 7u)};
        TEST_ASSERT_EQUAL_HEX8(slow_crc(data, 1), taper_crc8_8h2f(data, 1));
        TEST_ASSERT_EQUAL_HEX8(slow_crc(data, 2), taper_crc8_8h2f(data, 2));
    }
}

static void test_the_data_id_list_of_setpoint_1_is_as_published(void) {
    static const uint8_t expected[COUNTERS] = {0xaa, 0xc1, 0x4f, 0x65, 0x86, 0x8f, 0xdf, 0xd2,
                                               0x71, 0xbd, 0x8e, 0x17, 0x54, 0xd6, 0x1e, 0x85};
    for (unsigned counter = 0; counter < COUNTERS; counter++) {
        TEST_ASSERT_EQUAL_HEX8(expected[counter], taper_e2e_data_id(SETPOINT_NODE_1, (uint8_t)counter));
    }
}

static void test_golden_frames_come_out(void) {
    taper_frame_t frame = golden_charge;
    frame.data[0] = 0;
    taper_e2e_protect(&frame, 0);
    TEST_ASSERT_EQUAL_HEX8_ARRAY(golden_charge.data, frame.data, TAPER_FRAME_LENGTH);

    frame = golden_pause;
    frame.data[0] = 0xEE;
    frame.data[1] = 0x03;
    taper_e2e_protect(&frame, 15);
    TEST_ASSERT_EQUAL_HEX8_ARRAY(golden_pause.data, frame.data, TAPER_FRAME_LENGTH);
}

static void test_golden_frames_are_accepted(void) {
    TEST_ASSERT_EQUAL(TAPER_E2E_OK, check_alone(&golden_charge));
    TEST_ASSERT_EQUAL(TAPER_E2E_OK, check_alone(&golden_pause));
}

static void test_protection_leaves_everything_but_crc_and_counter(void) {
    taper_frame_t frame = {.id = 0x101, .bus = 1, .length = 8, .data = {0, 0xA0, 1, 2, 3, 4, 5, 6}};
    taper_e2e_protect(&frame, 9);
    static const uint8_t expected[7] = {0xA9, 1, 2, 3, 4, 5, 6};
    TEST_ASSERT_EQUAL_HEX8_ARRAY(expected, &frame.data[1], 7);
    TEST_ASSERT_EQUAL_HEX16(0x101, frame.id);
    TEST_ASSERT_EQUAL_UINT8(1, frame.bus);
}

static void test_a_wrong_length_counts_as_a_crc_error(void) {
    for (uint8_t length = 0; length < TAPER_FRAME_LENGTH; length++) {
        taper_frame_t frame = golden_charge;
        frame.length = length;
        TEST_ASSERT_EQUAL(TAPER_E2E_CRC_ERROR, check_alone(&frame));
    }
}

static void test_the_first_frame_is_accepted_whatever_its_counter(void) {
    for (unsigned counter = 0; counter < COUNTERS; counter++) {
        const taper_frame_t frame = frame_with_counter(counter);
        TEST_ASSERT_EQUAL(TAPER_E2E_OK, check_alone(&frame));
    }
}

static void test_consecutive_frames_are_ok_over_the_counters_wrap(void) {
    for (unsigned counter = 0; counter < 3 * COUNTERS; counter++) {
        TEST_ASSERT_EQUAL(TAPER_E2E_OK, receive(counter));
    }
}

static void test_a_counter_is_sorted_by_how_far_it_moved(void) {
    for (unsigned last = 0; last < COUNTERS; last++) {
        for (unsigned delta = 0; delta < COUNTERS; delta++) {
            setUp();
            TEST_ASSERT_EQUAL(TAPER_E2E_OK, receive(last));
            const taper_e2e_check_t expected = delta == 0   ? TAPER_E2E_REPEATED
                                               : delta == 1 ? TAPER_E2E_OK
                                               : delta <= 3 ? TAPER_E2E_OK_SOME_LOST
                                                            : TAPER_E2E_WRONG_SEQUENCE;
            TEST_ASSERT_EQUAL(expected, receive(last + delta));
        }
    }
}

static void test_a_wrong_sequence_resynchronises(void) {
    receive(0);
    TEST_ASSERT_EQUAL(TAPER_E2E_WRONG_SEQUENCE, receive(8));
    TEST_ASSERT_EQUAL(TAPER_E2E_OK, receive(9));
}

static void test_a_corrupt_frame_does_not_move_the_counter(void) {
    receive(4);
    TEST_ASSERT_EQUAL(TAPER_E2E_CRC_ERROR, receive_corrupt(9));
    TEST_ASSERT_EQUAL(TAPER_E2E_OK, receive(5));
}

static void test_a_corrupt_first_frame_does_not_synchronise(void) {
    TEST_ASSERT_EQUAL(TAPER_E2E_CRC_ERROR, receive_corrupt(9));
    TEST_ASSERT_FALSE(receiver.synchronised);
    TEST_ASSERT_EQUAL(TAPER_E2E_OK, receive(2));
}

static void test_a_replayed_frame_stays_repeated(void) {
    receive(3);
    for (int i = 0; i < 20; i++) {
        TEST_ASSERT_EQUAL(TAPER_E2E_REPEATED, receive(3));
    }
    TEST_ASSERT_EQUAL(TAPER_E2E_OK, receive(4));
}

static void test_a_sender_is_valid_before_it_was_heard(void) {
    TEST_ASSERT_TRUE(taper_e2e_is_valid(&receiver));
}

static void test_two_errors_in_five_are_valid_and_three_are_not(void) {
    receive_corrupt(0);
    receive_corrupt(0);
    TEST_ASSERT_TRUE(taper_e2e_is_valid(&receiver));
    receive_corrupt(0);
    TEST_ASSERT_FALSE(taper_e2e_is_valid(&receiver));
}

static void test_an_error_leaves_the_window_after_five_frames(void) {
    for (int i = 0; i < 3; i++) {
        receive_corrupt(0);
    }
    receive(0);
    receive(1);
    TEST_ASSERT_FALSE(taper_e2e_is_valid(&receiver));
    receive(2);
    TEST_ASSERT_TRUE(taper_e2e_is_valid(&receiver));
}

static void test_errors_far_apart_stay_valid(void) {
    for (unsigned i = 0; i < 40; i++) {
        if (i % 3u == 0u) {
            receive_corrupt(i);
        }
        receive(i);
        TEST_ASSERT_TRUE(taper_e2e_is_valid(&receiver));
    }
}

static void test_a_wrong_sequence_counts_as_an_error(void) {
    receive(0);
    receive(5);
    receive(10);
    TEST_ASSERT_TRUE(taper_e2e_is_valid(&receiver));
    receive(15);
    TEST_ASSERT_FALSE(taper_e2e_is_valid(&receiver));
}

static void test_a_repeated_frame_neither_heals_nor_hurts(void) {
    receive(0);
    for (int i = 0; i < 10; i++) {
        receive(0);
    }
    TEST_ASSERT_TRUE(taper_e2e_is_valid(&receiver));
    for (int i = 0; i < 3; i++) {
        receive_corrupt(1);
    }
    for (int i = 0; i < 10; i++) {
        receive(0);
    }
    TEST_ASSERT_FALSE(taper_e2e_is_valid(&receiver));
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_the_crc_gives_the_check_value_of_the_catalogue);
    RUN_TEST(test_the_crc_of_nothing_is_zero);
    RUN_TEST(test_the_table_equals_the_polynomial);
    RUN_TEST(test_the_data_id_list_of_setpoint_1_is_as_published);
    RUN_TEST(test_golden_frames_come_out);
    RUN_TEST(test_golden_frames_are_accepted);
    RUN_TEST(test_protection_leaves_everything_but_crc_and_counter);
    RUN_TEST(test_a_wrong_length_counts_as_a_crc_error);
    RUN_TEST(test_the_first_frame_is_accepted_whatever_its_counter);
    RUN_TEST(test_consecutive_frames_are_ok_over_the_counters_wrap);
    RUN_TEST(test_a_counter_is_sorted_by_how_far_it_moved);
    RUN_TEST(test_a_wrong_sequence_resynchronises);
    RUN_TEST(test_a_corrupt_frame_does_not_move_the_counter);
    RUN_TEST(test_a_corrupt_first_frame_does_not_synchronise);
    RUN_TEST(test_a_replayed_frame_stays_repeated);
    RUN_TEST(test_a_sender_is_valid_before_it_was_heard);
    RUN_TEST(test_two_errors_in_five_are_valid_and_three_are_not);
    RUN_TEST(test_an_error_leaves_the_window_after_five_frames);
    RUN_TEST(test_errors_far_apart_stay_valid);
    RUN_TEST(test_a_wrong_sequence_counts_as_an_error);
    RUN_TEST(test_a_repeated_frame_neither_heals_nor_hurts);
    return UNITY_END();
}
