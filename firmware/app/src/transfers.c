#include "taper/transfers.h"

#include <string.h>

#include "transfer_wire.h"

#define FUNCTION_SHIFT 6
#define NODE_MASK      0x3Fu
#define LINKS          3u

static uint16_t id_of(taper_message_kind_t function, uint8_t node) {
    return (uint16_t)((unsigned)function << FUNCTION_SHIFT | node);
}

static void open_link(taper_isotp_t *link, uint8_t bus, uint8_t node, uint8_t *buffer, uint16_t capacity) {
    const taper_isotp_options_t options = {
        .send_id = id_of(TAPER_MESSAGE_ISOTP_TO, node),
        .receive_id = id_of(TAPER_MESSAGE_ISOTP_FROM, node),
        .bus = bus,
        .block_size = TAPER_TRANSFER_BLOCK_SIZE,
        .separation_ms = TAPER_TRANSFER_SEPARATION_ms,
        .waits = TAPER_TRANSFER_WAITS,
        .timeout_ms = TAPER_ISOTP_FROM_TIMEOUT_ms,
        .buffer = buffer,
        .capacity = capacity,
    };
    (void)taper_isotp_init(link, &options); /* refuses wrong options only, and these are right */
}

void taper_transfers_init(taper_transfers_t *transfers, const taper_station_config_t *config) {
    memset(transfers, 0, sizeof *transfers);
    transfers->config = config;
    open_link(&transfers->gateway, 0, TAPER_NODE_GATEWAY, transfers->gateway_buffer,
              sizeof transfers->gateway_buffer);
    open_link(&transfers->tool, 0, TAPER_NODE_TOOL, transfers->tool_buffer, sizeof transfers->tool_buffer);
    /* Nobody's yet. Nothing is taken for it before somebody claims it. */
    open_link(&transfers->connector, 0, TAPER_NODE_CONTROLLER, NULL, 0);
    transfers->connector_index = config->connector_count;
}

/** Index of a connector; connector_count: there is none. */
static uint8_t connector_at(const taper_station_config_t *config, uint8_t bus, uint8_t node) {
    uint8_t i = 0;
    while (i < config->connector_count &&
           (config->connectors[i].bus != bus || config->connectors[i].node != node)) {
        i++;
    }
    return i;
}

/** Only the frame that begins a message makes the shared link somebody's; ISO-TP sorts out what else is in it. */
static bool begins_message(const taper_frame_t *frame) {
    return frame->length > 0 && frame->data[0] < 0x20u;
}

/** Give the link of the connectors to the sender of `frame`, if nothing goes on in it and the frame begins a message. */
static void claim(taper_transfers_t *transfers, const taper_frame_t *frame) {
    const uint8_t node = frame->id & NODE_MASK;
    const bool is_from = frame->id >> FUNCTION_SHIFT == TAPER_MESSAGE_ISOTP_FROM;
    if (!is_from || !begins_message(frame) || taper_isotp_busy(&transfers->connector)) {
        return;
    }
    const uint8_t index = connector_at(transfers->config, frame->bus, node);
    if (index == transfers->config->connector_count) {
        return;
    }
    transfers->connector_index = index;
    open_link(&transfers->connector, frame->bus, node, transfers->connector_buffer,
              sizeof transfers->connector_buffer);
}

static void reply(taper_isotp_t *link, uint8_t *message, taper_transfer_answer_t answer, uint32_t now_ms) {
    taper_isotp_cancel(link);
    (void)taper_isotp_send(link, message, taper_transfer_write_answer(message, answer), now_ms);
}

/** Whether a message on `link` has failed. It is counted, and forgotten. */
static bool drop_failed(taper_transfers_t *transfers, taper_isotp_t *link, uint32_t now_ms) {
    uint16_t length = 0;
    const taper_isotp_state_t state = taper_isotp_received(link, &length);
    if (state == TAPER_ISOTP_IDLE || state == TAPER_ISOTP_BUSY || state == TAPER_ISOTP_DONE) {
        return false;
    }
    taper_count(&transfers->refused);
    taper_isotp_release(link, now_ms);
    return true;
}

/**
 * Open the message on `link` if it is whole, and free its buffer: the bytes stay until the next frame is taken.
 * @return false if there is none; `*answer` says whether its envelope is good, and whether it is one of `types`, a bit each.
 */
static bool open_whole(taper_isotp_t *link, uint32_t now_ms, unsigned types, taper_transfer_t *transfer,
                       taper_transfer_answer_t *answer) {
    uint16_t length = 0;
    if (taper_isotp_received(link, &length) != TAPER_ISOTP_DONE) {
        return false;
    }
    *answer = taper_transfer_open(link->options.buffer, length, transfer);
    if (*answer == TAPER_ANSWER_ACCEPTED && (1u << transfer->type & types) == 0) {
        *answer = TAPER_ANSWER_VERSION;
    }
    taper_isotp_release(link, now_ms);
    return true;
}

static taper_transfer_result_t take_curve(taper_transfers_t *transfers, const taper_transfer_scene_t *scene,
                                          taper_transfer_content_t *content) {
    const unsigned types = 1u << TAPER_TRANSFER_LIMIT_CURVE | 1u << TAPER_TRANSFER_PRICE_CURVE;
    taper_transfer_t transfer;
    taper_transfer_answer_t answer;
    if (!open_whole(&transfers->gateway, scene->now_ms, types, &transfer, &answer)) {
        return TAPER_RESULT_NONE;
    }
    const bool prices = answer == TAPER_ANSWER_ACCEPTED && transfer.type == TAPER_TRANSFER_PRICE_CURVE;
    if (answer == TAPER_ANSWER_ACCEPTED) {
        answer = prices ? taper_transfer_read_price(&transfer, scene, &content->price)
                        : taper_transfer_read_curve(&transfer, scene, &content->curve);
    }
    if (answer == TAPER_ANSWER_ACCEPTED) { /* the station has the last word: taper_transfers_answer() */
        return prices ? TAPER_RESULT_PRICE : TAPER_RESULT_CURVE;
    }
    taper_transfers_answer(transfers, answer, scene->now_ms);
    return TAPER_RESULT_REFUSED;
}

static taper_transfer_result_t take_request(taper_transfers_t *transfers,
                                            const taper_transfer_scene_t *scene) {
    taper_transfer_t transfer;
    taper_transfer_answer_t answer;
    if (!open_whole(&transfers->tool, scene->now_ms, 1u << TAPER_TRANSFER_LOG_REQUEST, &transfer, &answer)) {
        return TAPER_RESULT_NONE;
    }
    if (answer != TAPER_ANSWER_ACCEPTED) {
        taper_count(&transfers->refused);
        reply(&transfers->tool, transfers->log, answer, scene->now_ms);
        return TAPER_RESULT_REFUSED;
    }
    taper_count(&transfers->accepted);
    taper_isotp_cancel(&transfers->tool);
    const uint16_t length = taper_transfer_write_log(transfers->log, scene->events);
    (void)taper_isotp_send(&transfers->tool, transfers->log, length, scene->now_ms);
    return TAPER_RESULT_NONE;
}

static taper_transfer_result_t take_identifier(taper_transfers_t *transfers,
                                               const taper_transfer_scene_t *scene,
                                               taper_transfer_content_t *content) {
    taper_transfer_t transfer;
    taper_transfer_answer_t answer;
    if (!open_whole(&transfers->connector, scene->now_ms, 1u << TAPER_TRANSFER_IDENTIFIER, &transfer,
                    &answer)) {
        return TAPER_RESULT_NONE;
    }
    if (answer == TAPER_ANSWER_ACCEPTED) {
        answer = taper_transfer_read_identifier(&transfer, transfers->identifier[transfers->connector_index]);
    }
    reply(&transfers->connector, transfers->connector_answer, answer, scene->now_ms);
    if (answer != TAPER_ANSWER_ACCEPTED) {
        taper_count(&transfers->refused);
        return TAPER_RESULT_REFUSED;
    }
    taper_count(&transfers->accepted);
    content->connector = transfers->connector_index;
    return TAPER_RESULT_IDENTIFIER;
}

taper_transfer_result_t taper_transfers_take(taper_transfers_t *transfers, const taper_frame_t *frame,
                                             const taper_transfer_scene_t *scene,
                                             taper_transfer_content_t *content) {
    if (taper_isotp_take(&transfers->gateway, frame, scene->now_ms)) {
        return drop_failed(transfers, &transfers->gateway, scene->now_ms)
                   ? TAPER_RESULT_REFUSED
                   : take_curve(transfers, scene, content);
    }
    if (taper_isotp_take(&transfers->tool, frame, scene->now_ms)) {
        return drop_failed(transfers, &transfers->tool, scene->now_ms) ? TAPER_RESULT_REFUSED
                                                                       : take_request(transfers, scene);
    }
    claim(transfers, frame);
    const bool claimed = transfers->connector_index < transfers->config->connector_count;
    if (claimed && taper_isotp_take(&transfers->connector, frame, scene->now_ms)) {
        return drop_failed(transfers, &transfers->connector, scene->now_ms)
                   ? TAPER_RESULT_REFUSED
                   : take_identifier(transfers, scene, content);
    }
    return TAPER_RESULT_NONE;
}

void taper_transfers_answer(taper_transfers_t *transfers, taper_transfer_answer_t answer, uint32_t now_ms) {
    taper_count(answer == TAPER_ANSWER_ACCEPTED ? &transfers->accepted : &transfers->refused);
    reply(&transfers->gateway, transfers->gateway_answer, answer, now_ms);
}

static taper_isotp_t *link_at(taper_transfers_t *transfers, unsigned k) {
    taper_isotp_t *const links[LINKS] = {&transfers->gateway, &transfers->tool, &transfers->connector};
    return links[k % LINKS];
}

bool taper_transfers_next(taper_transfers_t *transfers, uint32_t now_ms, taper_frame_t *frame) {
    bool given = false;
    for (unsigned k = 0; k < LINKS && !given; k++) {
        const unsigned at = (transfers->turn + k) % LINKS;
        taper_isotp_t *link = link_at(transfers, at);
        given = taper_isotp_next(link, now_ms, frame);
        (void)drop_failed(transfers, link, now_ms);
        if (given) {
            transfers->turn = (uint8_t)((at + 1) % LINKS);
        }
    }
    return given;
}

void taper_transfers_sent(taper_transfers_t *transfers, const taper_frame_t *frame, uint32_t now_ms) {
    for (unsigned k = 0; k < LINKS; k++) {
        taper_isotp_t *link = link_at(transfers, k);
        if (link->options.send_id == frame->id && link->options.bus == frame->bus) {
            taper_isotp_sent(link, now_ms);
        }
    }
}

const char *taper_transfers_identifier(const taper_transfers_t *transfers, uint8_t connector) {
    return connector < TAPER_MAX_CONNECTORS ? transfers->identifier[connector] : "";
}

void taper_transfers_forget(taper_transfers_t *transfers, uint8_t connector) {
    if (connector < TAPER_MAX_CONNECTORS) {
        transfers->identifier[connector][0] = '\0';
    }
}
