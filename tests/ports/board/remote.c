#include "remote.h"

#include <string.h>

taper_slcan_message_t remote_message(remote_kind_t kind, unsigned index, const void *data, uint8_t length) {
    taper_slcan_message_t message = {
        .id = REMOTE_ID | (uint32_t)kind << 8 | (index & 0xFFu), .is_extended = true, .length = length};
    memcpy(message.data, data, length);
    return message;
}

static void put_u32(uint8_t *to, uint32_t value) {
    for (unsigned i = 0; i < 4; i++) {
        to[i] = (uint8_t)(value >> (8u * i));
    }
}

static uint32_t get_u32(const uint8_t *from) {
    return from[0] | (uint32_t)from[1] << 8 | (uint32_t)from[2] << 16 | (uint32_t)from[3] << 24;
}

taper_slcan_message_t remote_value(remote_kind_t kind, unsigned index, uint32_t value) {
    uint8_t data[4];
    put_u32(data, value);
    return remote_message(kind, index, data, sizeof data);
}

unsigned remote_kind(const taper_slcan_message_t *message) {
    return message->is_extended && (message->id & 0xFFFF0000u) == REMOTE_ID ? message->id >> 8 & 0xFFu : 0;
}

unsigned remote_index(const taper_slcan_message_t *message) {
    return message->id & 0xFFu;
}

uint32_t remote_u32(const taper_slcan_message_t *message) {
    return get_u32(message->data);
}

void remote_pack(const taper_frame_t *frame, uint8_t words[16]) {
    words[0] = (uint8_t)frame->id;
    words[1] = (uint8_t)(frame->id >> 8);
    words[2] = frame->bus;
    words[3] = frame->length;
    put_u32(words + 4, frame->time_ms);
    memcpy(words + 8, frame->data, TAPER_FRAME_LENGTH);
}

void remote_unpack(const uint8_t words[16], taper_frame_t *frame) {
    frame->id = (uint16_t)(words[0] | words[1] << 8);
    frame->bus = words[2];
    frame->length = words[3];
    frame->time_ms = get_u32(words + 4);
    memcpy(frame->data, words + 8, TAPER_FRAME_LENGTH);
}
