#include "station_io.h"

#include "taper/codec.h"

/** Frames taken in one step: what all nodes send in three seconds. A babbling bus cannot hold the step up. */
#define TAPER_MAX_FRAMES_PER_STEP (TAPER_MAX_CONNECTORS * 32u + 64u)

/** Least validity of a setpoint, and how many control ticks it must outlive. */
#define VALIDITY_FLOOR_ms 3000u
#define VALIDITY_TICKS    3u
/** Longest that SETPOINT can say. */
#define VALIDITY_MOST_ms 127000u

/** Place of a connector's message kind among its end-to-end receivers, or -1. */
static int receiver_place(unsigned function) {
    switch (function) {
    case TAPER_MESSAGE_EVSE_STATUS: return 0;
    case TAPER_MESSAGE_EV_STATUS: return 1;
    case TAPER_MESSAGE_EVSE_ELEC: return 2;
    case TAPER_MESSAGE_EV_PARAM_A: return 3;
    case TAPER_MESSAGE_EV_PARAM_B: return 4;
    case TAPER_MESSAGE_EV_PARAM_C: return 5;
    case TAPER_MESSAGE_EV_PARAM_D: return 6;
    default: return -1;
    }
}

/** The end-to-end receiver for a frame, or NULL for a frame that this station does not listen to. */
static taper_e2e_receiver_t *receiver_of(taper_station_t *station, const taper_frame_t *frame) {
    const unsigned function = frame->id >> 6;
    const uint8_t node = (uint8_t)(frame->id & 0x3F);
    if (node == TAPER_NODE_GATEWAY && frame->bus == 0) {
        if (function == TAPER_MESSAGE_SITE_LIMIT) {
            return &station->gateway_e2e[0];
        }
        return function == TAPER_MESSAGE_TIME_SYNC ? &station->gateway_e2e[1] : NULL;
    }
    const int place = receiver_place(function);
    const int connector = taper_session_connector(station->options.config, frame->bus, node);
    return place < 0 || connector < 0 ? NULL : &station->connector_e2e[connector][place];
}

static bool is_good(taper_station_counters_t *counters, taper_e2e_receiver_t *receiver,
                    const taper_frame_t *frame) {
    switch (taper_e2e_check(receiver, frame)) {
    case TAPER_E2E_OK: break;
    case TAPER_E2E_OK_SOME_LOST: taper_count(&counters->frames_lost); break;
    case TAPER_E2E_REPEATED: taper_count(&counters->frames_repeated); return false;
    case TAPER_E2E_WRONG_SEQUENCE: taper_count(&counters->frames_lost); return false;
    case TAPER_E2E_CRC_ERROR:
    default: taper_count(&counters->crc_errors); return false;
    }
    if (!taper_e2e_is_valid(receiver)) {
        taper_count(&counters->frames_untrusted);
        return false;
    }
    return true;
}

static void take_frame(taper_station_t *station, const taper_frame_t *frame, uint32_t now_ms) {
    taper_message_t message;
    bool bad_field = false;
    taper_e2e_receiver_t *receiver = receiver_of(station, frame);
    taper_count(&station->counters.frames_received);
    if (receiver == NULL) {
        taper_count(&station->counters.frames_unknown);
        return;
    }
    if (!is_good(&station->counters, receiver, frame)) {
        return;
    }
    const bool usable = taper_decode(frame, &message, &bad_field);
    if (!usable || bad_field) {
        taper_count(&station->counters.bad_fields);
    }
    if (!usable) {
        return;
    }
    if (message.kind == TAPER_MESSAGE_SITE_LIMIT) {
        taper_limits_apply(&station->limits, &message.as.site_limit, now_ms);
    } else {
        (void)taper_session_apply(&station->sessions, &message, now_ms);
    }
}

void taper_station_receive(taper_station_t *station, uint32_t now_ms) {
    const taper_port_t *port = station->options.port;
    taper_frame_t frame;
    for (uint32_t taken = 0; taken < TAPER_MAX_FRAMES_PER_STEP && port->receive(port->context, &frame);
         taken++) {
        take_frame(station, &frame, now_ms);
    }
}

/** @return whether the port took it: a frame that was never sent must leave no gap in the counter. */
static bool send_message(taper_station_t *station, const taper_message_t *message, uint8_t counter) {
    const taper_port_t *port = station->options.port;
    taper_frame_t frame;
    if (!taper_encode(message, &frame)) {
        return false;
    }
    taper_e2e_protect(&frame, counter);
    const bool taken = port->send(port->context, &frame);
    taper_count(taken ? &station->counters.frames_sent : &station->counters.send_refused);
    return taken;
}

static uint8_t next_counter(uint8_t counter) {
    return (uint8_t)((counter + 1) & 0x0F);
}

static int32_t validity_ms(const taper_station_config_t *config) {
    uint32_t validity =
        config->tick_ms < VALIDITY_MOST_ms ? config->tick_ms * VALIDITY_TICKS : VALIDITY_MOST_ms;
    validity = validity < VALIDITY_FLOOR_ms ? VALIDITY_FLOOR_ms : validity;
    return (int32_t)(validity > VALIDITY_MOST_ms ? VALIDITY_MOST_ms : validity);
}

static void send_setpoint(taper_station_t *station, uint8_t i) {
    const taper_connector_config_t *connector = &station->options.config->connectors[i];
    const int32_t current_mA = station->setpoints.current_mA[i];
    const taper_message_t message = {
        .kind = TAPER_MESSAGE_SETPOINT,
        .bus = connector->bus,
        .node = connector->node,
        .as.setpoint =
            {
                .command = current_mA > 0 ? TAPER_COMMAND_CHARGE : TAPER_COMMAND_PAUSE,
                .current_mA = current_mA,
                .validity_ms = validity_ms(station->options.config),
                .fallback_mA = 0,
                .phase_mask = connector->phases == 3 ? 7 : 1,
                .session = taper_session_number(&station->sessions, i),
            },
    };
    if (send_message(station, &message, station->setpoint_counter[i])) {
        station->setpoint_counter[i] = next_counter(station->setpoint_counter[i]);
    }
}

static taper_ctrl_status_t status_of(const taper_station_t *station) {
    taper_ctrl_status_t status = {
        .mode = (uint8_t)station->supervisor.mode,
        .verdict = (uint8_t)station->planner.verdict,
        .limit_source = (uint8_t)station->limit_now.source,
        .solve_ticks = station->planner.slices,
        .iterations = taper_planner_iterations(&station->planner),
        .plan_version = (uint8_t)station->counters.plans,
    };
    for (uint8_t i = 0; i < station->snapshot.count; i++) {
        const bool active = station->snapshot.demand[i].active;
        status.active = (uint8_t)(status.active + (active ? 1 : 0));
        status.waiting =
            (uint8_t)(status.waiting + (active && station->setpoints.current_mA[i] == 0 ? 1 : 0));
    }
    return status;
}

static uint8_t bus_count(const taper_station_config_t *config) {
    uint8_t buses = 0;
    for (uint8_t i = 0; i < config->connector_count; i++) {
        buses = config->connectors[i].bus >= buses ? (uint8_t)(config->connectors[i].bus + 1) : buses;
    }
    return buses;
}

static void send_status(taper_station_t *station) {
    taper_message_t message = {.kind = TAPER_MESSAGE_CTRL_STATUS, .node = TAPER_NODE_CONTROLLER};
    message.as.ctrl_status = status_of(station);
    const uint8_t buses = bus_count(station->options.config);
    for (message.bus = 0; message.bus < buses; message.bus++) {
        if (send_message(station, &message, station->status_counter[message.bus])) {
            station->status_counter[message.bus] = next_counter(station->status_counter[message.bus]);
        }
    }
}

void taper_station_send(taper_station_t *station) {
    for (uint8_t i = 0; i < station->options.config->connector_count; i++) {
        send_setpoint(station, i);
    }
    send_status(station);
}
