/* Frames in: who sent them, whether to believe them, and where they go. */
#include "station_internal.h"
#include "taper/codec.h"

/** Frames taken in one call: what all nodes send in three seconds. A babbling bus cannot hold the station up. */
#define MAX_FRAMES (TAPER_MAX_CONNECTORS * 32u + 64u)

/** Nominal frames a second, rounded up. What is also sent on change counts twice: a connector's EVSE_STATUS and
    EV_PARAM_A..E, beside its EV_STATUS, EVSE_ELEC and EVSE_INFO; the gateway's SITE_LIMIT, beside SITE_METER and TIME_SYNC.
    Three times that is too much. */
#define CONNECTOR_NOMINAL                                                         \
    (2u * 1000u / TAPER_EVSE_STATUS_CYCLE_ms + 1000u / TAPER_EV_STATUS_CYCLE_ms + \
     1000u / TAPER_EVSE_ELEC_CYCLE_ms + 2u * 5000u / TAPER_EV_PARAM_A_CYCLE_ms + 1u)
#define GATEWAY_NOMINAL 4u
#define TOO_MUCH        3u

/** Who sent a frame, and what its receiver remembers of it. */
typedef struct {
    taper_node_guard_t *guard;
    taper_e2e_receiver_t *receiver;
    int connector; /**< -1: the gateway */
} sender_t;

/** Place of a connector's message kind among its end-to-end receivers, or -1. */
static int connector_place(unsigned function) {
    switch (function) {
    case TAPER_MESSAGE_EVSE_STATUS: return 0;
    case TAPER_MESSAGE_EV_STATUS: return 1;
    case TAPER_MESSAGE_EVSE_ELEC: return 2;
    case TAPER_MESSAGE_EV_PARAM_A: return 3;
    case TAPER_MESSAGE_EV_PARAM_B: return 4;
    case TAPER_MESSAGE_EV_PARAM_C: return 5;
    case TAPER_MESSAGE_EV_PARAM_D: return 6;
    case TAPER_MESSAGE_EV_PARAM_E: return 7;
    case TAPER_MESSAGE_EVSE_INFO: return 8;
    case TAPER_MESSAGE_EMCY: return 9;
    default: return -1;
    }
}

static int gateway_place(unsigned function) {
    switch (function) {
    case TAPER_MESSAGE_SITE_LIMIT: return 0;
    case TAPER_MESSAGE_TIME_SYNC: return 1;
    case TAPER_MESSAGE_SITE_METER: return 2;
    case TAPER_MESSAGE_EMCY: return 3;
    default: return -1;
    }
}

/** @return false for a frame that this station does not listen to. */
static bool find_sender(taper_station_t *station, const taper_frame_t *frame, sender_t *sender) {
    const unsigned function = (unsigned)frame->id >> 6;
    const uint8_t node = (uint8_t)(frame->id & 0x3Fu);
    if (node == TAPER_NODE_GATEWAY && frame->bus == 0) {
        const int place = gateway_place(function);
        *sender = (sender_t){&station->gateway_guard, &station->gateway_e2e[place < 0 ? 0 : place], -1};
        return place >= 0;
    }
    const int place = connector_place(function);
    const int connector = taper_session_connector(station->options.config, frame->bus, node);
    if (place < 0 || connector < 0) {
        return false;
    }
    *sender = (sender_t){&station->connector_guard[connector], &station->connector_e2e[connector][place],
                         connector};
    return true;
}

static void note_bad_frames(taper_station_t *station, taper_trouble_t *trouble, const taper_frame_t *frame) {
    const uint8_t node = (uint8_t)(frame->id & 0x3Fu);
    if (taper_trouble_is_news(trouble, frame->time_ms)) {
        taper_event_note(&station->events, TAPER_EVENT_BAD_FRAMES, frame->bus, node, frame->id >> 6);
    }
    taper_alarm_raise(station, TAPER_EVENT_BAD_FRAMES, frame->bus, node, station->events.now_ms);
}

/** The counter of what a frame turned out to be; TAPER_COUNTERS for a good one. */
static taper_counter_t counter_of(taper_e2e_check_t check) {
    switch (check) {
    case TAPER_E2E_OK: return TAPER_COUNTERS;
    case TAPER_E2E_OK_SOME_LOST:
    case TAPER_E2E_WRONG_SEQUENCE: return TAPER_COUNTER_FRAMES_LOST;
    case TAPER_E2E_REPEATED: return TAPER_COUNTER_FRAMES_REPEATED;
    case TAPER_E2E_CRC_ERROR:
    default: return TAPER_COUNTER_CRC_ERRORS;
    }
}

/** Whether a frame is sound, new, and of a sender that is to be believed. */
static bool is_good(taper_station_t *station, const sender_t *sender, const taper_frame_t *frame) {
    taper_e2e_receiver_t *receiver = sender->receiver;
    const taper_e2e_check_t check = taper_e2e_check(receiver, frame);
    const bool valid = taper_e2e_is_valid(receiver);
    const taper_counter_t counter = counter_of(check);
    if (counter != TAPER_COUNTERS) {
        taper_station_count(station, counter);
    }
    if (!valid) {
        note_bad_frames(station, &sender->guard->bad_frames, frame);
    }
    if (check != TAPER_E2E_OK && check != TAPER_E2E_OK_SOME_LOST) {
        return false;
    }
    if (!valid) {
        taper_station_count(station, TAPER_COUNTER_FRAMES_UNTRUSTED);
        return false;
    }
    return true;
}

static void note_bad_field(taper_station_t *station, const sender_t *sender, const taper_frame_t *frame) {
    taper_station_count(station, TAPER_COUNTER_BAD_FIELDS);
    if (taper_trouble_is_news(&sender->guard->bad_field, frame->time_ms)) {
        taper_event_note(&station->events, TAPER_EVENT_BAD_FIELD, frame->bus, (uint8_t)(frame->id & 0x3Fu),
                         frame->id >> 6);
    }
}

/** Whether an EMCY is news: it was not noted within the last minute, and not too many others were. */
static bool emcy_is_news(taper_node_guard_t *guard, uint16_t code, uint32_t at_ms) {
    taper_emcy_note_t *place = NULL;
    for (unsigned k = 0; k < TAPER_EMCYS_OF_NODE; k++) {
        taper_emcy_note_t *note = &guard->emcy[k];
        const bool lately = note->noted && taper_elapsed_ms(at_ms, note->at_ms) < TAPER_SAME_TROUBLE_ms;
        if (lately && note->code == code) {
            return false;
        }
        place = lately ? place : note;
    }
    if (place != NULL) {
        *place = (taper_emcy_note_t){.noted = true, .code = code, .at_ms = at_ms};
    }
    return place != NULL;
}

static void hear_emcy(taper_station_t *station, const sender_t *sender, const taper_message_t *message,
                      uint32_t at_ms) {
    const uint16_t code = message->as.emcy.code;
    if (emcy_is_news(sender->guard, code, at_ms)) {
        taper_event_note(&station->events, TAPER_EVENT_EMCY_HEARD, message->bus, message->node, code);
    }
}

static void use_message(taper_station_t *station, const sender_t *sender, const taper_message_t *message,
                        uint32_t at_ms) {
    switch (message->kind) {
    case TAPER_MESSAGE_SITE_LIMIT:
        taper_limits_apply(&station->limits, &message->as.site_limit, at_ms);
        break;
    case TAPER_MESSAGE_SITE_METER:
        taper_limits_apply_meter(&station->limits, &message->as.site_meter, at_ms);
        break;
    case TAPER_MESSAGE_EMCY: hear_emcy(station, sender, message, at_ms); break;
    case TAPER_MESSAGE_TIME_SYNC: (void)taper_session_apply(&station->sessions, message, at_ms); break;
    case TAPER_MESSAGE_EVSE_STATUS:
        taper_ledger_hear(&station->ledger, (uint8_t)sender->connector, &message->as.evse_status, at_ms);
        (void)taper_session_apply_to(&station->sessions, (uint8_t)sender->connector, message, at_ms);
        if (taper_ledger_is_accepted(&station->ledger, (uint8_t)sender->connector)) {
            taper_session_confirm(&station->sessions, (uint8_t)sender->connector);
        }
        break;
    default:
        (void)taper_session_apply_to(&station->sessions, (uint8_t)sender->connector, message, at_ms);
        break;
    }
}

/** A frame with an identifier that only a controller sends, and sound: there is a second one (fault 20). */
static void hear_rival(taper_station_t *station, const taper_frame_t *frame) {
    taper_e2e_receiver_t fresh = {0};
    if (taper_e2e_check(&fresh, frame) != TAPER_E2E_OK) {
        taper_station_count(station, TAPER_COUNTER_CRC_ERRORS);
        return;
    }
    if (!station->rival_heard) {
        taper_event_note(&station->events, TAPER_EVENT_TWO_CONTROLLERS, frame->bus, 0, frame->id >> 6);
    }
    station->rival_heard = true;
    station->rival_ms = frame->time_ms;
}

static bool is_ours_to_send(const taper_frame_t *frame) {
    const unsigned function = (unsigned)frame->id >> 6;
    const unsigned node = frame->id & 0x3Fu;
    return (function == TAPER_MESSAGE_SETPOINT && node >= 1 && node <= TAPER_NODES_PER_BUS) ||
           (function == TAPER_MESSAGE_CTRL_STATUS && node == TAPER_NODE_CONTROLLER);
}

/** The gateway is told what became of its curve of `count` points; the log has those that are in force. */
static void answer_curve(taper_station_t *station, taper_status_t status, taper_event_code_t event,
                         uint16_t count) {
    taper_transfers_answer(&station->transfers,
                           status == TAPER_OK ? TAPER_ANSWER_ACCEPTED : TAPER_ANSWER_CONTENT,
                           station->events.now_ms);
    if (status == TAPER_OK) {
        taper_event_note(&station->events, event, 0, TAPER_NODE_GATEWAY, count);
    }
}

static void set_curve(taper_station_t *station) {
    const taper_limit_curve_t *curve = &station->scratch.incoming.curve;
    answer_curve(station, taper_limits_set_curve(&station->limits, TAPER_CURVE_OF_GATEWAY, curve),
                 TAPER_EVENT_CURVE_SET, curve->count);
}

static void set_price(taper_station_t *station) {
    const taper_price_curve_t *price = &station->scratch.incoming.price;
    answer_curve(station, taper_limits_set_price(&station->limits, price), TAPER_EVENT_PRICE_SET,
                 price->count);
}

static void note_identifier(taper_station_t *station, const taper_frame_t *frame, uint8_t connector) {
    const bool known = taper_transfers_identifier(&station->transfers, connector)[0] != '\0';
    station->identifier_kept[connector] = false;
    station->sessions.changes++;
    taper_event_note(&station->events, TAPER_EVENT_IDENTIFIED, frame->bus, (uint8_t)(frame->id & 0x3Fu),
                     known);
}

static void take_transfer(taper_station_t *station, const taper_frame_t *frame) {
    const uint32_t now_ms = station->events.now_ms;
    const taper_transfer_scene_t scene = {.now_ms = now_ms,
                                          .clock_is_set = station->sessions.clock_heard.heard,
                                          .unix_s = taper_session_unix_s(&station->sessions, now_ms),
                                          .time_scale = station->sessions.time_scale,
                                          .events = &station->events};
    switch (taper_transfers_take(&station->transfers, frame, &scene, &station->scratch.incoming)) {
    case TAPER_RESULT_CURVE: set_curve(station); break;
    case TAPER_RESULT_PRICE: set_price(station); break;
    case TAPER_RESULT_IDENTIFIER: note_identifier(station, frame, station->scratch.incoming.connector); break;
    case TAPER_RESULT_REFUSED: /* counted there, and noted with those that ran out of time */
    case TAPER_RESULT_NONE:
    default: break;
    }
}

static void take_report(taper_station_t *station, taper_frame_t *frame) {
    sender_t sender;
    taper_message_t message;
    bool bad_field = false;
    if (!find_sender(station, frame, &sender)) {
        taper_strangers_hear(station, frame);
        taper_station_count(station, TAPER_COUNTER_FRAMES_UNKNOWN);
        return;
    }
    frame->time_ms = taper_node_guard_time(sender.guard, frame->time_ms, station->events.now_ms);
    const uint32_t most_per_second = TOO_MUCH * (sender.connector < 0 ? GATEWAY_NOMINAL : CONNECTOR_NOMINAL);
    if (!taper_node_guard_passes(station, sender.guard, most_per_second, frame) ||
        !is_good(station, &sender, frame)) {
        return;
    }
    const bool usable = taper_decode(frame, &message, &bad_field);
    if (!usable || bad_field) {
        note_bad_field(station, &sender, frame);
    }
    if (usable) {
        use_message(station, &sender, &message, frame->time_ms);
    }
}

static void take_frame(taper_station_t *station, taper_frame_t *frame) {
    taper_station_count(station, TAPER_COUNTER_FRAMES_RECEIVED);
    if ((unsigned)frame->id >> 6 == TAPER_MESSAGE_ISOTP_FROM) {
        take_transfer(station, frame);
    } else if (is_ours_to_send(frame)) {
        hear_rival(station, frame);
    } else {
        take_report(station, frame);
    }
}

void taper_station_receive(taper_station_t *station, uint32_t now_ms) {
    const taper_port_t *port = station->options.port;
    /* A port that does not know when a frame came leaves the time alone: then it came now. */
    taper_frame_t frame = {.time_ms = now_ms};
    for (uint32_t taken = 0; taken < MAX_FRAMES && port->receive(port->context, &frame); taken++) {
        if (taper_time_reached(frame.time_ms, now_ms)) {
            frame.time_ms = now_ms;
        }
        take_frame(station, &frame);
        frame.time_ms = now_ms;
    }
}
