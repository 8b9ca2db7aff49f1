#define _GNU_SOURCE // program_invocation_short_name

#include "memory.h"

#include <errno.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

_Noreturn void sim_out_of_memory(void) {
    fprintf(stderr, "%s: out of memory\n", program_invocation_short_name);
    exit(EXIT_FAILURE);
}

void *sim_allocate(size_t count, size_t size) {
    void *memory = calloc(count == 0 ? 1 : count, size);
    if (memory == NULL) {
        sim_out_of_memory();
    }
    return memory;
}

void *sim_grow(void *array, size_t *room, size_t needed, size_t size) {
    if (needed <= *room) {
        return array;
    }
    size_t wanted = *room < 32 ? 64 : *room * 2;
    wanted = wanted < needed ? needed : wanted;
    if (wanted > SIZE_MAX / 2 / size) {
        sim_out_of_memory();
    }
    void *memory = realloc(array, wanted * size);
    if (memory == NULL) {
        sim_out_of_memory();
    }
    *room = wanted;
    return memory;
}

char *sim_copy(const char *text) {
    const size_t size = strlen(text) + 1;
    char *copy = sim_allocate(size, 1);
    memcpy(copy, text, size);
    return copy;
}
