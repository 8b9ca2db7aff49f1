#define _GNU_SOURCE // gmtime_r

#include "log.h"

#include <poll.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

/** Longest line. Below PIPE_BUF, so that poll() tells whether it fits into a pipe as a whole. */
#define LINE     1024
#define US_PER_S UINT64_C(1000000)

static const struct {
    const char *name;
    int priority; // of syslog
} levels[] = {
    [TAPER_LOG_ERROR] = {"error", 3},
    [TAPER_LOG_WARNING] = {"warning", 4},
    [TAPER_LOG_INFO] = {"info", 6},
    [TAPER_LOG_DEBUG] = {"debug", 7},
};

// One process has one stderr.
static struct {
    taper_log_level_t most;
    bool priorities;
    uint32_t dropped;
} state = {.most = TAPER_LOG_INFO};

bool taper_log_find_level(const char *name, taper_log_level_t *level) {
    for (unsigned i = 0; i < sizeof levels / sizeof levels[0]; i++) {
        if (strcmp(levels[i].name, name) == 0) {
            *level = (taper_log_level_t)i;
            return true;
        }
    }
    return false;
}

void taper_log_open(taper_log_level_t most) {
    state.most = most;
    state.priorities = getenv("JOURNAL_STREAM") != NULL;
    state.dropped = 0;
}

uint64_t taper_log_wall_us(void) {
    struct timespec now;
    (void)clock_gettime(CLOCK_REALTIME, &now);
    return (uint64_t)now.tv_sec * US_PER_S + (uint64_t)now.tv_nsec / 1000;
}

uint32_t taper_log_dropped(void) {
    return state.dropped;
}

/** RFC 3339, UTC, milliseconds. */
static void format_time(char text[32], uint64_t time_us) {
    _Static_assert(sizeof(time_t) == 8, "dates after 2038");
    const time_t seconds = (time_t)(time_us / US_PER_S);
    struct tm parts;
    char day[24];
    (void)gmtime_r(&seconds, &parts);
    (void)strftime(day, sizeof day, "%Y-%m-%dT%H:%M:%S", &parts);
    (void)snprintf(text, 32, "%s.%03uZ", day, (unsigned)(time_us % US_PER_S / 1000));
}

static void put(const char *line, size_t length) {
    struct pollfd out = {.fd = STDERR_FILENO, .events = POLLOUT};
    if (poll(&out, 1, 0) != 1 || write(STDERR_FILENO, line, length) != (ssize_t)length) {
        state.dropped += state.dropped != UINT32_MAX ? 1 : 0;
    }
}

static void put_line(taper_log_level_t level, uint32_t age_ms, const char *event, const char *format,
                     va_list values) {
    char when[32];
    char line[LINE];
    format_time(when, taper_log_wall_us() - (uint64_t)age_ms * 1000);
    int used = state.priorities ? snprintf(line, sizeof line, "<%d>", levels[level].priority) : 0;
    used += snprintf(line + used, sizeof line - (size_t)used, "ts=%s level=%s event=%s%s", when,
                     levels[level].name, event, format[0] == '\0' ? "" : " ");
    used += vsnprintf(line + used, sizeof line - (size_t)used, format, values);
    size_t length = used < LINE - 1 ? (size_t)used : LINE - 2;
    length -= line[length - 1] == ' ' ? 1 : 0; // nothing more to say
    line[length] = '\n';
    put(line, length + 1);
}

void taper_log(taper_log_level_t level, const char *event, const char *format, ...) {
    va_list values;
    va_start(values, format);
    if (level <= state.most) {
        put_line(level, 0, event, format, values);
    }
    va_end(values);
}

void taper_log_past(taper_log_level_t level, uint32_t age_ms, const char *event, const char *format, ...) {
    va_list values;
    va_start(values, format);
    if (level <= state.most) {
        put_line(level, age_ms, event, format, values);
    }
    va_end(values);
}

void taper_log_text(taper_log_level_t level, const char *event, const char *key, const char *text) {
    char quoted[LINE / 2];
    size_t used = 0;
    for (; *text != '\0' && used < sizeof quoted - 3; text++) {
        if (*text == '"' || *text == '\\') {
            quoted[used++] = '\\';
        }
        quoted[used++] = (unsigned char)*text < ' ' ? ' ' : *text;
    }
    quoted[used] = '\0';
    taper_log(level, event, "%s=\"%s\"", key, quoted);
}
