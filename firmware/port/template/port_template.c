#include "port_template.h"

/*
 * As it stands, this port compiles and is safe: it hears nothing, so the station stays in mode INIT and no connector
 * charges. Each function says what the board has to do. All of them run in the context that calls
 * taper_station_step(); none of them may block.
 */

/*
 * Fetch the oldest frame from the queue that the receive interrupt fills, from whichever bus it came.
 *
 * - `bus` counts from 0 in the order of the station's description. `length` is the DLC, as received.
 * - Skip remote frames, error frames and 29-bit identifiers here. Do not check contents: the station does.
 * - The queue should hold a control tick's worth: about 11 frames a second per connector, and room for a burst.
 *   When it is full, drop the oldest frame and count it: the newest state is what matters.
 */
static bool receive(void *context, taper_frame_t *frame) {
    taper_template_board_t *board = context;
    (void)board;
    (void)frame;
    return false; /* nothing waiting */
}

/*
 * Hand one frame to the CAN controller of `frame->bus`, or to a queue behind it that its interrupt empties.
 *
 * - Return false when it was not taken: queue full, bus-off, no such bus. The station counts that and sends the newest
 *   value again in its next tick; never wait, and never keep a frame that was refused.
 * - Frames with the same identifier must leave in the order they came: the receiver checks a counter. Use one mailbox,
 *   or a FIFO; several mailboxes with the same priority may swap two frames.
 * - After bus-off, restart the controller after 1, 2, 4 .. 60 s, and throw away what was queued: an old setpoint must
 *   not leave late.
 */
static bool send(void *context, const taper_frame_t *frame) {
    taper_template_board_t *board = context;
    (void)board;
    (void)frame;
    return false; /* not taken */
}

/*
 * Reload the hardware watchdog; 2 s suits a control tick of 1 s. It is called from here only, at the end of a tick
 * that finished: do not reload it in an interrupt or an idle loop as well, that would hide a hang.
 */
static void kick_watchdog(void *context) {
    taper_template_board_t *board = context;
    (void)board;
}

/* Free-running microseconds that may wrap. It only serves the account of solve times. */
static uint32_t clock_us(void *context) {
    taper_template_board_t *board = context;
    (void)board;
    return 0;
}

taper_port_t taper_template_port(taper_template_board_t *board) {
    const taper_port_t port = {
        .context = board,
        .receive = receive,
        .send = send,
        .kick_watchdog = kick_watchdog, /* NULL for a board without a watchdog */
        .clock_us = clock_us,           /* NULL for a board without a fast clock */
    };
    return port;
}
