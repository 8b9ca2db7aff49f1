/** Values of command line options. What is wrong ends the program with argp_error(): the option, the reason, the value. */
#ifndef TAPER_LINUX_ARGUMENTS_H
#define TAPER_LINUX_ARGUMENTS_H

#include <argp.h>
#include <stdint.h>

/** A finite number that is not negative. */
double taper_argument_not_negative(const char *option, const char *text, struct argp_state *state);

/** A whole number in [low, high], in decimal digits. */
uint64_t taper_argument_whole(const char *option, const char *text, uint64_t low, uint64_t high,
                              struct argp_state *state);

/** The index of a station in taper_stations[]. */
unsigned taper_argument_station(const char *option, const char *name, struct argp_state *state);

/** The index of a station in taper_stations[], or taper_station_count: there is none of that name. */
unsigned taper_argument_find_station(const char *name);

/** The names of all stations, separated by commas. To be freed. */
char *taper_argument_station_names(void);

/** For argp's help filter: "TEXT: NAMES", to be freed by argp, or `text` itself without names. Frees `names`. */
char *taper_argument_with_names(const char *text, char *names);

#endif
