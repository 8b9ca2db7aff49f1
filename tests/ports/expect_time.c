/* A frame's time is that of its reception, on the station's clock. */
#include "expect.h"

/** Two clocks, in whole milliseconds. */
#define ROUNDING_ms 2u
#define FRAMES      4u

/** A frame, and the station's clock before and after it came. */
typedef struct {
    uint32_t before_ms, after_ms;
} moment_t;

static moment_t say_now(uint32_t number) {
    const taper_frame_t frame = expect_numbered(number);
    moment_t moment = {.before_ms = rig.now_ms()};
    expect_say(&frame);
    moment.after_ms = rig.now_ms();
    return moment;
}

/** By differences: the clock may wrap in between. */
static void assert_received_at(const moment_t *moment, uint32_t time_ms) {
    const uint32_t since_ms = time_ms - (moment->before_ms - ROUNDING_ms);
    const uint32_t longest_ms = moment->after_ms - moment->before_ms + 2 * ROUNDING_ms;
    TEST_ASSERT_TRUE_MESSAGE(since_ms <= longest_ms, "not the time of its reception");
}

static void say_some_and_take_them_later(void) {
    moment_t moment[FRAMES];
    taper_frame_t frame[FRAMES];
    for (unsigned i = 0; i < FRAMES; i++) {
        moment[i] = say_now(i);
        rig.pass_ms(40);
    }
    if (rig.begin_call != NULL) {
        rig.begin_call();
    }
    for (unsigned i = 0; i < FRAMES; i++) {
        TEST_ASSERT_TRUE(rig.port->receive(rig.port->context, &frame[i]));
        TEST_ASSERT_EQUAL_UINT32(i, expect_number_of(&frame[i]));
        assert_received_at(&moment[i], frame[i].time_ms);
    }
    for (unsigned i = 1; i < FRAMES; i++) {
        TEST_ASSERT_TRUE(frame[i].time_ms - frame[i - 1].time_ms < UINT32_C(0x80000000));
    }
}

static void test_a_frame_that_waited_has_the_time_of_its_reception(void) {
    say_some_and_take_them_later();
}

static void test_times_go_on_over_the_wrap_of_the_clock(void) {
    rig.stop();
    rig.start(0u - 100u);
    TEST_ASSERT_TRUE(rig.now_ms() > UINT32_C(0x80000000));
    say_some_and_take_them_later();
    TEST_ASSERT_TRUE(rig.now_ms() < UINT32_C(0x80000000));
}

static void test_the_clock_in_microseconds_goes_on_if_there_is_one(void) {
    TEST_ASSERT_EQUAL(rig.has.clock_us, rig.port->clock_us != NULL);
    if (rig.port->clock_us != NULL) {
        const uint32_t began_us = rig.port->clock_us(rig.port->context);
        rig.pass_ms(20);
        const uint32_t elapsed_us = rig.port->clock_us(rig.port->context) - began_us;
        TEST_ASSERT_TRUE(elapsed_us >= 19000u && elapsed_us < RIG_PATIENCE_ms * 1000u);
    }
}

void expect_time(void) {
    RUN_TEST(test_a_frame_that_waited_has_the_time_of_its_reception);
    RUN_TEST(test_times_go_on_over_the_wrap_of_the_clock);
    RUN_TEST(test_the_clock_in_microseconds_goes_on_if_there_is_one);
}
