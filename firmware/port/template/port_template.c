#include "port_template.h"

/*
 * As it stands, this port compiles and is safe: it hears nothing, so the station stays in mode INIT and no connector
 * charges. Each function says what the board has to do. All of them run in the context that calls
 * taper_station_step() or taper_station_poll(); none of them may block.
 */

/*
 * Fetch the oldest frame from the queue that the receive interrupt fills, from whichever bus it came.
 *
 * - `bus` counts from 0 in the order of the station's description. `length` is the DLC, as received.
 * - `time_ms` is when the interrupt saw the frame, on the clock that taper_station_step() is called with. A board that does
 *   not know leaves it alone: the frame then counts as received when it is taken.
 * - Skip remote frames, error frames, 29-bit identifiers, and what this board sends itself, if the controller hears that
 *   (a FlexCAN does, unless SRXDIS is set). Do not check contents: the station does.
 * - The queue should hold a control tick's worth: about 11 frames a second per connector, and room for a burst.
 *   When it is full, drop the oldest frame and count it: the newest state is what matters. The count is what
 *   receive_overflows() tells.
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
 *   value again in its next poll; never wait, and never keep a frame that was refused.
 * - Frames with the same identifier must leave in the order they came: the receiver checks a counter. Use one mailbox,
 *   or a FIFO; several mailboxes with the same priority may swap two frames.
 * - Keep the queue short, some 30 frames: an old setpoint must not leave late. At bus-off, throw away what is queued.
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

/* Whether the CAN controller of `bus` is bus-off. The station then stops sending and decides when to try again. */
static bool bus_is_off(void *context, uint8_t bus) {
    taper_template_board_t *board = context;
    (void)board;
    (void)bus;
    return false;
}

/* Bring that controller back: on an FDCAN clear INIT, on a FlexCAN clear BOFFREC. It needs 128 times eleven recessive bits
   then; do not wait for them. Switch automatic recovery off, or the station's pauses have no effect. */
static void restart_bus(void *context, uint8_t bus) {
    taper_template_board_t *board = context;
    (void)board;
    (void)bus;
}

/* Frames that the receive queue, or the controller's FIFO, has lost so far. */
static uint32_t receive_overflows(void *context) {
    taper_template_board_t *board = context;
    (void)board;
    return 0;
}

/*
 * Copy `copy` (0 or 1) of the record of an area (taper_store_area_t) in non-volatile memory, `length` bytes as they are, at
 * most TAPER_STORE_RECORD_MAX: four flash sectors, or four ranges of an EEPROM or FRAM. A record has its own length,
 * sequence number and CRC-32, so a write that power-off cuts short may leave that copy torn; it must not harm another.
 * The station writes its own area at most every ten seconds, and every 15 minutes while vehicles charge; settings are
 * written by hand. Flash that bears few erasures is erased only when a sector is full: append, and read the last one.
 * False from a read says that the copy was never written. One that cannot be read answers true, with zeros.
 */
static bool store_read(void *context, unsigned area, unsigned copy, void *data, uint32_t length) {
    taper_template_board_t *board = context;
    (void)board;
    (void)area;
    (void)copy;
    (void)data;
    (void)length;
    return false; /* never written */
}

static bool store_write(void *context, unsigned area, unsigned copy, const void *data, uint32_t length) {
    taper_template_board_t *board = context;
    (void)board;
    (void)area;
    (void)copy;
    (void)data;
    (void)length;
    return false; /* not written */
}

taper_port_t taper_template_port(taper_template_board_t *board) {
    const taper_port_t port = {
        .context = board,
        .receive = receive,
        .send = send,
        .kick_watchdog = kick_watchdog,         /* NULL for a board without a watchdog */
        .clock_us = clock_us,                   /* NULL for a board without a fast clock */
        .bus_is_off = bus_is_off,               /* NULL where it cannot be told */
        .restart_bus = restart_bus,             /* NULL where the controller comes back by itself */
        .receive_overflows = receive_overflows, /* NULL where it is not counted */
        .store_read = store_read,               /* both NULL for a board without a store */
        .store_write = store_write,
    };
    return port;
}
