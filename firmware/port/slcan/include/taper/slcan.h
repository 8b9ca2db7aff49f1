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
 * Commands: S0..S8 and s (taken, without meaning here), O, L (listen only: nothing of the station is sent), C, t and T (a
 * frame for the station), r and R (remote frames, taken and dropped), F (status flags, below), Z0 (Z1, timestamps, is
 * refused), V and N (version, serial number). Good commands are answered as LAWICEL says ("<CR>", "z<CR>", "Z<CR>"), all
 * else by BEL.
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
/** Frames to be sent; a power of two. */
#define TAPER_SLCAN_SEND_DEPTH 256u

/** A frame on the wire. */
typedef struct {
    uint32_t id; /**< 11 bits, or 29 of an extended one */
    bool is_extended, is_remote;
    uint8_t length; /**< 0..8 */
    uint8_t data[TAPER_FRAME_LENGTH];
} taper_slcan_message_t;

/** Line with its CR into `line`. @return its length; 0 for a message that is out of range. */
size_t taper_slcan_encode(const taper_slcan_message_t *message, char line[TAPER_SLCAN_LINE]);

/** A line without its CR: any of t, T, r, R, digits in upper or lower case. @return false: it is none of these, or not whole. */
bool taper_slcan_decode(const char *line, size_t length, taper_slcan_message_t *message);

/** A stream of bytes, such as a UART or a socket. Neither function blocks. */
typedef struct {
    void *context;
    /** Take up to `size` bytes that have come. @return how many. */
    size_t (*read)(void *context, uint8_t *data, size_t size);
    /** Give up to `size` bytes. @return how many were taken. */
    size_t (*write)(void *context, const uint8_t *data, size_t size);
} taper_stream_t;

/** The adapter. The caller owns it; private but for the counters. */
typedef struct {
    taper_stream_t stream;
    uint32_t now_ms; /**< of the last pump: reception time of frames */
    bool is_open, listens_only;
    char line[TAPER_SLCAN_LINE];
    uint8_t line_length;
    bool line_is_bad; /**< too long: all up to the next CR is dropped */
    taper_frame_t received[TAPER_SLCAN_RECEIVE_DEPTH];
    uint32_t receive_head, receive_tail; /**< free-running */
    taper_frame_t to_send[TAPER_SLCAN_SEND_DEPTH];
    uint32_t send_head, send_tail;
    char out[64]; /**< what the stream has not taken yet: answers, and the frame that is being sent */
    uint8_t out_length, out_taken;
    bool holds_extended; /**< nothing more is read until it is taken */
    taper_slcan_message_t extended;
    uint32_t overflows; /**< received frames lost because the queue was full: the oldest; saturating */
    uint32_t bad_lines; /**< refused by BEL; saturating */
} taper_slcan_t;

/** A closed channel over `stream`, which is copied. */
void taper_slcan_init(taper_slcan_t *slcan, const taper_stream_t *stream);

/**
 * Move bytes in both directions until neither gets on, at `now_ms`, the reception time of the frames that come. Call it as often
 * as the stream needs. Extended frames are not for the station; the first one stops reading until it is taken, so that its
 * place among the others is known.
 */
void taper_slcan_pump(taper_slcan_t *slcan, uint32_t now_ms);

/** The extended frame that came. @return false: none. */
bool taper_slcan_take_extended(taper_slcan_t *slcan, taper_slcan_message_t *message);

/** Send an extended frame behind all that is queued, at once: pumps until the stream has taken everything. */
void taper_slcan_send_extended(taper_slcan_t *slcan, const taper_slcan_message_t *message);

/** Whether all that was to be sent is on the stream. */
bool taper_slcan_is_drained(const taper_slcan_t *slcan);

/** The adapter as the station's port, one bus, without watchdog, microseconds and store. `slcan` must outlive it. */
taper_port_t taper_slcan_port(taper_slcan_t *slcan);

#endif
