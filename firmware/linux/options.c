#include "options.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "arguments.h"
#include "taper/stations.h"
#include "taper/version.h"

#define LONGEST_NAME    15 // of a network interface
#define UNKNOWN_STATION UINT32_MAX

const char *argp_program_version = "taper-station " TAPER_VERSION;

static const char description[] =
    "Run a charging station on CAN: hear connectors and gateway, plan, and tell every connector its current."
    "\v"
    "STOP: SIGTERM or SIGINT tells every connector to use its fallback current, and ends with exit code 0. "
    "SIGHUP is ignored.\n"
    "\n"
    "LOG: one line per event on stderr, in logfmt. Under systemd the service manager is told when the "
    "station is "
    "ready, what it does, and that it is alive (Type=notify, WatchdogSec=).\n"
    "\n"
    "RECORDING: all frames taken and sent, as candump -l writes them, and in FILE.station the options in "
    "force and when it began. Times are the station's own, in whole milliseconds. taper-sim --replay-log "
    "FILE "
    "runs a station on it again. What is there of these names is kept as FILE.old and FILE.station.old. A "
    "FILE that is a pipe or a device gets the frames only.\n"
    "\n"
    "TIME SCALE: batteries, departures, the wall clock, planning steps, and what vehicles and limits need "
    "time "
    "for run S times faster than the bus, whose periods and timeouts stay as they are. For simulated "
    "vehicles "
    "only.\n"
    "\n"
    "EXIT CODE: 0 stopped, 1 could not start or go on, 2 bad command line.\n";

enum {
    KEY_CAN = 256,
    KEY_STATION,
    KEY_LIMIT,
    KEY_FAILSAFE,
    KEY_TICK,
    KEY_SCALE,
    KEY_ITERATIONS,
    KEY_NO_PLANNER,
    KEY_RECORD,
    KEY_STORE,
    KEY_LOG_LEVEL,
};

static const struct argp_option options[] = {
    {"can", KEY_CAN, "IFACE", 0, "CAN interface; once for each bus of the station, bus 0 first", 0},
    {"station", KEY_STATION, "NAME", 0, "Station to be", 0},
    {"limit-kw", KEY_LIMIT, "X", 0, "Lower the site limit to this [kW] (default: the station's own)", 0},
    {"failsafe-kw", KEY_FAILSAFE, "X", 0,
     "Lower the limit while the gateway is silent to this [kW] (default: the station's own)", 0},
    {"tick-ms", KEY_TICK, "N", 0, "Control tick [ms], 20..1000 (default: the station's own, 1000)", 0},
    {"time-scale", KEY_SCALE, "S", 0, "Simulation: run S times faster, 1..1000 (default: 1; see below)", 0},
    {"iterations", KEY_ITERATIONS, "N", 0,
     "Solver iterations in a control tick, 1..500; fewer than 10 bound its work (default: 50; 500 if the "
     "tick stands for 10 s or more)",
     0},
    {"no-planner", KEY_NO_PLANNER, NULL, 0, "Charge by earliest deadline first", 0},
    {"record", KEY_RECORD, "FILE", 0, "Record all frames in this file (see below)", 0},
    {"store", KEY_STORE, "FILE", 0, "Keep what outlives a restart in FILE.0, FILE.1 (default: nowhere)", 0},
    {"log-level", KEY_LOG_LEVEL, "L", 0, "error, warning, info or debug (default: info)", 0},
    {0},
};

/** Where the parser puts things. */
typedef struct {
    taper_options_t *chosen;
    taper_made_t *made;
} target_t;

/** Add the names that this program knows to the help. */
static char *add_names(int key, const char *text, void *input) {
    (void)input;
    return taper_argument_with_names(text, key == KEY_STATION ? taper_argument_station_names() : NULL);
}

static void add_interface(taper_options_t *chosen, const char *name, struct argp_state *state) {
    if (name[0] == '\0' || strlen(name) > LONGEST_NAME) {
        argp_error(state, "--can: not the name of a network interface: '%s'", name);
    }
    if (chosen->interface_count == TAPER_SOCKETCAN_BUSES) {
        argp_error(state, "--can: more than %d buses", TAPER_SOCKETCAN_BUSES);
        return;
    }
    for (unsigned i = 0; i < chosen->interface_count; i++) {
        if (strcmp(chosen->interfaces[i], name) == 0) {
            argp_error(state, "--can: '%s' is given twice", name);
        }
    }
    chosen->interfaces[chosen->interface_count++] = name;
}

/** What can only be checked when all options are known. */
static void finish(const target_t *target, struct argp_state *state) {
    const taper_options_t *chosen = target->chosen;
    char reason[160];
    if (chosen->setup.station == UNKNOWN_STATION) {
        argp_error(state, "--station is needed: one of %s", taper_argument_station_names());
        return;
    }
    if (chosen->interface_count == 0) {
        argp_error(state, "--can is needed, such as --can can0");
    }
    const taper_station_config_t *station = taper_stations[chosen->setup.station];
    const unsigned buses = taper_setup_buses(station);
    if (buses != chosen->interface_count) {
        argp_error(state, "--can: station %s has %u bus%s, not %u", station->name, buses,
                   buses == 1 ? "" : "es", (unsigned)chosen->interface_count);
    }
    if (!taper_setup_make(&chosen->setup, target->made, reason, sizeof reason)) {
        argp_error(state, "%s", reason);
    }
}

static void set_level(taper_options_t *chosen, const char *name, struct argp_state *state) {
    if (!taper_log_find_level(name, &chosen->log_level)) {
        argp_error(state, "--log-level: not one of error, warning, info, debug: '%s'", name);
    }
}

static uint16_t whole(const char *option, const char *text, uint16_t low, uint16_t high,
                      struct argp_state *state) {
    return (uint16_t)taper_argument_whole(option, text, low, high, state);
}

static error_t parse(int key, char *text, struct argp_state *state) {
    const target_t *target = state->input;
    taper_options_t *chosen = target->chosen;
    taper_setup_t *setup = &chosen->setup;
    switch (key) {
    case KEY_CAN: add_interface(chosen, text, state); break;
    case KEY_STATION: setup->station = taper_argument_station("--station", text, state); break;
    case KEY_LIMIT: setup->limit_kw = taper_argument_not_negative("--limit-kw", text, state); break;
    case KEY_FAILSAFE: setup->failsafe_kw = taper_argument_not_negative("--failsafe-kw", text, state); break;
    case KEY_TICK:
        setup->tick_ms = whole("--tick-ms", text, TAPER_SETUP_TICK_MIN_ms, TAPER_SETUP_TICK_MAX_ms, state);
        break;
    case KEY_SCALE: setup->time_scale = whole("--time-scale", text, 1, TAPER_MAX_TIME_SCALE, state); break;
    case KEY_ITERATIONS:
        setup->iterations = whole("--iterations", text, 1, TAPER_MAX_ITERATIONS, state);
        break;
    case KEY_NO_PLANNER: setup->no_planner = true; break;
    case KEY_RECORD: chosen->record = text; break;
    case KEY_STORE: chosen->store = text; break;
    case KEY_LOG_LEVEL: set_level(chosen, text, state); break;
    case ARGP_KEY_ARG: argp_error(state, "unexpected argument '%s'", text); break;
    case ARGP_KEY_END: finish(target, state); break;
    default: return ARGP_ERR_UNKNOWN;
    }
    return 0;
}

void taper_options_parse(int argc, char **argv, taper_options_t *chosen, taper_made_t *made) {
    static const struct argp parser = {
        .options = options, .parser = parse, .doc = description, .help_filter = add_names};
    target_t target = {.chosen = chosen, .made = made};
    *chosen = (taper_options_t){.setup = taper_setup_default(UNKNOWN_STATION), .log_level = TAPER_LOG_INFO};
    argp_err_exit_status = TAPER_EXIT_USAGE;
    // Every error of ours ends the program inside; what is left is memory that argp could not get.
    if (argp_parse(&parser, argc, argv, 0, NULL, &target) != 0) {
        exit(TAPER_EXIT_USAGE);
    }
}
