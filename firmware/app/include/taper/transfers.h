/**
 * What goes over ISO-TP, and what becomes of it: limit and price curves from the gateway, identifiers of vehicles from their
 * connectors, and the event log to a tool. A transfer has a header of its own and a CRC-32 over all of it; it is used when
 * it is whole and right in every point, or not at all. No hard limit depends on it.
 *
 * On the wire, little endian:
 *
 *     byte 0 version (1), byte 1 type (taper_transfer_type_t), bytes 2-3 count of items, items, 4 bytes CRC-32 (IEEE 802.3)
 *
 *     LIMIT_CURVE    gateway -> station   items of 6 bytes: Unix time [s] u32, limit u16 x 100 W; times ascending
 *     PRICE_CURVE    gateway -> station   items of 6 bytes: Unix time [s] u32, price s16 in 1/1000 of the currency's unit per
 *                                         kWh, not 0x8000; times ascending
 *     IDENTIFIER     connector -> station items of 1 byte: printable ASCII, 1..TAPER_IDENTIFIER_LENGTH; empty: forget it
 *     LOG_REQUEST    tool -> station      no items
 *     LOG            station -> tool      items of 16 bytes: time_ms u32, unix_s u32, data i32, code, bus, node, 0
 *     ANSWER         station -> sender    one item of 1 byte: taper_transfer_answer_t
 *
 * Every whole message is answered: with LOG if it asks for it, otherwise with ANSWER. A torn one is not. A new message
 * from the same sender ends an answer or a log that is still on its way out.
 */
#ifndef TAPER_TRANSFERS_H
#define TAPER_TRANSFERS_H

#include <stdbool.h>
#include <stdint.h>

#include "taper/crc32.h"
#include "taper/event.h"
#include "taper/frame.h"
#include "taper/isotp.h"
#include "taper/types.h"

#define TAPER_TRANSFER_VERSION  1
#define TAPER_IDENTIFIER_LENGTH 24

/** Bytes of a transfer that are not items: header and CRC-32. */
#define TAPER_TRANSFER_ENVELOPE 8u
#define TAPER_CURVE_ITEM        6u
#define TAPER_LOG_ITEM          16u

/** What the station asks its senders to keep: at most so many frames between two of its polls [frames, ms]. */
#define TAPER_TRANSFER_BLOCK_SIZE    32
#define TAPER_TRANSFER_SEPARATION_ms 2
/** Flow controls "wait" in a row that the station bears. */
#define TAPER_TRANSFER_WAITS 10

typedef enum {
    TAPER_TRANSFER_LIMIT_CURVE = 1,
    TAPER_TRANSFER_PRICE_CURVE = 2,
    TAPER_TRANSFER_IDENTIFIER = 3,
    TAPER_TRANSFER_LOG_REQUEST = 5,
    TAPER_TRANSFER_LOG = 6,
    TAPER_TRANSFER_ANSWER = 7,
} taper_transfer_type_t;

typedef enum {
    TAPER_ANSWER_ACCEPTED = 0,
    TAPER_ANSWER_CRC = 1,     /**< CRC-32 or length wrong */
    TAPER_ANSWER_VERSION = 2, /**< another version, or a type that is not for us */
    TAPER_ANSWER_CONTENT = 3, /**< out of order, out of range, too many items */
    TAPER_ANSWER_CLOCK = 4,   /**< a curve in Unix time, and our clock was never set */
} taper_transfer_answer_t;

/** The station's end of all transfers. Private to the app layer, but for the two counters; the caller owns the memory. */
typedef struct {
    const taper_station_config_t *config;
    uint32_t accepted; /**< transfers that took effect; never falls */
    uint32_t refused;  /**< ISO-TP messages that were torn, ran out of time, or were not valid; never falls */
    taper_isotp_t gateway, tool, connector;
    uint8_t gateway_buffer[TAPER_TRANSFER_ENVELOPE + TAPER_MAX_LIMIT_POINTS * TAPER_CURVE_ITEM];
    uint8_t tool_buffer[16];
    uint8_t connector_buffer[TAPER_TRANSFER_ENVELOPE + TAPER_IDENTIFIER_LENGTH];
    uint8_t connector_index; /**< who has, or had last, the link `connector`; connector_count: nobody yet */
    uint8_t turn;            /**< link that is asked first for its next frame */
    uint8_t gateway_answer[16], connector_answer[16];
    uint8_t log[TAPER_TRANSFER_ENVELOPE +
                TAPER_EVENTS * TAPER_LOG_ITEM]; /**< or the answer being sent to the tool */
    char identifier[TAPER_MAX_CONNECTORS][TAPER_IDENTIFIER_LENGTH + 1];
} taper_transfers_t;

/** What a whole transfer brought. */
typedef enum {
    TAPER_RESULT_NONE,
    TAPER_RESULT_CURVE,      /**< the limits are in `content->curve` */
    TAPER_RESULT_PRICE,      /**< the prices are in `content->price` */
    TAPER_RESULT_IDENTIFIER, /**< the identifier of `content->connector` was told */
    TAPER_RESULT_REFUSED,    /**< torn, corrupt or not valid; nothing changed */
} taper_transfer_result_t;

/** The thing itself: the member that the result names. */
typedef union {
    taper_limit_curve_t curve;
    taper_price_curve_t price;
    uint8_t connector;
} taper_transfer_content_t;

/** No transfer under way, no identifier known. `config` must outlive it. */
void taper_transfers_init(taper_transfers_t *transfers, const taper_station_config_t *config);

/** The station's side of a transfer: its clock, its log. */
typedef struct {
    uint32_t now_ms; /**< station's clock */
    bool clock_is_set;
    uint32_t unix_s;     /**< wall clock at `now_ms` */
    uint32_t time_scale; /**< world seconds per second of the bus; 1 on a real station */
    const taper_event_log_t *events;
} taper_transfer_scene_t;

/**
 * Take in a frame of function ISOTP_FROM (from gateway, tool or a connector of the station); others are left alone. When
 * it completes a curve, `*content` is filled, with times on the station's world clock (`now_ms * time_scale`, wrapping);
 * points past are merged into one of now. (If all prices are past, the last keeps its time: the end of a price counts from
 * there; more than TAPER_PRICE_HOLDS_ms ago is as good as two hours.) No point is more than TAPER_CURVE_SPAN_ms ahead, and a
 * curve without points is one too: nothing is known any more. The curve counts as accepted only after
 * taper_transfers_answer(); until then it is the caller's, and nothing here remembers it. `*content` is not touched unless
 * the result says what is in it.
 *
 * The connectors share one link. While it is with one of them, the others are not heard: ISO-TP lets them run into their
 * timeout, and they have to try again.
 *
 * Cost: O(bytes of the message) for the frame that completes it, O(connectors) for the first of a connector.
 */
taper_transfer_result_t taper_transfers_take(taper_transfers_t *transfers, const taper_frame_t *frame,
                                             const taper_transfer_scene_t *scene,
                                             taper_transfer_content_t *content);

/** Tell the gateway what became of its curve. */
void taper_transfers_answer(taper_transfers_t *transfers, taper_transfer_answer_t answer, uint32_t now_ms);

/**
 * The next frame to send, if one is due; the link that did not have its way last comes first, so that a bus that is off
 * does not block the others. A frame that is not reported by taper_transfers_sent() before the next call is given again
 * in its turn. A peer may ask for frames without a gap: take a few in a row only, setpoints wait behind them. A
 * transfer that ran out of time is counted in `refused` here.
 */
bool taper_transfers_next(taper_transfers_t *transfers, uint32_t now_ms, taper_frame_t *frame);

/** `frame`, the last one given, is out. */
void taper_transfers_sent(taper_transfers_t *transfers, const taper_frame_t *frame, uint32_t now_ms);

/** Identifier of the vehicle at a connector; empty: none. */
const char *taper_transfers_identifier(const taper_transfers_t *transfers, uint8_t connector);

/** The vehicle left. */
void taper_transfers_forget(taper_transfers_t *transfers, uint8_t connector);

#endif
