/* Full queues: the newest are kept on the way in, and counted; nothing that was taken is lost on the way out. */
#include "expect.h"

/** More than any queue holds. */
#define MANY 20000u

static bool counts(void) {
    return rig.port->receive_overflows != NULL;
}

static uint32_t overflows(void) {
    return counts() ? rig.port->receive_overflows(rig.port->context) : 0;
}

/** The world sends until frames are lost for sure. @return how many it sent. */
static uint32_t flood(void) {
    uint32_t sent = 0;
    while (overflows() < 10 && sent < MANY) {
        for (unsigned n = 0; n < 50; n++) {
            const taper_frame_t frame = expect_numbered(sent++);
            rig.say(&frame);
        }
        rig.settle();
    }
    TEST_ASSERT_TRUE_MESSAGE(sent < MANY || !counts(), "a receive queue without end");
    return sent;
}

/** The station takes all of a flood: the newest, without a gap. @return number of the oldest that was there. */
static uint32_t take_the_newest(uint32_t sent) {
    const taper_frame_t oldest = expect_received();
    const uint32_t first = expect_number_of(&oldest);
    TEST_ASSERT_TRUE_MESSAGE(first > 0, "the oldest is still there");
    for (uint32_t number = first + 1; number < sent; number++) {
        const taper_frame_t frame = expect_received();
        TEST_ASSERT_EQUAL_UINT32(number, expect_number_of(&frame));
    }
    expect_nothing_received();
    return first;
}

static void test_a_full_receive_queue_drops_its_oldest_frames_counts_them_and_goes_on(void) {
    TEST_ASSERT_EQUAL_UINT32(0, overflows());
    const uint32_t lost = take_the_newest(flood());
    const taper_frame_t next = expect_numbered(MANY);
    expect_say(&next);
    const taper_frame_t frame = expect_received();
    TEST_ASSERT_EQUAL_UINT32(MANY, expect_number_of(&frame));
    TEST_ASSERT_EQUAL_UINT32(counts() ? lost : 0, overflows());
}

/** The station sends until it is refused. @return how many were taken. */
static uint32_t fill(void) {
    uint32_t taken = 0;
    for (taper_frame_t frame = expect_numbered(0); taken < MANY && expect_send(&frame);) {
        frame = expect_numbered(++taken);
    }
    TEST_ASSERT_TRUE_MESSAGE(taken > 0 && taken < MANY, "a send queue without room, or without end");
    return taken;
}

/** Until the port has room again. */
static void send_patiently(const taper_frame_t *frame) {
    uint32_t waited_ms = 0;
    for (; !expect_send(frame); waited_ms += 5) {
        TEST_ASSERT_TRUE_MESSAGE(waited_ms < RIG_PATIENCE_ms, "refused for ever");
        rig.pass_ms(5);
        rig.settle();
    }
}

static void assert_heard(uint32_t number) {
    const taper_frame_t frame = expect_heard();
    TEST_ASSERT_EQUAL_UINT32(number, expect_number_of(&frame));
}

static void test_a_full_send_queue_refuses_delivers_all_that_it_took_and_goes_on(void) {
    rig.jam(true);
    const uint32_t taken = fill();
    rig.jam(false);
    for (uint32_t number = 0; number < taken; number++) {
        assert_heard(number);
    }
    for (uint32_t number = 0; number < 20; number++) {
        const taper_frame_t frame = expect_numbered(number);
        send_patiently(&frame);
        assert_heard(number);
    }
    expect_nothing_heard();
}

void expect_queues(void) {
    RUN_TEST(test_a_full_receive_queue_drops_its_oldest_frames_counts_them_and_goes_on);
    RUN_TEST(test_a_full_send_queue_refuses_delivers_all_that_it_took_and_goes_on);
}
