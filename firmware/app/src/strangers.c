/* Connectors on the bus that the station has no place for (docs/protocol.md, fault 31). They get no current: nobody sends them
   a setpoint to charge by. They are told so, and where they stand by arrival; the others do not notice. */
#include <string.h>

#include "station_internal.h"
#include "taper/codec.h"

static bool is_one(const taper_stranger_t *stranger, const taper_frame_t *frame) {
    return stranger->node == (frame->id & 0x3Fu) && stranger->bus == frame->bus;
}

static unsigned count_strangers(const taper_station_t *station) {
    unsigned count = 0;
    while (count < TAPER_STRANGERS && station->stranger[count].node != 0) {
        count++;
    }
    return count;
}

/** Those behind move up. */
static void forget(taper_station_t *station, unsigned place) {
    taper_stranger_t *stranger = station->stranger;
    memmove(stranger + place, stranger + place + 1, (TAPER_STRANGERS - place - 1u) * sizeof *stranger);
    memset(stranger + TAPER_STRANGERS - 1, 0, sizeof *stranger);
}

static void forget_silent(taper_station_t *station, uint32_t now_ms) {
    for (unsigned k = count_strangers(station); k-- > 0;) {
        if (taper_elapsed_ms(now_ms, station->stranger[k].heard_ms) > TAPER_EVSE_STATUS_TIMEOUT_ms) {
            forget(station, k);
        }
    }
}

/** The frame's sender, or NULL: it is not noted. */
static taper_stranger_t *find(taper_station_t *station, const taper_frame_t *frame) {
    for (unsigned k = 0; k < TAPER_STRANGERS; k++) {
        if (station->stranger[k].node != 0 && is_one(&station->stranger[k], frame)) {
            return &station->stranger[k];
        }
    }
    return NULL;
}

/** A new place for the frame's sender, or NULL: as many are noted already. */
static taper_stranger_t *add(taper_station_t *station, const taper_frame_t *frame) {
    const unsigned count = count_strangers(station);
    if (count == TAPER_STRANGERS) {
        return NULL;
    }
    station->stranger[count] = (taper_stranger_t){.bus = frame->bus, .node = (uint8_t)(frame->id & 0x3Fu)};
    taper_station_count(station, TAPER_COUNTER_STRANGERS);
    taper_event_note(&station->events, TAPER_EVENT_QUEUED, frame->bus, (uint8_t)(frame->id & 0x3Fu),
                     (int32_t)count + 1);
    return &station->stranger[count];
}

/** Any sound frame by itself: nothing is remembered of a sender without a place. */
static bool read_alone(const taper_frame_t *frame, taper_message_t *message) {
    taper_e2e_receiver_t fresh = {0};
    bool bad_field = false;
    return taper_e2e_check(&fresh, frame) == TAPER_E2E_OK && taper_decode(frame, message, &bad_field);
}

static void hear_status(taper_station_t *station, const taper_frame_t *frame) {
    taper_stranger_t *stranger = find(station, frame);
    stranger = stranger != NULL ? stranger : add(station, frame);
    if (stranger != NULL) {
        stranger->heard_ms = frame->time_ms;
    }
}

/** It obeys setpoints for its own session only. */
static void hear_session(taper_station_t *station, const taper_frame_t *frame, uint8_t session) {
    taper_stranger_t *stranger = find(station, frame);
    if (stranger != NULL) {
        stranger->session = session;
    }
}

void taper_strangers_hear(taper_station_t *station, const taper_frame_t *frame) {
    const unsigned node = frame->id & 0x3Fu;
    const unsigned function = (unsigned)frame->id >> 6;
    const bool tells = function == TAPER_MESSAGE_EVSE_STATUS || function == TAPER_MESSAGE_EV_PARAM_A;
    taper_message_t message;
    if (!tells || node < 1 || node > TAPER_NODES_PER_BUS ||
        frame->bus >= taper_station_buses(station->options.config) || !read_alone(frame, &message)) {
        return;
    }
    if (function == TAPER_MESSAGE_EV_PARAM_A) {
        hear_session(station, frame, message.as.ev_param_a.session);
    } else if (message.as.evse_status.ev_present) {
        hear_status(station, frame);
    }
}

static void send_to(taper_station_t *station, unsigned place, unsigned count, uint32_t now_ms) {
    taper_stranger_t *stranger = &station->stranger[place];
    taper_message_t pause = {.kind = TAPER_MESSAGE_SETPOINT, .bus = stranger->bus, .node = stranger->node};
    taper_message_t outlook = {.kind = TAPER_MESSAGE_OUTLOOK, .bus = stranger->bus, .node = stranger->node};
    pause.as.setpoint = (taper_setpoint_t){.command = TAPER_COMMAND_PAUSE,
                                           .validity_ms = (int32_t)station->ledger.validity_ms,
                                           .session = stranger->session};
    outlook.as.outlook = (taper_outlook_t){.reason = TAPER_REASON_QUEUED,
                                           .waiting_place = (uint8_t)(place + 1u),
                                           .waiting_of = (uint8_t)count,
                                           .soc_at_departure_permille = TAPER_ABSENT,
                                           .short_Wh = TAPER_ABSENT};
    (void)taper_station_send_message(station, &pause, &stranger->setpoint_counter, now_ms);
    (void)taper_station_send_message(station, &outlook, &stranger->outlook_counter, now_ms);
}

void taper_strangers_send(taper_station_t *station, uint32_t now_ms) {
    forget_silent(station, now_ms);
    const unsigned count = count_strangers(station);
    for (unsigned k = 0; k < count; k++) {
        send_to(station, k, count, now_ms);
    }
}
