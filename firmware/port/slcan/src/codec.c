/* Between a frame and its line. */
#include <string.h>

#include "slcan_internal.h"

#define LARGEST_STANDARD_ID 0x7FFu
#define LARGEST_EXTENDED_ID 0x1FFFFFFFu

static unsigned id_digits(const taper_slcan_message_t *message) {
    return message->is_extended ? 8u : 3u;
}

static unsigned data_bytes(const taper_slcan_message_t *message) {
    return message->is_remote ? 0u : message->length;
}

static bool is_in_range(const taper_slcan_message_t *message) {
    return message->length <= TAPER_FRAME_LENGTH &&
           message->id <= (message->is_extended ? LARGEST_EXTENDED_ID : LARGEST_STANDARD_ID);
}

static char letter_of(const taper_slcan_message_t *message) {
    if (message->is_remote) {
        return message->is_extended ? 'R' : 'r';
    }
    return message->is_extended ? 'T' : 't';
}

static size_t put_hex(char *line, size_t at, uint32_t value, unsigned digits) {
    for (unsigned digit = digits; digit > 0; digit--) {
        line[at++] = "0123456789ABCDEF"[value >> (4u * (digit - 1u)) & 0xFu];
    }
    return at;
}

size_t taper_slcan_encode(const taper_slcan_message_t *message, char line[TAPER_SLCAN_LINE]) {
    if (!is_in_range(message)) {
        return 0;
    }
    line[0] = letter_of(message);
    size_t at = put_hex(line, 1, message->id, id_digits(message));
    at = put_hex(line, at, message->length, 1);
    for (unsigned i = 0; i < data_bytes(message); i++) {
        at = put_hex(line, at, message->data[i], 2);
    }
    line[at] = '\r';
    return at + 1;
}

/** @return the digit's value; 16 and more: none. */
static uint32_t digit_of(char letter) {
    if (letter >= '0' && letter <= '9') {
        return (uint32_t)(letter - '0');
    }
    if (letter >= 'A' && letter <= 'F') {
        return (uint32_t)(letter - 'A') + 10u;
    }
    return letter >= 'a' && letter <= 'f' ? (uint32_t)(letter - 'a') + 10u : 16u;
}

bool taper_slcan_get_hex(const char *text, unsigned digits, uint32_t *value) {
    *value = 0;
    for (unsigned i = 0; i < digits; i++) {
        const uint32_t digit = digit_of(text[i]);
        if (digit > 0xFu) {
            return false;
        }
        *value = *value << 4 | digit;
    }
    return true;
}

static bool get_head(const char *line, size_t length, taper_slcan_message_t *message) {
    uint32_t data_length = 0;
    memset(message, 0, sizeof *message);
    const char letter = length > 0 ? line[0] : '\0';
    message->is_extended = letter == 'T' || letter == 'R';
    message->is_remote = letter == 'r' || letter == 'R';
    const unsigned digits = id_digits(message);
    if (letter_of(message) != letter || length < 1 + digits + 1 ||
        !taper_slcan_get_hex(line + 1, digits, &message->id) ||
        !taper_slcan_get_hex(line + 1 + digits, 1, &data_length)) {
        return false;
    }
    message->length = (uint8_t)data_length;
    return is_in_range(message);
}

bool taper_slcan_decode(const char *line, size_t length, taper_slcan_message_t *message) {
    if (!get_head(line, length, message)) {
        return false;
    }
    const size_t head = 1u + id_digits(message) + 1u;
    if (length != head + 2u * data_bytes(message)) {
        return false;
    }
    for (unsigned i = 0; i < data_bytes(message); i++) {
        uint32_t byte = 0;
        if (!taper_slcan_get_hex(line + head + 2u * i, 2, &byte)) {
            return false;
        }
        message->data[i] = (uint8_t)byte;
    }
    return true;
}
