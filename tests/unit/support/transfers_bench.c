#include "transfers_bench.h"

#include <string.h>

#include "scene.h"
#include "unity.h"

taper_transfers_t transfers;
taper_transfer_scene_t scene;
taper_transfer_content_t content;
bench_peer_t gateway, tool;

static taper_event_log_t events;

void bench_open_peer(bench_peer_t *peer, uint8_t bus, uint8_t node) {
    const taper_isotp_options_t options = {
        .send_id = (uint16_t)(0x640u | node),
        .receive_id = (uint16_t)(0x600u | node),
        .bus = bus,
        .waits = 3,
        .timeout_ms = 1000,
        .buffer = peer->buffer,
        .capacity = sizeof peer->buffer,
    };
    TEST_ASSERT_EQUAL(TAPER_OK, taper_isotp_init(&peer->link, &options));
}

void bench_start(void) {
    memset(&events, 0, sizeof events);
    memset(&content, 0, sizeof content);
    scene = (taper_transfer_scene_t){.now_ms = BENCH_NOW_ms,
                                     .clock_is_set = true,
                                     .unix_s = BENCH_UNIX_s,
                                     .time_scale = 1,
                                     .events = &events};
    taper_transfers_init(&transfers, scene_four());
    bench_open_peer(&gateway, 0, TAPER_NODE_GATEWAY);
    bench_open_peer(&tool, 0, TAPER_NODE_TOOL);
}

static void put(uint8_t *to, uint32_t value, unsigned bytes) {
    for (unsigned i = 0; i < bytes; i++) {
        to[i] = (uint8_t)(value >> 8 * i);
    }
}

uint16_t bench_seal(uint8_t *message, uint8_t type, uint16_t count, const void *items, uint16_t bytes) {
    message[0] = 1;
    message[1] = type;
    put(message + 2, count, 2);
    memmove(message + 4, items, bytes);
    put(message + 4 + bytes, taper_crc32(message, 4u + bytes), 4);
    return (uint16_t)(bytes + 8);
}

uint16_t bench_curve(uint8_t *message, uint16_t count, const uint32_t *unix_s, const uint16_t *limits_100W) {
    uint8_t items[TAPER_MAX_LIMIT_POINTS * 6];
    TEST_ASSERT_TRUE(count <= TAPER_MAX_LIMIT_POINTS);
    for (uint16_t k = 0; k < count; k++) {
        put(items + k * 6u, unix_s[k], 4);
        put(items + k * 6u + 4, limits_100W[k], 2);
    }
    return bench_seal(message, TAPER_TRANSFER_LIMIT_CURVE, count, items, (uint16_t)(count * 6u));
}

void bench_send(bench_peer_t *peer, const uint8_t *message, uint16_t length) {
    taper_isotp_release(&peer->link, scene.now_ms);
    taper_isotp_cancel(&peer->link);
    TEST_ASSERT_EQUAL(TAPER_OK, taper_isotp_send(&peer->link, message, length, scene.now_ms));
}

bool bench_from_peer(bench_peer_t *peer, taper_transfer_result_t *result) {
    taper_frame_t frame;
    if (!taper_isotp_next(&peer->link, scene.now_ms, &frame)) {
        return false;
    }
    taper_isotp_sent(&peer->link, scene.now_ms);
    *result = taper_transfers_take(&transfers, &frame, &scene, &content);
    return true;
}

bool bench_to_peer(bench_peer_t *peer) {
    taper_frame_t frame;
    if (!taper_transfers_next(&transfers, scene.now_ms, &frame)) {
        return false;
    }
    taper_transfers_sent(&transfers, &frame, scene.now_ms);
    (void)taper_isotp_take(&gateway.link, &frame, scene.now_ms);
    (void)taper_isotp_take(&tool.link, &frame, scene.now_ms);
    if (peer != &gateway && peer != &tool) {
        (void)taper_isotp_take(&peer->link, &frame, scene.now_ms);
    }
    return true;
}

static bool anybody_busy(const bench_peer_t *peer) {
    return taper_isotp_busy(&peer->link) || taper_isotp_busy(&transfers.gateway) ||
           taper_isotp_busy(&transfers.tool) || taper_isotp_busy(&transfers.connector);
}

taper_transfer_result_t bench_settle(bench_peer_t *peer) {
    taper_transfer_result_t last = TAPER_RESULT_NONE;
    while (anybody_busy(peer)) {
        taper_transfer_result_t result = TAPER_RESULT_NONE;
        (void)bench_from_peer(peer, &result);
        if (result == TAPER_RESULT_CURVE || result == TAPER_RESULT_PRICE) {
            taper_transfers_answer(&transfers, TAPER_ANSWER_ACCEPTED, scene.now_ms);
        }
        (void)bench_to_peer(peer);
        last = result == TAPER_RESULT_NONE ? last : result;
        scene.now_ms++;
    }
    return last;
}

taper_transfer_result_t bench_transfer(bench_peer_t *peer, const uint8_t *message, uint16_t length) {
    bench_send(peer, message, length);
    return bench_settle(peer);
}

void bench_answered(bench_peer_t *peer, taper_transfer_answer_t answer) {
    uint8_t expected[9];
    const uint8_t item = (uint8_t)answer;
    uint16_t length = 0;
    TEST_ASSERT_EQUAL(TAPER_ISOTP_DONE, taper_isotp_received(&peer->link, &length));
    TEST_ASSERT_EQUAL_UINT16(bench_seal(expected, TAPER_TRANSFER_ANSWER, 1, &item, 1), length);
    TEST_ASSERT_EQUAL_HEX8_ARRAY(expected, peer->buffer, length);
    taper_isotp_release(&peer->link, scene.now_ms);
}

void bench_not_answered(const bench_peer_t *peer) {
    uint16_t length = 0;
    TEST_ASSERT_EQUAL(TAPER_ISOTP_IDLE, taper_isotp_received(&peer->link, &length));
}
