#include "memory.h"

#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static _Noreturn void out_of_memory(void) {
    fputs("taper-sim: out of memory\n", stderr);
    exit(EXIT_FAILURE);
}

void *sim_allocate(size_t count, size_t size) {
    void *memory = calloc(count == 0 ? 1 : count, size);
    if (memory == NULL) {
        out_of_memory();
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
        out_of_memory();
    }
    void *memory = realloc(array, wanted * size);
    if (memory == NULL) {
        out_of_memory();
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
