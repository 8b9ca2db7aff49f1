/* What is no frame for the station does not reach it; what is one is not judged. */
#include "expect.h"

/** More than the smallest receive queue holds. */
#define MANY 1500u

static const char *const kind_name[RIG_BAD_KINDS] = {
    [RIG_REMOTE] = "remote frame",
    [RIG_EXTENDED] = "29-bit identifier",
    [RIG_EXTENDED_REMOTE] = "remote frame with a 29-bit identifier",
    [RIG_ERROR] = "error frame",
    [RIG_FD] = "frame of CAN FD",
    [RIG_MALFORMED] = "malformed line",
};

static void test_bad_frames_are_dropped_and_the_good_ones_around_them_are_not(void) {
    uint32_t number = 0;
    for (unsigned kind = 0; kind < RIG_BAD_KINDS; kind++) {
        if (rig.carries[kind]) {
            const taper_frame_t before = expect_numbered(number);
            const taper_frame_t after = expect_numbered(number + 1);
            rig.say(&before);
            rig.say_bad((rig_bad_t)kind);
            rig.say(&after);
            rig.settle();
            for (unsigned good = 0; good < 2; good++, number++) {
                const taper_frame_t frame = expect_received();
                TEST_ASSERT_EQUAL_UINT32_MESSAGE(number, expect_number_of(&frame), kind_name[kind]);
            }
        }
    }
    expect_nothing_received();
}

static void test_many_bad_frames_do_not_push_good_ones_out(void) {
    const taper_frame_t good = expect_numbered(1);
    expect_say(&good);
    for (unsigned n = 0; n < MANY; n++) {
        const rig_bad_t kind = (rig_bad_t)(n % RIG_BAD_KINDS);
        if (rig.carries[kind]) {
            rig.say_bad(kind);
        }
        if (n % 50 == 49) {
            rig.settle();
        }
    }
    const taper_frame_t frame = expect_received();
    TEST_ASSERT_EQUAL_UINT32(1, expect_number_of(&frame));
    expect_nothing_received();
    if (rig.port->receive_overflows != NULL) {
        TEST_ASSERT_EQUAL_UINT32(0, rig.port->receive_overflows(rig.port->context));
    }
}

/* The station counts what is too short by itself: it knows which frames there should be. */
static void test_frames_of_a_wrong_length_are_handed_over_as_they_are(void) {
    for (uint8_t length = 0; length < TAPER_FRAME_LENGTH; length++) {
        const taper_frame_t frame = {.id = 0x101, .length = length, .data = {1, 2, 3, 4, 5, 6, 7}};
        expect_say(&frame);
        const taper_frame_t received = expect_received();
        expect_equal(&frame, &received);
    }
}

void expect_bad_frames(void) {
    RUN_TEST(test_bad_frames_are_dropped_and_the_good_ones_around_them_are_not);
    RUN_TEST(test_many_bad_frames_do_not_push_good_ones_out);
    RUN_TEST(test_frames_of_a_wrong_length_are_handed_over_as_they_are);
}
