#define _GNU_SOURCE // ppoll

#include "daemon.h"

#include <errno.h>
#include <inttypes.h>
#include <poll.h>
#include <signal.h>
#include <stdio.h>
#include <string.h>
#include <time.h>

#include "board.h"
#include "events.h"
#include "report.h"
#include "taper/stations.h"
#include "taper/version.h"

_Static_assert(TAPER_COMPANION_BUSES >= TAPER_SOCKETCAN_BUSES, "a companion must hold all interfaces");

typedef struct {
    const taper_options_t *options;
    uint64_t start_us;      /**< CLOCK_MONOTONIC at station time 0 */
    uint64_t start_wall_us; /**< wall clock then */
    uint32_t tick_ms;
    uint64_t missed_ticks;
    taper_socketcan_t can;
    taper_port_t can_port, port;
    taper_notify_t notify;
    taper_record_t record;
    taper_board_t board;
    taper_station_t station;
    taper_report_t report;
    uint32_t events_seen;
    sigset_t awake_mask; /**< signals blocked while asleep */
} daemon_t;

// Too large for a stack, and there is one per process.
static daemon_t the_daemon;
static volatile sig_atomic_t stop_asked;

static void ask_to_stop(int signal_number) {
    (void)signal_number;
    stop_asked = 1;
}

/** The stop signals arrive only while the daemon sleeps, so that none is missed between a look and the sleep. */
static void set_signals(daemon_t *daemon) {
    const struct sigaction stop = {.sa_handler = ask_to_stop};
    const struct sigaction ignore = {.sa_handler = SIG_IGN};
    sigset_t stops;
    (void)sigemptyset(&stops);
    (void)sigaddset(&stops, SIGTERM);
    (void)sigaddset(&stops, SIGINT);
    (void)sigprocmask(SIG_BLOCK, &stops, &daemon->awake_mask);
    (void)sigdelset(&daemon->awake_mask, SIGTERM);
    (void)sigdelset(&daemon->awake_mask, SIGINT);
    (void)sigaction(SIGTERM, &stop, NULL);
    (void)sigaction(SIGINT, &stop, NULL);
    (void)sigaction(SIGHUP, &ignore, NULL);
    (void)sigaction(SIGPIPE, &ignore, NULL);
}

static uint64_t now_ms(const daemon_t *daemon) {
    return (taper_board_steady_us() - daemon->start_us) / 1000;
}

/** The clock of the received frames. */
static uint32_t station_ms(void *context) {
    return (uint32_t)now_ms(context);
}

/**
 * Sleep until `due_ms`. The CAN sockets are not waited on: a wake-up for every frame would cost more than all the rest,
 * and the kernel keeps frames for much longer than a poll's interval.
 */
static void sleep_until(const daemon_t *daemon, uint64_t due_ms, bool stoppable) {
    const uint64_t due_us = daemon->start_us + due_ms * 1000;
    uint64_t left_us;
    do {
        const uint64_t steady_us = taper_board_steady_us();
        left_us = due_us > steady_us ? due_us - steady_us : 0;
        const struct timespec left = {.tv_sec = (time_t)(left_us / 1000000),
                                      .tv_nsec = (long)(left_us % 1000000) * 1000};
        // With nothing left, too: a daemon that is always late must still hear that it should stop.
        (void)ppoll(NULL, 0, &left, stoppable ? &daemon->awake_mask : NULL);
    } while (left_us > 0 && !(stoppable && stop_asked));
}

static bool fail(const char *what, const char *reason) {
    taper_log_text(TAPER_LOG_ERROR, what, "reason", reason);
    return false;
}

#define FUNCTION(name)   {TAPER_MESSAGE_##name << 6, 0x7C0}
#define GATEWAY_ID(name) {TAPER_MESSAGE_##name << 6 | TAPER_NODE_GATEWAY, 0x7FF}

/** What the station listens to. SETPOINT and CTRL_STATUS are its own to send: heard, they come from a second controller. */
static const taper_socketcan_filter_t filters[] = {
    FUNCTION(EMCY),        GATEWAY_ID(SITE_LIMIT), FUNCTION(SETPOINT),     FUNCTION(EVSE_STATUS),
    FUNCTION(EV_STATUS),   FUNCTION(EVSE_ELEC),    GATEWAY_ID(SITE_METER), GATEWAY_ID(TIME_SYNC),
    FUNCTION(CTRL_STATUS), FUNCTION(EV_PARAM_A),   FUNCTION(EV_PARAM_B),   FUNCTION(EV_PARAM_C),
    FUNCTION(EV_PARAM_D),  FUNCTION(EV_PARAM_E),   FUNCTION(EVSE_INFO),    FUNCTION(ISOTP_FROM),
};

static bool open_can(daemon_t *daemon, const taper_options_t *options) {
    char reason[256] = "";
    const taper_socketcan_options_t can = {.interfaces = options->interfaces,
                                           .count = options->interface_count,
                                           .filters = filters,
                                           .filter_count = sizeof filters / sizeof filters[0],
                                           .now_ms = station_ms,
                                           .clock_context = daemon};
    if (!taper_socketcan_open(&daemon->can, &can, reason, sizeof reason)) {
        return fail("can_failed", reason);
    }
    daemon->can_port = taper_socketcan_port(&daemon->can);
    return true;
}

static bool open_record(daemon_t *daemon, const taper_options_t *options, const taper_made_t *made) {
    if (options->record == NULL) {
        return true;
    }
    // Whole milliseconds: so are all times in the recording.
    const uint64_t start_us = daemon->start_wall_us / 1000 * 1000;
    const taper_companion_t companion = taper_companion_of(made, options->setup.station, start_us,
                                                           options->interfaces, options->interface_count);
    if (!taper_record_open(&daemon->record, options->record, &companion)) {
        char reason[512];
        (void)snprintf(reason, sizeof reason, "--record: %s: %s", options->record, strerror(errno));
        return fail("record_failed", reason);
    }
    return true;
}

static bool open_station(daemon_t *daemon, const taper_options_t *options, taper_made_t *made) {
    taper_board_init(&daemon->board, &daemon->can_port, options->record != NULL ? &daemon->record : NULL,
                     &daemon->notify, options->store);
    daemon->port = taper_board_port(&daemon->board);
    daemon->tick_ms = made->tick_ms;
    made->options.port = &daemon->port;
    if (taper_station_init(&daemon->station, &made->options) != TAPER_OK) {
        return fail("station_refused", "the firmware refuses the station with these options");
    }
    return true;
}

static void log_start(const taper_options_t *options, const taper_made_t *made) {
    taper_log(TAPER_LOG_INFO, "start",
              "version=%s station=%s connectors=%u buses=%u limit_W=%" PRId32 " failsafe_W=%" PRId32
              " tick_ms=%" PRIu32 " time_scale=%u iterations=%u planner=%s",
              TAPER_VERSION, made->config.name, (unsigned)made->config.connector_count,
              (unsigned)options->interface_count, made->config.groups[0].limit_W, made->config.failsafe_W,
              made->tick_ms, (unsigned)made->options.time_scale, (unsigned)made->options.iterations_per_tick,
              made->options.solver != NULL ? "yes" : "no");
    if (made->options.solver == NULL && !options->setup.no_planner) {
        taper_log(TAPER_LOG_WARNING, "no_planner",
                  "reason=\"this build has none; charging by earliest deadline first\"");
    }
}

static taper_reported_t reported(const daemon_t *daemon) {
    return (taper_reported_t){.station = &daemon->station,
                              .can = &daemon->can,
                              .interfaces = daemon->options->interfaces,
                              .interface_count = daemon->options->interface_count,
                              .board = &daemon->board,
                              .missed_ticks = daemon->missed_ticks};
}

static void tick(daemon_t *daemon, uint64_t time_ms) {
    taper_station_step(&daemon->station, (uint32_t)time_ms);
    const taper_reported_t about = reported(daemon);
    if (time_ms == 0) {
        taper_notify_say(&daemon->notify, "READY=1");
    }
    taper_report(&daemon->report, &about);
}

/** One call of the station, at a time of the grid. */
static void call_station(daemon_t *daemon, uint64_t time_ms) {
    taper_board_set_time(&daemon->board, time_ms);
    if (time_ms % daemon->tick_ms == 0) {
        tick(daemon, time_ms);
    } else {
        taper_station_poll(&daemon->station, (uint32_t)time_ms);
    }
    taper_events_log(&daemon->station, &daemon->events_seen, (uint32_t)time_ms);
    if (daemon->board.record != NULL) {
        taper_record_flush(&daemon->record);
    }
}

/** The call after that at `time_ms`. Polls that are late are made up for; ticks that are late by a tick are left out. */
static uint64_t next_call(daemon_t *daemon, uint64_t time_ms) {
    const uint64_t next_ms = taper_setup_next_ms(time_ms, daemon->tick_ms);
    const uint64_t last_tick_ms = now_ms(daemon) / daemon->tick_ms * daemon->tick_ms;
    if (last_tick_ms < next_ms + daemon->tick_ms) {
        return next_ms;
    }
    const uint64_t first_missed = (next_ms + daemon->tick_ms - 1) / daemon->tick_ms;
    const uint64_t missed = last_tick_ms / daemon->tick_ms - first_missed;
    daemon->missed_ticks += missed;
    taper_log(TAPER_LOG_WARNING, "overrun", "missed_ticks=%" PRIu64 " total=%" PRIu64, missed,
              daemon->missed_ticks);
    return last_tick_ms;
}

/** Tell all connectors, often enough that a lost frame does no harm. */
static void stop(daemon_t *daemon) {
    taper_notify_say(&daemon->notify, "STOPPING=1");
    uint64_t time_ms = now_ms(daemon);
    time_ms = time_ms > daemon->board.now_ms ? time_ms : daemon->board.now_ms + 1;
    for (unsigned i = 0; i < TAPER_SETUP_STOPS; i++, time_ms += TAPER_SETUP_STOP_ms) {
        sleep_until(daemon, time_ms, false);
        taper_board_set_time(&daemon->board, time_ms);
        taper_station_stop(&daemon->station, (uint32_t)time_ms);
    }
    taper_events_log(&daemon->station, &daemon->events_seen, (uint32_t)daemon->board.now_ms);
    const taper_reported_t about = reported(daemon);
    taper_report_summary(&about);
}

static void run(daemon_t *daemon) {
    uint64_t time_ms = 0;
    call_station(daemon, time_ms);
    while (!stop_asked) {
        time_ms = next_call(daemon, time_ms);
        sleep_until(daemon, time_ms, true);
        if (!stop_asked) {
            call_station(daemon, time_ms);
        }
    }
    stop(daemon);
}

int taper_daemon_run(const taper_options_t *options, taper_made_t *made) {
    daemon_t *daemon = &the_daemon;
    daemon->options = options;
    taper_log_open(options->log_level);
    set_signals(daemon);
    taper_notify_open(&daemon->notify);
    // The station first: it takes its time, and station time 0 should be now.
    if (!open_station(daemon, options, made)) {
        return TAPER_EXIT_FAILURE;
    }
    daemon->start_us = taper_board_steady_us();
    daemon->start_wall_us = taper_log_wall_us();
    if (!open_can(daemon, options)) {
        return TAPER_EXIT_FAILURE;
    }
    if (!open_record(daemon, options, made)) {
        taper_socketcan_close(&daemon->can);
        return TAPER_EXIT_FAILURE;
    }
    log_start(options, made);
    run(daemon);
    if (options->record != NULL) {
        taper_record_close(&daemon->record);
    }
    taper_log(TAPER_LOG_INFO, "stop", "reason=signal");
    taper_socketcan_close(&daemon->can);
    taper_notify_close(&daemon->notify);
    return TAPER_EXIT_OK;
}
