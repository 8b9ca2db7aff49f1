/* Between the stream and the queues. */
#include <string.h>

#include "slcan_internal.h"
#include "taper/types.h"

_Static_assert((TAPER_SLCAN_RECEIVE_DEPTH & (TAPER_SLCAN_RECEIVE_DEPTH - 1u)) == 0u &&
                   (TAPER_SLCAN_SEND_DEPTH & (TAPER_SLCAN_SEND_DEPTH - 1u)) == 0u,
               "free-running indices wrap at a power of two");

/** Reads of one pump, at most. */
#define READS (TAPER_SLCAN_RECEIVE_DEPTH * TAPER_SLCAN_LINE / sizeof((taper_slcan_t){0}.in))

void taper_slcan_init(taper_slcan_t *slcan, const taper_stream_t *stream) {
    memset(slcan, 0, sizeof *slcan);
    slcan->stream = *stream;
}

/* ---- Towards the stream */

static size_t room(const taper_slcan_t *slcan) {
    return sizeof slcan->out - slcan->out_length;
}

/** Append a message for which there is room; one that is out of range is nothing. */
static void put_message(taper_slcan_t *slcan, const taper_slcan_message_t *message) {
    char line[TAPER_SLCAN_LINE];
    const size_t length = taper_slcan_encode(message, line);
    memcpy(slcan->out + slcan->out_length, line, length);
    slcan->out_length = (uint8_t)(slcan->out_length + length);
}

static void put_queued(taper_slcan_t *slcan) {
    while (slcan->send_head != slcan->send_tail && room(slcan) >= TAPER_SLCAN_LINE) {
        const taper_frame_t *frame = &slcan->to_send[slcan->send_tail % TAPER_SLCAN_SEND_DEPTH];
        taper_slcan_message_t message = {.id = frame->id, .length = frame->length};
        memcpy(message.data, frame->data, sizeof message.data);
        put_message(slcan, &message);
        slcan->send_tail++;
    }
}

/** @return whether the stream took something. */
static bool write_out(taper_slcan_t *slcan) {
    put_queued(slcan);
    if (slcan->out_taken == slcan->out_length) {
        return false;
    }
    const size_t taken =
        slcan->stream.write(slcan->stream.context, (const uint8_t *)slcan->out + slcan->out_taken,
                            (size_t)(slcan->out_length - slcan->out_taken));
    slcan->out_taken = (uint8_t)(slcan->out_taken + taken);
    if (slcan->out_taken == slcan->out_length) {
        slcan->out_taken = slcan->out_length = 0;
    }
    return taken > 0;
}

bool taper_slcan_has_frame(const taper_slcan_t *slcan) {
    return slcan->receive_head != slcan->receive_tail;
}

bool taper_slcan_is_drained(const taper_slcan_t *slcan) {
    return slcan->send_head == slcan->send_tail && slcan->out_taken == slcan->out_length;
}

static void drain(taper_slcan_t *slcan) {
    while (!taper_slcan_is_drained(slcan)) {
        (void)write_out(slcan);
    }
}

void taper_slcan_send_extended(taper_slcan_t *slcan, const taper_slcan_message_t *message) {
    if (!slcan->is_open) {
        return;
    }
    drain(slcan);
    put_message(slcan, message);
    drain(slcan);
}

/* ---- From the stream */

static void take_byte(taper_slcan_t *slcan, uint8_t byte) {
    if (byte == '\r') {
        taper_slcan_obey(slcan);
        slcan->line_length = 0;
    } else if (slcan->line_length < TAPER_SLCAN_LINE) { /* a line so long is refused at its end */
        slcan->line[slcan->line_length++] = (char)byte;
    }
}

/** @return whether some bytes were looked at. */
static bool read_in(taper_slcan_t *slcan) {
    const bool was_empty = slcan->in_taken == slcan->in_length;
    if (was_empty && !slcan->holds_extended) {
        slcan->in_taken = 0;
        slcan->in_length = (uint8_t)slcan->stream.read(slcan->stream.context, slcan->in, sizeof slcan->in);
    }
    const uint8_t began = slcan->in_taken;
    while (slcan->in_taken < slcan->in_length && !slcan->holds_extended && room(slcan) >= SLCAN_ANSWER) {
        take_byte(slcan, slcan->in[slcan->in_taken++]);
    }
    return slcan->in_taken != began;
}

void taper_slcan_pump(taper_slcan_t *slcan, uint32_t now_ms) {
    slcan->now_ms = now_ms;
    for (unsigned reads = 0; reads < READS; reads++) {
        const bool wrote = write_out(slcan);
        const bool read = read_in(slcan);
        if (!wrote && !read) {
            return;
        }
    }
}

bool taper_slcan_take_extended(taper_slcan_t *slcan, taper_slcan_message_t *message) {
    if (!slcan->holds_extended) {
        return false;
    }
    *message = slcan->extended;
    slcan->holds_extended = false;
    return true;
}

/* ---- The port */

static bool port_receive(void *context, taper_frame_t *frame) {
    taper_slcan_t *slcan = context;
    if (slcan->receive_head == slcan->receive_tail) {
        return false;
    }
    *frame = slcan->received[slcan->receive_tail % TAPER_SLCAN_RECEIVE_DEPTH];
    slcan->receive_tail++;
    return true;
}

static bool is_sendable(const taper_frame_t *frame) {
    return frame->bus == 0 && frame->id <= 0x7FFu && frame->length <= TAPER_FRAME_LENGTH;
}

static bool port_send(void *context, const taper_frame_t *frame) {
    taper_slcan_t *slcan = context;
    if (!slcan->is_open || !is_sendable(frame)) {
        return false;
    }
    if (slcan->send_head - slcan->send_tail == TAPER_SLCAN_SEND_DEPTH) {
        slcan->flags |= TAPER_SLCAN_FLAG_SEND_FULL;
        return false;
    }
    slcan->to_send[slcan->send_head % TAPER_SLCAN_SEND_DEPTH] = *frame;
    slcan->send_head++;
    return true;
}

static uint32_t port_receive_overflows(void *context) {
    const taper_slcan_t *slcan = context;
    return slcan->overflows;
}

taper_port_t taper_slcan_port(taper_slcan_t *slcan) {
    const taper_port_t port = {
        .context = slcan,
        .receive = port_receive,
        .send = port_send,
        .receive_overflows = port_receive_overflows,
    };
    return port;
}
