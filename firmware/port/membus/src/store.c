/* The station's store in RAM, with the faults of real memory: writes cut short, and bits that flip. */
#include <string.h>

#include "membus_internal.h"

void taper_membus_store_init(taper_membus_t *bus) {
    memset(bus->store, 0xFF, sizeof bus->store);
    for (unsigned area = 0; area < TAPER_STORE_AREAS; area++) {
        for (unsigned copy = 0; copy < TAPER_STORE_COPIES; copy++) {
            bus->store[area][copy].written = false;
        }
    }
    bus->tear_next = false;
    bus->tear_after = 0;
    bus->store_writes = 0;
}

static bool fits(unsigned area, unsigned copy, uint32_t length) {
    return area < TAPER_STORE_AREAS && copy < TAPER_STORE_COPIES && length <= TAPER_STORE_RECORD_MAX;
}

bool taper_membus_store_read(void *context, unsigned area, unsigned copy, void *data, uint32_t length) {
    const taper_membus_t *bus = context;
    if (!fits(area, copy, length) || !bus->store[area][copy].written) {
        return false;
    }
    memcpy(data, bus->store[area][copy].data, length);
    return true;
}

bool taper_membus_store_write(void *context, unsigned area, unsigned copy, const void *data,
                              uint32_t length) {
    taper_membus_t *bus = context;
    if (!fits(area, copy, length)) {
        return false;
    }
    taper_membus_copy_t *target = &bus->store[area][copy];
    const bool is_torn = bus->tear_next && bus->tear_after < length;
    const uint32_t done = is_torn ? bus->tear_after : length;
    taper_count(&bus->store_writes);
    bus->tear_next = false;
    memcpy(target->data, data, done);
    target->written = target->written || done > 0;
    return !is_torn;
}

void taper_membus_tear_next_write(taper_membus_t *bus, uint32_t bytes) {
    bus->tear_next = true;
    bus->tear_after = bytes;
}

void taper_membus_rot(taper_membus_t *bus, unsigned area, unsigned copy, uint32_t bit) {
    if (fits(area, copy, 0) && bit < TAPER_STORE_RECORD_MAX * 8u) {
        bus->store[area][copy].data[bit / 8u] ^= (uint8_t)(1u << (bit % 8u));
    }
}
