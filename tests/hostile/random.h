/** The splitmix64 generator: the same seed, the same world. */
#ifndef HOSTILE_RANDOM_H
#define HOSTILE_RANDOM_H

#include <stdbool.h>
#include <stdint.h>

typedef struct {
    uint64_t state;
} random_t;

static inline uint64_t random_bits(random_t *random) {
    random->state += UINT64_C(0x9E3779B97F4A7C15);
    uint64_t z = random->state;
    z = (z ^ (z >> 30)) * UINT64_C(0xBF58476D1CE4E5B9);
    z = (z ^ (z >> 27)) * UINT64_C(0x94D049BB133111EB);
    return z ^ (z >> 31);
}

/** @return 0..below-1; 0 for a `below` of 0. */
static inline uint32_t random_below(random_t *random, uint32_t below) {
    return below == 0 ? 0 : (uint32_t)((random_bits(random) >> 32) * below >> 32);
}

/** @return low..high */
static inline int32_t random_in(random_t *random, int32_t low, int32_t high) {
    return low + (int32_t)random_below(random, (uint32_t)(high - low + 1));
}

/** Once in `times`, on average. */
static inline bool random_once_in(random_t *random, uint32_t times) {
    return random_below(random, times) == 0;
}

#endif
