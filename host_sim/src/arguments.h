/** What the command lines of the programs have in common. */
#ifndef SIM_ARGUMENTS_H
#define SIM_ARGUMENTS_H

#include <stdint.h>

#include "taper/types.h"

struct argp_state;

/** Exit codes of the programs. */
enum {
    SIM_EXIT_OK = 0,
    SIM_EXIT_INPUT = 1,     /**< a file that cannot be read or written, or says something wrong */
    SIM_EXIT_USAGE = 2,     /**< a command line that makes no sense */
    SIM_EXIT_VIOLATION = 3, /**< the run went through, but a limit was exceeded */
};

/** @return the index of a station in taper_stations[], or taper_station_count. */
unsigned sim_station_find(const char *name);

/** @return the same; argp_error() for a name that is none. */
unsigned sim_argument_station(const char *name, struct argp_state *state);

/** The names of all stations, separated by commas. To be freed. */
char *sim_station_names(void);

/** A number that is not negative; argp_error() for anything else. */
double sim_argument_number(const char *option, const char *text, struct argp_state *state);

/** A whole number in low..high; argp_error() for anything else. */
uint64_t sim_argument_whole(const char *option, const char *text, uint64_t low, uint64_t high,
                            struct argp_state *state);

#endif
