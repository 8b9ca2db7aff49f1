/* What the attached side asks for, line by line. */
#include <string.h>

#include "slcan_internal.h"
#include "taper/types.h"

/* V: hardware 1.0, software 1.3 of LAWICEL's command set. */
static const char version[] = "V1013\r";
static const char serial_number[] = "NTAPR\r";

static void answer(taper_slcan_t *slcan, const char *text) {
    for (; *text != '\0'; text++) {
        slcan->out[slcan->out_length++] = *text;
    }
}

void taper_slcan_open(taper_slcan_t *slcan) {
    slcan->is_open = true;
    slcan->listens_only = false;
    slcan->flags = 0;
}

static bool open_channel(taper_slcan_t *slcan, bool listens_only) {
    if (slcan->is_open) {
        return false;
    }
    taper_slcan_open(slcan);
    slcan->listens_only = listens_only;
    taper_count(&slcan->opens);
    return true;
}

/* An old setpoint must not leave late: what waits goes, as at bus-off. */
static void close_channel(taper_slcan_t *slcan) {
    slcan->is_open = false;
    slcan->send_tail = slcan->send_head;
}

static void put_received(taper_slcan_t *slcan, const taper_slcan_message_t *message) {
    taper_frame_t frame = {.id = (uint16_t)message->id, .length = message->length, .time_ms = slcan->now_ms};
    memcpy(frame.data, message->data, sizeof frame.data);
    if (slcan->receive_head - slcan->receive_tail == TAPER_SLCAN_RECEIVE_DEPTH) {
        taper_count(&slcan->overflows);
        slcan->flags |= TAPER_SLCAN_FLAG_OVERRUN;
        slcan->receive_tail++;
    }
    slcan->received[slcan->receive_head % TAPER_SLCAN_RECEIVE_DEPTH] = frame;
    slcan->receive_head++;
}

/** @return NULL: refused. */
static const char *take_frame(taper_slcan_t *slcan) {
    taper_slcan_message_t message;
    if (!slcan->is_open || slcan->listens_only ||
        !taper_slcan_decode(slcan->line, slcan->line_length, &message)) {
        return NULL;
    }
    if (message.is_extended && !message.is_remote) {
        slcan->extended = message;
        slcan->holds_extended = true;
    } else if (!message.is_remote) {
        put_received(slcan, &message);
    }
    return message.is_extended ? "Z\r" : "z\r";
}

static bool take_bit_rate(const taper_slcan_t *slcan) {
    return !slcan->is_open && slcan->line_length == 2 && slcan->line[1] >= '0' && slcan->line[1] <= '8';
}

static bool take_bit_timing(const taper_slcan_t *slcan) {
    uint32_t registers;
    return !slcan->is_open && slcan->line_length == 5 && taper_slcan_get_hex(slcan->line + 1, 4, &registers);
}

static void tell_flags(taper_slcan_t *slcan) {
    char text[] = "F00\r";
    text[1] = "0123456789ABCDEF"[slcan->flags >> 4];
    text[2] = "0123456789ABCDEF"[slcan->flags & 0xFu];
    answer(slcan, text);
    slcan->flags = 0;
}

/** Commands of a single letter. @return NULL: refused; "": answered already. */
static const char *obey_letter(taper_slcan_t *slcan) {
    switch (slcan->line[0]) {
    case 'O': return open_channel(slcan, false) ? "\r" : NULL;
    case 'L': return open_channel(slcan, true) ? "\r" : NULL;
    case 'C': close_channel(slcan); return "\r";
    case 'V': return version;
    case 'N': return serial_number;
    case 'F':
        if (!slcan->is_open) {
            return NULL;
        }
        tell_flags(slcan);
        return "";
    default: return NULL;
    }
}

static const char *obey_line(taper_slcan_t *slcan) {
    switch (slcan->line[0]) {
    case 't':
    case 'T':
    case 'r':
    case 'R': return take_frame(slcan);
    case 'S': return take_bit_rate(slcan) ? "\r" : NULL;
    case 's': return take_bit_timing(slcan) ? "\r" : NULL;
    case 'Z': return slcan->line_length == 2 && slcan->line[1] == '0' ? "\r" : NULL;
    default: return slcan->line_length == 1 ? obey_letter(slcan) : NULL;
    }
}

void taper_slcan_obey(taper_slcan_t *slcan) {
    if (slcan->line_length == 0) {
        return;
    }
    const char *text = obey_line(slcan);
    if (text == NULL) {
        taper_count(&slcan->bad_lines);
    }
    answer(slcan, text == NULL ? "\a" : text);
}
