#include "codec_bench.h"

#include <string.h>

#include "unity.h"

const taper_message_kind_t codec_bench_kinds[CODEC_BENCH_KINDS] = {
    TAPER_MESSAGE_EMCY,        TAPER_MESSAGE_SITE_LIMIT, TAPER_MESSAGE_SETPOINT,   TAPER_MESSAGE_EVSE_STATUS,
    TAPER_MESSAGE_EV_STATUS,   TAPER_MESSAGE_EVSE_ELEC,  TAPER_MESSAGE_SITE_METER, TAPER_MESSAGE_TIME_SYNC,
    TAPER_MESSAGE_CTRL_STATUS, TAPER_MESSAGE_EV_PARAM_A, TAPER_MESSAGE_EV_PARAM_B, TAPER_MESSAGE_EV_PARAM_C,
    TAPER_MESSAGE_EV_PARAM_D,  TAPER_MESSAGE_EVSE_INFO,  TAPER_MESSAGE_PLAN,       TAPER_MESSAGE_OUTLOOK,
    TAPER_MESSAGE_CTRL_DIAG,   TAPER_MESSAGE_EV_PARAM_E,
};

uint8_t codec_bench_node_of(taper_message_kind_t kind) {
    switch (kind) {
    case TAPER_MESSAGE_SITE_LIMIT:
    case TAPER_MESSAGE_SITE_METER:
    case TAPER_MESSAGE_TIME_SYNC: return TAPER_NODE_GATEWAY;
    case TAPER_MESSAGE_CTRL_DIAG:
    case TAPER_MESSAGE_CTRL_STATUS: return TAPER_NODE_CONTROLLER;
    default: return CODEC_BENCH_CONNECTOR;
    }
}

taper_message_t codec_bench_message_of(taper_message_kind_t kind) {
    taper_message_t message;
    memset(&message, 0, sizeof message);
    message.kind = kind;
    message.node = codec_bench_node_of(kind);
    return message;
}

taper_frame_t codec_bench_encode(const taper_message_t *message) {
    taper_frame_t frame;
    TEST_ASSERT_TRUE(taper_encode(message, &frame));
    return frame;
}

taper_message_t codec_bench_decode(const taper_frame_t *frame) {
    taper_message_t message;
    bool bad = false;
    TEST_ASSERT_TRUE(taper_decode(frame, &message, &bad));
    TEST_ASSERT_FALSE(bad);
    return message;
}

taper_frame_t codec_bench_frame_of(taper_message_kind_t kind) {
    const taper_message_t message = codec_bench_message_of(kind);
    return codec_bench_encode(&message);
}

void codec_bench_identifiers(uint16_t ids[CODEC_BENCH_IDS]) {
    unsigned count = 0;
    for (unsigned id = 0; id < 0x800u; id++) {
        const taper_frame_t frame = {.id = (uint16_t)id, .length = TAPER_FRAME_LENGTH};
        taper_message_t message;
        bool bad = false;
        if (taper_decode(&frame, &message, &bad)) {
            TEST_ASSERT_LESS_THAN_UINT(CODEC_BENCH_IDS, count);
            ids[count++] = (uint16_t)id;
        }
    }
    TEST_ASSERT_EQUAL_UINT(CODEC_BENCH_IDS, count);
}
