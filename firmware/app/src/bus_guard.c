/* Bus-off and senders that are blocked: leave the bus alone for 1, 2, 4 .. 60 s, then try again (faults 17 and 18). */
#include "station_internal.h"

#define FIRST_PAUSE_s   1u
#define LONGEST_PAUSE_s 60u
/** A controller that was asked to come back needs this long to have heard enough of the bus. */
#define RESTART_TAKES_ms 200u
/** Nothing taken for this long is as good as bus-off. */
#define BLOCKED_ms 1000u
/** After this long without trouble, the next pause is the shortest again. */
#define HEALTHY_ms UINT32_C(60000)

uint8_t taper_station_buses(const taper_station_config_t *config) {
    uint8_t buses = 0;
    for (uint8_t i = 0; i < config->connector_count; i++) {
        buses = config->connectors[i].bus >= buses ? (uint8_t)(config->connectors[i].bus + 1) : buses;
    }
    return buses;
}

static void leave_alone(taper_station_t *station, uint8_t bus, taper_event_code_t why, uint32_t now_ms) {
    taper_bus_guard_t *guard = &station->bus[bus];
    const bool healthy = taper_elapsed_ms(now_ms, guard->back_ms) >= HEALTHY_ms;
    if (guard->backoff_s == 0 || healthy) {
        guard->backoff_s = FIRST_PAUSE_s;
    }
    guard->silent = true;
    guard->refusing = false;
    guard->retry_ms = now_ms + guard->backoff_s * UINT32_C(1000);
    const unsigned longer_s = guard->backoff_s * 2u;
    guard->backoff_s = (uint8_t)(longer_s < LONGEST_PAUSE_s ? longer_s : LONGEST_PAUSE_s);
    taper_station_count(station, TAPER_COUNTER_BUS_OFF);
    if (!guard->in_trouble) {
        taper_event_note(&station->events, why, bus, 0, bus);
    }
    guard->in_trouble = true;
}

static void try_again(taper_station_t *station, uint8_t bus, bool is_off, uint32_t now_ms) {
    const taper_port_t *port = station->options.port;
    taper_bus_guard_t *guard = &station->bus[bus];
    if (is_off && port->restart_bus != NULL) {
        port->restart_bus(port->context, bus);
    }
    guard->silent = false;
    guard->back_ms = now_ms;
}

static void update_one(taper_station_t *station, uint8_t bus, uint32_t now_ms) {
    const taper_port_t *port = station->options.port;
    taper_bus_guard_t *guard = &station->bus[bus];
    const bool is_off = port->bus_is_off != NULL && port->bus_is_off(port->context, bus);
    const bool restarting =
        guard->backoff_s != 0 && taper_elapsed_ms(now_ms, guard->back_ms) < RESTART_TAKES_ms;
    if (guard->silent) {
        if (taper_time_reached(now_ms, guard->retry_ms)) {
            try_again(station, bus, is_off, now_ms);
        }
    } else if (is_off && !restarting) {
        leave_alone(station, bus, TAPER_EVENT_BUS_OFF, now_ms);
    }
}

void taper_bus_guard_update(taper_station_t *station, uint32_t now_ms) {
    const taper_port_t *port = station->options.port;
    const uint8_t buses = taper_station_buses(station->options.config);
    for (uint8_t bus = 0; bus < buses; bus++) {
        update_one(station, bus, now_ms);
    }
    if (port->receive_overflows != NULL) {
        station->counters.count[TAPER_COUNTER_RECEIVE_OVERFLOWS] = port->receive_overflows(port->context);
    }
}

static void note_refusal(taper_station_t *station, uint8_t bus, uint32_t now_ms) {
    taper_bus_guard_t *guard = &station->bus[bus];
    if (!guard->refusing) {
        guard->refusing_since_ms = now_ms;
    } else if (taper_elapsed_ms(now_ms, guard->refusing_since_ms) >= BLOCKED_ms) {
        leave_alone(station, bus, TAPER_EVENT_SEND_BLOCKED, now_ms);
    }
}

bool taper_bus_guard_send(taper_station_t *station, const taper_frame_t *frame, uint32_t now_ms) {
    const taper_port_t *port = station->options.port;
    taper_bus_guard_t *guard = &station->bus[frame->bus];
    if (guard->silent) {
        return false;
    }
    const bool taken = port->send(port->context, frame);
    taper_station_count(station, taken ? TAPER_COUNTER_FRAMES_SENT : TAPER_COUNTER_SEND_REFUSED);
    if (!taken) {
        note_refusal(station, frame->bus, now_ms);
    } else if (guard->in_trouble) {
        guard->in_trouble = false;
        taper_event_note(&station->events, TAPER_EVENT_BUS_BACK, frame->bus, 0, frame->bus);
    }
    guard->refusing = !taken && !guard->silent;
    return taken;
}
