/* Two links and a wire between them: every length, every fault at every frame, and noise. */
#include <string.h>

#include "isotp_bench.h"
#include "scene.h"
#include "unity.h"

#define LONGEST TAPER_ISOTP_LONGEST
#define MESSAGE 60u /* bytes of the messages that meet a fault: first frame, 8 consecutive, 3 flow controls */
#define BLOCK   3
#define NO_FRAME 1000u

typedef enum { LOSE, REPEAT, DELAY } fault_t;

static uint8_t a_buffer[LONGEST], b_buffer[LONGEST], message[LONGEST], answer[LONGEST];
static taper_isotp_t a, b;

/* The wire with a fault. */
static struct {
    fault_t fault;
    unsigned at, carried; /* number of the frame that it hits, and how many there were */
    bool holding;
    taper_frame_t held;
} wire;

static void open_with(uint8_t block_size, uint8_t separation_ms) {
    taper_isotp_options_t options = bench_options(a_buffer, LONGEST);
    options.block_size = block_size;
    options.separation_ms = separation_ms;
    TEST_ASSERT_EQUAL(TAPER_OK, taper_isotp_init(&a, &options));
    options = bench_peer_options(b_buffer, LONGEST);
    options.block_size = block_size;
    options.separation_ms = separation_ms;
    TEST_ASSERT_EQUAL(TAPER_OK, taper_isotp_init(&b, &options));
}

void setUp(void) {
    memset(&wire, 0, sizeof wire);
    wire.at = NO_FRAME;
    open_with(BLOCK, 0);
}
void tearDown(void) {}

static uint32_t loop_back(uint16_t length, uint32_t now_ms) {
    bench_fill(message, length, length);
    TEST_ASSERT_EQUAL(TAPER_OK, taper_isotp_send(&a, message, length, now_ms));
    const uint32_t end_ms = bench_run(&a, &b, now_ms);
    TEST_ASSERT_EQUAL(TAPER_ISOTP_DONE, taper_isotp_sending(&a));
    bench_holds(&b, message, length);
    taper_isotp_release(&b, end_ms);
    return end_ms;
}

static void test_every_length_comes_through_with_several_block_sizes(void) {
    const uint8_t blocks[] = {0, 1, 2, 7, 16, 255};
    for (unsigned k = 0; k < sizeof blocks; k++) {
        uint32_t now_ms = UINT32_MAX - 50;
        open_with(blocks[k], 0);
        for (uint16_t length = 1; length <= LONGEST; length++) {
            now_ms = loop_back(length, now_ms);
        }
    }
}

static void test_lengths_come_through_with_several_separations(void) {
    const uint8_t separations_ms[] = {1, 5, 20, 127};
    for (unsigned k = 0; k < sizeof separations_ms; k++) {
        uint32_t now_ms = UINT32_MAX - 500;
        open_with(0, separations_ms[k]);
        for (uint16_t length = 1; length <= LONGEST; length = (uint16_t)(length + 91)) {
            const uint32_t begun_ms = now_ms;
            now_ms = loop_back(length, now_ms);
            const uint32_t consecutive = length > TAPER_ISOTP_SINGLE ? length / 7u : 0;
            const uint32_t gaps = consecutive > 0 ? consecutive - 1 : 0;
            TEST_ASSERT_TRUE(taper_elapsed_ms(now_ms, begun_ms) >= gaps * separations_ms[k]);
        }
    }
}

static void test_without_blocks_one_flow_control_is_enough_for_the_longest_message(void) {
    unsigned flow_controls = 0;
    taper_frame_t frame;
    open_with(0, 0);
    bench_fill(message, LONGEST, 1);
    TEST_ASSERT_EQUAL(TAPER_OK, taper_isotp_send(&a, message, LONGEST, 0));
    while (taper_isotp_sending(&a) == TAPER_ISOTP_BUSY) {
        if (taper_isotp_next(&a, 0, &frame)) {
            taper_isotp_sent(&a, 0);
            TEST_ASSERT_TRUE(taper_isotp_take(&b, &frame, 0));
        }
        if (taper_isotp_next(&b, 0, &frame)) {
            taper_isotp_sent(&b, 0);
            TEST_ASSERT_TRUE(taper_isotp_take(&a, &frame, 0));
            flow_controls++;
        }
    }
    bench_holds(&b, message, LONGEST);
    TEST_ASSERT_EQUAL_UINT(1, flow_controls);
}

static void test_both_directions_go_at_once(void) {
    for (uint16_t length = 8; length <= LONGEST; length = (uint16_t)(length + 73)) {
        const uint16_t other = (uint16_t)(LONGEST + 8u - length);
        bench_fill(message, length, 1);
        bench_fill(answer, other, 2);
        TEST_ASSERT_EQUAL(TAPER_OK, taper_isotp_send(&a, message, length, 0));
        TEST_ASSERT_EQUAL(TAPER_OK, taper_isotp_send(&b, answer, other, 0));
        (void)bench_run(&a, &b, 0);
        bench_holds(&b, message, length);
        bench_holds(&a, answer, other);
        taper_isotp_release(&a, 0);
        taper_isotp_release(&b, 0);
    }
}

static void test_a_send_queue_that_is_often_full_costs_only_time(void) {
    uint32_t random = 7;
    uint32_t now_ms = 0;
    bench_fill(message, 500, 3);
    TEST_ASSERT_EQUAL(TAPER_OK, taper_isotp_send(&a, message, 500, now_ms));
    while (taper_isotp_busy(&a) || taper_isotp_busy(&b)) {
        taper_isotp_t *const from = scene_random(&random) & 1u ? &a : &b;
        taper_frame_t frame;
        if (taper_isotp_next(from, now_ms, &frame) && scene_random(&random) % 4 == 0) {
            taper_isotp_sent(from, now_ms);
            TEST_ASSERT_TRUE(taper_isotp_take(from == &a ? &b : &a, &frame, now_ms));
        }
        now_ms++;
    }
    bench_holds(&b, message, 500);
}

static void deliver(const taper_frame_t *frame, uint32_t now_ms) {
    (void)taper_isotp_take(&a, frame, now_ms);
    (void)taper_isotp_take(&b, frame, now_ms);
}

static void deliver_held(uint32_t now_ms) {
    if (wire.holding) {
        wire.holding = false;
        deliver(&wire.held, now_ms);
    }
}

static void carry(const taper_frame_t *frame, uint32_t now_ms) {
    const bool hit = wire.carried == wire.at;
    wire.carried++;
    if (hit && wire.fault == DELAY) {
        wire.holding = true;
        wire.held = *frame;
        return;
    }
    if (!hit || wire.fault == REPEAT) {
        deliver(frame, now_ms);
    }
    if (hit && wire.fault == REPEAT) {
        deliver(frame, now_ms);
    }
    deliver_held(now_ms); /* it comes after the one that followed it */
}

static bool move(taper_isotp_t *from, uint32_t now_ms) {
    taper_frame_t frame;
    if (!taper_isotp_next(from, now_ms, &frame)) {
        return false;
    }
    taper_isotp_sent(from, now_ms);
    carry(&frame, now_ms);
    return true;
}

/** Until all is quiet; a frame that nothing overtakes is late by some milliseconds. */
static uint32_t run_wire(uint32_t now_ms) {
    unsigned quiet_ms = 0;
    while (taper_isotp_busy(&a) || taper_isotp_busy(&b) || wire.holding) {
        const bool a_moves = move(&a, now_ms);
        const bool b_moves = move(&b, now_ms);
        quiet_ms = a_moves || b_moves ? 0 : quiet_ms + 1;
        if (quiet_ms == 5) {
            deliver_held(now_ms);
        }
        now_ms++;
    }
    return now_ms;
}

/** A message that meets the fault, and one after it. @return frames that the first took. */
static unsigned meet(fault_t fault, unsigned at) {
    setUp();
    wire.fault = fault;
    wire.at = at;
    bench_fill(message, MESSAGE, at + 1);
    TEST_ASSERT_EQUAL(TAPER_OK, taper_isotp_send(&a, message, MESSAGE, 0));
    uint32_t now_ms = run_wire(0);
    const unsigned frames = wire.carried;
    if (bench_received(&b) == TAPER_ISOTP_DONE) {
        bench_holds(&b, message, MESSAGE);
    }
    taper_isotp_release(&b, now_ms);

    bench_fill(message, MESSAGE, at + 100);
    TEST_ASSERT_EQUAL(TAPER_OK, taper_isotp_send(&a, message, MESSAGE, now_ms));
    now_ms = run_wire(now_ms);
    TEST_ASSERT_EQUAL(TAPER_ISOTP_DONE, taper_isotp_sending(&a));
    bench_holds(&b, message, MESSAGE);
    return frames;
}

static void meet_at_every_frame(fault_t fault) {
    const unsigned frames = meet(fault, NO_FRAME);
    TEST_ASSERT_EQUAL_UINT(1 + 8 + 3, frames);
    for (unsigned at = 0; at < frames; at++) {
        (void)meet(fault, at);
    }
}

static void test_the_loss_of_any_frame_gives_no_wrong_message_and_the_next_comes_through(void) {
    meet_at_every_frame(LOSE);
}

static void test_the_repetition_of_any_frame_gives_no_wrong_message_and_the_next_comes_through(void) {
    meet_at_every_frame(REPEAT);
}

static void test_any_frame_too_late_gives_no_wrong_message_and_the_next_comes_through(void) {
    meet_at_every_frame(DELAY);
}

static void test_the_loss_of_a_data_frame_is_never_a_message(void) {
    for (unsigned at = 0; at < 12; at++) {
        const bool is_flow = at == 1 || at == 5 || at == 9;
        setUp();
        wire.at = at;
        bench_fill(message, MESSAGE, at);
        TEST_ASSERT_EQUAL(TAPER_OK, taper_isotp_send(&a, message, MESSAGE, 0));
        (void)run_wire(0);
        TEST_ASSERT_NOT_EQUAL(TAPER_ISOTP_DONE, bench_received(&b));
        TEST_ASSERT_TRUE(!is_flow || taper_isotp_sending(&a) == TAPER_ISOTP_TIMEOUT);
    }
}

static void test_a_sender_that_stops_at_any_frame_leaves_the_link_free_for_the_next_message(void) {
    for (unsigned frames = 1; frames < 12; frames++) {
        setUp();
        bench_fill(message, MESSAGE, frames);
        TEST_ASSERT_EQUAL(TAPER_OK, taper_isotp_send(&a, message, MESSAGE, 0));
        while (wire.carried < frames) {
            if (!move(&a, 0)) {
                (void)move(&b, 0);
            }
        }
        taper_isotp_cancel(&a);
        TEST_ASSERT_NOT_EQUAL(TAPER_ISOTP_DONE, bench_received(&b));
        if (frames % 2 == 0) { /* at once, or after the timeout */
            (void)run_wire(0);
            TEST_ASSERT_EQUAL(TAPER_ISOTP_TIMEOUT, bench_received(&b));
        }
        bench_fill(message, MESSAGE, frames + 50);
        TEST_ASSERT_EQUAL(TAPER_OK, taper_isotp_send(&a, message, MESSAGE, 2000));
        (void)run_wire(2000);
        bench_holds(&b, message, MESSAGE);
    }
}

#define NOISE_CAPACITY 100u
#define NOISE_FRAMES   (1000000u / TEST_SHARE)

static void assert_sound(const taper_isotp_t *link, const uint8_t *buffer) {
    TEST_ASSERT_TRUE(link->in.state <= TAPER_ISOTP_REFUSED && link->out.state <= TAPER_ISOTP_REFUSED);
    TEST_ASSERT_TRUE(link->in.got <= NOISE_CAPACITY);
    TEST_ASSERT_TRUE(link->in.state != TAPER_ISOTP_BUSY || link->in.got < link->in.length);
    TEST_ASSERT_TRUE(link->in.state != TAPER_ISOTP_DONE || link->in.got == link->in.length);
    TEST_ASSERT_TRUE(link->out.sent <= link->out.length);
    TEST_ASSERT_EQUAL_HEX8(0xA5, buffer[NOISE_CAPACITY]);
}

static taper_frame_t noise(uint32_t *random) {
    taper_frame_t frame = {.id = BENCH_RECEIVE_ID, .length = (uint8_t)(scene_random(random) % 10)};
    for (unsigned i = 0; i < TAPER_FRAME_LENGTH; i++) {
        frame.data[i] = (uint8_t)(scene_random(random) >> 24);
    }
    if (scene_random(random) % 8 != 0) { /* mostly of a known kind, mostly whole, often the right number */
        frame.data[0] &= 0x3Fu;
        frame.length = TAPER_FRAME_LENGTH;
    }
    if (frame.data[0] >> 4 == 1 && scene_random(random) % 4 != 0) {
        frame.data[0] = 0x10;
    }
    return frame;
}

static void stir(taper_isotp_t *link, uint32_t *random, uint32_t now_ms) {
    taper_frame_t frame;
    const uint32_t dice = scene_random(random) % 16;
    if (dice < 8 && taper_isotp_next(link, now_ms, &frame)) {
        TEST_ASSERT_EQUAL_UINT8(TAPER_FRAME_LENGTH, frame.length);
        TEST_ASSERT_EQUAL_HEX16(BENCH_SEND_ID, frame.id);
        if (dice < 6) {
            taper_isotp_sent(link, now_ms);
        }
    } else if (dice == 8) {
        taper_isotp_release(link, now_ms);
    } else if (dice == 9) {
        (void)taper_isotp_send(link, message, (uint16_t)(scene_random(random) % 200), now_ms);
    } else if (dice == 10) {
        taper_isotp_cancel(link);
    } else if (dice == 11) {
        taper_isotp_sent(link, now_ms);
    }
}

static void test_a_million_frames_of_noise_break_nothing(void) {
    uint32_t random = 20240229;
    uint32_t now_ms = UINT32_MAX - 100000;
    unsigned whole = 0;
    unsigned long_ones = 0;
    taper_isotp_options_t options = bench_options(a_buffer, NOISE_CAPACITY);
    options.block_size = 4;
    TEST_ASSERT_EQUAL(TAPER_OK, taper_isotp_init(&a, &options));
    a_buffer[NOISE_CAPACITY] = 0xA5;
    for (unsigned k = 0; k < NOISE_FRAMES; k++) {
        taper_frame_t frame = noise(&random);
        if (frame.data[0] >> 4 == 2 && scene_random(&random) % 8 != 0) {
            frame.data[0] = (uint8_t)(0x20u | a.in.sequence);
        }
        now_ms += scene_random(&random) % 64 == 0 ? scene_random(&random) % 2000 : 1;
        const bool was_long = bench_received(&a) == TAPER_ISOTP_BUSY;
        TEST_ASSERT_TRUE(taper_isotp_take(&a, &frame, now_ms));
        whole += bench_received(&a) == TAPER_ISOTP_DONE;
        long_ones += was_long && bench_received(&a) == TAPER_ISOTP_DONE && a.in.length > TAPER_ISOTP_SINGLE;
        assert_sound(&a, a_buffer);
        stir(&a, &random, now_ms);
        assert_sound(&a, a_buffer);
    }
    TEST_ASSERT_TRUE(whole > NOISE_FRAMES / 100); /* the noise does reach deep */
    TEST_ASSERT_TRUE(long_ones > NOISE_FRAMES / 10000);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_every_length_comes_through_with_several_block_sizes);
    RUN_TEST(test_lengths_come_through_with_several_separations);
    RUN_TEST(test_without_blocks_one_flow_control_is_enough_for_the_longest_message);
    RUN_TEST(test_both_directions_go_at_once);
    RUN_TEST(test_a_send_queue_that_is_often_full_costs_only_time);
    RUN_TEST(test_the_loss_of_any_frame_gives_no_wrong_message_and_the_next_comes_through);
    RUN_TEST(test_the_repetition_of_any_frame_gives_no_wrong_message_and_the_next_comes_through);
    RUN_TEST(test_any_frame_too_late_gives_no_wrong_message_and_the_next_comes_through);
    RUN_TEST(test_the_loss_of_a_data_frame_is_never_a_message);
    RUN_TEST(test_a_sender_that_stops_at_any_frame_leaves_the_link_free_for_the_next_message);
    RUN_TEST(test_a_million_frames_of_noise_break_nothing);
    return UNITY_END();
}
