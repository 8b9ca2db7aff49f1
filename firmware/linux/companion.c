#define _GNU_SOURCE // PATH_MAX, strsep

#include "companion.h"

#include <errno.h>
#include <inttypes.h>
#include <limits.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "arguments.h"
#include "taper/stations.h"
#include "taper/version.h"
#include "whole_file.h"

#define US_PER_MS 1000
/** Year 5138: as late as a line of a CAN log. */
#define LATEST_us UINT64_C(100000000000000000)

enum {
    KEY_FORMAT,
    KEY_VERSION,
    KEY_STATION,
    KEY_LIMIT,
    KEY_FAILSAFE,
    KEY_TICK,
    KEY_SCALE,
    KEY_ITERATIONS,
    KEY_PLANNER,
    KEY_START,
    KEY_BUS,
};

#define KEYS (KEY_BUS + TAPER_COMPANION_BUSES)

static const char *const names[KEYS] = {
    [KEY_FORMAT] = "format",       [KEY_VERSION] = "version",
    [KEY_STATION] = "station",     [KEY_LIMIT] = "limit_W",
    [KEY_FAILSAFE] = "failsafe_W", [KEY_TICK] = "tick_ms",
    [KEY_SCALE] = "time_scale",    [KEY_ITERATIONS] = "iterations",
    [KEY_PLANNER] = "planner",     [KEY_START] = "start_us",
    [KEY_BUS] = "bus_0",           [KEY_BUS + 1] = "bus_1",
    [KEY_BUS + 2] = "bus_2",       [KEY_BUS + 3] = "bus_3",
};

taper_companion_t taper_companion_of(const taper_made_t *made, unsigned station, uint64_t start_us,
                                     const char *const *interfaces, unsigned buses) {
    taper_companion_t companion = {
        .version = TAPER_VERSION,
        .station = station,
        .limit_W = made->config.groups[0].limit_W,
        .failsafe_W = made->config.failsafe_W,
        .tick_ms = made->tick_ms,
        .time_scale = made->options.time_scale,
        .iterations = made->options.iterations_per_tick,
        .planner = made->options.solver != NULL,
        .start_us = start_us,
        .buses = buses,
    };
    for (unsigned i = 0; i < buses; i++) {
        (void)snprintf(companion.interface[i], sizeof companion.interface[i], "%s", interfaces[i]);
    }
    return companion;
}

size_t taper_companion_format(const taper_companion_t *companion, char text[TAPER_COMPANION_TEXT]) {
    int length = snprintf(
        text, TAPER_COMPANION_TEXT,
        "format=%d\nversion=%s\nstation=%s\nlimit_W=%" PRId32 "\nfailsafe_W=%" PRId32 "\ntick_ms=%" PRIu32
        "\ntime_scale=%u\niterations=%u\nplanner=%s\nstart_us=%" PRIu64 "\n",
        TAPER_COMPANION_FORMAT, companion->version, taper_stations[companion->station]->name,
        companion->limit_W, companion->failsafe_W, companion->tick_ms, (unsigned)companion->time_scale,
        (unsigned)companion->iterations, companion->planner ? "yes" : "no", companion->start_us);
    for (unsigned i = 0; i < companion->buses; i++) {
        length += snprintf(text + length, (size_t)(TAPER_COMPANION_TEXT - length), "%s=%s\n",
                           names[KEY_BUS + i], companion->interface[i]);
    }
    return (size_t)length;
}

/** The lines by their keys. */
typedef struct {
    const char *value[KEYS]; /**< NULL: not given */
    unsigned line[KEYS];
    unsigned lines;
    char *reason;
    size_t reason_size;
} reader_t;

__attribute__((format(printf, 4, 5))) static bool refuse(const reader_t *reader, unsigned line,
                                                         const char *key, const char *format, ...) {
    va_list arguments;
    const int length = snprintf(reader->reason, reader->reason_size, "%u: %.40s: ", line, key);
    va_start(arguments, format);
    if (length >= 0 && (size_t)length < reader->reason_size) {
        (void)vsnprintf(reader->reason + length, reader->reason_size - (size_t)length, format, arguments);
    }
    va_end(arguments);
    return false;
}

static bool refuse_value(const reader_t *reader, unsigned key, const char *expected) {
    return refuse(reader, reader->line[key], names[key], "not %s: '%.40s'", expected, reader->value[key]);
}

static bool refuse_missing(const reader_t *reader, unsigned key) {
    return refuse(reader, reader->lines + 1, names[key], "missing");
}

static bool whole(const reader_t *reader, unsigned key, uint64_t low, uint64_t high, uint64_t *value) {
    const char *text = reader->value[key];
    char *end = NULL;
    char expected[80];
    if (text == NULL) {
        return refuse_missing(reader, key);
    }
    errno = 0;
    *value = strtoull(text, &end, 10);
    if (text[0] >= '0' && text[0] <= '9' && *end == '\0' && errno == 0 && *value >= low && *value <= high) {
        return true;
    }
    (void)snprintf(expected, sizeof expected, "a whole number in %" PRIu64 "..%" PRIu64, low, high);
    return refuse_value(reader, key, expected);
}

/** A newer format may be told by its first line alone: what else is in it is not for this program to judge. */
static bool check_format(const reader_t *reader) {
    uint64_t format = 0;
    if (!whole(reader, KEY_FORMAT, 1, UINT32_MAX, &format)) {
        return false;
    }
    return format <= TAPER_COMPANION_FORMAT ||
           refuse(reader, 1, names[KEY_FORMAT],
                  "%" PRIu64 " is newer than what this program knows, %d: replay it with a newer one", format,
                  TAPER_COMPANION_FORMAT);
}

static bool take_line(reader_t *reader, char *text) {
    char *value = strchr(text, '=');
    unsigned key = 0;
    reader->lines++;
    if (value == NULL) {
        return refuse(reader, reader->lines, text, "not KEY=VALUE");
    }
    *value++ = '\0';
    while (key < KEYS && strcmp(names[key], text) != 0) {
        key++;
    }
    if (reader->lines == 1 && key != KEY_FORMAT) {
        return refuse(reader, 1, names[KEY_FORMAT], "missing: it is the first line");
    }
    if (key == KEYS) {
        return refuse(reader, reader->lines, text, "unknown key");
    }
    if (reader->value[key] != NULL) {
        return refuse(reader, reader->lines, text, "given in line %u before", reader->line[key]);
    }
    reader->value[key] = value;
    reader->line[key] = reader->lines;
    return key != KEY_FORMAT || check_format(reader);
}

static bool take_lines(reader_t *reader, char *text) {
    while (text != NULL && *text != '\0') {
        if (!take_line(reader, strsep(&text, "\n"))) {
            return false;
        }
    }
    return true;
}

/** Something of at most `size` - 1 characters. */
static bool read_word(const reader_t *reader, unsigned key, char *word, size_t size) {
    const char *text = reader->value[key];
    if (text == NULL) {
        return refuse_missing(reader, key);
    }
    if (text[0] == '\0' || strlen(text) >= size || strpbrk(text, " \t\r") != NULL) {
        return refuse_value(reader, key, key == KEY_VERSION ? "a version" : "the name of an interface");
    }
    (void)snprintf(word, size, "%s", text);
    return true;
}

static bool read_station(const reader_t *reader, taper_companion_t *companion) {
    if (reader->value[KEY_STATION] == NULL) {
        return refuse_missing(reader, KEY_STATION);
    }
    companion->station = taper_argument_find_station(reader->value[KEY_STATION]);
    if (companion->station < taper_station_count) {
        return true;
    }
    char *known = taper_argument_station_names();
    (void)refuse(reader, reader->line[KEY_STATION], names[KEY_STATION],
                 "unknown station '%.40s'; there are %s", reader->value[KEY_STATION],
                 known != NULL ? known : "others");
    free(known);
    return false;
}

static bool read_planner(const reader_t *reader, taper_companion_t *companion) {
    if (reader->value[KEY_PLANNER] == NULL) {
        return refuse_missing(reader, KEY_PLANNER);
    }
    companion->planner = strcmp(reader->value[KEY_PLANNER], "yes") == 0;
    if (!companion->planner && strcmp(reader->value[KEY_PLANNER], "no") != 0) {
        return refuse_value(reader, KEY_PLANNER, "yes or no");
    }
    return !companion->planner || taper_setup_solver(companion->station) != NULL ||
           refuse(reader, reader->line[KEY_PLANNER], names[KEY_PLANNER], "this build has none");
}

static bool read_limits(const reader_t *reader, taper_companion_t *companion) {
    const taper_station_config_t *station = taper_stations[companion->station];
    uint64_t limit_W = 0;
    uint64_t failsafe_W = 0;
    if (!whole(reader, KEY_LIMIT, 0, (uint64_t)station->groups[0].limit_W, &limit_W)) {
        return false;
    }
    const uint64_t most_W = (uint64_t)station->failsafe_W < limit_W ? (uint64_t)station->failsafe_W : limit_W;
    if (!whole(reader, KEY_FAILSAFE, 0, most_W, &failsafe_W)) {
        return false;
    }
    companion->limit_W = (int32_t)limit_W;
    companion->failsafe_W = (int32_t)failsafe_W;
    return true;
}

static bool read_times(const reader_t *reader, taper_companion_t *companion) {
    uint64_t tick_ms = 0;
    uint64_t scale = 0;
    uint64_t iterations = 0;
    if (!whole(reader, KEY_TICK, TAPER_SETUP_TICK_MIN_ms, TAPER_SETUP_TICK_MAX_ms, &tick_ms) ||
        !whole(reader, KEY_SCALE, 1, TAPER_MAX_TIME_SCALE, &scale) ||
        !whole(reader, KEY_ITERATIONS, 1, TAPER_MAX_ITERATIONS, &iterations) ||
        !whole(reader, KEY_START, 0, LATEST_us, &companion->start_us)) {
        return false;
    }
    companion->tick_ms = (uint32_t)tick_ms;
    companion->time_scale = (uint16_t)scale;
    companion->iterations = (uint16_t)iterations;
    return companion->start_us % US_PER_MS == 0 || refuse_value(reader, KEY_START, "a whole millisecond");
}

static bool read_buses(const reader_t *reader, taper_companion_t *companion) {
    const taper_station_config_t *station = taper_stations[companion->station];
    companion->buses = taper_setup_buses(station);
    for (unsigned i = 0; i < TAPER_COMPANION_BUSES; i++) {
        const unsigned key = KEY_BUS + i;
        if (i < companion->buses) {
            if (!read_word(reader, key, companion->interface[i], sizeof companion->interface[i])) {
                return false;
            }
        } else if (reader->value[key] != NULL) {
            return refuse(reader, reader->line[key], names[key], "station %s has no such bus", station->name);
        }
    }
    return true;
}

bool taper_companion_parse(char *text, taper_companion_t *companion, char *reason, size_t reason_size) {
    reader_t reader = {.reason = reason, .reason_size = reason_size};
    memset(companion, 0, sizeof *companion);
    return take_lines(&reader, text) && (reader.lines > 0 || refuse_missing(&reader, KEY_FORMAT)) &&
           read_word(&reader, KEY_VERSION, companion->version, sizeof companion->version) &&
           read_station(&reader, companion) && read_limits(&reader, companion) &&
           read_times(&reader, companion) && read_planner(&reader, companion) &&
           read_buses(&reader, companion);
}

bool taper_companion_write(const taper_companion_t *companion, const char *recording) {
    char file[PATH_MAX];
    char text[TAPER_COMPANION_TEXT];
    if ((size_t)snprintf(file, sizeof file, "%s.station", recording) >= sizeof file) {
        errno = ENAMETOOLONG;
        return false;
    }
    const size_t length = taper_companion_format(companion, text);
    return taper_whole_file_write(file, text, length, 0644);
}

/** The text of a file; one that is too long for a companion, or no text, is no companion. @return why not, or NULL. */
static const char *read_text(FILE *stream, char text[TAPER_COMPANION_TEXT]) {
    const size_t length = fread(text, 1, TAPER_COMPANION_TEXT, stream);
    if (ferror(stream)) {
        return strerror(errno);
    }
    if (length == TAPER_COMPANION_TEXT || memchr(text, '\0', length) != NULL) {
        return "not the companion of a recording";
    }
    text[length] = '\0';
    return NULL;
}

taper_companion_verdict_t taper_companion_read(const char *recording, taper_companion_t *companion,
                                               char *reason, size_t reason_size) {
    char text[TAPER_COMPANION_TEXT] = "";
    char file[PATH_MAX];
    char why[256];
    if ((size_t)snprintf(file, sizeof file, "%s.station", recording) >= sizeof file) {
        return TAPER_COMPANION_NONE;
    }
    FILE *stream = fopen(file, "r");
    if (stream == NULL && errno == ENOENT) {
        return TAPER_COMPANION_NONE;
    }
    const char *unreadable = stream == NULL ? strerror(errno) : read_text(stream, text);
    if (stream != NULL) {
        (void)fclose(stream);
    }
    if (unreadable == NULL && taper_companion_parse(text, companion, why, sizeof why)) {
        return TAPER_COMPANION_GOOD;
    }
    (void)snprintf(reason, reason_size, "%s:%s%s", file, unreadable != NULL ? " " : "",
                   unreadable != NULL ? unreadable : why);
    return TAPER_COMPANION_BAD;
}
