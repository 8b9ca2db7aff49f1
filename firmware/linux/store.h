/**
 * The station's non-volatile store: copy k of its record is the file PATH.k, that of its settings PATH.settings.k. A file is
 * replaced as a whole or not at all.
 */
#ifndef TAPER_LINUX_STORE_H
#define TAPER_LINUX_STORE_H

#include <stdbool.h>
#include <stdint.h>

/**
 * @return false: there is no such file. Of one that is too short the rest is zero, of one that cannot be read all of it: the
 * station's CRC-32 refuses that.
 */
bool taper_store_read(const char *path, unsigned area, unsigned copy, void *data, uint32_t length);

/** Write a new file, to the disk, then rename it. @return false, with errno: the copy is as it was. Blocks for the disk. */
bool taper_store_write(const char *path, unsigned area, unsigned copy, const void *data, uint32_t length);

#endif
