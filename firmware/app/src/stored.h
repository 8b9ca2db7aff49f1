/**
 * Private to the app layer: a record in the store that power may cut short at any moment. It has two copies. A write goes
 * to the one that does not hold the newest good record, so that one good record is always there.
 *
 *     byte 0 "T", 1 "P", 2 area, 3 layout of the body, 4 length of the body u32, 8 sequence u32, 12 body, CRC-32 of all before it
 *
 * little endian, byte by byte. Of the good copies the one with the higher sequence counts; the sequence wraps. A sound record
 * with another layout is refused: what the layout means is its owner's.
 */
#ifndef TAPER_STORED_H
#define TAPER_STORED_H

#include "taper/port.h"
#include "taper/settings.h"

#define TAPER_STORED_HEADER   12u
#define TAPER_STORED_ENVELOPE (TAPER_STORED_HEADER + 4u)

/** One area of the store, and memory for a record of it. */
typedef struct {
    const taper_port_t *port;
    uint8_t *bytes; /**< [capacity]; the body is at TAPER_STORED_HEADER */
    uint32_t capacity;
    uint8_t area;      /**< taper_store_area_t */
    uint8_t layout;    /**< of a body that its owner understands */
    uint8_t next_copy; /**< to be written next */
    uint32_t sequence; /**< of the newest record; 0 at first */
    bool copies_agree; /**< both are good, and of one sequence */
} taper_stored_area_t;

/** Whether the port has a store. */
bool taper_stored_is_there(const taper_port_t *port);

/** The newest good record into `bytes`; `*length` is that of its body, 0 if there is none. Cost: O(bytes). */
taper_stored_t taper_stored_read(taper_stored_area_t *area, uint32_t *length);

/**
 * Write the body in `bytes`, `length` long, as the newest record. @return false: it could not be written, and counts as not
 * written; the next call tries the same copy again.
 */
bool taper_stored_write(taper_stored_area_t *area, uint32_t length);

/** Write what was written or read last to the other copy too, with the same sequence. @return false: as above. */
bool taper_stored_write_twin(taper_stored_area_t *area, uint32_t length);

#endif
