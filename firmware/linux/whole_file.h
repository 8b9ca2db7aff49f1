/** Small files that are there as a whole or not at all, also after a power failure. */
#ifndef TAPER_LINUX_WHOLE_FILE_H
#define TAPER_LINUX_WHOLE_FILE_H

#include <stdbool.h>
#include <stddef.h>
#include <sys/types.h>

/**
 * Write to FILE.new, to the disk, then rename. Blocks for the disk.
 * @param mode of a new file, less the umask
 * @return false, with errno: `file` is as it was.
 */
bool taper_whole_file_write(const char *file, const void *data, size_t length, mode_t mode);

#endif
