/* The station's record in RAM, with the faults of real memory: writes cut short, and bits that flip. */
#include <string.h>

#include "membus_internal.h"

void taper_membus_store_init(taper_membus_t *bus) {
    for (unsigned copy = 0; copy < TAPER_STORE_COPIES; copy++) {
        memset(bus->store[copy].data, 0xFF, sizeof bus->store[copy].data);
        bus->store[copy].written = false;
    }
    bus->tear_next = false;
    bus->tear_after = 0;
    bus->store_writes = 0;
}

static bool fits(unsigned copy, uint32_t length) {
    return copy < TAPER_STORE_COPIES && length <= TAPER_MEMBUS_RECORD;
}

bool taper_membus_store_read(void *context, unsigned copy, void *data, uint32_t length) {
    const taper_membus_t *bus = context;
    if (!fits(copy, length) || !bus->store[copy].written) {
        return false;
    }
    memcpy(data, bus->store[copy].data, length);
    return true;
}

bool taper_membus_store_write(void *context, unsigned copy, const void *data, uint32_t length) {
    taper_membus_t *bus = context;
    if (!fits(copy, length)) {
        return false;
    }
    const bool is_torn = bus->tear_next && bus->tear_after < length;
    const uint32_t done = is_torn ? bus->tear_after : length;
    taper_count(&bus->store_writes);
    bus->tear_next = false;
    memcpy(bus->store[copy].data, data, done);
    bus->store[copy].written = bus->store[copy].written || done > 0;
    return !is_torn;
}

void taper_membus_tear_next_write(taper_membus_t *bus, uint32_t bytes) {
    bus->tear_next = true;
    bus->tear_after = bytes;
}

void taper_membus_rot(taper_membus_t *bus, unsigned copy, uint32_t bit) {
    if (copy < TAPER_STORE_COPIES && bit < TAPER_MEMBUS_RECORD * 8u) {
        bus->store[copy].data[bit / 8u] ^= (uint8_t)(1u << (bit % 8u));
    }
}
