#include "board_talk.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "memory.h"

/** An emulator that is just starting does not listen yet. */
#define CONNECT_ms 3000u
/** No station sends more in one call. */
#define MOST_FRAMES 4096u
/** A board that is left takes what was sent to it, or it does not matter. */
#define CLOSE_ms 1000u

bool sim_board_fail(const sim_board_talk_t *talk, const char *format, ...) {
    va_list arguments;
    fprintf(stderr, "taper-sim: board at %s: ", talk->address);
    va_start(arguments, format);
    vfprintf(stderr, format, arguments);
    va_end(arguments);
    fputc('\n', stderr);
    return false;
}

/** @return false, after one line: the board sends without end. */
static bool keep_frame(sim_board_talk_t *talk, const taper_slcan_message_t *message, const char *what) {
    if (talk->count == MOST_FRAMES) {
        return sim_board_fail(talk, "it sends more than %u frames, where %s was awaited", MOST_FRAMES, what);
    }
    taper_frame_t frame = {.id = (uint16_t)message->id, .length = message->length};
    memcpy(frame.data, message->data, sizeof frame.data);
    talk->frame = sim_grow(talk->frame, &talk->room, talk->count + 1, sizeof *talk->frame);
    talk->frame[talk->count++] = frame;
    return true;
}

void sim_board_drop_frames(sim_board_talk_t *talk) {
    talk->taken = talk->count = 0;
}

bool sim_board_take_frame(sim_board_talk_t *talk, taper_frame_t *frame) {
    if (talk->taken == talk->count) {
        sim_board_drop_frames(talk);
        return false;
    }
    *frame = talk->frame[talk->taken++];
    return true;
}

/** @return whether this event ends the wait; then with one line, which `what` belongs to. */
static bool is_the_end(const sim_board_talk_t *talk, sim_slcan_event_t event, const char *what) {
    switch (event) {
    case SIM_SLCAN_MESSAGE: return false;
    case SIM_SLCAN_REFUSED:
        if (talk->knows_us) { // before, it may be the rest of a line of an earlier connection
            (void)sim_board_fail(talk, "it refused a line as none of SLCAN, where %s was awaited", what);
        }
        return talk->knows_us;
    case SIM_SLCAN_STRANGE:
        if (talk->knows_us) {
            (void)sim_board_fail(talk, "it says '%s', where %s was awaited", talk->line.text, what);
        }
        return talk->knows_us;
    case SIM_SLCAN_SILENT:
        (void)sim_board_fail(talk, "it has said nothing for %u s, where %s was awaited",
                             talk->timeout_ms / 1000u, what);
        return true;
    case SIM_SLCAN_LOST:
    default: (void)sim_board_fail(talk, "the connection is lost, where %s was awaited", what); return true;
    }
}

/** The next message of drive.h; frames are kept on the way. @return false, after one line. */
static bool next_message(sim_board_talk_t *talk, const char *what, taper_slcan_message_t *message,
                         uint8_t *kind, uint8_t *index) {
    for (;;) {
        const sim_slcan_event_t event = sim_slcan_next(&talk->line, message, talk->timeout_ms);
        if (is_the_end(talk, event, what)) {
            return false;
        }
        if (event == SIM_SLCAN_MESSAGE && taper_drive_split(message, kind, index)) {
            return true;
        }
        if (event == SIM_SLCAN_MESSAGE && !message->is_extended && !message->is_remote &&
            !keep_frame(talk, message, what)) {
            return false;
        }
    }
}

bool sim_board_await(sim_board_talk_t *talk, taper_drive_kind_t kind, uint8_t index, const char *what,
                     taper_slcan_message_t *message) {
    uint8_t came = 0;
    uint8_t came_index = 0;
    if (!next_message(talk, what, message, &came, &came_index)) {
        return false;
    }
    if (came == kind && came_index == index) {
        talk->knows_us = true;
        return true;
    }
    if (came == TAPER_DRIVE_HELLO) {
        return sim_board_fail(talk, "it was reset, where %s was awaited", what);
    }
    return sim_board_fail(talk, "it answers out of turn (kind 0x%02X, index %u), where %s was awaited", came,
                          came_index, what);
}

void sim_board_say(sim_board_talk_t *talk, const taper_slcan_message_t *message) {
    sim_slcan_send(&talk->line, message);
}

/** An answer to somebody who was attached before may still come; the greeting follows it. */
static bool await_greeting(sim_board_talk_t *talk, taper_slcan_message_t *message) {
    uint8_t kind = 0;
    uint8_t index = 0;
    while (kind != TAPER_DRIVE_HELLO) {
        if (!next_message(talk, "its greeting", message, &kind, &index)) {
            return false;
        }
    }
    talk->knows_us = true;
    sim_board_drop_frames(talk);
    return true;
}

bool sim_board_open(sim_board_talk_t *talk, const char *address, unsigned timeout_s) {
    char reason[200];
    taper_slcan_message_t hello;
    *talk = (sim_board_talk_t){.address = address, .timeout_ms = timeout_s * 1000u};
    const unsigned patience_ms = talk->timeout_ms < CONNECT_ms ? talk->timeout_ms : CONNECT_ms;
    if (!sim_slcan_connect(&talk->line, address, patience_ms, reason, sizeof reason)) {
        fprintf(stderr, "taper-sim: --bus: %s\n", reason);
        return false;
    }
    // The empty line ends what somebody before may have left, and closing ends what he has opened.
    sim_slcan_command(&talk->line, "\rC\rS6\rO\r");
    if (!await_greeting(talk, &hello)) {
        return false;
    }
    const uint32_t version = taper_drive_get_u32(&hello);
    return version == TAPER_DRIVE_VERSION ||
           sim_board_fail(talk, "it obeys version %lu of the drive protocol, and not %u",
                          (unsigned long)version, TAPER_DRIVE_VERSION);
}

void sim_board_close(sim_board_talk_t *talk) {
    if (talk->knows_us) {
        sim_slcan_command(&talk->line, "C\r");
    }
    sim_slcan_close(&talk->line, CLOSE_ms);
    free(talk->frame);
    talk->frame = NULL;
}
