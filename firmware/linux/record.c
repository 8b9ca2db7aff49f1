#define _GNU_SOURCE // O_CLOEXEC

#include "record.h"

#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

_Static_assert(sizeof(off_t) == 8, "a recording grows beyond 2 GB within a day");

static bool name(char text[PATH_MAX], const char *file, const char *suffix) {
    if ((size_t)snprintf(text, PATH_MAX, "%s%s", file, suffix) >= PATH_MAX) {
        errno = ENAMETOOLONG;
        return false;
    }
    return true;
}

static bool is_file(const char *file) {
    struct stat status;
    return stat(file, &status) == 0 && S_ISREG(status.st_mode);
}

/**
 * The recording of the run before is what one wants after a crash. Its companion goes after it: whoever was ended between
 * the two leaves it to the next run, which then finds no recording beside it.
 */
static bool keep_old(const char *file) {
    char old[PATH_MAX];
    char companion[PATH_MAX];
    char old_companion[PATH_MAX];
    if (!name(old, file, ".old") || !name(companion, file, ".station") ||
        !name(old_companion, file, ".station.old")) {
        return false;
    }
    const bool was_there = is_file(file);
    if (was_there && rename(file, old) != 0) {
        return false;
    }
    if (is_file(companion)) {
        return rename(companion, old_companion) == 0;
    }
    // A companion of the recording before that one tells nothing about it.
    return !was_there || unlink(old_companion) == 0 || errno == ENOENT;
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

/** A pipe or a device has no companion. */
static bool write_companion(const taper_record_t *record, const char *file) {
    struct stat status;
    return fstat(record->fd, &status) != 0 || !S_ISREG(status.st_mode) ||
           taper_companion_write(&record->companion, file);
}

bool taper_record_open(taper_record_t *record, const char *file, const taper_companion_t *companion) {
    record->fd = -1;
    record->companion = *companion;
    record->written = 0;
    record->error = 0;
    record->used = 0;
    if (!keep_old(file)) {
        return false;
    }
    record->fd = open(file, O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
    if (record->fd >= 0 && !write_companion(record, file)) {
        give_up(record, errno);
        return true;
    }
    return record->fd >= 0;
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

void taper_record_frame(taper_record_t *record, const taper_frame_t *frame, uint64_t time_ms) {
    taper_candump_line_t line = {.time_us = record->companion.start_us + time_ms * 1000, .frame = *frame};
    if (record->fd < 0) {
        return;
    }
    if (sizeof record->buffer - record->used < TAPER_CANDUMP_LINE) {
        taper_record_flush(record);
    }
    (void)snprintf(line.interface, sizeof line.interface, "%s", record->companion.interface[frame->bus]);
    record->used += taper_candump_format(&line, record->buffer + record->used);
}

void taper_record_close(taper_record_t *record) {
    taper_record_flush(record);
    if (record->fd >= 0) {
        (void)close(record->fd);
        record->fd = -1;
    }
}
