/**
 * A recording: all frames that the station took and sent, in the order in which it saw them, as a CAN log (candump.h).
 *
 * Only whole lines get into the file, also when the disk is full. The first error ends the recording, and nothing else.
 */
#ifndef TAPER_LINUX_RECORD_H
#define TAPER_LINUX_RECORD_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "candump.h"

typedef struct {
    int fd; /**< -1: none, or ended by an error */
    const char *const *interfaces;
    uint64_t start_us; /**< wall clock at station time 0 */
    uint64_t written;  /**< bytes in the file */
    int error;         /**< errno that ended the recording, 0: none */
    size_t used;
    char buffer[1 << 16];
} taper_record_t;

/**
 * Begin. A file of that name is kept as FILE.old. `interfaces` is borrowed: [bus] names.
 * @return false, with errno, if the file cannot be made.
 */
bool taper_record_open(taper_record_t *record, const char *file, const char *const *interfaces,
                       uint64_t start_us);

/** Add a frame at station time `time_ms`. @param direction TAPER_CANDUMP_RECEIVED or TAPER_CANDUMP_SENT */
void taper_record_frame(taper_record_t *record, const taper_frame_t *frame, uint64_t time_ms, char direction);

/** Hand what is there to the kernel. */
void taper_record_flush(taper_record_t *record);

void taper_record_close(taper_record_t *record);

#endif
