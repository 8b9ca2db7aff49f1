/**
 * ISO-TP (ISO 15765-2) on the station bus: messages of up to 4095 bytes in frames of eight, both directions, in memory
 * that the caller owns. Normal addressing, classic CAN. Frames are sent padded to eight bytes (0xCC), and taken unpadded
 * too. The escape to lengths above 4095 is refused.
 *
 * A link is one pair of identifiers. It receives and sends at the same time, one message each way. Time is an argument;
 * the caller moves frames: it hands received ones to taper_isotp_take(), and sends what taper_isotp_next() gives.
 *
 * What the standard calls unexpected: a single or first frame in the middle of a reception ends it and starts the new
 * one; a consecutive frame or a flow control that nobody waits for is ignored, and so is a frame that contradicts its
 * own length. ISO-TP has no checksum: bytes in a whole message may be wrong, so what matters carries its own CRC.
 */
#ifndef TAPER_ISOTP_H
#define TAPER_ISOTP_H

#include <stdbool.h>
#include <stdint.h>

#include "taper/frame.h"
#include "taper/types.h"

/** Longest message of classic ISO-TP. */
#define TAPER_ISOTP_LONGEST 4095u
/** Longest message that is one frame. */
#define TAPER_ISOTP_SINGLE 7u
/** Greatest gap that can be asked for [ms]. */
#define TAPER_ISOTP_SEPARATION_MAX_ms 127u

/** How a link behaves; constant for its life. */
typedef struct {
    uint16_t send_id, receive_id;
    uint8_t bus;
    uint8_t block_size;    /**< frames that we take between two flow controls; 0: all */
    uint8_t separation_ms; /**< least gap that we ask a sender to keep, 0..127 */
    uint8_t waits;         /**< flow controls "wait" in a row that we bear as a sender (N_WFTmax) */
    /** N_As, N_Bs and N_Cr, > 0: longest wait for a frame of ours to leave, for flow control, for the next frame. */
    uint32_t timeout_ms;
    uint8_t *buffer;   /**< for received messages */
    uint16_t capacity; /**< of it, 0..TAPER_ISOTP_LONGEST; a longer message is refused with "overflow" */
} taper_isotp_options_t;

typedef enum {
    TAPER_ISOTP_IDLE,
    TAPER_ISOTP_BUSY,
    TAPER_ISOTP_DONE, /**< received: whole, in the buffer; sent: the last frame is out */
    TAPER_ISOTP_TIMEOUT,
    TAPER_ISOTP_SEQUENCE, /**< a frame was lost or came twice */
    TAPER_ISOTP_OVERFLOW, /**< received: longer than the buffer; sent: the peer said so */
    TAPER_ISOTP_REFUSED,  /**< the peer said wait too often, or sent a flow status without a meaning */
} taper_isotp_state_t;

/** Private to the layer; in the header because the caller owns the memory. */
typedef struct {
    taper_isotp_options_t options;
    struct {
        taper_isotp_state_t state;
        uint16_t length, got;
        uint8_t sequence, in_block;
        bool flow_due;                    /**< a flow control is to be sent */
        uint8_t flow_status;              /**< 0 continue, 1 wait, 2 overflow */
        uint32_t since_ms;                /**< of the last frame, the peer's or our flow control */
        uint16_t next_length;             /**< of the message that waits for the buffer; 0: none */
        uint8_t next[TAPER_ISOTP_SINGLE]; /**< its first bytes */
    } in;
    struct {
        taper_isotp_state_t state;
        const uint8_t *data;
        uint16_t length, sent;
        uint8_t sequence, left_in_block, waits;
        bool unlimited_block, waiting_for_flow;
        uint32_t separation_ms; /**< between two of our frames, as the peer asks */
        uint32_t gap_ms;        /**< from `since_ms` to the next frame */
        uint32_t since_ms;      /**< of the last frame, ours or the peer's */
    } out;
    uint8_t given; /**< what the last taper_isotp_next() gave */
} taper_isotp_t;

/** An idle link. @return TAPER_ERR_ARGUMENT for a NULL buffer with a capacity, a capacity above
    TAPER_ISOTP_LONGEST, equal identifiers, ones above 0x7FF, a separation above 127 ms, or a timeout of 0. */
taper_status_t taper_isotp_init(taper_isotp_t *link, const taper_isotp_options_t *options);

/**
 * Take in a frame, whatever its bytes; others than ours (bus, receive_id) are left alone. Cost: a copy of seven bytes.
 * @return whether it was for this link.
 */
bool taper_isotp_take(taper_isotp_t *link, const taper_frame_t *frame, uint32_t now_ms);

/**
 * The frame to send at `now_ms`, if one is due; flow control comes before data. It is given again until
 * taper_isotp_sent() says that it is out, so a full send queue costs nothing but time, up to `timeout_ms`. Timeouts are
 * judged here and in taper_isotp_take(): call it at least every few milliseconds while busy.
 *
 * A gap that the peer asks for is kept for one millisecond more, because a clock of whole milliseconds sees a gap of n
 * when only a little more than n - 1 have passed. Gaps below a millisecond count as one.
 */
bool taper_isotp_next(taper_isotp_t *link, uint32_t now_ms, taper_frame_t *frame);

/** What the last taper_isotp_next() gave is out. Does nothing if that has been overtaken by a frame taken since. */
void taper_isotp_sent(taper_isotp_t *link, uint32_t now_ms);

/** Begin to send `data`, which must stay as it is until the state is no longer BUSY. @return TAPER_ERR_ARGUMENT for a
    length of 0 or above TAPER_ISOTP_LONGEST, or while a message is on its way out. */
taper_status_t taper_isotp_send(taper_isotp_t *link, const uint8_t *data, uint16_t length, uint32_t now_ms);

/** Stop sending; the state becomes IDLE if it was BUSY. The peer finds out by its timeout, or by the next message. */
void taper_isotp_cancel(taper_isotp_t *link);

/** State of the message coming in; `length` is that of the message in the buffer, 0 unless DONE. DONE stays until
    taper_isotp_release(), the failures until then or until the next message. */
taper_isotp_state_t taper_isotp_received(const taper_isotp_t *link, uint16_t *length);

/**
 * Free the buffer for the next message; a failure is forgotten. While a whole message is in the buffer, a new one waits:
 * its sender is told so, half of `timeout_ms` apart, and of several the newest is kept. It is let in here, so that the
 * state may become BUSY, or DONE again. Does nothing while BUSY.
 */
void taper_isotp_release(taper_isotp_t *link, uint32_t now_ms);

/** State of the message going out. */
taper_isotp_state_t taper_isotp_sending(const taper_isotp_t *link);

/** Whether frames are still expected or to be sent, in either direction. */
bool taper_isotp_busy(const taper_isotp_t *link);

#endif
