/**
 * ISO-TP (ISO 15765-2) on the station bus: messages of up to 4095 bytes in frames of eight, both directions, in memory
 * that the caller owns. Normal addressing, classic CAN, frames padded to eight bytes.
 *
 * A link is one pair of identifiers. It receives and sends at the same time, one message each way. Time is an argument;
 * the caller moves frames: it hands received ones to taper_isotp_take(), and sends what taper_isotp_next() gives.
 */
#ifndef TAPER_ISOTP_H
#define TAPER_ISOTP_H

#include <stdbool.h>
#include <stdint.h>

#include "taper/frame.h"
#include "taper/types.h"

/** Longest message of classic ISO-TP. */
#define TAPER_ISOTP_LONGEST 4095u

/** How a link behaves; constant for its life. */
typedef struct {
    uint16_t send_id, receive_id;
    uint8_t bus;
    uint8_t block_size;    /**< frames that we take between two flow controls; 0: all */
    uint8_t separation_ms; /**< least gap that we ask a sender to keep, 0..127 */
    uint8_t waits;         /**< flow controls "wait" that we bear as a sender before giving up */
    uint32_t timeout_ms;   /**< N_Bs and N_Cr: longest wait for flow control, or for the next frame of a message */
    uint8_t *buffer;       /**< for received messages */
    uint16_t capacity;     /**< of it; a longer message is refused with "overflow" */
} taper_isotp_options_t;

typedef enum {
    TAPER_ISOTP_IDLE,
    TAPER_ISOTP_BUSY,
    TAPER_ISOTP_DONE,     /**< received: whole, in the buffer; sent: the last frame is out */
    TAPER_ISOTP_TIMEOUT,
    TAPER_ISOTP_SEQUENCE, /**< a frame was lost or came twice */
    TAPER_ISOTP_OVERFLOW, /**< received: longer than the buffer; sent: the peer said so */
    TAPER_ISOTP_REFUSED,  /**< the peer said wait too often, or sent nonsense */
} taper_isotp_state_t;

/** Private to the layer; in the header because the caller owns the memory. */
typedef struct {
    taper_isotp_options_t options;
    struct {
        taper_isotp_state_t state;
        uint16_t length, got;
        uint8_t sequence, in_block;
        bool flow_due;        /**< a flow control is to be sent */
        uint8_t flow_status;  /**< 0 continue, 1 wait, 2 overflow */
        uint32_t since_ms;    /**< of the last frame */
    } in;
    struct {
        taper_isotp_state_t state;
        const uint8_t *data;
        uint16_t length, sent;
        uint8_t sequence, left_in_block, waits;
        bool unlimited_block, waiting_for_flow;
        uint32_t separation_ms;
        uint32_t since_ms;    /**< of the last frame, ours or the peer's */
    } out;
} taper_isotp_t;

/** An idle link. @return TAPER_ERR_ARGUMENT for a NULL buffer with a capacity, equal identifiers, or ones above 0x7FF. */
taper_status_t taper_isotp_init(taper_isotp_t *link, const taper_isotp_options_t *options);

/**
 * Take in a frame; others than ours (bus, receive_id) are left alone. Cost: a copy of seven bytes.
 * @return whether it was for this link.
 */
bool taper_isotp_take(taper_isotp_t *link, const taper_frame_t *frame, uint32_t now_ms);

/**
 * The frame to send at `now_ms`, if one is due. It is given again until taper_isotp_sent() says that it is out, so a full
 * send queue costs nothing but time. Timeouts are judged here: call it at least every few milliseconds while busy.
 */
bool taper_isotp_next(taper_isotp_t *link, uint32_t now_ms, taper_frame_t *frame);
void taper_isotp_sent(taper_isotp_t *link, uint32_t now_ms);

/** Begin to send `data`, which must stay as it is until the state is no longer BUSY. @return TAPER_ERR_ARGUMENT for a
    length of 0 or above TAPER_ISOTP_LONGEST, or while a message is on its way out. */
taper_status_t taper_isotp_send(taper_isotp_t *link, const uint8_t *data, uint16_t length, uint32_t now_ms);

/** State of the message coming in. DONE and the failures stay until taper_isotp_release() or the next message. */
taper_isotp_state_t taper_isotp_received(const taper_isotp_t *link, uint16_t *length);

/** Free the buffer for the next message; until then a new one is told to wait. */
void taper_isotp_release(taper_isotp_t *link);

/** State of the message going out. */
taper_isotp_state_t taper_isotp_sending(const taper_isotp_t *link);

#endif
