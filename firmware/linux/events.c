#include "events.h"

#include <inttypes.h>
#include <stdio.h>

// The compiler holds this switch to the codes: one that is missing is an error (-Wswitch). So is a wrong name.
#define KIND(code, level, data)                                                           \
    case TAPER_EVENT_##code: return (taper_event_kind_t) { #code, TAPER_LOG_##level, data \
        }

taper_event_kind_t taper_event_kind(uint8_t code) {
    switch ((taper_event_code_t)code) {
        KIND(STARTED, INFO, "starts");
        KIND(STOPPED, INFO, NULL);
        KIND(MODE, INFO, "mode");
        KIND(CONNECTOR_LOST, WARNING, NULL);
        KIND(CONNECTOR_BACK, INFO, NULL);
        KIND(BAD_FRAMES, WARNING, NULL);
        KIND(BABBLING, WARNING, NULL);
        KIND(TWO_CONTROLLERS, ERROR, NULL);
        KIND(BUS_OFF, ERROR, "bus");
        KIND(BUS_BACK, INFO, NULL);
        KIND(SEND_BLOCKED, ERROR, NULL);
        KIND(GATEWAY_LOST, WARNING, NULL);
        KIND(GATEWAY_BACK, INFO, NULL);
        KIND(METER_LOST, WARNING, NULL);
        KIND(METER_BACK, INFO, NULL);
        KIND(CLOCK_SET, INFO, "seconds");
        KIND(VERSION, WARNING, "version");
        KIND(REPAIRED, WARNING, NULL);
        KIND(ROTATION, WARNING, NULL);
        KIND(BAD_FIELD, WARNING, "function");
        KIND(SOC_JUMP, WARNING, "soc_permille");
        KIND(SESSION_BEGUN, INFO, "session");
        KIND(SESSION_ENDED, INFO, "session");
        KIND(CURVE_SET, INFO, "points");
        KIND(TRANSFER_REFUSED, WARNING, "data");
        KIND(STORE_OLD_COPY, WARNING, "record");
        KIND(STORE_RESET, ERROR, "record");
        KIND(EMCY_HEARD, WARNING, "code");
        KIND(LIMIT_NEGATIVE, WARNING, "limit_W");
        KIND(GUARD, ERROR, "fallback");
        KIND(IDENTIFIED, INFO, NULL);
        KIND(PLANNER_OFF, WARNING, "verdict");
        KIND(PLANNER_ON, INFO, NULL);
        KIND(TICK_OVERRUN, WARNING, "ms");
        KIND(SETPOINT_FLIP, ERROR, NULL);
        KIND(OVER_DRAW, WARNING, "dA");
        KIND(LOCKED_OUT, WARNING, NULL);
        KIND(PRICE_SET, INFO, "points");
        KIND(LIMIT_FLAPS, WARNING, "before_W");
        KIND(QUEUED, WARNING, "place");
        KIND(SESSION_RESUMED, INFO, "session");
    }
    return (taper_event_kind_t){NULL, TAPER_LOG_WARNING, "data"};
}

const char *taper_mode_name(uint8_t mode) {
    switch ((taper_mode_t)mode) {
    case TAPER_MODE_INIT: return "init";
    case TAPER_MODE_PLAN: return "plan";
    case TAPER_MODE_FALLBACK: return "fallback";
    case TAPER_MODE_FAILSAFE: return "failsafe";
    }
    return "unknown";
}

/** The code's name as in taper/bus.h, in small letters; "code-N" for one that this program does not know. */
static void print_name(char *text, size_t size, const taper_event_kind_t *kind, uint8_t code) {
    if (kind->name == NULL) {
        (void)snprintf(text, size, "code-%u", (unsigned)code);
        return;
    }
    size_t i = 0;
    for (; kind->name[i] != '\0' && i + 1 < size; i++) {
        const char c = kind->name[i];
        text[i] = (char)(c >= 'A' && c <= 'Z' ? c - 'A' + 'a' : c);
    }
    text[i] = '\0';
}

/** The identifier itself is for the log as well: who was there is what people look for later. */
static void print_identifier(const taper_station_t *station, const taper_event_t *event, char *text,
                             size_t size) {
    const int connector = taper_session_connector(station->options.config, event->bus, event->node);
    (void)snprintf(text, size, "bus=%u node=%u identifier=\"%s\"", (unsigned)event->bus,
                   (unsigned)event->node,
                   connector < 0 ? "" : taper_transfers_identifier(&station->transfers, (uint8_t)connector));
}

static void log_event(const taper_station_t *station, const taper_event_t *event, uint32_t now_ms) {
    const taper_event_kind_t kind = taper_event_kind(event->code);
    char name[32];
    char about[96] = "";
    int used = 0;
    print_name(name, sizeof name, &kind, event->code);
    if (event->node != 0) {
        used = snprintf(about, sizeof about, "bus=%u node=%u", (unsigned)event->bus, (unsigned)event->node);
    }
    if (event->code == TAPER_EVENT_IDENTIFIED) {
        print_identifier(station, event, about, sizeof about);
    } else if (event->code == TAPER_EVENT_MODE) {
        (void)snprintf(about, sizeof about, "mode=%s limit_W=%" PRId32, taper_mode_name((uint8_t)event->data),
                       taper_station_site_limit_W(station));
    } else if (kind.data != NULL) {
        (void)snprintf(about + used, sizeof about - (size_t)used, "%s%s=%" PRId32, used > 0 ? " " : "",
                       kind.data, event->data);
    }
    taper_log_past(kind.level, taper_elapsed_ms(now_ms, event->time_ms), name, "%s", about);
}

void taper_events_log(const taper_station_t *station, uint32_t *seen, uint32_t now_ms) {
    const taper_event_log_t *log = taper_station_events(station);
    const uint32_t fresh = log->count - *seen;
    if (fresh > TAPER_EVENTS) {
        taper_log(TAPER_LOG_WARNING, "events_lost", "count=%" PRIu32, fresh - TAPER_EVENTS);
        *seen = log->count - TAPER_EVENTS;
    }
    for (; *seen != log->count; ++*seen) {
        log_event(station, &log->event[*seen % TAPER_EVENTS], now_ms);
    }
}
