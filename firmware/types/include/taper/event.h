/**
 * What happened, for people: the station's event log. A ring of fixed size; the oldest event gives way.
 * Codes are in `taper/bus.h`: the same in EMCY, in the log dump and in the daemon's log.
 */
#ifndef TAPER_EVENT_H
#define TAPER_EVENT_H

#include <stdint.h>

#include "taper/bus.h"

/** Events kept. A power of two. */
#define TAPER_EVENTS 64u

_Static_assert((TAPER_EVENTS & (TAPER_EVENTS - 1u)) == 0u, "a free-running count wraps at a power of two");

typedef struct {
    uint32_t time_ms;  /**< station's clock */
    uint32_t unix_s;   /**< wall clock, 0: never set */
    int32_t data;      /**< depends on the code */
    uint8_t code;      /**< taper_event_code_t */
    uint8_t bus, node; /**< whom it is about; node 0: the station */
} taper_event_t;

typedef struct {
    taper_event_t event[TAPER_EVENTS];
    uint32_t
        count; /**< ever noted; the last min(count, TAPER_EVENTS) are in the ring, at index % TAPER_EVENTS */
    uint32_t now_ms; /**< time of what is noted next */
    uint32_t unix_s;
} taper_event_log_t;

/** Note an event. Cost: constant. A NULL log keeps nothing. */
static inline void taper_event_note(taper_event_log_t *log, taper_event_code_t code, uint8_t bus,
                                    uint8_t node, int32_t data) {
    if (log != 0) {
        log->event[log->count % TAPER_EVENTS] = (taper_event_t){.time_ms = log->now_ms,
                                                                .unix_s = log->unix_s,
                                                                .data = data,
                                                                .code = (uint8_t)code,
                                                                .bus = bus,
                                                                .node = node};
        log->count++;
    }
}

#endif
