#define _GNU_SOURCE // O_CLOEXEC, O_DIRECTORY

#include "whole_file.h"

#include <errno.h>
#include <fcntl.h>
#include <libgen.h>
#include <limits.h>
#include <stdio.h>
#include <unistd.h>

static bool write_all(int fd, const unsigned char *data, size_t length) {
    size_t done = 0;
    while (done < length) {
        const ssize_t step = write(fd, data + done, length - done);
        if (step <= 0 && errno != EINTR) {
            return false;
        }
        done += step > 0 ? (size_t)step : 0;
    }
    return fsync(fd) == 0;
}

/** A rename lasts when its directory is on the disk. */
static bool sync_directory(const char *file) {
    char copy[PATH_MAX];
    (void)snprintf(copy, sizeof copy, "%s", file);
    const int fd = open(dirname(copy), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    const bool good = fd >= 0 && fsync(fd) == 0;
    if (fd >= 0) {
        (void)close(fd);
    }
    return good;
}

bool taper_whole_file_write(const char *file, const void *data, size_t length, mode_t mode) {
    char fresh[PATH_MAX];
    if ((size_t)snprintf(fresh, sizeof fresh, "%s.new", file) >= sizeof fresh) {
        errno = ENAMETOOLONG;
        return false;
    }
    const int fd = open(fresh, O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, mode);
    if (fd < 0) {
        return false;
    }
    const bool written = write_all(fd, data, length);
    const bool closed = close(fd) == 0;
    return written && closed && rename(fresh, file) == 0 && sync_directory(file);
}
