#include "curve.h"

#include <math.h>
#include <stddef.h>

#include "taper/bus.h"
#include "taper/crc32.h"

/** The station takes times up to 24 days ahead; it needs to know no more than this. */
#define CURVE_AHEAD_S (14 * INT64_C(86400))
/** It goes out again this often; at least this often while it is too long to go out whole. */
#define CURVE_PERIOD_S      86400
#define LONG_CURVE_PERIOD_S 900
/** No answer for so long is none (docs/transfers.md); after a refusal or a torn transfer it is tried again as late. */
#define RETRY_ms UINT32_C(2000)
/** A station that says nothing for longer was away. */
#define SILENCE_ms   UINT32_C(3000)
#define HEADER_BYTES 4u
#define WIRE_STEP_KW 0.1
#define WIRE_MOST    65535.0

#define TO_GATEWAY   ((uint16_t)((unsigned)TAPER_MESSAGE_ISOTP_TO << 6 | TAPER_NODE_GATEWAY))
#define FROM_GATEWAY ((uint16_t)((unsigned)TAPER_MESSAGE_ISOTP_FROM << 6 | TAPER_NODE_GATEWAY))
#define CTRL_STATUS  ((uint16_t)((unsigned)TAPER_MESSAGE_CTRL_STATUS << 6 | TAPER_NODE_CONTROLLER))

void sim_curve_init(sim_curve_t *curve, const sim_course_t *limits) {
    *curve = (sim_curve_t){0};
    const bool changes = limits != NULL && limits->count > 1;
    curve->told[SIM_CURVE_LIMITS] = (sim_told_t){.course = changes ? limits : NULL, .due_s = INT64_MIN};
    const taper_isotp_options_t options = {
        .send_id = FROM_GATEWAY,
        .receive_id = TO_GATEWAY,
        .waits = TAPER_TRANSFER_WAITS,
        .timeout_ms = TAPER_ISOTP_FROM_TIMEOUT_ms,
        .buffer = curve->answer,
        .capacity = sizeof curve->answer,
    };
    (void)taper_isotp_init(&curve->link, &options); // refuses wrong options only, and these are right
}

void sim_curve_set_prices(sim_curve_t *curve, const sim_course_t *prices) {
    curve->told[SIM_CURVE_PRICES] = (sim_told_t){.course = prices, .due_s = INT64_MIN};
}

static void put(uint8_t *to, uint32_t value, unsigned bytes) {
    for (unsigned k = 0; k < bytes; k++) {
        to[k] = (uint8_t)(value >> (8 * k));
    }
}

static uint32_t get(const uint8_t *from, unsigned bytes) {
    uint32_t value = 0;
    for (unsigned k = 0; k < bytes; k++) {
        value |= (uint32_t)from[k] << (8 * k);
    }
    return value;
}

/** The wire knows whole seconds: the least limit in the one that begins at `second`, rounded down [100 W]. */
static uint32_t wire_limit(const sim_course_t *limits, int64_t second) {
    const double kw = sim_course_least(limits, (double)second, (double)second + 1.0);
    return (uint32_t)fmin(floor(kw / WIRE_STEP_KW + 1e-6), WIRE_MOST); // the hair: see watts() in gateway.c
}

/** The price at the beginning of a second, in thousandths, as 16 bits of two's complement. */
static uint32_t wire_price(const sim_course_t *prices, int64_t second) {
    const long milli = lround(prices->value[sim_course_point(prices, (double)second)] * 1000.0);
    return (uint32_t)milli & 0xFFFFu;
}

/** A message that is being written. */
typedef struct {
    sim_curve_t *curve;
    const sim_course_t *course;
    uint16_t most; /**< points that fit */
    uint16_t count;
    int64_t last_s;
    uint32_t last_value;
} writer_t;

static uint8_t *item(sim_curve_t *curve, unsigned k) {
    return curve->message + HEADER_BYTES + (size_t)k * TAPER_CURVE_ITEM;
}

static uint32_t wire_value(const writer_t *writer, int64_t second) {
    return writer->curve->topic == SIM_CURVE_PRICES ? wire_price(writer->course, second)
                                                    : wire_limit(writer->course, second);
}

static void put_point(writer_t *writer, int64_t second, uint32_t value) {
    put(item(writer->curve, writer->count), (uint32_t)second, 4);
    put(item(writer->curve, writer->count) + 4, value, 2);
    writer->last_s = second;
    writer->last_value = value;
    writer->count++;
}

/** Add the value of a second, unless the message has it already, or it is that of the second before. */
static void add(writer_t *writer, int64_t second) {
    const uint32_t value = wire_value(writer, second);
    const bool is_new = writer->count == 0 || (second > writer->last_s && value != writer->last_value);
    if (is_new && writer->count < writer->most) {
        put_point(writer, second, value);
    }
}

/** The changes from `now_s` to `end_s`, as far as they fit. */
static void add_changes(writer_t *writer, int64_t now_s, int64_t end_s) {
    const sim_course_t *course = writer->course;
    add(writer, now_s);
    for (size_t i = sim_course_point(course, (double)now_s);
         i < course->count && course->time_s[i] < (double)end_s && writer->count < writer->most; i++) {
        if (course->time_s[i] > (double)now_s) {
            add(writer, (int64_t)floor(course->time_s[i]));
            add(writer, (int64_t)ceil(course->time_s[i]));
        }
    }
    if (writer->curve->topic == SIM_CURVE_PRICES && writer->count < writer->most) {
        put_point(writer, end_s,
                  wire_value(writer, end_s)); // the last price of a message does not hold for long
    }
}

/** Header and CRC-32. @return the message's length. */
static uint16_t seal(sim_curve_t *curve, uint16_t count) {
    curve->message[0] = TAPER_TRANSFER_VERSION;
    curve->message[1] =
        curve->topic == SIM_CURVE_PRICES ? TAPER_TRANSFER_PRICE_CURVE : TAPER_TRANSFER_LIMIT_CURVE;
    put(curve->message + 2, count, 2);
    const uint16_t before_crc = (uint16_t)(HEADER_BYTES + count * TAPER_CURVE_ITEM);
    put(curve->message + before_crc, taper_crc32(curve->message, before_crc), 4);
    return (uint16_t)(before_crc + 4u);
}

/** Write the course from `now_s` on, as far as it fits. @return the message's length. */
static uint16_t write_message(sim_curve_t *curve, int64_t now_s) {
    sim_told_t *told = &curve->told[curve->topic];
    writer_t writer = {.curve = curve,
                       .course = told->course,
                       .most = curve->topic == SIM_CURVE_PRICES ? TAPER_MAX_PRICE_POINTS
                                                                : TAPER_MAX_LIMIT_POINTS};
    add_changes(&writer, now_s, now_s + CURVE_AHEAD_S);
    told->next_due_s = now_s + CURVE_PERIOD_S;
    if (writer.count == writer.most) {
        const int64_t half_s = (int64_t)get(item(curve, writer.count / 2), 4) - now_s;
        told->next_due_s = now_s + (half_s < LONG_CURVE_PERIOD_S ? half_s : LONG_CURVE_PERIOD_S);
    }
    return seal(curve, writer.count);
}

static void begin(sim_curve_t *curve, double unix_s, uint32_t now_ms) {
    const uint16_t length = write_message(curve, (int64_t)floor(unix_s));
    curve->told[curve->topic].lost = false;
    curve->tries++;
    curve->state = SIM_CURVE_SENDING;
    (void)taper_isotp_send(&curve->link, curve->message, length, now_ms); // nothing else is on its way
}

static void wait(sim_curve_t *curve, uint32_t now_ms) {
    curve->state = SIM_CURVE_WAITING;
    curve->waiting_since_ms = now_ms;
}

static bool is_due(const sim_told_t *told, double unix_s) {
    return told->course != NULL && (told->lost || unix_s >= (double)told->due_s);
}

/** The first topic that is due; SIM_CURVE_TOPICS: none is. */
static sim_curve_topic_t due_topic(const sim_curve_t *curve, double unix_s) {
    unsigned topic = 0;
    while (topic < SIM_CURVE_TOPICS && !is_due(&curve->told[topic], unix_s)) {
        topic++;
    }
    return (sim_curve_topic_t)topic;
}

bool sim_curve_is_settled(const sim_curve_t *curve, double unix_s) {
    return curve->state == SIM_CURVE_QUIET && due_topic(curve, unix_s) == SIM_CURVE_TOPICS;
}

static void move_on(sim_curve_t *curve, double unix_s, uint32_t now_ms) {
    const sim_curve_topic_t due = due_topic(curve, unix_s);
    if (curve->state == SIM_CURVE_SENDING && taper_isotp_sending(&curve->link) != TAPER_ISOTP_BUSY) {
        wait(curve, now_ms);
    }
    if (curve->state == SIM_CURVE_QUIET && due != SIM_CURVE_TOPICS) {
        curve->topic = due;
        begin(curve, unix_s, now_ms);
    } else if (curve->state == SIM_CURVE_WAITING &&
               taper_elapsed_ms(now_ms, curve->waiting_since_ms) >= RETRY_ms) {
        begin(curve, unix_s, now_ms);
    }
}

bool sim_curve_next(sim_curve_t *curve, double unix_s, uint32_t now_ms, taper_frame_t *frame) {
    move_on(curve, unix_s, now_ms);
    return taper_isotp_next(&curve->link, now_ms, frame);
}

void sim_curve_sent(sim_curve_t *curve, uint32_t now_ms) {
    taper_isotp_sent(&curve->link, now_ms);
    if (curve->state == SIM_CURVE_SENDING && taper_isotp_sending(&curve->link) == TAPER_ISOTP_DONE) {
        wait(curve, now_ms);
    }
}

static bool is_answer(const uint8_t *message, uint16_t length) {
    const uint16_t before_crc = HEADER_BYTES + 1u;
    return length == TAPER_TRANSFER_ENVELOPE + 1u && message[0] == TAPER_TRANSFER_VERSION &&
           message[1] == TAPER_TRANSFER_ANSWER && get(message + 2, 2) == 1 &&
           get(message + before_crc, 4) == taper_crc32(message, before_crc);
}

/** What is torn, or not an answer, is as good as none. */
static void read_answer(sim_curve_t *curve, uint16_t length, uint32_t now_ms) {
    if (curve->state != SIM_CURVE_WAITING || !is_answer(curve->answer, length)) {
        return;
    }
    if (curve->answer[HEADER_BYTES] == TAPER_ANSWER_ACCEPTED) {
        curve->state = SIM_CURVE_QUIET;
        curve->told[curve->topic].due_s = curve->told[curve->topic].next_due_s;
        curve->accepted++;
    } else {
        wait(curve, now_ms);
    }
}

bool sim_curve_take(sim_curve_t *curve, const taper_frame_t *frame, uint32_t now_ms) {
    uint16_t length = 0;
    if (!taper_isotp_take(&curve->link, frame, now_ms)) {
        return false;
    }
    if (taper_isotp_received(&curve->link, &length) == TAPER_ISOTP_DONE) {
        read_answer(curve, length, now_ms);
    }
    taper_isotp_release(&curve->link, now_ms);
    return true;
}

void sim_curve_watch(sim_curve_t *curve, const taper_frame_t *frame, uint32_t now_ms) {
    if (frame->bus != 0 || frame->id != CTRL_STATUS) {
        return;
    }
    const bool first = !curve->status_check.synchronised;
    const taper_e2e_check_t check = taper_e2e_check(&curve->status_check, frame);
    if (check == TAPER_E2E_CRC_ERROR) {
        return;
    }
    const bool was_away = taper_elapsed_ms(now_ms, curve->status_ms) > SILENCE_ms;
    for (unsigned k = 0; k < SIM_CURVE_TOPICS && !first && (was_away || check != TAPER_E2E_OK); k++) {
        curve->told[k].lost = true;
    }
    curve->status_ms = now_ms;
}
