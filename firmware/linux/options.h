/** The command line of taper-station. */
#ifndef TAPER_LINUX_OPTIONS_H
#define TAPER_LINUX_OPTIONS_H

#include "log.h"
#include "setup.h"
#include "taper/socketcan.h"

/** Exit codes. */
enum {
    TAPER_EXIT_OK = 0,
    TAPER_EXIT_FAILURE = 1,
    TAPER_EXIT_USAGE = 2,
};

/** Strings are borrowed from the command line. */
typedef struct {
    taper_setup_t setup;
    const char *interfaces[TAPER_SOCKETCAN_BUSES]; /**< bus 0 first */
    uint8_t interface_count;
    const char *record; /**< NULL: none */
    const char *store;  /**< NULL: none */
    taper_log_level_t log_level;
} taper_options_t;

/**
 * Read the command line, and make the station of it. Prints and ends the program on --help and --version (0) and on what it
 * does not understand (2).
 */
void taper_options_parse(int argc, char **argv, taper_options_t *chosen, taper_made_t *made);

#endif
