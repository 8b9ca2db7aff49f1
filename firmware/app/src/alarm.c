/* Conditions that others should know of: EMCY three times 20 ms apart, then every second while they last. */
#include "station_internal.h"

#define FIRST_GAP_ms 20u
#define LATER_GAP_ms 1000u
#define FIRST_COUNT  3u
/** A condition that was not seen again for this long is over. */
#define OVER_ms 2000u

static taper_alarm_t *find(taper_station_t *station, uint8_t code, uint8_t bus, uint8_t node) {
    for (unsigned k = 0; k < TAPER_ALARMS; k++) {
        taper_alarm_t *alarm = &station->alarm[k];
        if (alarm->code == code && (code == 0 || (alarm->bus == bus && alarm->node == node))) {
            return alarm;
        }
    }
    return NULL;
}

void taper_alarm_raise(taper_station_t *station, taper_event_code_t code, uint8_t bus, uint8_t node,
                       uint32_t now_ms) {
    taper_alarm_t *alarm = find(station, (uint8_t)code, bus, node);
    if (alarm == NULL) {
        alarm = find(station, 0, 0, 0);
        if (alarm == NULL) {
            return; /* many alarms at once: the event log has it, and one of these will end */
        }
        *alarm = (taper_alarm_t){.code = (uint8_t)code, .bus = bus, .node = node, .next_ms = now_ms};
    }
    alarm->raised_ms = now_ms;
}

/** What the station does about it, as EMCY says it. */
static uint8_t reaction_to(taper_event_code_t code) {
    switch (code) {
    case TAPER_EVENT_BAD_FRAMES: return 1;
    case TAPER_EVENT_BABBLING:
    case TAPER_EVENT_OVER_DRAW: return 2;
    case TAPER_EVENT_TWO_CONTROLLERS: return 3;
    default: return 0;
    }
}

static void send_alarm(taper_station_t *station, taper_alarm_t *alarm, uint32_t now_ms) {
    const taper_event_code_t code = (taper_event_code_t)alarm->code;
    const taper_message_t message = {
        .kind = TAPER_MESSAGE_EMCY,
        .bus = alarm->bus,
        .node = TAPER_NODE_CONTROLLER,
        .as.emcy = {.severity = reaction_to(code) > 1 ? TAPER_SEVERITY_FAULT : TAPER_SEVERITY_WARNING,
                    .code = (uint16_t)code,
                    .reaction = reaction_to(code),
                    .about = alarm->node}};
    if (taper_station_send_message(station, &message, &station->emcy_counter[alarm->bus], now_ms)) {
        alarm->sent = (uint8_t)taper_min_i32(alarm->sent + 1, FIRST_COUNT);
        alarm->next_ms = now_ms + (alarm->sent < FIRST_COUNT ? FIRST_GAP_ms : LATER_GAP_ms);
    }
}

void taper_alarm_update(taper_station_t *station, uint32_t now_ms) {
    for (unsigned k = 0; k < TAPER_ALARMS; k++) {
        taper_alarm_t *alarm = &station->alarm[k];
        if (alarm->code == 0) {
            continue;
        }
        if (alarm->sent > 0 && taper_elapsed_ms(now_ms, alarm->raised_ms) >= OVER_ms) {
            *alarm = (taper_alarm_t){0};
        } else if (taper_time_reached(now_ms, alarm->next_ms)) {
            send_alarm(station, alarm, now_ms);
        }
    }
}
