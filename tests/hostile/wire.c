#include "wire.h"

#define CRC_POLYNOMIAL 0x2Fu
#define WINDOW         0x1Fu /* five frames */

static uint8_t crc_table[256];

static void make_crc_table(void) {
    for (unsigned byte = 0; byte < 256; byte++) {
        unsigned crc = byte;
        for (unsigned bit = 0; bit < 8; bit++) {
            crc = (crc & 0x80u) != 0u ? (crc << 1 ^ CRC_POLYNOMIAL) & 0xFFu : crc << 1;
        }
        crc_table[byte] = (uint8_t)crc;
    }
}

static uint8_t data_id(uint32_t id, uint32_t counter) {
    uint32_t x = id << 4 | counter;
    x ^= x >> 7;
    x *= UINT32_C(0x9E3779B1);
    x ^= x >> 15;
    x *= UINT32_C(0x85EBCA6B);
    x ^= x >> 13;
    return (uint8_t)(x >> 24);
}

static uint8_t crc_of(const taper_frame_t *frame) {
    if (crc_table[1] == 0) {
        make_crc_table();
    }
    uint8_t crc = 0xFF;
    for (unsigned k = 1; k < TAPER_FRAME_LENGTH; k++) {
        crc = crc_table[crc ^ frame->data[k]];
    }
    return crc_table[crc ^ data_id(frame->id, frame->data[1] & 0x0Fu)] ^ 0xFF;
}

taper_frame_t wire_frame(unsigned function, unsigned node) {
    return (taper_frame_t){.id = (uint16_t)(function << 6 | node), .length = TAPER_FRAME_LENGTH};
}

unsigned wire_function(const taper_frame_t *frame) {
    return (unsigned)frame->id >> 6;
}

unsigned wire_node(const taper_frame_t *frame) {
    return frame->id & 0x3Fu;
}

static uint64_t payload(const taper_frame_t *frame) {
    uint64_t bits = 0;
    for (unsigned k = TAPER_FRAME_LENGTH; k-- > 0;) {
        bits = bits << 8 | frame->data[k];
    }
    return bits;
}

static uint64_t mask_of(unsigned length) {
    return (UINT64_C(1) << length) - 1u;
}

void wire_put(taper_frame_t *frame, unsigned start, unsigned length, uint32_t value) {
    const uint64_t mask = mask_of(length) << start;
    const uint64_t bits = (payload(frame) & ~mask) | ((uint64_t)value << start & mask);
    for (unsigned k = 0; k < TAPER_FRAME_LENGTH; k++) {
        frame->data[k] = (uint8_t)(bits >> (8u * k));
    }
}

uint32_t wire_get(const taper_frame_t *frame, unsigned start, unsigned length) {
    return (uint32_t)(payload(frame) >> start & mask_of(length));
}

int32_t wire_get_signed(const taper_frame_t *frame, unsigned start, unsigned length) {
    const int64_t value = wire_get(frame, start, length);
    const int64_t sign = (int64_t)1 << (length - 1u);
    return (int32_t)((value & sign) != 0 ? value - 2 * sign : value);
}

void wire_seal(taper_frame_t *frame, unsigned counter) {
    frame->data[1] = (uint8_t)((frame->data[1] & 0xF0u) | (counter & 0x0Fu));
    frame->data[0] = crc_of(frame);
}

bool wire_is_sound(const taper_frame_t *frame) {
    return frame->length == TAPER_FRAME_LENGTH && frame->data[0] == crc_of(frame);
}

static unsigned ones(unsigned bits) {
    unsigned count = 0;
    for (; bits != 0u; bits &= bits - 1u) {
        count++;
    }
    return count;
}

bool wire_accepts(wire_receiver_t *receiver, const taper_frame_t *frame) {
    const bool sound = wire_is_sound(frame);
    const uint8_t counter = frame->data[1] & 0x0Fu;
    const unsigned delta = receiver->heard ? (unsigned)(counter - receiver->counter) & 0x0Fu : 1u;
    if (sound && delta == 0u) {
        return false; /* repeated: no news either way */
    }
    const bool good = sound && delta <= 3u;
    receiver->errors = (uint8_t)(((unsigned)receiver->errors << 1 | (good ? 0u : 1u)) & WINDOW);
    if (sound) {
        receiver->heard = true;
        receiver->counter = counter;
    }
    return good && ones(receiver->errors) <= 2u;
}

wire_setpoint_t wire_setpoint(const taper_frame_t *frame) {
    return (wire_setpoint_t){.command = wire_get(frame, 12, 4),
                             .current_mA = (int32_t)wire_get(frame, 16, 16) * 100,
                             .validity_ms = wire_get(frame, 32, 8) * 500u,
                             .fallback_mA = (int32_t)wire_get(frame, 40, 8) * 500,
                             .phase_mask = wire_get(frame, 48, 3),
                             .session = (uint8_t)wire_get(frame, 56, 8),
                             .counter = (uint8_t)wire_get(frame, 8, 4)};
}
