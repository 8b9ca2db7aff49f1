#define _POSIX_C_SOURCE 200809L

/**
 * taper-ev: the field of a station - connector controllers, vehicles, energy gateway - on CAN interfaces of Linux.
 * `taper-ev --help` is the manual.
 */
#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "ev_options.h"
#include "ev_wait.h"
#include "field.h"
#include "memory.h"
#include "output.h"
#include "taper/stations.h"

/** Steps of steps.csv and connectors.csv, in the world's time. */
#define RECORD_S 60
/** How often the line on a terminal changes. */
#define SHOW_ms             500
#define FIRST_NODE_ID(kind) ((uint16_t)((kind) << 6))
#define ALL_NODES           0x7C0
#define ONE_NODE            0x7FF

typedef struct {
    const ev_options_t *options;
    const taper_station_config_t *station;
    taper_socketcan_t can;
    taper_port_t port;
    sim_sessions_t sessions;
    sim_course_t limits; /**< count 0: none */
    sim_course_t prices; /**< likewise */
    sim_results_t results;
    sim_field_t field;
    int64_t recorded_s; /**< last step that was recorded */
    uint32_t shown_ms;
    bool on_terminal;
} ev_t;

static bool open_buses(ev_t *ev) {
    static const taper_socketcan_filter_t filters[] = {
        {FIRST_NODE_ID(TAPER_MESSAGE_SETPOINT), ALL_NODES},
        {FIRST_NODE_ID(TAPER_MESSAGE_CTRL_STATUS), ALL_NODES},
        {FIRST_NODE_ID(TAPER_MESSAGE_CTRL_DIAG), ALL_NODES},
        {FIRST_NODE_ID(TAPER_MESSAGE_OUTLOOK), ALL_NODES},
        {FIRST_NODE_ID(TAPER_MESSAGE_ISOTP_TO) | TAPER_NODE_GATEWAY, ONE_NODE},
    };
    const taper_socketcan_options_t options = {.interfaces = ev->options->interfaces,
                                               .count = ev->options->interface_count,
                                               .filters = filters,
                                               .filter_count = sizeof filters / sizeof filters[0],
                                               .now_ms = ev_now_ms};
    char reason[200];
    if (!taper_socketcan_open(&ev->can, &options, reason, sizeof reason)) {
        fprintf(stderr, "taper-ev: %s\n", reason);
        return false;
    }
    ev->port = taper_socketcan_port(&ev->can);
    return true;
}

/** Read what does not depend on the station, before anybody waits for it. */
static bool load(ev_t *ev) {
    const ev_options_t *options = ev->options;
    const unsigned most = options->station < taper_station_count
                              ? taper_stations[options->station]->connector_count
                              : TAPER_MAX_CONNECTORS;
    return sim_sessions_load(&ev->sessions, options->sessions_file, most) &&
           (options->price_file == NULL || sim_prices_load(&ev->prices, options->price_file)) &&
           (options->out == NULL || sim_output_check(options->out));
}

static bool has_limit(const ev_options_t *options) {
    return options->limit_file != NULL || options->limit_kw >= 0.0;
}

/** Sessions that name a connector of another process are left to it. */
static void leave_others(ev_t *ev) {
    sim_sessions_t *sessions = &ev->sessions;
    size_t kept = 0;
    for (size_t i = 0; i < sessions->count; i++) {
        const unsigned connector = sessions->session[i].connector;
        if (connector == 0 || ev->options->played[connector - 1]) {
            sessions->session[kept++] = sessions->session[i];
        } else {
            free(sessions->session[i].id);
        }
    }
    sessions->count = kept;
}

/** Now that the station is known: its limits, and whose sessions are played. */
static bool fit_to_station(ev_t *ev) {
    const ev_options_t *options = ev->options;
    for (size_t i = 0; i < ev->sessions.count; i++) {
        if (ev->sessions.session[i].connector > ev->station->connector_count) {
            fprintf(stderr, "%s: session %s: station %s has %u connectors\n", options->sessions_file,
                    ev->sessions.session[i].id, ev->station->name, ev->station->connector_count);
            return false;
        }
    }
    if (options->some_connectors) {
        leave_others(ev);
    }
    return !has_limit(options) || sim_limits_choose(&ev->limits, options->limit_file, options->limit_kw,
                                                    ev->station->groups[0].limit_W / 1000.0);
}

static double first_arrival_s(const sim_sessions_t *sessions) {
    double first_s = (double)INFINITY;
    for (size_t i = 0; i < sessions->count; i++) {
        first_s = fmin(first_s, sessions->session[i].arrival_s);
    }
    return isfinite(first_s) ? floor(first_s / 60.0) * 60.0 : 0.0;
}

static void start_field(ev_t *ev, bool *closed) {
    const ev_options_t *options = ev->options;
    for (unsigned i = 0; i < ev->station->connector_count; i++) {
        closed[i] = options->some_connectors && !options->played[i];
    }
    const sim_field_options_t field = {.station = ev->station,
                                       .port = &ev->port,
                                       .sessions = &ev->sessions,
                                       .outcome = ev->results.outcome,
                                       .limits = has_limit(options) ? &ev->limits : NULL,
                                       .prices = options->price_file != NULL ? &ev->prices : NULL,
                                       .closed = closed,
                                       .world_start_s = first_arrival_s(&ev->sessions),
                                       .time_scale = options->time_scale,
                                       .tells_taper = !options->no_taper,
                                       .no_gateway = options->no_gateway,
                                       .seed = options->seed};
    sim_field_init(&ev->field, &field, ev_now_ms(NULL));
    ev->recorded_s = INT64_MIN;
}

static unsigned count_active(const sim_field_t *field) {
    unsigned active = 0;
    for (unsigned i = 0; i < field->options.station->connector_count; i++) {
        active += sim_evse_wants(&field->evse[i]) ? 1 : 0;
    }
    return active;
}

static void record_connector(ev_t *ev, int64_t step_s, unsigned i) {
    const sim_evse_t *evse = &ev->field.evse[i];
    const sim_connector_row_t row = {
        .time_s = step_s,
        .connector = i,
        .evse = evse,
        .soc = sim_evse_soc(evse),
        .current_A = evse->current_A,
        .outlook = sim_watch_outlook(&ev->field.watch, evse->config->bus, evse->config->node)};
    sim_results_connector(&ev->results, &row);
}

static void record(ev_t *ev) {
    const sim_field_t *field = &ev->field;
    const int64_t step_s = (int64_t)floor(sim_field_world_s(field)) / RECORD_S * RECORD_S;
    ev->results.peak_kw = fmax(ev->results.peak_kw, field->tracker.drawn_kw);
    if (step_s == ev->recorded_s) {
        return;
    }
    ev->recorded_s = step_s;
    const double limit_kw = fmin(sim_field_limit_kw(field), ev->station->groups[0].limit_W / 1000.0);
    sim_results_step(&ev->results, step_s, limit_kw, field->tracker.drawn_kw, count_active(field),
                     field->watch.mode);
    for (unsigned i = 0; i < ev->station->connector_count; i++) {
        if (field->evse[i].vehicle != NULL) {
            record_connector(ev, step_s, i);
        }
    }
}

/** A line for who watches. */
static void show(ev_t *ev) {
    const uint32_t now_ms = ev_now_ms(NULL);
    if (!ev->on_terminal || taper_elapsed_ms(now_ms, ev->shown_ms) < SHOW_ms) {
        return;
    }
    ev->shown_ms = now_ms;
    const int64_t passed_s = (int64_t)(sim_field_world_s(&ev->field) - ev->field.options.world_start_s);
    fprintf(stderr, "\rtaper-ev: %3d h %02d min, %u vehicles want %.1f kW\033[K", (int)(passed_s / 3600),
            (int)(passed_s / 60 % 60), count_active(&ev->field), ev->field.tracker.drawn_kw);
    fflush(stderr);
}

static void play(ev_t *ev, int timer) {
    bool on = true;
    while (on && (ev->options->stay || !sim_field_is_over(&ev->field))) {
        on = ev_wait_period(timer);
        sim_field_poll(&ev->field, ev_now_ms(NULL));
        record(ev);
        show(ev);
    }
    if (ev->on_terminal) {
        fputs("\r\033[K", stderr);
    }
    sim_field_finish(&ev->field);
}

static void fill_results(ev_t *ev) {
    sim_results_t *results = &ev->results;
    sim_watch_t *watch = &ev->field.watch;
    results->policy = "live";
    results->station = ev->station->name;
    results->tick_s = RECORD_S;
    results->seed = ev->options->seed;
    results->violation_ticks = ev->field.tracker.drawn.times;
    results->fallback_ticks = watch->fallback_reports;
    results->solves = watch->plans;
    results->guard_violations = watch->guard_violations;
    results->iterations = watch->iterations;
    watch->iterations = (sim_samples_t){0};
}

static void print_excess(const char *what, const sim_excess_t *excess) {
    if (excess->times > 0) {
        printf("%s above a limit %u times, %.1f s in all, first after %.1f s; at worst by %.3f kW\n", what,
               excess->times, (double)excess->ms / 1000.0, (double)excess->first_ms / 1000.0,
               excess->worst_kw);
    }
}

/** Play, and put the results out. @return the exit code of the program. */
static int run(ev_t *ev, int timer) {
    bool closed[TAPER_MAX_CONNECTORS];
    int code = SIM_EXIT_INPUT;
    sim_results_init(&ev->results, &ev->sessions, ev->options->out != NULL);
    start_field(ev, closed);
    play(ev, timer);
    fill_results(ev);
    if (ev->options->out == NULL || sim_results_write(&ev->results, ev->options->out)) {
        sim_results_print(&ev->results, stdout);
        print_excess("drawn", &ev->field.tracker.drawn);
        print_excess("allowed", &ev->field.tracker.may);
        if (ev->field.send_refused > 0) {
            printf("the bus took %u frames only at a later try, or never\n", ev->field.send_refused);
        }
        code = ev->results.violation_ticks > 0 ? SIM_EXIT_VIOLATION : SIM_EXIT_OK;
    }
    sim_field_free(&ev->field);
    sim_results_free(&ev->results);
    return code;
}

/** @return the exit code of the program. */
static int wait_and_run(ev_t *ev) {
    const int timer = ev_wait_init();
    if (timer < 0) {
        fprintf(stderr, "taper-ev: no timer: %s\n", strerror(errno));
        return SIM_EXIT_INPUT;
    }
    bool failed = false;
    int code = SIM_EXIT_INPUT;
    const unsigned station = ev_wait_for_controller(timer, &ev->port, ev->options, &failed);
    if (station < taper_station_count) {
        ev->station = taper_stations[station];
        code = fit_to_station(ev) ? run(ev, timer) : SIM_EXIT_INPUT;
    } else if (!failed) {
        code = SIM_EXIT_OK; // told to end before it began
    }
    (void)close(timer);
    return code;
}

int main(int argc, char **argv) {
    const ev_options_t options = ev_options_parse(argc, argv);
    ev_t *ev = sim_allocate(1, sizeof *ev);
    ev->options = &options;
    ev->on_terminal = isatty(STDERR_FILENO) == 1;
    int code = SIM_EXIT_INPUT;
    if (load(ev) && open_buses(ev)) {
        code = wait_and_run(ev);
        taper_socketcan_close(&ev->can);
    }
    sim_sessions_free(&ev->sessions);
    sim_course_free(&ev->limits);
    sim_course_free(&ev->prices);
    free(ev);
    return fflush(stdout) == 0 ? code : SIM_EXIT_INPUT;
}
