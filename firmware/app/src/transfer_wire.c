#include "transfer_wire.h"

#include <stddef.h>
#include <string.h>

#include "taper/limits.h"

#define HEADER_BYTES   4u
#define CRC_BYTES      4u
#define CURVE_STEP_W   100
#define CURVE_SPAN_s   (TAPER_CURVE_SPAN_ms / 1000u)
#define PRICE_ENDED_s  (2u * TAPER_PRICE_HOLDS_ms / 1000u)
#define NO_PRICE       0x8000u
#define FIRST_PRINTING 0x20u
#define LAST_PRINTING  0x7Eu

_Static_assert(TAPER_TRANSFER_ENVELOPE == HEADER_BYTES + CRC_BYTES, "the envelope is header and CRC");
_Static_assert(TAPER_TRANSFER_ENVELOPE + TAPER_MAX_LIMIT_POINTS * TAPER_CURVE_ITEM <= TAPER_ISOTP_LONGEST,
               "the longest curve is one message");
_Static_assert(TAPER_MAX_PRICE_POINTS <= TAPER_MAX_LIMIT_POINTS, "prices fit into the gateway's buffer too");
_Static_assert(TAPER_TRANSFER_ENVELOPE + TAPER_EVENTS * TAPER_LOG_ITEM <= TAPER_ISOTP_LONGEST,
               "the whole log is one message");
_Static_assert((TAPER_EVENTS & (TAPER_EVENTS - 1u)) == 0,
               "the count of events wraps at a multiple of the ring");

static uint16_t get_u16(const uint8_t *from) {
    return (uint16_t)(from[0] | (unsigned)from[1] << 8);
}

static uint32_t get_u32(const uint8_t *from) {
    return get_u16(from) | (uint32_t)get_u16(from + 2) << 16;
}

static void put_u16(uint8_t *to, uint16_t value) {
    to[0] = (uint8_t)value;
    to[1] = (uint8_t)(value >> 8);
}

static void put_u32(uint8_t *to, uint32_t value) {
    put_u16(to, (uint16_t)value);
    put_u16(to + 2, (uint16_t)(value >> 16));
}

/** Bytes of an item that a sender may give us; 0: it has no items. */
static uint16_t item_bytes(uint8_t type) {
    switch (type) {
    case TAPER_TRANSFER_LIMIT_CURVE:
    case TAPER_TRANSFER_PRICE_CURVE: return TAPER_CURVE_ITEM;
    case TAPER_TRANSFER_IDENTIFIER: return 1;
    default: return 0;
    }
}

static bool is_for_us(uint8_t type) {
    return type == TAPER_TRANSFER_LIMIT_CURVE || type == TAPER_TRANSFER_PRICE_CURVE ||
           type == TAPER_TRANSFER_IDENTIFIER || type == TAPER_TRANSFER_LOG_REQUEST;
}

taper_transfer_answer_t taper_transfer_open(const uint8_t *message, uint16_t length,
                                            taper_transfer_t *transfer) {
    if (length < TAPER_TRANSFER_ENVELOPE ||
        get_u32(message + length - CRC_BYTES) != taper_crc32(message, length - CRC_BYTES)) {
        return TAPER_ANSWER_CRC;
    }
    if (message[0] != TAPER_TRANSFER_VERSION || !is_for_us(message[1])) {
        return TAPER_ANSWER_VERSION;
    }
    *transfer = (taper_transfer_t){
        .type = message[1], .count = get_u16(message + 2), .items = message + HEADER_BYTES};
    const uint32_t item = item_bytes(transfer->type);
    const bool fits = length == TAPER_TRANSFER_ENVELOPE + transfer->count * item;
    return fits && (item > 0 || transfer->count == 0) ? TAPER_ANSWER_ACCEPTED : TAPER_ANSWER_CRC;
}

/** Header and CRC around items that are there already. @return the message's length. */
static uint16_t seal(uint8_t *message, taper_transfer_type_t type, uint16_t count, uint16_t bytes) {
    const uint16_t before_crc = (uint16_t)(HEADER_BYTES + bytes);
    message[0] = TAPER_TRANSFER_VERSION;
    message[1] = (uint8_t)type;
    put_u16(message + 2, count);
    put_u32(message + before_crc, taper_crc32(message, before_crc));
    return (uint16_t)(before_crc + CRC_BYTES);
}

uint16_t taper_transfer_write_answer(uint8_t *message, taper_transfer_answer_t answer) {
    message[HEADER_BYTES] = (uint8_t)answer;
    return seal(message, TAPER_TRANSFER_ANSWER, 1, 1);
}

static void put_event(uint8_t *item, const taper_event_t *event) {
    put_u32(item, event->time_ms);
    put_u32(item + 4, event->unix_s);
    put_u32(item + 8, (uint32_t)event->data);
    item[12] = event->code;
    item[13] = event->bus;
    item[14] = event->node;
    item[15] = 0;
}

uint16_t taper_transfer_write_log(uint8_t *message, const taper_event_log_t *events) {
    const uint32_t count = events->count < TAPER_EVENTS ? events->count : TAPER_EVENTS;
    for (uint32_t k = 0; k < count; k++) {
        const uint32_t at = (events->count - count + k) % TAPER_EVENTS;
        put_event(message + HEADER_BYTES + (size_t)k * TAPER_LOG_ITEM, &events->event[at]);
    }
    return seal(message, TAPER_TRANSFER_LOG, (uint16_t)count, (uint16_t)(count * TAPER_LOG_ITEM));
}

static uint32_t point_unix_s(const taper_transfer_t *transfer, uint16_t k) {
    return get_u32(transfer->items + (size_t)k * TAPER_CURVE_ITEM);
}

static uint16_t point_value(const taper_transfer_t *transfer, uint16_t k) {
    return get_u16(transfer->items + (size_t)k * TAPER_CURVE_ITEM + 4);
}

/** Whether times ascend and none is too far ahead. */
static bool times_are_good(const taper_transfer_t *transfer, uint32_t now_unix_s) {
    for (uint16_t k = 0; k < transfer->count; k++) {
        const uint32_t at_s = point_unix_s(transfer, k);
        if ((k > 0 && at_s <= point_unix_s(transfer, (uint16_t)(k - 1))) ||
            (at_s > now_unix_s && at_s - now_unix_s > CURVE_SPAN_s)) {
            return false;
        }
    }
    return true;
}

/** What a curve of up to `most` points has to be, whatever its values. */
static taper_transfer_answer_t check_curve(const taper_transfer_t *transfer,
                                           const taper_transfer_scene_t *scene, uint16_t most) {
    if (transfer->count > 0 && !scene->clock_is_set) {
        return TAPER_ANSWER_CLOCK;
    }
    return transfer->count <= most && times_are_good(transfer, scene->unix_s) ? TAPER_ANSWER_ACCEPTED
                                                                              : TAPER_ANSWER_CONTENT;
}

/** The first point that matters: of those past, the last. */
static uint16_t first_point(const taper_transfer_t *transfer, uint32_t now_unix_s) {
    uint16_t k = 0;
    while (k + 1u < transfer->count && point_unix_s(transfer, (uint16_t)(k + 1)) <= now_unix_s) {
        k++;
    }
    return k;
}

/** The time of a point on the station's world clock; now, if it is past. */
static uint32_t point_ms(const taper_transfer_t *transfer, const taper_transfer_scene_t *scene, uint16_t k) {
    const uint32_t at_s = point_unix_s(transfer, k);
    const uint32_t ahead_s = at_s > scene->unix_s ? at_s - scene->unix_s : 0;
    return scene->now_ms * scene->time_scale + ahead_s * 1000u;
}

taper_transfer_answer_t taper_transfer_read_curve(const taper_transfer_t *transfer,
                                                  const taper_transfer_scene_t *scene,
                                                  taper_limit_curve_t *curve) {
    const taper_transfer_answer_t answer = check_curve(transfer, scene, TAPER_MAX_LIMIT_POINTS);
    if (answer != TAPER_ANSWER_ACCEPTED) {
        return answer;
    }
    curve->count = 0;
    for (uint16_t k = first_point(transfer, scene->unix_s); k < transfer->count; k++) {
        curve->point[curve->count] = (taper_limit_point_t){
            .time_ms = point_ms(transfer, scene, k), .limit_W = point_value(transfer, k) * CURVE_STEP_W};
        curve->count++;
    }
    return TAPER_ANSWER_ACCEPTED;
}

static bool prices_are_good(const taper_transfer_t *transfer) {
    bool good = true;
    for (uint16_t k = 0; k < transfer->count; k++) {
        good = good && point_value(transfer, k) != NO_PRICE;
    }
    return good;
}

/** How long ago the last point was, as far as it matters [ms]. */
static uint32_t last_age_ms(const taper_transfer_t *transfer, uint32_t now_unix_s) {
    const uint32_t last_s = point_unix_s(transfer, (uint16_t)(transfer->count - 1));
    const uint32_t age_s = last_s < now_unix_s ? now_unix_s - last_s : 0;
    return (age_s < PRICE_ENDED_s ? age_s : PRICE_ENDED_s) * 1000u;
}

taper_transfer_answer_t taper_transfer_read_price(const taper_transfer_t *transfer,
                                                  const taper_transfer_scene_t *scene,
                                                  taper_price_curve_t *price) {
    const taper_transfer_answer_t answer = check_curve(transfer, scene, TAPER_MAX_PRICE_POINTS);
    if (answer != TAPER_ANSWER_ACCEPTED) {
        return answer;
    }
    if (!prices_are_good(transfer)) {
        return TAPER_ANSWER_CONTENT;
    }
    price->count = 0;
    for (uint16_t k = first_point(transfer, scene->unix_s); k < transfer->count; k++) {
        const int32_t value = point_value(transfer, k);
        price->point[price->count] =
            (taper_price_point_t){.time_ms = point_ms(transfer, scene, k),
                                  .milli_per_kWh = value < (int32_t)NO_PRICE ? value : value - 0x10000};
        price->count++;
    }
    if (price->count > 0) { /* no change, unless the last point is past */
        price->point[price->count - 1].time_ms -= last_age_ms(transfer, scene->unix_s);
    }
    return TAPER_ANSWER_ACCEPTED;
}

taper_transfer_answer_t taper_transfer_read_identifier(const taper_transfer_t *transfer, char *identifier) {
    if (transfer->count > TAPER_IDENTIFIER_LENGTH) {
        return TAPER_ANSWER_CONTENT;
    }
    for (uint16_t k = 0; k < transfer->count; k++) {
        if (transfer->items[k] < FIRST_PRINTING || transfer->items[k] > LAST_PRINTING) {
            return TAPER_ANSWER_CONTENT;
        }
    }
    memset(identifier, 0, TAPER_IDENTIFIER_LENGTH + 1);
    memcpy(identifier, transfer->items, transfer->count);
    return TAPER_ANSWER_ACCEPTED;
}
