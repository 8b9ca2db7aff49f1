/* Frames out: setpoints, status, what is for display, and transfers. */
#include "station_internal.h"
#include "taper/codec.h"

/** Least validity of a setpoint, and how many control ticks it must outlive. */
#define VALIDITY_FLOOR_ms 3000u
#define VALIDITY_TICKS    3u
/** Longest that SETPOINT can say. */
#define VALIDITY_MOST_ms 127000u
/** Setpoints wait behind frames of transfers: a peer that asks for no gap gets no more than this at a time. */
#define TRANSFER_FRAMES 8u
/** Counters that increases and repeats without an echo leave for a decrease. The others last while a setpoint does. */
#define COUNTERS_KEPT 4u
/** PLAN goes round all connectors in this many seconds. */
#define PLAN_ROUND_s 8u

_Static_assert(VALIDITY_FLOOR_ms > 4u * TAPER_SETPOINT_CYCLE_ms,
               "a setpoint outlives the loss of some frames");

uint32_t taper_station_validity_ms(const taper_station_options_t *options) {
    const uint32_t tick_ms = options->config->tick_ms / options->time_scale;
    const uint32_t validity_ms = tick_ms < VALIDITY_MOST_ms ? tick_ms * VALIDITY_TICKS : VALIDITY_MOST_ms;
    if (validity_ms > VALIDITY_MOST_ms) {
        return VALIDITY_MOST_ms;
    }
    return validity_ms < VALIDITY_FLOOR_ms ? VALIDITY_FLOOR_ms : validity_ms;
}

bool taper_station_send_message(taper_station_t *station, const taper_message_t *message, uint8_t *counter,
                                uint32_t now_ms) {
    taper_frame_t frame;
    if (!taper_encode(message, &frame)) {
        return false;
    }
    taper_e2e_protect(&frame, *counter);
    if (!taper_bus_guard_send(station, &frame, now_ms)) {
        return false;
    }
    *counter = (uint8_t)((*counter + 1) & 0x0F);
    return true;
}

static taper_command_t command_for(const taper_station_t *station, uint8_t i) {
    if (station->draw[i].state == TAPER_DRAW_LOCKED) {
        return TAPER_COMMAND_STOP;
    }
    return station->setpoints.current_mA[i] > 0 ? TAPER_COMMAND_CHARGE : TAPER_COMMAND_PAUSE;
}

static taper_message_t setpoint_of(const taper_station_t *station, uint8_t i) {
    const taper_connector_config_t *connector = &station->options.config->connectors[i];
    const int32_t current_mA = station->setpoints.current_mA[i];
    return (taper_message_t){
        .kind = TAPER_MESSAGE_SETPOINT,
        .bus = connector->bus,
        .node = connector->node,
        .as.setpoint =
            {
                .command = command_for(station, i),
                .current_mA = current_mA,
                .validity_ms = (int32_t)station->ledger.validity_ms,
                .fallback_mA = station->fallback.current_mA[i],
                .phase_mask =
                    (uint8_t)((1u << taper_phases_allowed(station, i)) - 1u), /* others are not booked */
                .session = station->setpoint_session[i],
            },
    };
}

/** Whether the setpoint takes something away from what was told last. */
static bool is_less(const taper_station_t *station, uint8_t i) {
    const taper_ledger_entry_t *entry = &station->ledger.entry[i];
    return station->setpoints.current_mA[i] < entry->last_mA ||
           station->fallback.current_mA[i] < entry->last_fallback_mA ||
           (command_for(station, i) == TAPER_COMMAND_STOP && station->sent_command[i] != TAPER_COMMAND_STOP);
}

/** Whether a counter is free for this setpoint: while it is not, an older one with that counter may be in force. */
static bool has_counter(const taper_station_t *station, uint8_t i) {
    const uint8_t counter = station->setpoint_counter[i];
    const uint8_t last = (uint8_t)((counter + COUNTERS_KEPT) % TAPER_LEDGER_SETPOINTS);
    return taper_ledger_can_send(&station->ledger, i, counter) &&
           (is_less(station, i) || taper_ledger_can_send(&station->ledger, i, last));
}

/** One setpoint, noted in the ledger before anybody can act on it. What was refused is tried again with the newest value. */
static void send_setpoint(taper_station_t *station, uint8_t i, uint32_t now_ms) {
    const uint8_t counter = station->setpoint_counter[i];
    const taper_message_t message = setpoint_of(station, i);
    if (!has_counter(station, i)) {
        return;
    }
    if (taper_station_send_message(station, &message, &station->setpoint_counter[i], now_ms)) {
        const bool new_session = station->sent_session[i] != station->setpoint_session[i];
        taper_ledger_sent(&station->ledger, i, counter, station->setpoints.current_mA[i],
                          station->fallback.current_mA[i], now_ms);
        taper_shape_sent(&station->shape, i, station->setpoints.current_mA[i], new_session,
                         now_ms * station->options.time_scale);
        taper_phases_sent(station, i, now_ms);
        station->sent_mA[i] = station->setpoints.current_mA[i];
        station->sent_fallback_mA[i] = station->fallback.current_mA[i];
        station->sent_command[i] = (uint8_t)message.as.setpoint.command;
        station->sent_phases[i] = taper_phases_allowed(station, i);
        station->sent_session[i] = station->setpoint_session[i];
        station->sent_ms[i] = now_ms;
    }
}

static bool is_due(const taper_station_t *station, uint8_t i, uint32_t now_ms) {
    return station->setpoints.current_mA[i] != station->sent_mA[i] ||
           station->fallback.current_mA[i] != station->sent_fallback_mA[i] ||
           (uint8_t)command_for(station, i) != station->sent_command[i] ||
           taper_phases_allowed(station, i) != station->sent_phases[i] ||
           station->setpoint_session[i] != station->sent_session[i] ||
           taper_elapsed_ms(now_ms, station->sent_ms[i]) >= TAPER_SETPOINT_CYCLE_ms;
}

void taper_station_send_setpoints(taper_station_t *station, uint32_t now_ms) {
    taper_station_check_seal(station, now_ms);
    for (uint8_t i = 0; i < station->options.config->connector_count; i++) {
        if (is_due(station, i, now_ms)) {
            send_setpoint(station, i, now_ms);
        }
    }
}

void taper_station_forget_sent(taper_station_t *station) {
    for (uint8_t i = 0; i < station->options.config->connector_count; i++) {
        station->sent_mA[i] = -1;
    }
}

static taper_ctrl_status_t status_of(const taper_station_t *station) {
    taper_ctrl_status_t status = {
        .mode = (uint8_t)station->supervisor.mode,
        .verdict = (uint8_t)station->planner.verdict,
        .limit_source = (uint8_t)station->limit_now.source,
        .solve_ticks = (uint8_t)taper_min_i32(station->planner.slices, UINT8_MAX),
        .iterations = taper_planner_iterations(&station->planner),
        .plan_version = (uint8_t)taper_station_counter(station, TAPER_COUNTER_PLANS),
    };
    for (uint8_t i = 0; i < station->snapshot.count; i++) {
        const bool active = station->snapshot.demand[i].active;
        status.active = (uint8_t)(status.active + (active ? 1 : 0));
        status.waiting =
            (uint8_t)(status.waiting + (active && station->setpoints.current_mA[i] == 0 ? 1 : 0));
    }
    return status;
}

void taper_station_send_status(taper_station_t *station, uint32_t now_ms) {
    taper_message_t message = {.kind = TAPER_MESSAGE_CTRL_STATUS, .node = TAPER_NODE_CONTROLLER};
    message.as.ctrl_status = status_of(station);
    const uint8_t buses = taper_station_buses(station->options.config);
    for (message.bus = 0; message.bus < buses; message.bus++) {
        const bool due = station->status_due[message.bus];
        station->status_due[message.bus] =
            due &&
            !taper_station_send_message(station, &message, &station->status_counter[message.bus], now_ms);
    }
}

static void send_plan(taper_station_t *station, uint8_t i, uint32_t now_ms) {
    const taper_connector_config_t *connector = &station->options.config->connectors[i];
    const taper_demand_t *demand = &station->snapshot.demand[i];
    taper_message_t message = {.kind = TAPER_MESSAGE_PLAN, .bus = connector->bus, .node = connector->node};
    const bool planned =
        taper_station_has_plan(station) && demand->active && station->plan_session[i] == demand->session;
    for (uint8_t t = 0; t < TAPER_PLAN_STEPS; t++) {
        message.as.plan.power_W[t] = planned ? taper_station_planned_W(station, i, t) : TAPER_ABSENT;
    }
    (void)taper_station_send_message(station, &message, &station->plan_counter[i], now_ms);
}

static void send_outlook(taper_station_t *station, uint8_t i, uint32_t now_ms) {
    const taper_connector_config_t *connector = &station->options.config->connectors[i];
    taper_message_t message = {.kind = TAPER_MESSAGE_OUTLOOK, .bus = connector->bus, .node = connector->node};
    message.as.outlook = taper_station_outlook(station, i);
    (void)taper_station_send_message(station, &message, &station->outlook_counter[i], now_ms);
}

static void send_diag(taper_station_t *station, uint32_t now_ms) {
    taper_message_t message = {.kind = TAPER_MESSAGE_CTRL_DIAG, .node = TAPER_NODE_CONTROLLER};
    const uint8_t index = station->next_diag;
    station->next_diag = (uint8_t)((index + 1) % TAPER_COUNTERS);
    message.as.ctrl_diag =
        (taper_ctrl_diag_t){.index = index, .value = taper_station_counter(station, (taper_counter_t)index)};
    const uint8_t buses = taper_station_buses(station->options.config);
    for (message.bus = 0; message.bus < buses; message.bus++) {
        (void)taper_station_send_message(station, &message, &station->diag_counter[message.bus], now_ms);
    }
}

void taper_station_send_display(taper_station_t *station, uint32_t now_ms) {
    const uint8_t connectors = station->options.config->connector_count;
    if (taper_elapsed_ms(now_ms, station->second_ms) < TAPER_PLAN_CYCLE_ms) {
        return;
    }
    station->second_ms = now_ms;
    for (unsigned k = 0; k < (connectors + PLAN_ROUND_s - 1u) / PLAN_ROUND_s; k++) {
        send_plan(station, station->next_plan, now_ms);
        send_outlook(station, station->next_plan, now_ms);
        station->next_plan = (uint8_t)((station->next_plan + 1) % connectors);
    }
    taper_strangers_send(station, now_ms);
    send_diag(station, now_ms);
}

static void note_transfers(taper_station_t *station, uint32_t now_ms) {
    uint32_t *count = station->counters.count;
    if (station->transfers.refused != count[TAPER_COUNTER_TRANSFERS_REFUSED] &&
        taper_trouble_is_news(&station->refused_transfers, now_ms)) {
        taper_event_note(&station->events, TAPER_EVENT_TRANSFER_REFUSED, 0, 0,
                         taper_saturate_i32(station->transfers.refused));
    }
    count[TAPER_COUNTER_TRANSFERS] = station->transfers.accepted;
    count[TAPER_COUNTER_TRANSFERS_REFUSED] = station->transfers.refused;
}

void taper_station_send_transfers(taper_station_t *station, uint32_t now_ms) {
    taper_frame_t frame;
    for (unsigned k = 0; k < TRANSFER_FRAMES && taper_transfers_next(&station->transfers, now_ms, &frame);
         k++) {
        if (taper_bus_guard_send(station, &frame, now_ms)) {
            taper_transfers_sent(&station->transfers, &frame, now_ms);
        }
    }
    note_transfers(station, now_ms);
}
