/** The station's events (taper/event.h) as lines of the log. */
#ifndef TAPER_LINUX_EVENTS_H
#define TAPER_LINUX_EVENTS_H

#include "log.h"
#include "taper/station.h"

/** What a code means for people. */
typedef struct {
    const char *name; /**< that of the code in taper/bus.h, in capitals; NULL: no such code */
    taper_log_level_t level;
    const char *data; /**< what `data` of the event is; NULL: nothing */
} taper_event_kind_t;

taper_event_kind_t taper_event_kind(uint8_t code);

/** Name of a mode: "init", "plan", "fallback", "failsafe". */
const char *taper_mode_name(uint8_t mode);

/** Log what was noted since `*seen`, the count of events seen, and move it on. `now_ms` is the station's time. */
void taper_events_log(const taper_station_t *station, uint32_t *seen, uint32_t now_ms);

#endif
