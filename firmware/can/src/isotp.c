#include "taper/isotp.h"

#include <string.h>

/* ISO 15765-2:2016, 9.6: the high nibble of the first byte says what a frame is. */
#define KIND_SHIFT       4
#define KIND_SINGLE      0u
#define KIND_FIRST       1u
#define KIND_CONSECUTIVE 2u
#define KIND_FLOW        3u
#define LOW_NIBBLE       0x0Fu

#define FLOW_CONTINUE 0u
#define FLOW_WAIT     1u
#define FLOW_OVERFLOW 2u
#define FLOW_LENGTH   3u

#define PADDING           0xCCu
#define FIRST_BYTES       6u /* of the message, in its first frame */
#define CONSECUTIVE_BYTES 7u

#define GIVEN_NOTHING 0u
#define GIVEN_FLOW    1u
#define GIVEN_DATA    2u

taper_status_t taper_isotp_init(taper_isotp_t *link, const taper_isotp_options_t *options) {
    const bool ids_good = options->send_id <= 0x7FFu && options->receive_id <= 0x7FFu &&
                          options->send_id != options->receive_id;
    const bool buffer_good =
        (options->buffer != NULL || options->capacity == 0) && options->capacity <= TAPER_ISOTP_LONGEST;
    if (!ids_good || !buffer_good || options->separation_ms > TAPER_ISOTP_SEPARATION_MAX_ms ||
        options->timeout_ms == 0) {
        return TAPER_ERR_ARGUMENT;
    }
    memset(link, 0, sizeof *link);
    link->options = *options;
    return TAPER_OK;
}

static uint16_t least(uint32_t a, uint32_t b) {
    return (uint16_t)(a < b ? a : b);
}

/** More than the timeout after `since_ms`; a `now_ms` a little before it is not. */
static bool expired(const taper_isotp_t *link, uint32_t since_ms, uint32_t now_ms) {
    return !taper_time_reached(since_ms + link->options.timeout_ms, now_ms);
}

static void flow_is_due(taper_isotp_t *link, uint8_t status) {
    link->in.flow_due = true;
    link->in.flow_status = status;
    if (link->given == GIVEN_FLOW) { /* an older one: that it is out says nothing about this one */
        link->given = GIVEN_NOTHING;
    }
}

static void judge_in(taper_isotp_t *link, uint32_t now_ms) {
    const bool late = expired(link, link->in.since_ms, now_ms);
    if (link->in.state == TAPER_ISOTP_BUSY && late) {
        link->in.state = TAPER_ISOTP_TIMEOUT;
        link->in.flow_due = false;
    }
    if (link->in.flow_due && link->in.flow_status == FLOW_OVERFLOW && late) {
        link->in.flow_due = false; /* nobody waits for it any more */
    }
    const bool held = link->in.state == TAPER_ISOTP_DONE && link->in.next_length > TAPER_ISOTP_SINGLE;
    if (held && !link->in.flow_due &&
        taper_time_reached(now_ms, link->in.since_ms + link->options.timeout_ms / 2)) {
        flow_is_due(link, FLOW_WAIT);
    }
}

static void judge_out(taper_isotp_t *link, uint32_t now_ms) {
    if (link->out.state == TAPER_ISOTP_BUSY && expired(link, link->out.since_ms + link->out.gap_ms, now_ms)) {
        link->out.state = TAPER_ISOTP_TIMEOUT;
    }
}

/** A message of `length` begins with `bytes`, into a buffer that is free. */
static void begin(taper_isotp_t *link, uint16_t length, const uint8_t *bytes) {
    const bool single = length <= TAPER_ISOTP_SINGLE;
    link->in.next_length = 0;
    link->in.flow_due = false;
    link->in.length = length;
    link->in.got = 0;
    if (length > link->options.capacity) {
        link->in.state = TAPER_ISOTP_OVERFLOW;
        if (!single) {
            flow_is_due(link, FLOW_OVERFLOW);
        }
        return;
    }
    link->in.got = single ? length : FIRST_BYTES;
    memcpy(link->options.buffer, bytes, link->in.got);
    link->in.state = single ? TAPER_ISOTP_DONE : TAPER_ISOTP_BUSY;
    link->in.sequence = 1;
    link->in.in_block = 0;
    if (!single) {
        flow_is_due(link, FLOW_CONTINUE);
    }
}

/** The same while the buffer holds a message that nobody has released yet. */
static void let_wait(taper_isotp_t *link, uint16_t length, const uint8_t *bytes) {
    link->in.next_length = 0;
    link->in.flow_due = false;
    if (length > link->options.capacity) {
        flow_is_due(link, FLOW_OVERFLOW);
        return;
    }
    link->in.next_length = length;
    memcpy(link->in.next, bytes, length <= TAPER_ISOTP_SINGLE ? length : FIRST_BYTES);
    if (length > TAPER_ISOTP_SINGLE) {
        flow_is_due(link, FLOW_WAIT);
    }
}

static void arrives(taper_isotp_t *link, uint16_t length, const uint8_t *bytes, uint32_t now_ms) {
    link->in.since_ms = now_ms;
    if (link->in.state == TAPER_ISOTP_DONE) {
        let_wait(link, length, bytes);
    } else {
        begin(link, length, bytes);
    }
}

static void take_single(taper_isotp_t *link, const taper_frame_t *frame, uint32_t now_ms) {
    const uint16_t length = frame->data[0] & LOW_NIBBLE;
    if (length > 0 && length < frame->length) { /* 0 is the escape of CAN FD */
        arrives(link, length, &frame->data[1], now_ms);
    }
}

static void take_first(taper_isotp_t *link, const taper_frame_t *frame, uint32_t now_ms) {
    const unsigned length = (unsigned)(frame->data[0] & LOW_NIBBLE) << 8 | frame->data[1];
    if (frame->length < TAPER_FRAME_LENGTH || (length > 0 && length <= TAPER_ISOTP_SINGLE)) {
        return;
    }
    /* 0 is the escape to more than 4095: longer than any buffer. */
    arrives(link, length == 0 ? UINT16_MAX : (uint16_t)length, &frame->data[2], now_ms);
}

static void take_consecutive(taper_isotp_t *link, const taper_frame_t *frame, uint32_t now_ms) {
    const uint16_t bytes = least((uint32_t)link->in.length - link->in.got, CONSECUTIVE_BYTES);
    if (link->in.state != TAPER_ISOTP_BUSY || link->in.flow_due || frame->length < 1 + bytes) {
        return;
    }
    if ((frame->data[0] & LOW_NIBBLE) != link->in.sequence) {
        link->in.state = TAPER_ISOTP_SEQUENCE;
        return;
    }
    memcpy(&link->options.buffer[link->in.got], &frame->data[1], bytes);
    link->in.got = (uint16_t)(link->in.got + bytes);
    link->in.sequence = (link->in.sequence + 1u) & LOW_NIBBLE;
    link->in.since_ms = now_ms;
    link->in.in_block++; /* wraps only where nobody looks at it: a block size is at most 255 */
    if (link->in.got == link->in.length) {
        link->in.state = TAPER_ISOTP_DONE;
    } else if (link->options.block_size > 0 && link->in.in_block == link->options.block_size) {
        link->in.in_block = 0;
        flow_is_due(link, FLOW_CONTINUE);
    }
}

/** ISO 15765-2:2016, 9.6.5.4, and the millisecond that the clock may hide. */
static uint32_t separation_ms(uint8_t wire) {
    if (wire == 0) {
        return 0;
    }
    if (wire >= 0xF1u && wire <= 0xF9u) { /* 100..900 us */
        return 1 + 1;
    }
    return (uint32_t)least(wire, TAPER_ISOTP_SEPARATION_MAX_ms) + 1;
}

static void go_on(taper_isotp_t *link, uint8_t block_size, uint8_t separation) {
    link->out.waiting_for_flow = false;
    link->out.waits = 0;
    link->out.unlimited_block = block_size == 0;
    link->out.left_in_block = block_size;
    link->out.separation_ms = separation_ms(separation);
    link->out.gap_ms = 0;
}

static void take_flow(taper_isotp_t *link, const taper_frame_t *frame, uint32_t now_ms) {
    const bool expected = link->out.state == TAPER_ISOTP_BUSY && link->out.waiting_for_flow;
    if (!expected || frame->length < FLOW_LENGTH) {
        return;
    }
    const unsigned status = frame->data[0] & LOW_NIBBLE;
    link->out.since_ms = now_ms;
    if (status == FLOW_CONTINUE) {
        go_on(link, frame->data[1], frame->data[2]);
    } else if (status == FLOW_WAIT && link->out.waits < link->options.waits) {
        link->out.waits++;
    } else {
        link->out.state = status == FLOW_OVERFLOW ? TAPER_ISOTP_OVERFLOW : TAPER_ISOTP_REFUSED;
    }
}

bool taper_isotp_take(taper_isotp_t *link, const taper_frame_t *frame, uint32_t now_ms) {
    if (frame->bus != link->options.bus || frame->id != link->options.receive_id) {
        return false;
    }
    if (frame->length == 0 || frame->length > TAPER_FRAME_LENGTH) {
        return true;
    }
    judge_in(link, now_ms);
    judge_out(link, now_ms);
    switch (frame->data[0] >> KIND_SHIFT) {
    case KIND_SINGLE: take_single(link, frame, now_ms); break;
    case KIND_FIRST: take_first(link, frame, now_ms); break;
    case KIND_CONSECUTIVE: take_consecutive(link, frame, now_ms); break;
    case KIND_FLOW: take_flow(link, frame, now_ms); break;
    default: break;
    }
    return true;
}

static void fill_flow(const taper_isotp_t *link, taper_frame_t *frame) {
    frame->data[0] = (uint8_t)(KIND_FLOW << KIND_SHIFT | link->in.flow_status);
    frame->data[1] = link->options.block_size;
    frame->data[2] = link->options.separation_ms;
}

/** Bytes of the message in the next frame. */
static uint16_t data_bytes(const taper_isotp_t *link) {
    if (link->out.length <= TAPER_ISOTP_SINGLE) {
        return link->out.length;
    }
    return link->out.sent == 0 ? FIRST_BYTES
                               : least((uint32_t)link->out.length - link->out.sent, CONSECUTIVE_BYTES);
}

static void fill_data(const taper_isotp_t *link, taper_frame_t *frame) {
    uint8_t header = 1;
    if (link->out.length <= TAPER_ISOTP_SINGLE) {
        frame->data[0] = (uint8_t)link->out.length;
    } else if (link->out.sent == 0) {
        frame->data[0] = (uint8_t)(KIND_FIRST << KIND_SHIFT | link->out.length >> 8);
        frame->data[1] = (uint8_t)link->out.length;
        header = 2;
    } else {
        frame->data[0] = (uint8_t)(KIND_CONSECUTIVE << KIND_SHIFT | link->out.sequence);
    }
    memcpy(&frame->data[header], &link->out.data[link->out.sent], data_bytes(link));
}

static bool data_is_due(const taper_isotp_t *link, uint32_t now_ms) {
    return link->out.state == TAPER_ISOTP_BUSY && !link->out.waiting_for_flow &&
           taper_time_reached(now_ms, link->out.since_ms + link->out.gap_ms);
}

bool taper_isotp_next(taper_isotp_t *link, uint32_t now_ms, taper_frame_t *frame) {
    judge_in(link, now_ms);
    judge_out(link, now_ms);
    link->given = GIVEN_NOTHING;
    if (!link->in.flow_due && !data_is_due(link, now_ms)) {
        return false;
    }
    *frame =
        (taper_frame_t){.id = link->options.send_id, .bus = link->options.bus, .length = TAPER_FRAME_LENGTH};
    memset(frame->data, PADDING, sizeof frame->data);
    if (link->in.flow_due) {
        fill_flow(link, frame);
        link->given = GIVEN_FLOW;
    } else {
        fill_data(link, frame);
        link->given = GIVEN_DATA;
    }
    return true;
}

static void flow_is_out(taper_isotp_t *link, uint32_t now_ms) {
    link->in.flow_due = false;
    link->in.since_ms = now_ms;
}

static void wait_for_flow(taper_isotp_t *link) {
    link->out.waiting_for_flow = true;
    link->out.gap_ms = 0;
}

static void data_is_out(taper_isotp_t *link, uint32_t now_ms) {
    const bool first = link->out.sent == 0;
    link->out.sent = (uint16_t)(link->out.sent + data_bytes(link));
    link->out.since_ms = now_ms;
    if (link->out.sent == link->out.length) {
        link->out.state = TAPER_ISOTP_DONE;
        return;
    }
    link->out.sequence = (link->out.sequence + 1u) & LOW_NIBBLE;
    link->out.gap_ms = link->out.separation_ms;
    link->out.left_in_block--; /* before the first flow control, and without blocks, nobody looks at it */
    if (first || (!link->out.unlimited_block && link->out.left_in_block == 0)) {
        wait_for_flow(link);
    }
}

void taper_isotp_sent(taper_isotp_t *link, uint32_t now_ms) {
    if (link->given == GIVEN_FLOW && link->in.flow_due) {
        flow_is_out(link, now_ms);
    }
    if (link->given == GIVEN_DATA && link->out.state == TAPER_ISOTP_BUSY) {
        data_is_out(link, now_ms);
    }
    link->given = GIVEN_NOTHING;
}

taper_status_t taper_isotp_send(taper_isotp_t *link, const uint8_t *data, uint16_t length, uint32_t now_ms) {
    if (length == 0 || length > TAPER_ISOTP_LONGEST || link->out.state == TAPER_ISOTP_BUSY) {
        return TAPER_ERR_ARGUMENT;
    }
    memset(&link->out, 0, sizeof link->out);
    link->out.state = TAPER_ISOTP_BUSY;
    link->out.data = data;
    link->out.length = length;
    link->out.since_ms = now_ms;
    return TAPER_OK;
}

void taper_isotp_cancel(taper_isotp_t *link) {
    if (link->out.state == TAPER_ISOTP_BUSY) {
        link->out.state = TAPER_ISOTP_IDLE;
    }
    if (link->given == GIVEN_DATA) { /* that it is out says nothing about the next message */
        link->given = GIVEN_NOTHING;
    }
}

taper_isotp_state_t taper_isotp_received(const taper_isotp_t *link, uint16_t *length) {
    *length = link->in.state == TAPER_ISOTP_DONE ? link->in.length : 0;
    return link->in.state;
}

void taper_isotp_release(taper_isotp_t *link, uint32_t now_ms) {
    if (link->in.state == TAPER_ISOTP_BUSY) {
        return;
    }
    link->in.state = TAPER_ISOTP_IDLE;
    if (link->in.next_length > 0) {
        link->in.since_ms = now_ms;
        begin(link, link->in.next_length, link->in.next);
    }
}

taper_isotp_state_t taper_isotp_sending(const taper_isotp_t *link) {
    return link->out.state;
}

bool taper_isotp_busy(const taper_isotp_t *link) {
    return link->in.state == TAPER_ISOTP_BUSY || link->in.flow_due || link->in.next_length > 0 ||
           link->out.state == TAPER_ISOTP_BUSY;
}
