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

typedef struct {
    uint32_t time_ms;   /**< station's clock */
    uint32_t unix_s;    /**< wall clock, 0: never set */
    int32_t data;       /**< depends on the code */
    uint8_t code;       /**< taper_event_code_t */
    uint8_t bus, node;  /**< whom it is about; node 0: the station */
} taper_event_t;

typedef struct {
    taper_event_t event[TAPER_EVENTS];
    uint32_t count; /**< ever noted; the last min(count, TAPER_EVENTS) are in the ring, at index % TAPER_EVENTS */
} taper_event_log_t;

#endif
