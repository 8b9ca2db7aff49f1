/** The command line of taper-ev. */
#ifndef SIM_EV_OPTIONS_H
#define SIM_EV_OPTIONS_H

#include <stdbool.h>
#include <stdint.h>

#include "exit_codes.h"
#include "taper/socketcan.h"
#include "taper/types.h"

/** Strings are borrowed from the command line. */
typedef struct {
    const char *interfaces[TAPER_SOCKETCAN_BUSES];
    uint8_t interface_count;
    const char *sessions_file;
    const char *price_file; /**< NULL: none */
    const char *limit_file; /**< NULL: none */
    const char *out;        /**< NULL: no files */
    unsigned station;       /**< index in taper_stations[]; taper_station_count: found on the bus */
    double limit_kw;        /**< negative: not given */
    uint32_t time_scale;
    bool some_connectors; /**< only those of `played` */
    bool played[TAPER_MAX_CONNECTORS];
    unsigned last_played; /**< the highest of them, from 1 */
    bool no_gateway, no_taper, stay;
    uint64_t seed;
} ev_options_t;

/** Read the command line. Prints and ends the program on --help (0) and on what it does not understand (2). */
ev_options_t ev_options_parse(int argc, char **argv);

#endif
