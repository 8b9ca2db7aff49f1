#include "isotp_bench.h"

#include <stdlib.h>

#include "scene.h"
#include "unity.h"

taper_isotp_options_t bench_options(uint8_t *buffer, uint16_t capacity) {
    return (taper_isotp_options_t){
        .send_id = BENCH_SEND_ID,
        .receive_id = BENCH_RECEIVE_ID,
        .waits = 3,
        .timeout_ms = BENCH_TIMEOUT_ms,
        .buffer = buffer,
        .capacity = capacity,
    };
}

taper_isotp_options_t bench_peer_options(uint8_t *buffer, uint16_t capacity) {
    taper_isotp_options_t options = bench_options(buffer, capacity);
    options.send_id = BENCH_RECEIVE_ID;
    options.receive_id = BENCH_SEND_ID;
    return options;
}

static uint8_t parse(const char *text, uint8_t *bytes) {
    uint8_t count = 0;
    char *end = NULL;
    for (const char *at = text; *at != '\0'; at = end) {
        TEST_ASSERT_LESS_THAN(TAPER_FRAME_LENGTH, count);
        bytes[count] = (uint8_t)strtoul(at, &end, 16);
        TEST_ASSERT_TRUE(end != at);
        count++;
    }
    return count;
}

taper_frame_t bench_frame(const char *bytes) {
    taper_frame_t frame = {.id = BENCH_RECEIVE_ID};
    frame.length = parse(bytes, frame.data);
    return frame;
}

void bench_take(taper_isotp_t *link, const char *bytes, uint32_t now_ms) {
    const taper_frame_t frame = bench_frame(bytes);
    TEST_ASSERT_TRUE(taper_isotp_take(link, &frame, now_ms));
}

void bench_gives(taper_isotp_t *link, const char *bytes, uint32_t now_ms) {
    uint8_t expected[TAPER_FRAME_LENGTH];
    taper_frame_t frame;
    TEST_ASSERT_EQUAL_UINT8(TAPER_FRAME_LENGTH, parse(bytes, expected));
    TEST_ASSERT_TRUE_MESSAGE(taper_isotp_next(link, now_ms, &frame), bytes);
    TEST_ASSERT_EQUAL_HEX16(link->options.send_id, frame.id);
    TEST_ASSERT_EQUAL_UINT8(TAPER_FRAME_LENGTH, frame.length);
    TEST_ASSERT_EQUAL_HEX8_ARRAY(expected, frame.data, TAPER_FRAME_LENGTH);
    taper_isotp_sent(link, now_ms);
}

void bench_gives_nothing(taper_isotp_t *link, uint32_t now_ms) {
    taper_frame_t frame;
    TEST_ASSERT_FALSE(taper_isotp_next(link, now_ms, &frame));
}

void bench_fill(uint8_t *data, uint16_t length, uint32_t seed) {
    uint32_t state = seed * 2654435761u + 1u;
    for (uint16_t i = 0; i < length; i++) {
        data[i] = (uint8_t)(scene_random(&state) >> 24);
    }
}

static bool move(taper_isotp_t *from, taper_isotp_t *to, uint32_t now_ms) {
    taper_frame_t frame;
    if (!taper_isotp_next(from, now_ms, &frame)) {
        return false;
    }
    taper_isotp_sent(from, now_ms);
    TEST_ASSERT_TRUE(taper_isotp_take(to, &frame, now_ms));
    return true;
}

bool bench_exchange(taper_isotp_t *a, taper_isotp_t *b, uint32_t now_ms) {
    const bool there = move(a, b, now_ms);
    const bool back = move(b, a, now_ms);
    return there || back;
}

uint32_t bench_run(taper_isotp_t *a, taper_isotp_t *b, uint32_t now_ms) {
    while (taper_isotp_busy(a) || taper_isotp_busy(b)) {
        while (bench_exchange(a, b, now_ms)) {
        }
        now_ms++;
    }
    return now_ms;
}

void bench_holds(const taper_isotp_t *link, const uint8_t *data, uint16_t length) {
    uint16_t got = 0;
    TEST_ASSERT_EQUAL(TAPER_ISOTP_DONE, taper_isotp_received(link, &got));
    TEST_ASSERT_EQUAL_UINT16(length, got);
    TEST_ASSERT_EQUAL_HEX8_ARRAY(data, link->options.buffer, length);
}

taper_isotp_state_t bench_received(const taper_isotp_t *link) {
    uint16_t length = 0;
    return taper_isotp_received(link, &length);
}
