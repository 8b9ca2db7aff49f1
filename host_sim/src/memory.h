/** Memory that cannot fail: a simulation without memory has nothing better to do than to say so and end. */
#ifndef SIM_MEMORY_H
#define SIM_MEMORY_H

#include <stddef.h>

/** Say so, and end. */
_Noreturn void sim_out_of_memory(void);

/** `count` zeroed elements of `size` bytes; never NULL. Free with free(). */
void *sim_allocate(size_t count, size_t size);

/**
 * Make room for at least `needed` elements of `size` bytes, at least doubling. `*room` is what there is room for.
 * @return the array, which may have moved; never NULL.
 */
void *sim_grow(void *array, size_t *room, size_t needed, size_t size);

/** A copy of `text`; never NULL. Free with free(). */
char *sim_copy(const char *text);

#endif
