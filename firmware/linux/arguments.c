#define _GNU_SOURCE // asprintf, open_memstream

#include "arguments.h"

#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "taper/stations.h"

double taper_argument_not_negative(const char *option, const char *text, struct argp_state *state) {
    char *end = NULL;
    const double value = strtod(text, &end);
    if (text[0] == '\0' || *end != '\0' || !isfinite(value)) {
        argp_error(state, "%s: not a number: '%s'", option, text);
    }
    if (value < 0.0) {
        argp_error(state, "%s: below 0: %s", option, text);
    }
    return fabs(value); // no -0
}

uint64_t taper_argument_whole(const char *option, const char *text, uint64_t low, uint64_t high,
                              struct argp_state *state) {
    char *end = NULL;
    errno = 0;
    const uint64_t value = strtoull(text, &end, 10);
    if (text[0] < '0' || text[0] > '9' || *end != '\0' || errno != 0 || value < low || value > high) {
        argp_error(state, "%s: not a whole number in %llu..%llu: '%s'", option, (unsigned long long)low,
                   (unsigned long long)high, text);
    }
    return value;
}

unsigned taper_argument_find_station(const char *name) {
    unsigned i = 0;
    while (i < taper_station_count && strcmp(taper_stations[i]->name, name) != 0) {
        i++;
    }
    return i;
}

unsigned taper_argument_station(const char *option, const char *name, struct argp_state *state) {
    const unsigned i = taper_argument_find_station(name);
    if (i == taper_station_count) {
        argp_error(state, "%s: unknown station '%s'; there are %s", option, name,
                   taper_argument_station_names());
    }
    return i;
}

char *taper_argument_station_names(void) {
    char *names = NULL;
    size_t size = 0;
    FILE *stream = open_memstream(&names, &size);
    for (unsigned i = 0; stream != NULL && i < taper_station_count; i++) {
        fprintf(stream, "%s%s", i == 0 ? "" : ", ", taper_stations[i]->name);
    }
    return stream != NULL && fclose(stream) == 0 ? names : NULL;
}

char *taper_argument_with_names(const char *text, char *names) {
    char *longer = NULL;
    if (names != NULL && asprintf(&longer, "%s: %s", text, names) < 0) {
        longer = NULL;
    }
    free(names);
    return longer != NULL ? longer : (char *)text;
}
