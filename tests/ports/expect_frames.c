/* Frames arrive in order, with all that they hold, in both directions. */
#include "expect.h"

#define BURST 200u

static taper_frame_t of_length(uint8_t length) {
    static const uint16_t ids[] = {0x000, 0x7FF, 0x001, 0x400, 0x555, 0x2AA, 0x123, 0x080, 0x77E};
    taper_frame_t frame = {.id = ids[length], .length = length};
    for (uint8_t i = 0; i < length; i++) {
        frame.data[i] = (uint8_t)(0xFFu - 0x1Fu * i);
    }
    return frame;
}

static void test_a_new_bus_has_nothing_for_anybody(void) {
    expect_nothing_received();
    expect_nothing_heard();
}

static void test_frames_of_all_lengths_reach_the_station_in_order(void) {
    for (uint8_t length = 0; length <= TAPER_FRAME_LENGTH; length++) {
        const taper_frame_t frame = of_length(length);
        rig.say(&frame);
    }
    rig.settle();
    for (uint8_t length = 0; length <= TAPER_FRAME_LENGTH; length++) {
        const taper_frame_t expected = of_length(length);
        const taper_frame_t frame = expect_received();
        expect_equal(&expected, &frame);
    }
    expect_nothing_received();
}

static void test_frames_of_all_lengths_reach_the_world_in_order(void) {
    for (uint8_t length = 0; length <= TAPER_FRAME_LENGTH; length++) {
        const taper_frame_t frame = of_length(length);
        TEST_ASSERT_TRUE(expect_send(&frame));
    }
    for (uint8_t length = 0; length <= TAPER_FRAME_LENGTH; length++) {
        const taper_frame_t expected = of_length(length);
        const taper_frame_t frame = expect_heard();
        expect_equal(&expected, &frame);
    }
    expect_nothing_heard();
}

static void test_frames_with_the_same_identifier_keep_their_order_to_the_station(void) {
    for (uint32_t number = 0; number < BURST; number++) {
        const taper_frame_t frame = expect_numbered(number);
        rig.say(&frame);
        if (number % 50 == 49) {
            rig.settle();
        }
    }
    for (uint32_t number = 0; number < BURST; number++) {
        const taper_frame_t frame = expect_received();
        TEST_ASSERT_EQUAL_UINT32(number, expect_number_of(&frame));
    }
}

static void test_frames_with_the_same_identifier_keep_their_order_to_the_world(void) {
    uint32_t heard = 0;
    for (uint32_t number = 0; number < BURST; number++) {
        const taper_frame_t frame = expect_numbered(number);
        TEST_ASSERT_TRUE(expect_send(&frame));
        if (number % 20 == 19) {
            for (; heard <= number; heard++) {
                const taper_frame_t there = expect_heard();
                TEST_ASSERT_EQUAL_UINT32(heard, expect_number_of(&there));
            }
        }
    }
}

static void test_the_directions_do_not_mix_and_nobody_hears_himself(void) {
    const taper_frame_t of_world = expect_numbered(1);
    const taper_frame_t of_station = expect_numbered(2);
    for (unsigned round = 0; round < 3; round++) {
        TEST_ASSERT_TRUE(expect_send(&of_station));
        expect_say(&of_world);
        const taper_frame_t received = expect_received();
        const taper_frame_t heard = expect_heard();
        TEST_ASSERT_EQUAL_UINT32(1, expect_number_of(&received));
        TEST_ASSERT_EQUAL_UINT32(2, expect_number_of(&heard));
    }
    expect_nothing_received();
    expect_nothing_heard();
}

static void test_what_no_bus_carries_is_refused_and_nothing_of_it_leaves(void) {
    static const taper_frame_t bad[] = {
        {.id = 0x800, .length = 8}, {.id = 0xFFFF}, {.id = 1, .length = 9}, {.id = 1, .bus = 250}};
    for (unsigned i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        TEST_ASSERT_FALSE(expect_send(&bad[i]));
    }
    const taper_frame_t good = expect_numbered(7);
    TEST_ASSERT_TRUE(expect_send(&good));
    const taper_frame_t heard = expect_heard();
    TEST_ASSERT_EQUAL_UINT32(7, expect_number_of(&heard));
    expect_nothing_heard();
}

void expect_frames(void) {
    RUN_TEST(test_a_new_bus_has_nothing_for_anybody);
    RUN_TEST(test_frames_of_all_lengths_reach_the_station_in_order);
    RUN_TEST(test_frames_of_all_lengths_reach_the_world_in_order);
    RUN_TEST(test_frames_with_the_same_identifier_keep_their_order_to_the_station);
    RUN_TEST(test_frames_with_the_same_identifier_keep_their_order_to_the_world);
    RUN_TEST(test_the_directions_do_not_mix_and_nobody_hears_himself);
    RUN_TEST(test_what_no_bus_carries_is_refused_and_nothing_of_it_leaves);
}
