/**
 * SLCAN, the ASCII protocol of LAWICEL's adapters, which Linux' slcand and python-can know: one line per frame, ended by a
 * carriage return, over any stream of bytes.
 *
 *     t1238AABBCCDDEEFF0011<CR>      standard frame: three digits of identifier, length, data
 *     T1FFFFF004AABBCCDD<CR>         extended frame: eight digits of identifier
 *
 * This is the end of the adapter: who is attached to the stream sees a CAN bus with the station on it. The attached side
 * opens the channel with "S6", "O"; until then nothing is sent, and what comes is lost.
 *
 * | command            | what it does                                                        | when           | answer    |
 * |--------------------|---------------------------------------------------------------------|----------------|-----------|
 * | S0..S8, sXXXX      | bit rate: taken, without meaning here                               | closed         | CR        |
 * | O                  | open the channel                                                    | closed         | CR        |
 * | L                  | open it to listen: the attached side hears the station, and is mute | closed         | CR        |
 * | C                  | close it; what waits to be sent is thrown away                      | always         | CR        |
 * | tIIIL.., rIIIL     | a frame, a remote frame (dropped) for the station                   | open, not mute | z CR      |
 * | TIIIIIIIIL.., R..  | the same with an extended identifier                                | open, not mute | Z CR      |
 * | F                  | status flags below, two digits; reading clears them                 | open           | Fxx CR    |
 * | Z0                 | no timestamps (Z1 is refused)                                       | always         | CR        |
 * | V, N               | version, serial number                                              | always         | V.., N.., |
 * | an empty line      | ends what came before it                                            | always         | none      |
 *
 * All else is answered by BEL, and counted.
 */
#ifndef TAPER_SLCAN_H
#define TAPER_SLCAN_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "taper/frame.h"
#include "taper/port.h"

/** Longest line, with its CR: "T", 8 digits, length, 16 digits. */
#define TAPER_SLCAN_LINE 27u
/** Received frames that wait for the station; a power of two. A burst of a tick from the largest station on one bus. */
#define TAPER_SLCAN_RECEIVE_DEPTH 1024u
/** Frames to be sent; a power of two. What the largest station on one bus sends in a tick. */
#define TAPER_SLCAN_SEND_DEPTH 256u

/** Status flags, as LAWICEL numbers them. */
#define TAPER_SLCAN_FLAG_SEND_FULL 0x01u /**< a frame of the station was refused: nobody takes what waits */
#define TAPER_SLCAN_FLAG_OVERRUN 0x08u /**< a frame for the station was lost: it was the oldest that waited */

/** A frame on the wire. */
typedef struct {
    uint32_t id; /**< 11 bits, or 29 of an extended one */
    bool is_extended, is_remote;
    uint8_t length; /**< 0..8 */
    uint8_t data[TAPER_FRAME_LENGTH];
} taper_slcan_message_t;

/** Line with its CR into `line`. @return its length; 0 for a message that is out of range. */
size_t taper_slcan_encode(const taper_slcan_message_t *message, char line[TAPER_SLCAN_LINE]);

/**
 * A line without its CR: any of t, T, r, R, digits in upper or lower case. What the line does not give is 0.
 * @return false: it is none of these, not whole, or out of range; `message` is then of no meaning.
 */
bool taper_slcan_decode(const char *line, size_t length, taper_slcan_message_t *message);

/** A stream of bytes, such as a UART or a socket. Neither function blocks. */
typedef struct {
    void *context;
    /** Take up to `size` bytes that have come. @return how many. */
    size_t (*read)(void *context, uint8_t *data, size_t size);
    /** Give up to `size` bytes. @return how many were taken. */
    size_t (*write)(void *context, const uint8_t *data, size_t size);
} taper_stream_t;

/** The adapter, about 20 KB. The caller owns it; private but for the counters, which saturate. */
typedef struct {
    taper_stream_t stream;
    uint32_t now_ms; /**< of the last pump: reception time of frames */
    bool is_open, listens_only;
    uint8_t flags;  /**< TAPER_SLCAN_FLAG_... since they were last read */
    uint8_t in[64]; /**< read from the stream, not looked at yet from `in_taken` on */
    uint8_t in_length, in_taken;
    char line[TAPER_SLCAN_LINE];
    uint8_t line_length; /**< TAPER_SLCAN_LINE: too long, without its CR */
    taper_frame_t received[TAPER_SLCAN_RECEIVE_DEPTH];
    uint32_t receive_head, receive_tail; /**< free-running */
    taper_frame_t to_send[TAPER_SLCAN_SEND_DEPTH];
    uint32_t send_head, send_tail;
    char out
        [64]; /**< what the stream has not taken yet, from `out_taken` on: answers, and frames on their way */
    uint8_t out_length, out_taken;
    bool holds_extended; /**< nothing more is read until it is taken */
    taper_slcan_message_t extended;
    uint32_t overflows; /**< received frames lost because the queue was full: the oldest */
    uint32_t bad_lines; /**< refused by BEL */
    uint32_t opens;     /**< times that the attached side has opened the channel */
} taper_slcan_t;

/** A closed channel over `stream`, which is copied. */
void taper_slcan_init(taper_slcan_t *slcan, const taper_stream_t *stream);

/** Open the channel as if the attached side had: for a board that resets behind the back of who is attached. */
void taper_slcan_open(taper_slcan_t *slcan);

/**
 * Move bytes in both directions until neither gets on, at `now_ms`, the reception time of the frames that come. Call it as
 * often as the stream needs. One call reads no more than the receive queue could hold, so that a flood does not keep it.
 * While the stream takes no answers, nothing is read.
 *
 * Extended frames are not for the station; the first one stops reading until it is taken, so that its place among the others
 * is known. Who has no use for them takes and forgets them.
 */
void taper_slcan_pump(taper_slcan_t *slcan, uint32_t now_ms);

/** The extended frame that came. @return false: none. */
bool taper_slcan_take_extended(taper_slcan_t *slcan, taper_slcan_message_t *message);

/**
 * Send an extended frame behind all that is queued, at once: writes until the stream has taken everything, and so waits for
 * it. For simulation only. Nothing is sent while the channel is closed.
 */
void taper_slcan_send_extended(taper_slcan_t *slcan, const taper_slcan_message_t *message);

/** Whether a received frame waits for the station. */
bool taper_slcan_has_frame(const taper_slcan_t *slcan);

/** Whether all that was to be sent is on the stream. */
bool taper_slcan_is_drained(const taper_slcan_t *slcan);

/**
 * The adapter as the station's port: one bus, number 0. `slcan` must outlive it. It has no watchdog, microseconds and store,
 * and cannot tell bus-off; the board's main fills in what the board has.
 *
 * - send() queues only: taper_slcan_pump() moves the frames. It refuses while the channel is closed.
 * - receive() takes what pumping has brought.
 */
taper_port_t taper_slcan_port(taper_slcan_t *slcan);

#endif
