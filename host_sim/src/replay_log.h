/** A recorded bus, put on the station's clock: what came in, what the station sent, and when it was called. */
#ifndef SIM_REPLAY_LOG_H
#define SIM_REPLAY_LOG_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "replay.h"
#include "taper/frame.h"

typedef struct {
    uint64_t time_us; /**< in the file */
    uint64_t time_ms; /**< station's clock: when it was received, or the time of the call that sent it */
    taper_frame_t frame;
    bool sent; /**< by the station */
} sim_replay_frame_t;

/** Where a log comes from. */
typedef struct {
    const char *file;
    const char *const *names; /**< [name_count] interfaces that are the station's buses, in order */
    unsigned name_count;      /**< 0: by their first appearance */
    unsigned buses;           /**< of the station */
    uint32_t tick_ms;
    bool exact;        /**< the station's own recording, in whole milliseconds from `start_us` on */
    uint64_t start_us; /**< station time 0, if `exact` */
} sim_replay_source_t;

typedef struct {
    sim_replay_frame_t *frame; /**< as they stand in the file */
    size_t count, room;
    bool exact;                           /**< the station's own recording */
    uint64_t start_us;                    /**< station time 0 in the file */
    uint64_t end_ms;                      /**< time of the last frame that the station sent */
    uint64_t stop_ms;                     /**< when it was stopped; UINT64_MAX: it was not */
    char interface[SIM_REPLAY_BUSES][16]; /**< [bus] */
    unsigned interfaces;
} sim_replay_log_t;

/** Whether this identifier is one that only the station sends. */
bool sim_replay_is_of_station(uint16_t id);

/** Whether `frame` ends a control tick. */
bool sim_replay_is_status(const taper_frame_t *frame);

/**
 * Read a CAN log, and find the station's clock in it.
 * @return false, after one line on stderr, for a file that cannot be read or replayed.
 */
bool sim_replay_load(sim_replay_log_t *log, const sim_replay_source_t *source);

void sim_replay_free(sim_replay_log_t *log);

#endif
