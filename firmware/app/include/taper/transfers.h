/**
 * What goes over ISO-TP, and what becomes of it: the limit curve from the gateway, identifiers of vehicles from their
 * connectors, and the event log to a tool. A transfer has a header of its own and a CRC-32 over all of it; it is used when
 * it is whole and right in every point, or not at all. No hard limit depends on it.
 *
 * On the wire, little endian:
 *
 *     byte 0 version (1), byte 1 type (taper_transfer_type_t), bytes 2-3 count of items, items, 4 bytes CRC-32 (IEEE 802.3)
 *
 *     LIMIT_CURVE    gateway -> station   items of 6 bytes: Unix time [s] u32, limit u16 x 100 W; times ascending
 *     IDENTIFIER     connector -> station items of 1 byte: printable ASCII, 1..TAPER_IDENTIFIER_LENGTH; empty: forget it
 *     LOG_REQUEST    tool -> station      no items
 *     LOG            station -> tool      items of 16 bytes: time_ms u32, unix_s u32, data i32, code, bus, node, 0
 *     ANSWER         station -> sender    one item of 1 byte: taper_transfer_answer_t
 */
#ifndef TAPER_TRANSFERS_H
#define TAPER_TRANSFERS_H

#include <stdbool.h>
#include <stdint.h>

#include "taper/event.h"
#include "taper/frame.h"
#include "taper/isotp.h"
#include "taper/types.h"

#define TAPER_TRANSFER_VERSION  1
#define TAPER_IDENTIFIER_LENGTH 24

typedef enum {
    TAPER_TRANSFER_LIMIT_CURVE = 1,
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

/** CRC-32 of IEEE 802.3 ("123456789" gives 0xCBF43926). */
uint32_t taper_crc32(const uint8_t *data, uint32_t length);

/** The station's end of all transfers. Private to the app layer; the caller owns the memory. */
typedef struct {
    const taper_station_config_t *config;
    taper_isotp_t gateway, tool, connector;
    uint8_t gateway_buffer[8 + TAPER_MAX_LIMIT_POINTS * 6];
    uint8_t tool_buffer[16];
    uint8_t connector_buffer[8 + TAPER_IDENTIFIER_LENGTH];
    uint8_t connector_bus, connector_node; /**< whose transfer `connector` is in; node 0: nobody's */
    uint8_t gateway_answer[16], connector_answer[16];
    uint8_t log[8 + TAPER_EVENTS * 16]; /**< being sent to the tool */
    char identifier[TAPER_MAX_CONNECTORS][TAPER_IDENTIFIER_LENGTH + 1];
} taper_transfers_t;

/** What a whole transfer brought. */
typedef enum {
    TAPER_RESULT_NONE,
    TAPER_RESULT_CURVE,      /**< the curve is in `curve` */
    TAPER_RESULT_IDENTIFIER, /**< the identifier of `connector` changed */
    TAPER_RESULT_REFUSED,    /**< torn, corrupt or not valid; nothing changed */
} taper_transfer_result_t;

/** No transfer under way, no identifier known. `config` must outlive it. */
void taper_transfers_init(taper_transfers_t *transfers, const taper_station_config_t *config);

/** The station's side of a transfer: its clock, its log. */
typedef struct {
    uint32_t now_ms;                /**< station's clock */
    bool clock_is_set;
    uint32_t unix_s;                /**< wall clock at `now_ms` */
    uint32_t time_scale;            /**< world seconds per second of the bus; 1 on a real station */
    const taper_event_log_t *events;
} taper_transfer_scene_t;

/**
 * Take in a frame of function ISOTP_FROM (from gateway, tool or a connector of the station). When it completes a curve,
 * `*curve` is filled, with times on the station's world clock (`now_ms * time_scale`, wrapping); points past are merged
 * into one of now. The curve counts as accepted only after taper_transfers_answer().
 */
taper_transfer_result_t taper_transfers_take(taper_transfers_t *transfers, const taper_frame_t *frame,
                                             const taper_transfer_scene_t *scene, taper_limit_curve_t *curve,
                                             uint8_t *connector);

/** Tell the gateway what became of its curve. */
void taper_transfers_answer(taper_transfers_t *transfers, taper_transfer_answer_t answer, uint32_t now_ms);

/** The next frame to send, if one is due; given again until taper_transfers_sent(). */
bool taper_transfers_next(taper_transfers_t *transfers, uint32_t now_ms, taper_frame_t *frame);
void taper_transfers_sent(taper_transfers_t *transfers, const taper_frame_t *frame, uint32_t now_ms);

/** Identifier of the vehicle at a connector; empty: none. */
const char *taper_transfers_identifier(const taper_transfers_t *transfers, uint8_t connector);

/** The vehicle left. */
void taper_transfers_forget(taper_transfers_t *transfers, uint8_t connector);

#endif
