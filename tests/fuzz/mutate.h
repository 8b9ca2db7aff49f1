/** Mutation of inputs by their structure: identifiers, counters, lengths, ends of fields. Deterministic from a seed. */
#ifndef TAPER_FUZZ_MUTATE_H
#define TAPER_FUZZ_MUTATE_H

#include <stddef.h>
#include <stdint.h>

/** Records in a mutated input, at most. */
#define MUTATE_RECORDS 512u

/** The next number of a SplitMix64 generator. */
uint64_t mutate_random(uint64_t *state);

/**
 * Make an input of at most MUTATE_RECORDS records out of stretches of two seeds (`size` > 0 each), about one record in
 * four changed. @return its size in bytes; `out` holds MUTATE_RECORDS * FUZZ_RECORD.
 */
size_t mutate(uint64_t *state, const uint8_t *seed[2], const size_t size[2], uint8_t *out);

#endif
