#define _GNU_SOURCE // O_CLOEXEC

#include "record.h"

#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

/** The recording of the run before is what one wants after a crash. */
static bool keep_old(const char *file) {
    struct stat status;
    char old[PATH_MAX];
    if (stat(file, &status) != 0 || !S_ISREG(status.st_mode)) {
        return true;
    }
    if ((size_t)snprintf(old, sizeof old, "%s.old", file) >= sizeof old) {
        errno = ENAMETOOLONG;
        return false;
    }
    return rename(file, old) == 0;
}

bool taper_record_open(taper_record_t *record, const char *file, const char *const *interfaces,
                       uint64_t start_us) {
    record->fd = -1;
    record->interfaces = interfaces;
    record->start_us = start_us;
    record->written = 0;
    record->error = 0;
    record->used = 0;
    if (!keep_old(file)) {
        return false;
    }
    record->fd = open(file, O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
    return record->fd >= 0;
}

/** End the recording at the last whole line. */
static void give_up(taper_record_t *record, int error) {
    record->error = error;
    // What cannot be truncated, such as a pipe, keeps what was written.
    const int truncated = ftruncate(record->fd, (off_t)record->written);
    (void)truncated;
    (void)close(record->fd);
    record->fd = -1;
}

void taper_record_flush(taper_record_t *record) {
    size_t done = 0;
    while (record->fd >= 0 && done < record->used) {
        const ssize_t step = write(record->fd, record->buffer + done, record->used - done);
        if (step > 0) {
            done += (size_t)step;
        } else if (step == 0 || errno != EINTR) {
            give_up(record, step == 0 ? EIO : errno);
        }
    }
    record->written += record->used;
    record->used = 0;
}

void taper_record_frame(taper_record_t *record, const taper_frame_t *frame, uint64_t time_ms,
                        char direction) {
    taper_candump_line_t line = {
        .time_us = record->start_us + time_ms * 1000, .frame = *frame, .direction = direction};
    if (record->fd < 0) {
        return;
    }
    if (sizeof record->buffer - record->used < TAPER_CANDUMP_LINE) {
        taper_record_flush(record);
    }
    (void)snprintf(line.interface, sizeof line.interface, "%s", record->interfaces[frame->bus]);
    record->used += taper_candump_format(&line, record->buffer + record->used);
}

void taper_record_close(taper_record_t *record) {
    taper_record_flush(record);
    if (record->fd >= 0) {
        (void)close(record->fd);
        record->fd = -1;
    }
}
