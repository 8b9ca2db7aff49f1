/**
 * A recording: all frames that the station took and sent, in the order in which it saw them, as a CAN log (candump.h), and
 * its companion (companion.h), by which a replay knows the station again.
 *
 * Only whole lines get into the file, also when the disk is full. The first error ends the recording, and nothing else.
 */
#ifndef TAPER_LINUX_RECORD_H
#define TAPER_LINUX_RECORD_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "companion.h"

typedef struct {
    int fd; /**< -1: none, or ended by an error */
    taper_companion_t companion;
    uint64_t written; /**< bytes in the file */
    int error;        /**< errno that ended the recording, 0: none */
    size_t used;
    char buffer[1 << 16];
} taper_record_t;

/**
 * Begin. A file of that name is kept as FILE.old, and its companion as FILE.station.old. A regular file gets a companion;
 * one that cannot be written ends the recording before its first line (`error`), for a full disk must not stop the station.
 * Blocks for the disk.
 * @return false, with errno, if the file cannot be made.
 */
bool taper_record_open(taper_record_t *record, const char *file, const taper_companion_t *companion);

/** Add a frame at station time `time_ms`. */
void taper_record_frame(taper_record_t *record, const taper_frame_t *frame, uint64_t time_ms);

/** Hand what is there to the kernel. */
void taper_record_flush(taper_record_t *record);

void taper_record_close(taper_record_t *record);

#endif
