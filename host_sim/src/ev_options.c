#include "ev_options.h"

#include <argp.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "arguments.h"
#include "taper/station.h"
#include "taper/stations.h"

static const char description[] =
    "Play the field of a charging station on CAN: connector controllers, their vehicles, and the energy "
    "gateway, as "
    "nodes of the station bus with its periods. The controller is another program, or a board."
    "\v"
    "It waits until a controller sends setpoints, and takes the built-in station with these connectors. The "
    "time of the "
    "world then begins at the first arrival, rounded down to a minute; the gateway tells it as Unix time. It "
    "ends with "
    "the last departure, or on SIGINT or SIGTERM with the results so far.\n"
    "\n"
    "TIME SCALE: periods, timeouts and validities on the bus stay as they are; arrivals, departures, "
    "batteries, limits "
    "and the clock run N times faster. The controller needs the same option. At 600 a day takes 144 s.\n"
    "\n"
    "SESSIONS CSV, LIMIT CSV and PRICE CSV: as in taper-sim --help. The courses of limit and price are sent "
    "ahead (ISO-TP), and again when the controller restarts.\n"
    "\n"
    "CONNECTORS: numbers and ranges, such as 1,4-8. Other processes play the others; sessions that name one "
    "of these are "
    "left to them, sessions that name none are all played here. One process only should play the gateway.\n"
    "\n"
    "OUTPUT in DIR: summary.json, sessions.csv, steps.csv, connectors.csv as from taper-sim, the latter two "
    "each minute "
    "of the world. What only the controller knows comes from its frames: mode, plans, iterations; solve_ms "
    "is 0. "
    "limit_violations counts how often the power rose above a limit. After a fall of the limit the old one "
    "counts for "
    "2.5 s more.\n"
    "\n"
    "EXIT CODE: 0 good, 1 bad input or no such interface, 2 bad command line, 3 a limit was exceeded.\n";

enum {
    KEY_CAN = 256,
    KEY_SESSIONS,
    KEY_STATION,
    KEY_SCALE,
    KEY_LIMIT,
    KEY_LIMIT_CSV,
    KEY_PRICE_CSV,
    KEY_CONNECTORS,
    KEY_NO_GATEWAY,
    KEY_NO_TAPER,
    KEY_OUT,
    KEY_SEED,
    KEY_STAY,
};

static const struct argp_option options[] = {
    {"can", KEY_CAN, "IFACE", 0, "CAN interface; once for each bus of the station, bus 0 first", 0},
    {"sessions", KEY_SESSIONS, "FILE", 0, "Charging sessions to play (CSV, see below)", 0},
    {"station", KEY_STATION, "NAME", 0, "Station whose field it is (default: found on the bus)", 0},
    {"time-scale", KEY_SCALE, "N", 0, "World seconds in a second of the bus, 1..1000 (default: 1)", 0},
    {"limit-kw", KEY_LIMIT, "X", 0, "Site limit that the gateway tells [kW] (default: none)", 0},
    {"limit-csv", KEY_LIMIT_CSV, "FILE", 0, "Site limit over time (CSV, see below)", 0},
    {"price-csv", KEY_PRICE_CSV, "FILE", 0, "Price of energy over time (CSV, see below)", 0},
    {"connectors", KEY_CONNECTORS, "LIST", 0, "Play only these connectors (default: all)", 0},
    {"no-gateway", KEY_NO_GATEWAY, NULL, 0, "Play no energy gateway: no clock, no limit", 0},
    {"no-taper", KEY_NO_TAPER, NULL, 0, "Keep the vehicles' taper back (EV_PARAM_D and E)", 0},
    {"out", KEY_OUT, "DIR", 0,
     "Write the results to this directory, made if missing (default: only print a summary)", 0},
    {"seed", KEY_SEED, "N", 0, "Decides where the end-to-end counters begin (default: 0)", 0},
    {"stay", KEY_STAY, NULL, 0, "Go on after the last departure", 0},
    {0},
};

_Static_assert(TAPER_MAX_TIME_SCALE == 1000, "the help says 1000");

/** Add the names that this program knows to the help. */
static char *add_names(int key, const char *text, void *input) {
    (void)input;
    return taper_argument_with_names(text, key == KEY_STATION ? taper_argument_station_names() : NULL);
}

static void add_interface(ev_options_t *chosen, const char *name, struct argp_state *state) {
    if (chosen->interface_count == TAPER_SOCKETCAN_BUSES) {
        argp_error(state, "--can: more than %d interfaces", TAPER_SOCKETCAN_BUSES);
        return;
    }
    chosen->interfaces[chosen->interface_count++] = name;
}

/** Take one number or range of a list. @return what follows it; NULL: it is none. */
static const char *take_range(ev_options_t *chosen, const char *text) {
    char *end = NULL;
    const unsigned long first = strtoul(text, &end, 10);
    unsigned long last = first;
    if (end == text || *text < '0' || *text > '9') {
        return NULL;
    }
    if (*end == '-') {
        const char *second = end + 1;
        last = strtoul(second, &end, 10);
        if (end == second || *second < '0' || *second > '9') {
            return NULL;
        }
    }
    if (first < 1 || last < first || last > TAPER_MAX_CONNECTORS) {
        return NULL;
    }
    for (unsigned long i = first; i <= last; i++) {
        chosen->played[i - 1] = true;
    }
    chosen->last_played = last > chosen->last_played ? (unsigned)last : chosen->last_played;
    return end;
}

static void set_connectors(ev_options_t *chosen, const char *text, struct argp_state *state) {
    chosen->some_connectors = true;
    const char *rest = take_range(chosen, text);
    while (rest != NULL && *rest == ',') {
        rest = take_range(chosen, rest + 1);
    }
    if (rest == NULL || *rest != '\0') {
        argp_error(state, "--connectors: not a list such as 1,4-8, of connectors in 1..%d: '%s'",
                   TAPER_MAX_CONNECTORS, text);
    }
}

/** What can only be checked when all options are known. */
static void check(const ev_options_t *chosen, struct argp_state *state) {
    const bool limited = chosen->limit_file != NULL || chosen->limit_kw >= 0.0;
    if (chosen->interface_count == 0) {
        argp_error(state, "--can is needed");
    }
    if (chosen->sessions_file == NULL) {
        argp_error(state, "--sessions is needed");
    }
    if (chosen->limit_file != NULL && chosen->limit_kw >= 0.0) {
        argp_error(state, "--limit-kw and --limit-csv exclude each other");
    }
    if (chosen->no_gateway && (limited || chosen->price_file != NULL)) {
        argp_error(state, "--no-gateway: there is nobody then to tell a limit or a price");
    }
    if (chosen->station < taper_station_count &&
        chosen->last_played > taper_stations[chosen->station]->connector_count) {
        argp_error(state, "--connectors: station %s has %u connectors", taper_stations[chosen->station]->name,
                   taper_stations[chosen->station]->connector_count);
    }
}

static error_t parse(int key, char *text, struct argp_state *state) {
    ev_options_t *chosen = state->input;
    switch (key) {
    case KEY_CAN: add_interface(chosen, text, state); break;
    case KEY_SESSIONS: chosen->sessions_file = text; break;
    case KEY_STATION: chosen->station = taper_argument_station("--station", text, state); break;
    case KEY_SCALE:
        chosen->time_scale =
            (uint32_t)taper_argument_whole("--time-scale", text, 1, TAPER_MAX_TIME_SCALE, state);
        break;
    case KEY_LIMIT: chosen->limit_kw = taper_argument_not_negative("--limit-kw", text, state); break;
    case KEY_LIMIT_CSV: chosen->limit_file = text; break;
    case KEY_PRICE_CSV: chosen->price_file = text; break;
    case KEY_CONNECTORS: set_connectors(chosen, text, state); break;
    case KEY_NO_GATEWAY: chosen->no_gateway = true; break;
    case KEY_NO_TAPER: chosen->no_taper = true; break;
    case KEY_OUT: chosen->out = text; break;
    case KEY_SEED: chosen->seed = taper_argument_whole("--seed", text, 0, UINT64_MAX, state); break;
    case KEY_STAY: chosen->stay = true; break;
    case ARGP_KEY_ARG: argp_error(state, "unexpected argument '%s'", text); break;
    case ARGP_KEY_END: check(chosen, state); break;
    default: return ARGP_ERR_UNKNOWN;
    }
    return 0;
}

ev_options_t ev_options_parse(int argc, char **argv) {
    static const struct argp parser = {
        .options = options, .parser = parse, .doc = description, .help_filter = add_names};
    ev_options_t chosen = {.station = taper_station_count, .limit_kw = -1.0, .time_scale = 1};
    argp_err_exit_status = SIM_EXIT_USAGE;
    // Every error of ours ends the program inside; what is left is memory that argp could not get.
    if (argp_parse(&parser, argc, argv, 0, NULL, &chosen) != 0) {
        exit(SIM_EXIT_USAGE);
    }
    return chosen;
}
