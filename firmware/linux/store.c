#define _GNU_SOURCE // O_CLOEXEC

#include "store.h"

#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "taper/port.h"
#include "whole_file.h"

/** Whether a record has such a place, and fits into it. */
static bool fits(unsigned area, unsigned copy, uint32_t length) {
    errno = EINVAL;
    return area < TAPER_STORE_AREAS && copy < TAPER_STORE_COPIES && length <= TAPER_STORE_RECORD_MAX;
}

/** Name of a copy's file. @return false, with errno, if that is too long. */
static bool name(char text[PATH_MAX], const char *path, unsigned area, unsigned copy) {
    static const char *const middle[TAPER_STORE_AREAS] = {
        [TAPER_STORE_STATION] = "",
        [TAPER_STORE_SETTINGS] = ".settings",
    };
    if ((size_t)snprintf(text, PATH_MAX, "%s%s.%u", path, middle[area], copy) >= PATH_MAX) {
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

bool taper_store_read(const char *path, unsigned area, unsigned copy, void *data, uint32_t length) {
    char file[PATH_MAX];
    if (!fits(area, copy, length) || !name(file, path, area, copy)) {
        return false;
    }
    const int fd = open(file, O_RDONLY | O_CLOEXEC);
    if (fd < 0 && errno == ENOENT) {
        return false;
    }
    if (fd < 0 || !read_all(fd, data, length)) {
        memset(data, 0, length);
    }
    if (fd >= 0) {
        (void)close(fd);
    }
    return true;
}

bool taper_store_write(const char *path, unsigned area, unsigned copy, const void *data, uint32_t length) {
    char file[PATH_MAX];
    return fits(area, copy, length) && name(file, path, area, copy) &&
           taper_whole_file_write(file, data, length, 0600);
}
