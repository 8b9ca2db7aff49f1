/**
 * Lines of a CAN log as `candump -l`, canplayer and python-can write and read them:
 *
 *     (1436509052.249713) can0 0C1#76100000060C0707
 *
 * python-can adds R or T, received or sent by who wrote the log. That word is passed over, and not written.
 */
#ifndef TAPER_LINUX_CANDUMP_H
#define TAPER_LINUX_CANDUMP_H

#include <stddef.h>
#include <stdint.h>

#include "taper/frame.h"

/** Longest line that is written, with its end and the closing NUL. */
#define TAPER_CANDUMP_LINE 80
#define TAPER_CANDUMP_NAME 16

typedef struct {
    uint64_t time_us; /**< wall clock, since 1970 */
    char interface[TAPER_CANDUMP_NAME];
    taper_frame_t frame; /**< id, length and data; bus and time_ms are not in the text */
} taper_candump_line_t;

typedef enum {
    TAPER_CANDUMP_FRAME,
    TAPER_CANDUMP_OTHER, /**< a sound line that no classic data frame with 11-bit id stands in, or an empty one */
    TAPER_CANDUMP_BAD,
} taper_candump_verdict_t;

/** Write a line, '\n' at its end. @return its length. */
size_t taper_candump_format(const taper_candump_line_t *line, char text[TAPER_CANDUMP_LINE]);

/** Read a line, with or without '\n'. `*line` is whole only if the answer is TAPER_CANDUMP_FRAME. */
taper_candump_verdict_t taper_candump_parse(const char *text, taper_candump_line_t *line);

#endif
