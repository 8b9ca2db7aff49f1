/** Files that appear in a directory all at once, or not at all. */
#ifndef SIM_OUTPUT_H
#define SIM_OUTPUT_H

#include <stdbool.h>
#include <stddef.h>

typedef struct {
    const char *name;
    const char *text;
    size_t size;
} sim_output_t;

/**
 * Whether files could be put there: it is a directory that can be written to, or what is there of its path ends in one.
 * Nothing is made yet. @return false, after one line.
 */
bool sim_output_check(const char *directory);

/**
 * Write `count` files to a new directory beside `directory`, then rename that to it; if `directory` exists, rename the
 * files into it, in their order. Missing parents of `directory` are made. Signals that would end the program wait meanwhile.
 * @return false, after one line on stderr; then nothing half-written is left, nor a parent that was made.
 */
bool sim_output_write(const char *directory, const sim_output_t *file, size_t count);

#endif
