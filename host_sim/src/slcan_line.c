#include "slcan_line.h"

#include <stdlib.h>
#include <string.h>

#include "memory.h"
#include "progress.h"

/** So much waits at most before the other side is offered it. */
#define OFFER 2048u
#define BEL   '\a'

bool sim_slcan_connect(sim_slcan_line_t *line, const char *address, unsigned timeout_ms, char *reason,
                       size_t reason_size) {
    memset(line, 0, sizeof *line);
    const bool connected = tcp_stream_connect(&line->tcp, address, timeout_ms, reason, reason_size);
    line->stream = tcp_stream_bytes(&line->tcp);
    return connected;
}

/** Give the other side what it takes now. */
static void offer(sim_slcan_line_t *line) {
    size_t taken = 1;
    while (taken > 0 && line->out_taken < line->out_length) {
        taken = line->stream.write(line->stream.context, (const uint8_t *)line->out + line->out_taken,
                                   line->out_length - line->out_taken);
        line->out_taken += taken;
    }
    if (line->out_taken == line->out_length) {
        line->out_taken = line->out_length = 0;
    }
}

static void put(sim_slcan_line_t *line, const char *text, size_t length) {
    line->out = sim_grow(line->out, &line->out_room, line->out_length + length, 1);
    memcpy(line->out + line->out_length, text, length);
    line->out_length += length;
    if (line->out_length - line->out_taken >= OFFER) {
        offer(line);
    }
}

void sim_slcan_command(sim_slcan_line_t *line, const char *text) {
    put(line, text, strlen(text));
}

void sim_slcan_send(sim_slcan_line_t *line, const taper_slcan_message_t *message) {
    char text[TAPER_SLCAN_LINE];
    put(line, text, taper_slcan_encode(message, text));
}

/** "z" and "Z": a frame was taken. Nothing: a command was. */
static bool is_good_answer(const sim_slcan_line_t *line) {
    return line->text_length == 0 || strcmp(line->text, "z") == 0 || strcmp(line->text, "Z") == 0;
}

/** A whole line. @return whether it means something. */
static bool read_line(sim_slcan_line_t *line, taper_slcan_message_t *message, sim_slcan_event_t *event) {
    line->text[line->text_length] = '\0';
    const bool means = !is_good_answer(line);
    *event =
        taper_slcan_decode(line->text, line->text_length, message) ? SIM_SLCAN_MESSAGE : SIM_SLCAN_STRANGE;
    line->text_length = 0;
    return means;
}

/** Look at what was read, up to the first that means something. @return whether there was such. */
static bool look(sim_slcan_line_t *line, taper_slcan_message_t *message, sim_slcan_event_t *event) {
    while (line->in_taken < line->in_length) {
        const char letter = (char)line->in[line->in_taken++];
        if (letter == BEL) {
            line->text_length = 0;
            *event = SIM_SLCAN_REFUSED;
            return true;
        }
        if (letter != '\r' && letter != '\n') {
            line->text[line->text_length] = letter;
            line->text_length += line->text_length < SIM_SLCAN_TEXT ? 1 : 0;
        } else if (read_line(line, message, event)) {
            return true;
        }
    }
    return false;
}

static bool read_more(sim_slcan_line_t *line) {
    line->in_taken = 0;
    line->in_length = line->stream.read(line->stream.context, line->in, sizeof line->in);
    return line->in_length > 0;
}

sim_slcan_event_t sim_slcan_next(sim_slcan_line_t *line, taper_slcan_message_t *message,
                                 unsigned timeout_ms) {
    sim_slcan_event_t event = SIM_SLCAN_SILENT;
    while (!look(line, message, &event)) {
        offer(line);
        if (read_more(line)) {
            continue;
        }
        if (line->tcp.is_broken) {
            return SIM_SLCAN_LOST;
        }
        if (!tcp_stream_wait(&line->tcp, line->out_length > 0, timeout_ms)) {
            return SIM_SLCAN_SILENT;
        }
    }
    return event;
}

void sim_slcan_close(sim_slcan_line_t *line, unsigned timeout_ms) {
    const uint64_t end_us = sim_now_us() + UINT64_C(1000) * timeout_ms;
    offer(line);
    while (line->out_length > 0 && !line->tcp.is_broken && sim_now_us() < end_us) {
        (void)tcp_stream_wait(&line->tcp, true, timeout_ms);
        (void)read_more(line); // the other side takes nothing while its answers are left lying
        offer(line);
    }
    tcp_stream_close(&line->tcp);
    free(line->out);
    line->out = NULL;
}
