#define _GNU_SOURCE // O_CLOEXEC, O_DIRECTORY

#include "store.h"

#include <errno.h>
#include <fcntl.h>
#include <libgen.h>
#include <limits.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

/** PATH.k and what is appended. @return false, with errno, if that is too long. */
static bool name(char text[PATH_MAX], const char *path, unsigned copy, const char *suffix) {
    if ((size_t)snprintf(text, PATH_MAX, "%s.%u%s", path, copy, suffix) >= PATH_MAX) {
        errno = ENAMETOOLONG;
        return false;
    }
    return true;
}

/** As much as there is, the rest zero. */
static bool read_all(int fd, unsigned char *data, uint32_t length) {
    uint32_t done = 0;
    memset(data, 0, length);
    while (done < length) {
        const ssize_t step = read(fd, data + done, length - done);
        if (step == 0) {
            return true;
        }
        if (step < 0 && errno != EINTR) {
            return false;
        }
        done += step > 0 ? (uint32_t)step : 0;
    }
    return true;
}

bool taper_store_read(const char *path, unsigned copy, void *data, uint32_t length) {
    char file[PATH_MAX];
    const int fd = name(file, path, copy, "") ? open(file, O_RDONLY | O_CLOEXEC) : -1;
    if (fd < 0) {
        return false;
    }
    const bool good = read_all(fd, data, length);
    (void)close(fd);
    return good;
}

static bool write_all(int fd, const unsigned char *data, uint32_t length) {
    uint32_t done = 0;
    while (done < length) {
        const ssize_t step = write(fd, data + done, length - done);
        if (step <= 0 && errno != EINTR) {
            return false;
        }
        done += step > 0 ? (uint32_t)step : 0;
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

bool taper_store_write(const char *path, unsigned copy, const void *data, uint32_t length) {
    char file[PATH_MAX];
    char fresh[PATH_MAX];
    if (!name(file, path, copy, "") || !name(fresh, path, copy, ".new")) {
        return false;
    }
    const int fd = open(fresh, O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);
    if (fd < 0) {
        return false;
    }
    const bool written = write_all(fd, data, length);
    const bool closed = close(fd) == 0;
    return written && closed && rename(fresh, file) == 0 && sync_directory(file);
}
