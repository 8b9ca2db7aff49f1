/**
 * Bytes of an attached side that may send anything -> the SLCAN adapter. What comes out of it, on either side, is in range,
 * in order and of the protocol.
 *
 * An input is what the attached side says. Bytes from 0x80 on are not said; they are events between: the station sends a
 * frame, takes what it received, extended frames are taken, the stream stops or goes on, time passes.
 */
#include <string.h>

#include "check.h"
#include "fuzz_slcan.h"
#include "taper/slcan.h"

/** Bytes that wait for a stream that stands still; more of an input are not said. */
#define SAID_AT_ONCE 65536u

fuzz_slcan_stats_t fuzz_slcan_stats;

static struct {
    taper_slcan_t slcan;
    taper_port_t port;
    uint8_t said[SAID_AT_ONCE];
    size_t said_head, said_tail;
    size_t chunk; /**< most bytes that one call moves; 0: the stream takes nothing */
    char heard[TAPER_SLCAN_LINE];
    size_t heard_length;
    uint32_t now_ms, last_ms;
    uint32_t next_sent, next_heard; /**< running numbers of the station's frames */
} world;

/* ---- The attached side: every line that it hears is one that LAWICEL has */

static bool is_answer(const char *line, size_t length) {
    static const char *const whole[] = {"", "z", "Z", "V1013", "NTAPR", "F00", "F01", "F08", "F09"};
    for (unsigned i = 0; i < sizeof whole / sizeof whole[0]; i++) {
        if (strlen(whole[i]) == length && memcmp(whole[i], line, length) == 0) {
            return true;
        }
    }
    return false;
}

/** Frames of the station have a running number; some are thrown away when the channel is closed, none comes twice. */
static void hear_frame(void) {
    taper_slcan_message_t message;
    uint32_t number;
    check_that(taper_slcan_decode(world.heard, world.heard_length, &message), "an answer that is none",
               world.heard[0]);
    check_that(!message.is_extended && !message.is_remote && message.length == 8, "a frame never sent",
               message.id);
    memcpy(&number, message.data, sizeof number);
    check_that(number >= world.next_heard && number < world.next_sent, "number of a frame", number);
    check_that(message.id == (number & 0x7FFu), "identifier of a frame", message.id);
    world.next_heard = number + 1;
    fuzz_slcan_stats.sent++;
}

static void hear(char letter) {
    if (letter == '\a') {
        check_that(world.heard_length == 0, "BEL within a line", world.heard[0]);
        fuzz_slcan_stats.refused++;
    } else if (letter != '\r') {
        check_that(world.heard_length < sizeof world.heard, "a line too long", letter);
        world.heard[world.heard_length++] = letter;
    } else {
        if (!is_answer(world.heard, world.heard_length)) {
            hear_frame();
        }
        world.heard_length = 0;
    }
}

static size_t adapter_write(void *context, const uint8_t *data, size_t size) {
    const size_t count = size < world.chunk ? size : world.chunk;
    (void)context;
    for (size_t i = 0; i < count; i++) {
        hear((char)data[i]);
    }
    return count;
}

static size_t adapter_read(void *context, uint8_t *data, size_t size) {
    const size_t limit = size < world.chunk ? size : world.chunk;
    size_t count = 0;
    (void)context;
    while (count < limit && world.said_tail < world.said_head) {
        data[count++] = world.said[world.said_tail++];
    }
    return count;
}

/* ---- The station */

static void receive_all(void) {
    taper_frame_t frame;
    while (world.port.receive(world.port.context, &frame)) {
        check_that(frame.id <= 0x7FFu, "received id", frame.id);
        check_that(frame.bus == 0, "received bus", frame.bus);
        check_that(frame.length <= TAPER_FRAME_LENGTH, "received length", frame.length);
        check_that(frame.time_ms >= world.last_ms && frame.time_ms <= world.now_ms, "received time",
                   frame.time_ms);
        for (unsigned i = frame.length; i < TAPER_FRAME_LENGTH; i++) {
            check_that(frame.data[i] == 0, "received behind the data", frame.data[i]);
        }
        world.last_ms = frame.time_ms;
        fuzz_slcan_stats.received++;
    }
}

static void take_extended(void) {
    taper_slcan_message_t message;
    while (taper_slcan_take_extended(&world.slcan, &message)) {
        check_that(message.is_extended && !message.is_remote, "extended flags", message.id);
        check_that(message.id <= 0x1FFFFFFFu, "extended id", message.id);
        check_that(message.length <= TAPER_FRAME_LENGTH, "extended length", message.length);
        fuzz_slcan_stats.extended++;
        taper_slcan_pump(&world.slcan, world.now_ms);
    }
}

static void send_frame(void) {
    taper_frame_t frame = {.id = (uint16_t)(world.next_sent & 0x7FFu), .length = TAPER_FRAME_LENGTH};
    memcpy(frame.data, &world.next_sent, sizeof world.next_sent);
    world.next_sent += world.port.send(world.port.context, &frame) ? 1u : 0u;
}

/* ---- */

static void pump(void) {
    taper_slcan_pump(&world.slcan, world.now_ms);
    check_that(world.slcan.line_length <= TAPER_SLCAN_LINE, "line_length", world.slcan.line_length);
    check_that(world.slcan.out_length <= sizeof world.slcan.out, "out_length", world.slcan.out_length);
}

static void happen(uint8_t event) {
    pump();
    switch (event % 8u) {
    case 0: receive_all(); break;
    case 1: take_extended(); break;
    case 2: world.chunk = 0; break;
    case 3: world.chunk = (size_t)(event >> 3 & 0xFu) + 1u; break;
    case 4: world.chunk = SAID_AT_ONCE; break;
    case 5: world.now_ms += event; break;
    default: send_frame(); break;
    }
    pump();
}

static void say(uint8_t byte) {
    if (world.said_head < SAID_AT_ONCE) {
        world.said[world.said_head++] = byte;
    }
}

static void begin(void) {
    const taper_stream_t stream = {.read = adapter_read, .write = adapter_write};
    memset(&world, 0, sizeof world);
    world.chunk = SAID_AT_ONCE;
    taper_slcan_init(&world.slcan, &stream);
    world.port = taper_slcan_port(&world.slcan);
}

/** The stream goes on, and all is taken: nothing may stay behind. */
static void finish(void) {
    world.chunk = SAID_AT_ONCE;
    do {
        pump();
        take_extended();
        receive_all();
    } while (world.said_tail < world.said_head);
    pump();
    check_that(taper_slcan_is_drained(&world.slcan), "frames left behind",
               world.slcan.send_head - world.slcan.send_tail);
    check_that(world.heard_length == 0, "half a line left behind", world.heard[0]);
    fuzz_slcan_stats.overflows += world.slcan.overflows;
    fuzz_slcan_stats.opens += world.slcan.opens;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    begin();
    for (size_t i = 0; i < size; i++) {
        if (data[i] < 0x80u) {
            say(data[i]);
        } else {
            happen(data[i]);
        }
    }
    finish();
    fuzz_slcan_stats.inputs++;
    fuzz_slcan_stats.bytes += size;
    return 0;
}
