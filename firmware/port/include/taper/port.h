/**
 * What a board provides. A port is one struct of callbacks with a context; only the app layer calls it.
 * `firmware/port/template/` is a fill-in start for a new board.
 */
#ifndef TAPER_PORT_H
#define TAPER_PORT_H

#include <stdbool.h>
#include <stdint.h>

#include "taper/frame.h"
#include "taper/sizes.h"

/** What the non-volatile store holds: a record for each area, so that one that is written often never harms another. */
typedef enum {
    TAPER_STORE_STATION = 0,  /**< what changes while it runs: sessions, the failsafe limit told, starts */
    TAPER_STORE_SETTINGS = 1, /**< what was set at the site (settings.h); written when somebody sets it */
    TAPER_STORE_AREAS
} taper_store_area_t;

/** Copies of each record: a write harms one of them at most. */
#define TAPER_STORE_COPIES 2u

/** The longest record [bytes]: of the area TAPER_STORE_STATION of an image for its largest station. */
#define TAPER_STORE_RECORD_MAX (64u + 104u * TAPER_MAX_CONNECTORS)

typedef struct {
    void *context;

    /**
     * Take the oldest received frame, with the time of its reception. @return false: none waiting. Must not block.
     * A full queue drops its oldest frame and counts it: the newest state is what matters.
     */
    bool (*receive)(void *context, taper_frame_t *frame);

    /** Queue a frame for sending. @return false: the queue is full, the bus is off, or no bus carries it (a `bus` that is
        not there, an identifier of more than 11 bits, a length above 8); the frame was not taken. Must not block. */
    bool (*send)(void *context, const taper_frame_t *frame);

    /** Called once at the end of every control tick that finished. NULL: the board has no watchdog. */
    void (*kick_watchdog)(void *context);

    /** Free-running microseconds, for the account of solve times only: nothing is decided by it. NULL: none. */
    uint32_t (*clock_us)(void *context);

    /** Whether the CAN controller of `bus` has left the bus after too many errors (bus-off). NULL: it never does. */
    bool (*bus_is_off)(void *context, uint8_t bus);

    /** Ask the controller of `bus`, which is off, to come back. NULL: it does so by itself. Must not block. */
    void (*restart_bus)(void *context, uint8_t bus);

    /** Frames lost because a receive queue was full; never falls. NULL: unknown. */
    uint32_t (*receive_overflows)(void *context);

    /**
     * Read the first `length` bytes of a copy (0..TAPER_STORE_COPIES-1) of an area's record (taper_store_area_t) in
     * non-volatile memory, or write it, from its first byte on; 1..TAPER_STORE_RECORD_MAX. A read may be longer or shorter
     * than what was written: what lies beyond is of no account. A write that power-off cuts short may leave that copy
     * torn, and no other of any area. Both NULL: no store.
     * @return of a read, false: this copy was never written. What was written and cannot be read must not look like that, or a
     * limit that was set at the site would be forgotten: answer true, with zeros, which are no record. Of a write, false: it
     * could not be done.
     */
    bool (*store_read)(void *context, unsigned area, unsigned copy, void *data, uint32_t length);
    bool (*store_write)(void *context, unsigned area, unsigned copy, const void *data, uint32_t length);
} taper_port_t;

#endif
