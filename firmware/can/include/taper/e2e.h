/**
 * End-to-end protection: AUTOSAR E2E Profile 22 on the station bus (docs/protocol.md).
 *
 * Byte 0 is a CRC-8 (polynomial 0x2F, initial 0xFF, final xor 0xFF) over bytes 1..7 and then one byte that is never
 * sent, `DataIDList[id][counter]`; the low nibble of byte 1 is the counter. It finds loss, repetition, insertion,
 * masquerade and corruption. It is no defence against an attacker who can write to the bus.
 */
#ifndef TAPER_E2E_H
#define TAPER_E2E_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "taper/frame.h"

/** What one received frame is, against those before it from the same sender. */
typedef enum {
    TAPER_E2E_OK,             /**< next counter, or the first frame at all */
    TAPER_E2E_OK_SOME_LOST,   /**< counter moved by 2..3: use it, count the loss */
    TAPER_E2E_REPEATED,       /**< same counter: not a sign of life */
    TAPER_E2E_WRONG_SEQUENCE, /**< counter moved by more: resynchronised on it, not used */
    TAPER_E2E_CRC_ERROR,      /**< corrupt, masqueraded, or wrong length */
} taper_e2e_check_t;

/** Receiver state for one (bus, id). Zero-initialised: nothing heard yet. */
typedef struct {
    uint8_t counter;   /**< of the last frame with a good CRC */
    bool synchronised; /**< `counter` is set */
    /** Bit k: the frame k before the last was in error; a window of 5. A repeated frame is no news either way and does
        not enter it. */
    uint8_t errors;
} taper_e2e_receiver_t;

/** CRC-8/8H2F of `length` bytes. "123456789" gives 0xDF. Cost: one table look-up per byte. */
uint8_t taper_crc8_8h2f(const uint8_t *data, size_t length);

/** Entry of the DataIDList for `id` (11 bits) and `counter` (0..15). */
uint8_t taper_e2e_data_id(uint16_t id, uint8_t counter);

/** Set counter and CRC of a frame whose id and bytes 1..7 are final. `counter` 0..15; the high nibble of byte 1 stays. */
void taper_e2e_protect(taper_frame_t *frame, uint8_t counter);

/** Check a frame and move the receiver. Only TAPER_E2E_OK and TAPER_E2E_OK_SOME_LOST carry data to use. */
taper_e2e_check_t taper_e2e_check(taper_e2e_receiver_t *receiver, const taper_frame_t *frame);

/**
 * Whether the last five frames held no more than two errors (CRC error or wrong sequence): otherwise the node counts as
 * lost. True before anything was heard: whether a node is alive is for its timeout to say.
 */
bool taper_e2e_is_valid(const taper_e2e_receiver_t *receiver);

#endif
