/**
 * What a board provides. A port is one struct of callbacks with a context; only the app layer calls it.
 * `firmware/port/template/` is a fill-in start for a new board.
 */
#ifndef TAPER_PORT_H
#define TAPER_PORT_H

#include <stdbool.h>
#include <stdint.h>

#include "taper/frame.h"

typedef struct {
    void *context;

    /** Take the oldest received frame. @return false: none waiting. Must not block. */
    bool (*receive)(void *context, taper_frame_t *frame);

    /** Queue a frame for sending. @return false: the queue is full, the frame was not taken. Must not block. */
    bool (*send)(void *context, const taper_frame_t *frame);

    /** Called once at the end of every control tick that finished. NULL: the board has no watchdog. */
    void (*kick_watchdog)(void *context);

    /** Free-running microseconds, for the account of solve times only: nothing is decided by it. NULL: none. */
    uint32_t (*clock_us)(void *context);
} taper_port_t;

#endif
