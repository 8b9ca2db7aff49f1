#include "candump.h"

#include <ctype.h>
#include <inttypes.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define US_PER_S     UINT64_C(1000000)
#define US_DIGITS    6
#define MOST_SECONDS UINT64_C(100000000000)
/** An 11-bit identifier is written with three digits; longer ones and error frames with eight. */
#define SHORT_ID_DIGITS 3
#define MOST_SHORT_ID   0x7FFUL

size_t taper_candump_format(const taper_candump_line_t *line, char text[TAPER_CANDUMP_LINE]) {
    char data[2 * TAPER_FRAME_LENGTH + 1] = "";
    for (unsigned i = 0; i < line->frame.length && i < TAPER_FRAME_LENGTH; i++) {
        (void)snprintf(&data[(size_t)2 * i], 3, "%02X", (unsigned)line->frame.data[i]);
    }
    const int length = snprintf(text, TAPER_CANDUMP_LINE, "(%010" PRIu64 ".%06" PRIu64 ") %s %03X#%s\n",
                                line->time_us / US_PER_S, line->time_us % US_PER_S, line->interface,
                                (unsigned)line->frame.id, data);
    return (size_t)length;
}

/** "(seconds.micros) ", micros with 1..6 digits. @return what follows, or NULL. */
static const char *parse_time(const char *text, uint64_t *time_us) {
    char *end = NULL;
    if (text[0] != '(' || !isdigit((unsigned char)text[1])) {
        return NULL;
    }
    const uint64_t seconds = strtoull(text + 1, &end, 10);
    if (*end != '.' || seconds > MOST_SECONDS) {
        return NULL;
    }
    uint64_t micros = 0;
    unsigned digits = 0;
    for (end++; digits < US_DIGITS && isdigit((unsigned char)*end); end++, digits++) {
        micros = micros * 10 + (uint64_t)(*end - '0');
    }
    const bool any = digits > 0;
    for (; digits < US_DIGITS; digits++) {
        micros *= 10;
    }
    *time_us = seconds * US_PER_S + micros;
    return any && end[0] == ')' && end[1] == ' ' ? end + 2 : NULL;
}

static bool parse_data(const char *text, taper_frame_t *frame) {
    const size_t digits = strlen(text);
    if (digits % 2 != 0 || digits > (size_t)2 * TAPER_FRAME_LENGTH ||
        strspn(text, "0123456789abcdefABCDEF") != digits) {
        return false;
    }
    frame->length = (uint8_t)(digits / 2);
    for (size_t i = 0; i < frame->length; i++) {
        const char pair[3] = {text[2 * i], text[2 * i + 1], '\0'};
        frame->data[i] = (uint8_t)strtoul(pair, NULL, 16);
    }
    return true;
}

/** "id#data"; "id##..." is CAN FD, "id#R" a remote frame. */
static taper_candump_verdict_t parse_frame(char *text, taper_frame_t *frame) {
    char *data = strchr(text, '#');
    if (data == NULL) {
        return TAPER_CANDUMP_BAD;
    }
    *data++ = '\0';
    const size_t digits = strlen(text);
    if (digits == 0 || digits > 8 || strspn(text, "0123456789abcdefABCDEF") != digits) {
        return TAPER_CANDUMP_BAD;
    }
    const unsigned long id = strtoul(text, NULL, 16);
    if (digits > SHORT_ID_DIGITS || id > MOST_SHORT_ID || data[0] == '#' || data[0] == 'R' ||
        data[0] == 'r') {
        return TAPER_CANDUMP_OTHER;
    }
    frame->id = (uint16_t)id;
    return parse_data(data, frame) ? TAPER_CANDUMP_FRAME : TAPER_CANDUMP_BAD;
}

taper_candump_verdict_t taper_candump_parse(const char *text, taper_candump_line_t *line) {
    memset(line, 0, sizeof *line);
    if (text[strspn(text, " \t\r\n")] == '\0') {
        return TAPER_CANDUMP_OTHER;
    }
    const char *rest = parse_time(text, &line->time_us);
    char frame[160];
    char word[2] = "";
    if (rest == NULL || sscanf(rest, "%15s %159s %1s", line->interface, frame, word) < 2) {
        return TAPER_CANDUMP_BAD;
    }
    if (word[0] != '\0' && strchr("RrTt", word[0]) == NULL) {
        return TAPER_CANDUMP_BAD;
    }
    return parse_frame(frame, &line->frame);
}
