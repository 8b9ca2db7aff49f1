#include "mutate.h"

#include <stdbool.h>
#include <string.h>

#include "fuzz_frames.h"

#define LONGEST_STRETCH 48u
/** Time passes rarely in random records: frames are what is tested, and ticks cost a hundred of them. */
#define TIME_IN  32u
#define EVENT_IN 8u

uint64_t mutate_random(uint64_t *state) {
    uint64_t z = *state += UINT64_C(0x9E3779B97F4A7C15);
    z = (z ^ (z >> 30)) * UINT64_C(0xBF58476D1CE4E5B9);
    z = (z ^ (z >> 27)) * UINT64_C(0x94D049BB133111EB);
    return z ^ (z >> 31);
}

static unsigned below(uint64_t *state, unsigned bound) {
    return (unsigned)((mutate_random(state) >> 32) * bound >> 32);
}

static void put_id(uint8_t *record, unsigned id) {
    record[1] = (uint8_t)id;
    record[2] = (uint8_t)((record[2] & 0x18u) | (id >> 8 & 0x07u));
}

static unsigned id_of(const uint8_t *record) {
    return record[1] | (record[2] & 0x07u) << 8;
}

/** A node that the hub has, the gateway, the tool, the controller, or one that nobody has. */
static unsigned some_node(uint64_t *state) {
    static const uint8_t special[] = {0, 9, 60, 61, 62, 63};
    return below(state, 2) == 0 ? 1 + below(state, 8) : special[below(state, sizeof special)];
}

static void change_id(uint64_t *state, uint8_t *record) {
    const unsigned id = id_of(record);
    switch (below(state, 4)) {
    case 0: put_id(record, (id & 0x7C0u) | some_node(state)); break;
    case 1: put_id(record, (id & 0x03Fu) | below(state, 32) << 6); break;
    case 2: put_id(record, id ^ 1u << below(state, 11)); break;
    default: record[2] = (uint8_t)((record[2] & 0x07u) | below(state, 4) << 3); break;
    }
}

static void change_data(uint64_t *state, uint8_t *data) {
    static const uint16_t end[] = {0x0000, 0x0001, 0x7FFF, 0x8000, 0x8001, 0xFFFE, 0xFFFF, 0xFF00};
    const uint16_t value = end[below(state, sizeof end / sizeof end[0])];
    const unsigned at = below(state, 7);
    switch (below(state, 4)) {
    case 0: data[at + 1] ^= (uint8_t)(1u << below(state, 8)); break;
    case 1: data[at + 1] = (uint8_t)value; break;
    case 2:
        data[at] = (uint8_t)value;
        data[at + 1] = (uint8_t)(value >> 8);
        break;
    default: data[at + 1] = (uint8_t)mutate_random(state); break;
    }
}

static void randomise(uint64_t *state, uint8_t *record) {
    const uint64_t bits = mutate_random(state);
    record[0] = below(state, 8) == 0 ? 0 : FUZZ_PROTECT | FUZZ_COUNT;
    put_id(record, below(state, 0x1B) << 6 | some_node(state));
    for (unsigned byte = 0; byte < 8; byte++) {
        record[4 + byte] = (uint8_t)(bits >> (8 * byte));
    }
}

/** Rarely something that happens to the station: it ends what the frames before have built up. */
static void happen(uint64_t *state, uint8_t *record) {
    if (below(state, EVENT_IN) != 0) {
        randomise(state, record);
        return;
    }
    record[0] = FUZZ_EVENT;
    record[4] = (uint8_t)below(state, FUZZ_EVENTS);
    record[5] = (uint8_t)below(state, 4) == 0 ? (uint8_t)mutate_random(state) : (uint8_t)below(state, 20);
    record[6] = (uint8_t)below(state, TAPER_STORE_COPIES);
}

static void change_record(uint64_t *state, uint8_t *record) {
    switch (below(state, 16)) {
    case 0: change_id(state, record); break;
    case 1: record[0] ^= FUZZ_PROTECT; break;
    case 2: record[0] ^= FUZZ_COUNT; break;
    case 3: record[0] = (uint8_t)((record[0] & 0x0Fu) | below(state, 16) << 4); break;
    case 4:
        record[3] = below(state, TIME_IN) == 0 ? (uint8_t)mutate_random(state) : (uint8_t)below(state, 200);
        break;
    case 5: randomise(state, record); break;
    case 6: happen(state, record); break;
    default: change_data(state, record + 4); break;
    }
}

size_t mutate(uint64_t *state, const uint8_t *seed[2], const size_t size[2], uint8_t *out) {
    size_t count = 0;
    while (count < MUTATE_RECORDS) {
        const unsigned which = below(state, 2);
        const size_t records = size[which] / FUZZ_RECORD;
        const size_t from = count == 0 ? 0 : below(state, (unsigned)records);
        size_t stretch = 1 + below(state, LONGEST_STRETCH);
        stretch = stretch < records - from ? stretch : records - from;
        stretch = stretch < MUTATE_RECORDS - count ? stretch : MUTATE_RECORDS - count;
        memcpy(out + count * FUZZ_RECORD, seed[which] + from * FUZZ_RECORD, stretch * FUZZ_RECORD);
        for (size_t k = count; k < count + stretch; k++) {
            if (below(state, 4) == 0) {
                change_record(state, out + k * FUZZ_RECORD);
            }
        }
        count += stretch;
    }
    return count * FUZZ_RECORD;
}
