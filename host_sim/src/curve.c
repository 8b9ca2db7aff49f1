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
    *curve = (sim_curve_t){.limits = limits, .due_s = INT64_MIN};
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

/** A message that is being written. */
typedef struct {
    sim_curve_t *curve;
    uint16_t count;
    int64_t last_s;
    uint32_t last_limit;
} writer_t;

static uint8_t *item(sim_curve_t *curve, unsigned k) {
    return curve->message + HEADER_BYTES + (size_t)k * TAPER_CURVE_ITEM;
}

/** Add the limit of a second, unless the message has it already, or it is that of the second before. */
static void add(writer_t *writer, int64_t second) {
    const uint32_t limit = wire_limit(writer->curve->limits, second);
    const bool new_limit = writer->count == 0 || (second > writer->last_s && limit != writer->last_limit);
    if (!new_limit || writer->count == TAPER_MAX_LIMIT_POINTS) {
        return;
    }
    put(item(writer->curve, writer->count), (uint32_t)second, 4);
    put(item(writer->curve, writer->count) + 4, limit, 2);
    writer->last_s = second;
    writer->last_limit = limit;
    writer->count++;
}

/** Write the course from `now_s` on, as far as it fits. @return the message's length. */
static uint16_t write_message(sim_curve_t *curve, int64_t now_s) {
    const sim_course_t *limits = curve->limits;
    const double end_s = (double)(now_s + CURVE_AHEAD_S);
    writer_t writer = {.curve = curve};
    add(&writer, now_s);
    for (size_t i = sim_course_point(limits, (double)now_s);
         i < limits->count && limits->time_s[i] < end_s && writer.count < TAPER_MAX_LIMIT_POINTS; i++) {
        if (limits->time_s[i] > (double)now_s) {
            add(&writer, (int64_t)floor(limits->time_s[i]));
            add(&writer, (int64_t)ceil(limits->time_s[i]));
        }
    }
    curve->next_due_s = now_s + CURVE_PERIOD_S;
    if (writer.count == TAPER_MAX_LIMIT_POINTS) {
        const int64_t half_s = (int64_t)get(item(curve, writer.count / 2), 4) - now_s;
        curve->next_due_s = now_s + (half_s < LONG_CURVE_PERIOD_S ? half_s : LONG_CURVE_PERIOD_S);
    }
    curve->message[0] = TAPER_TRANSFER_VERSION;
    curve->message[1] = TAPER_TRANSFER_LIMIT_CURVE;
    put(curve->message + 2, writer.count, 2);
    const uint16_t before_crc = (uint16_t)(HEADER_BYTES + writer.count * TAPER_CURVE_ITEM);
    put(curve->message + before_crc, taper_crc32(curve->message, before_crc), 4);
    return (uint16_t)(before_crc + 4u);
}

static void begin(sim_curve_t *curve, double unix_s, uint32_t now_ms) {
    const uint16_t length = write_message(curve, (int64_t)floor(unix_s));
    curve->lost = false;
    curve->tries++;
    curve->state = SIM_CURVE_SENDING;
    (void)taper_isotp_send(&curve->link, curve->message, length, now_ms); // nothing else is on its way
}

static void wait(sim_curve_t *curve, uint32_t now_ms) {
    curve->state = SIM_CURVE_WAITING;
    curve->waiting_since_ms = now_ms;
}

static bool is_due(const sim_curve_t *curve, double unix_s) {
    return curve->limits != NULL && curve->limits->count > 1 &&
           (curve->lost || unix_s >= (double)curve->due_s);
}

bool sim_curve_is_settled(const sim_curve_t *curve, double unix_s) {
    return curve->state == SIM_CURVE_QUIET && !is_due(curve, unix_s);
}

static void move_on(sim_curve_t *curve, double unix_s, uint32_t now_ms) {
    if (curve->state == SIM_CURVE_SENDING && taper_isotp_sending(&curve->link) != TAPER_ISOTP_BUSY) {
        wait(curve, now_ms);
    }
    const bool quiet = curve->state == SIM_CURVE_QUIET && is_due(curve, unix_s);
    const bool again =
        curve->state == SIM_CURVE_WAITING && taper_elapsed_ms(now_ms, curve->waiting_since_ms) >= RETRY_ms;
    if (quiet || again) {
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
        curve->due_s = curve->next_due_s;
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
    curve->lost = curve->lost || (!first && (was_away || check != TAPER_E2E_OK));
    curve->status_ms = now_ms;
}
