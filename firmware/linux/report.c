#include "report.h"

#include <inttypes.h>
#include <stdio.h>
#include <string.h>

#include "events.h"

/** Trouble of a bus is told at most so often. */
#define PORTS_ms   1000U
#define SUMMARY_ms 60000U

static unsigned count_active(const taper_snapshot_t *snapshot) {
    unsigned active = 0;
    for (unsigned i = 0; i < snapshot->count; i++) {
        active += snapshot->demand[i].active ? 1 : 0;
    }
    return active;
}

static void tell_status(taper_report_t *report, const taper_reported_t *about) {
    const taper_station_t *station = about->station;
    char status[sizeof report->status];
    (void)snprintf(status, sizeof status, "STATUS=%s, limit %.1f kW, %u active",
                   taper_mode_name((uint8_t)taper_station_mode(station)),
                   taper_station_site_limit_W(station) / 1000.0, count_active(&station->snapshot));
    if (strcmp(status, report->status) != 0) {
        memcpy(report->status, status, sizeof status);
        taper_notify_say(about->board->notify, status);
    }
}

static bool is_worse(const taper_socketcan_counters_t *now, const taper_socketcan_counters_t *last) {
    return now->kernel_drops != last->kernel_drops || now->queue_drops != last->queue_drops ||
           now->send_refused != last->send_refused || now->bus_off != last->bus_off ||
           now->downs != last->downs || now->restarts != last->restarts;
}

/** A line if something got worse since the last, and one if the bus came or went. */
static void report_bus(taper_report_t *report, const taper_reported_t *about, uint8_t bus) {
    const taper_socketcan_counters_t *now = taper_socketcan_counters(about->can, bus);
    const taper_port_t *port = about->board->can;
    const bool off = port->bus_is_off(port->context, bus);
    if (is_worse(now, &report->counters[bus])) {
        taper_log(TAPER_LOG_WARNING, "port",
                  "bus=%u interface=%s kernel_drops=%" PRIu32 " queue_drops=%" PRIu32 " send_refused=%" PRIu32
                  " bus_off=%" PRIu32 " downs=%" PRIu32 " restarts=%" PRIu32,
                  (unsigned)bus, about->interfaces[bus], now->kernel_drops, now->queue_drops,
                  now->send_refused, now->bus_off, now->downs, now->restarts);
    }
    if (off != report->off[bus]) {
        taper_log(off ? TAPER_LOG_ERROR : TAPER_LOG_INFO, off ? "port_off" : "port_back",
                  "bus=%u interface=%s", (unsigned)bus, about->interfaces[bus]);
    }
    report->counters[bus] = *now;
    report->off[bus] = off;
}

static void report_files(taper_report_t *report, const taper_board_t *board) {
    if (board->store_errors != report->store_errors) {
        taper_log_text(TAPER_LOG_ERROR, "store_error", "file", board->store);
        report->store_errors = board->store_errors;
    }
    if (board->record != NULL && board->record->error != report->record_error) {
        report->record_error = board->record->error;
        taper_log_text(TAPER_LOG_ERROR, "record_error", "reason", strerror(report->record_error));
    }
}

void taper_report_summary(const taper_reported_t *about) {
    static const char *const names[] = {
        [TAPER_COUNTER_FRAMES_RECEIVED] = "frames_received",
        [TAPER_COUNTER_FRAMES_SENT] = "frames_sent",
        [TAPER_COUNTER_FRAMES_UNKNOWN] = "frames_unknown",
        [TAPER_COUNTER_CRC_ERRORS] = "crc_errors",
        [TAPER_COUNTER_FRAMES_REPEATED] = "frames_repeated",
        [TAPER_COUNTER_FRAMES_LOST] = "frames_lost",
        [TAPER_COUNTER_FRAMES_UNTRUSTED] = "frames_untrusted",
        [TAPER_COUNTER_FRAMES_BABBLED] = "frames_babbled",
        [TAPER_COUNTER_BAD_FIELDS] = "bad_fields",
        [TAPER_COUNTER_RECEIVE_OVERFLOWS] = "receive_overflows",
        [TAPER_COUNTER_SEND_REFUSED] = "send_refused",
        [TAPER_COUNTER_BUS_OFF] = "bus_off",
        [TAPER_COUNTER_PLANS] = "plans",
        [TAPER_COUNTER_PLANS_REJECTED] = "plans_rejected",
        [TAPER_COUNTER_FALLBACK_TICKS] = "fallback_ticks",
        [TAPER_COUNTER_GUARD_VIOLATIONS] = "guard_violations",
        [TAPER_COUNTER_CLOCK_JUMPS] = "clock_jumps",
        [TAPER_COUNTER_SOC_JUMPS] = "soc_jumps",
        [TAPER_COUNTER_PARAMETERS_REPAIRED] = "parameters_repaired",
        [TAPER_COUNTER_TRANSFERS] = "transfers",
        [TAPER_COUNTER_TRANSFERS_REFUSED] = "transfers_refused",
        [TAPER_COUNTER_TICK_OVERRUNS] = "tick_overruns",
        [TAPER_COUNTER_SETPOINT_FLIPS] = "setpoint_flips",
        [TAPER_COUNTER_PLANNER_OFFS] = "planner_offs",
        [TAPER_COUNTER_OVER_DRAWS] = "over_draws",
        [TAPER_COUNTER_LOCKOUTS] = "lockouts",
        [TAPER_COUNTER_LIMIT_FLAPS] = "limit_flaps",
        [TAPER_COUNTER_STRANGERS] = "strangers",
        [TAPER_COUNTER_LIMITS_NEGATIVE] = "limits_negative",
    };
    _Static_assert(sizeof names / sizeof names[0] == TAPER_COUNTERS, "each counter has a name");
    char counters[960] = "";
    size_t used = 0;
    for (unsigned i = 0; i < TAPER_COUNTERS && used < sizeof counters; i++) {
        used += (size_t)snprintf(counters + used, sizeof counters - used, " %s=%" PRIu32, names[i],
                                 taper_station_counter(about->station, (taper_counter_t)i));
    }
    taper_log(TAPER_LOG_INFO, "summary",
              "mode=%s limit_W=%" PRId32 " active=%u%s missed_ticks=%" PRIu64 " log_dropped=%" PRIu32,
              taper_mode_name((uint8_t)taper_station_mode(about->station)),
              taper_station_site_limit_W(about->station), count_active(&about->station->snapshot), counters,
              about->missed_ticks, taper_log_dropped());
}

void taper_report(taper_report_t *report, const taper_reported_t *about) {
    const uint64_t now_ms = about->board->now_ms;
    tell_status(report, about);
    report_files(report, about->board);
    if (now_ms - report->ports_ms >= PORTS_ms) {
        report->ports_ms = now_ms;
        for (uint8_t bus = 0; bus < about->interface_count; bus++) {
            report_bus(report, about, bus);
        }
    }
    if (now_ms - report->summary_ms >= SUMMARY_ms) {
        report->summary_ms = now_ms;
        taper_report_summary(about);
    }
}
