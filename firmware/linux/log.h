/**
 * The daemon's log: one line per event on stderr, in logfmt.
 *
 *     ts=2026-05-01T12:00:00.123Z level=info event=mode mode=plan limit_W=110000
 *
 * Under journald (JOURNAL_STREAM is set) each line begins with its syslog priority, "<6>". A reader who does not read
 * never holds the station up: what does not fit into the pipe is dropped, and counted.
 */
#ifndef TAPER_LINUX_LOG_H
#define TAPER_LINUX_LOG_H

#include <stdbool.h>
#include <stdint.h>

typedef enum {
    TAPER_LOG_ERROR,
    TAPER_LOG_WARNING,
    TAPER_LOG_INFO,
    TAPER_LOG_DEBUG,
} taper_log_level_t;

/** @return whether `name` is that of a level ("error", "warning", "info", "debug"). */
bool taper_log_find_level(const char *name, taper_log_level_t *level);

/** Lines above `most` are left out. */
void taper_log_open(taper_log_level_t most);

/** A line, now. @param format the rest of the line, logfmt pairs; "" for none */
__attribute__((format(printf, 3, 4))) void taper_log(taper_log_level_t level, const char *event,
                                                     const char *format, ...);

/** A line about something `age_ms` ago. */
__attribute__((format(printf, 4, 5))) void taper_log_past(taper_log_level_t level, uint32_t age_ms,
                                                          const char *event, const char *format, ...);

/** A line with one value that may be any text: it is quoted. */
void taper_log_text(taper_log_level_t level, const char *event, const char *key, const char *text);

/** Lines that were dropped. */
uint32_t taper_log_dropped(void);

/** Wall clock [us since 1970]. */
uint64_t taper_log_wall_us(void);

#endif
