/**
 * FILE.station, the companion of a recording FILE: that it is the station's own, and what a replay needs besides the frames.
 *
 *     format=1                   of this file; the first line
 *     version=0.1.0              of the program
 *     station=hub
 *     limit_W=80000              in force, as all that follows
 *     failsafe_W=11000
 *     tick_ms=1000               on the bus
 *     time_scale=1
 *     iterations=50              in a control tick
 *     planner=yes                or no
 *     start_us=1436509052249000  wall clock at station time 0
 *     bus_0=can0                 one for each bus
 *
 * All keys must be there, once each. A key more makes a new format.
 */
#ifndef TAPER_LINUX_COMPANION_H
#define TAPER_LINUX_COMPANION_H

#include "candump.h"
#include "setup.h"

#define TAPER_COMPANION_FORMAT 1
#define TAPER_COMPANION_BUSES  4
/** Longest text that is written or read, with the closing NUL. */
#define TAPER_COMPANION_TEXT 1024
#define TAPER_COMPANION_WORD 32

typedef struct {
    char version[TAPER_COMPANION_WORD];
    unsigned station; /**< index in taper_stations[] */
    int32_t limit_W;
    int32_t failsafe_W;
    uint32_t tick_ms; /**< on the bus */
    uint16_t time_scale;
    uint16_t iterations;
    bool planner;
    uint64_t start_us;
    char interface[TAPER_COMPANION_BUSES][TAPER_CANDUMP_NAME]; /**< [bus] */
    unsigned buses;
} taper_companion_t;

typedef enum {
    TAPER_COMPANION_GOOD,
    TAPER_COMPANION_NONE, /**< there is no such file */
    TAPER_COMPANION_BAD,
} taper_companion_verdict_t;

/** Of the station as it was made by this program. @param interfaces [buses] names, at most TAPER_COMPANION_BUSES */
taper_companion_t taper_companion_of(const taper_made_t *made, unsigned station, uint64_t start_us,
                                     const char *const *interfaces, unsigned buses);

/** Write the lines. @return their length. */
size_t taper_companion_format(const taper_companion_t *companion, char text[TAPER_COMPANION_TEXT]);

/** Read the lines; `text` is cut up. @return false, with "LINE: KEY: why" in `reason`. */
bool taper_companion_parse(char *text, taper_companion_t *companion, char *reason, size_t reason_size);

/** Write FILE.station, as a whole or not at all. @return false, with errno. */
bool taper_companion_write(const taper_companion_t *companion, const char *recording);

/** Read FILE.station. If TAPER_COMPANION_BAD, `reason` is "FILE.station:LINE: KEY: why" or "FILE.station: why". */
taper_companion_verdict_t taper_companion_read(const char *recording, taper_companion_t *companion,
                                               char *reason, size_t reason_size);

#endif
