#define _GNU_SOURCE

#include "ev_wait.h"

#include <errno.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/timerfd.h>
#include <time.h>
#include <unistd.h>

#include "taper/stations.h"
#include "watch.h"

/** From the first setpoint on, this is long enough for all of them: they are repeated at least each second. */
#define LISTEN_ms 1200

static volatile sig_atomic_t told_to_end;

static void note_signal(int signal_number) {
    (void)signal_number;
    told_to_end = 1;
}

int ev_wait_init(void) {
    const struct sigaction action = {.sa_handler = note_signal};
    (void)sigaction(SIGINT, &action, NULL);
    (void)sigaction(SIGTERM, &action, NULL);
    const struct itimerspec period = {.it_interval.tv_nsec = EV_POLL_ms * 1000000L,
                                      .it_value.tv_nsec = EV_POLL_ms * 1000000L};
    const int timer = timerfd_create(CLOCK_MONOTONIC, TFD_CLOEXEC);
    if (timer < 0 || timerfd_settime(timer, 0, &period, NULL) != 0) {
        return -1;
    }
    return timer;
}

bool ev_wait_period(int timer) {
    uint64_t periods = 0;
    (void)!read(timer, &periods, sizeof periods); // cut short by a signal at worst
    return told_to_end == 0;
}

uint32_t ev_now_ms(void *unused) {
    (void)unused;
    struct timespec now;
    (void)clock_gettime(CLOCK_MONOTONIC, &now);
    return (uint32_t)((uint64_t)now.tv_sec * 1000U + (uint64_t)now.tv_nsec / 1000000U);
}

static bool listen_out(int timer, const taper_port_t *port, sim_watch_t *watch) {
    uint32_t first_ms = 0;
    while (ev_wait_period(timer)) {
        taper_frame_t frame;
        const bool heard = watch->connectors > 0;
        while (port->receive(port->context, &frame)) {
            sim_watch_take(watch, &frame);
        }
        if (!heard) {
            first_ms = ev_now_ms(NULL);
        } else if (taper_elapsed_ms(ev_now_ms(NULL), first_ms) >= LISTEN_ms) {
            return true;
        }
    }
    return false;
}

/** Whether a station has exactly the connectors that were heard of. */
static bool fits(const taper_station_config_t *station, const sim_watch_t *watch) {
    bool all = station->connector_count == watch->connectors;
    for (unsigned i = 0; i < station->connector_count; i++) {
        const taper_connector_config_t *connector = &station->connectors[i];
        all = all && connector->bus < SIM_WATCH_BUSES && watch->told[connector->bus][connector->node];
    }
    return all;
}

/** Say which stations there are, and how many connectors each has. */
static void list_stations(const char *text, const sim_watch_t *watch, const bool *listed) {
    fprintf(stderr, "taper-ev: the controller sends setpoints to %u connectors%s", watch->connectors, text);
    const char *separator = " ";
    for (unsigned k = 0; k < taper_station_count; k++) {
        if (listed == NULL || listed[k]) {
            fprintf(stderr, "%s%s (%u)", separator, taper_stations[k]->name,
                    taper_stations[k]->connector_count);
            separator = ", ";
        }
    }
    fputs("; choose with --station\n", stderr);
}

static unsigned find_station(const sim_watch_t *watch) {
    bool *listed = calloc(taper_station_count, sizeof *listed);
    unsigned found = taper_station_count;
    unsigned count = 0;
    for (unsigned k = 0; listed != NULL && k < taper_station_count; k++) {
        listed[k] = fits(taper_stations[k], watch);
        found = listed[k] ? k : found;
        count += listed[k] ? 1 : 0;
    }
    if (count == 0) {
        list_stations(", and no built-in station has exactly these; there are", watch, NULL);
    } else if (count > 1) {
        list_stations(", which fits more than one station:", watch, listed);
    }
    free(listed);
    return count == 1 ? found : taper_station_count;
}

static void say_what_for(const ev_options_t *options) {
    fputs("taper-ev: waiting for a controller on", stderr);
    for (unsigned i = 0; i < options->interface_count; i++) {
        fprintf(stderr, " %s", options->interfaces[i]);
    }
    fputc('\n', stderr);
}

unsigned ev_wait_for_controller(int timer, const taper_port_t *port, const ev_options_t *options,
                                bool *failed) {
    sim_watch_t watch = {0};
    unsigned station = taper_station_count;
    say_what_for(options);
    if (listen_out(timer, port, &watch)) {
        station = options->station < taper_station_count ? options->station : find_station(&watch);
        *failed = station == taper_station_count;
        if (!*failed && !fits(taper_stations[station], &watch)) {
            fprintf(stderr,
                    "taper-ev: note: the controller sends setpoints to other connectors than %s has\n",
                    taper_stations[station]->name);
        }
        if (!*failed && options->last_played > taper_stations[station]->connector_count) {
            fprintf(stderr, "taper-ev: --connectors: station %s has %u connectors\n",
                    taper_stations[station]->name, taper_stations[station]->connector_count);
            *failed = true;
        }
    }
    sim_watch_free(&watch);
    return *failed ? taper_station_count : station;
}
