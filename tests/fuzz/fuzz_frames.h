/**
 * The fuzz target "from frame to session table": bytes become frames and time, go through the port into a whole station of
 * type hub, and nothing that is out of range may be found behind the decoder.
 *
 * An input is a row of records of FUZZ_RECORD bytes; a rest that is too short is ignored:
 *
 *     byte 0      FUZZ_... flags; high nibble: length of the frame + 1, 0 or above 8: eight
 *     bytes 1, 2  little endian: identifier in bits 0..10, bus in bits 11..12
 *     byte 3      how time goes on after the frame (fuzz_time_t)
 *     bytes 4-11  data of the frame
 *
 * The clock of every input starts 20 s before it wraps.
 */
#ifndef TAPER_FUZZ_FRAMES_H
#define TAPER_FUZZ_FRAMES_H

#include <stddef.h>
#include <stdint.h>

#include "taper/station.h"

#define FUZZ_RECORD 12u

/** End-to-end protection is put right, so that fuzzing gets past the CRC. */
#define FUZZ_PROTECT 0x01u
/** And its counter is the next of this identifier, instead of the one in the data. */
#define FUZZ_COUNT 0x02u
/**
 * The record is a whole transfer over ISO-TP, cut into frames, with a right header and CRC-32: data byte 0 is the type,
 * byte 1 the number of records behind it whose data are the content, bytes 2-3 the number of items.
 */
#define FUZZ_TRANSFER 0x04u
/** Not a frame, but something that happens to the station: data byte 0 (fuzz_event_t, modulo their number), byte 1 a
    detail. */
#define FUZZ_EVENT 0x08u

typedef enum {
    FUZZ_BUS_OFF, /**< detail: restarts that it takes; 0: it comes back with FUZZ_BUS_ON */
    FUZZ_BUS_ON,
    FUZZ_POWER,      /**< power fails and comes back: a new station with the old store */
    FUZZ_TEAR_WRITE, /**< detail: bytes that the next write to the store gets done */
    FUZZ_ROT,        /**< detail: bit of a copy's first 32 bytes; data byte 2: copy */
    FUZZ_EVENTS,
} fuzz_event_t;

/** Byte 3 of a record. */
typedef enum {
    FUZZ_TIME_STANDS = 0,
    FUZZ_TIME_TICK =
        200, /**< from here on: 1, 2 .. 50 s, then a control tick; below: so many ms, then a poll */
    FUZZ_TIME_JUMP = 250, /**< from here on: 10 min, 2 h, 1, 6, 23 or 40 days, then a control tick */
} fuzz_time_t;

/** What was reached, for an account of the fuzzing; sums over all inputs. */
typedef struct {
    uint64_t inputs, frames, isotp_frames, transfers, events, steps, polls;
    uint64_t sound; /**< frames with good end-to-end protection, by our own account */
    uint64_t decoded[TAPER_MESSAGE_ISOTP_FROM + 1u]; /**< of these, decoded; by function */
    uint64_t partly_absent;                          /**< of these, with a field out of range */
    uint64_t sessions;                               /**< connectors in session, summed over ticks */
    uint64_t demands;                                /**< that wanted energy */
    uint64_t currents;                               /**< that got current */
    uint64_t answers;                                /**< frames that the station sent */
    uint64_t station[TAPER_COUNTERS];                /**< the station's own counters */
} fuzz_stats_t;

extern fuzz_stats_t fuzz_stats;

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

#endif
