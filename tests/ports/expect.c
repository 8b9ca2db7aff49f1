#include "expect.h"

#include <string.h>

taper_frame_t expect_numbered(uint32_t number) {
    taper_frame_t frame = {.id = 0x123, .length = TAPER_FRAME_LENGTH};
    memcpy(frame.data, &number, sizeof number);
    return frame;
}

uint32_t expect_number_of(const taper_frame_t *frame) {
    uint32_t number = 0;
    TEST_ASSERT_EQUAL_HEX16(0x123, frame->id);
    TEST_ASSERT_EQUAL_UINT8(TAPER_FRAME_LENGTH, frame->length);
    memcpy(&number, frame->data, sizeof number);
    return number;
}

void expect_say(const taper_frame_t *frame) {
    rig.say(frame);
    rig.settle();
}

static void begin_call(void) {
    if (rig.begin_call != NULL) {
        rig.begin_call();
    }
}

taper_frame_t expect_received(void) {
    taper_frame_t frame = {0};
    begin_call();
    TEST_ASSERT_TRUE_MESSAGE(rig.port->receive(rig.port->context, &frame), "nothing received");
    return frame;
}

taper_frame_t expect_heard(void) {
    taper_frame_t frame = {0};
    TEST_ASSERT_TRUE_MESSAGE(rig.hear(&frame, RIG_PATIENCE_ms), "nothing heard");
    return frame;
}

void expect_nothing_received(void) {
    taper_frame_t frame;
    rig.settle();
    begin_call();
    TEST_ASSERT_FALSE(rig.port->receive(rig.port->context, &frame));
}

void expect_nothing_heard(void) {
    taper_frame_t frame;
    rig.settle();
    TEST_ASSERT_FALSE(rig.hear(&frame, 50));
}

void expect_equal(const taper_frame_t *expected, const taper_frame_t *frame) {
    TEST_ASSERT_EQUAL_HEX16(expected->id, frame->id);
    TEST_ASSERT_EQUAL_UINT8(expected->bus, frame->bus);
    TEST_ASSERT_EQUAL_UINT8(expected->length, frame->length);
    if (expected->length > 0) {
        TEST_ASSERT_EQUAL_HEX8_ARRAY(expected->data, frame->data, expected->length);
    }
}

bool expect_send(const taper_frame_t *frame) {
    return rig.port->send(rig.port->context, frame);
}
