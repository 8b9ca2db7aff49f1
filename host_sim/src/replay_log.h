/** A recorded bus, put on the station's clock: what came in, what the station sent, and when it was called. */
#ifndef SIM_REPLAY_LOG_H
#define SIM_REPLAY_LOG_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "taper/frame.h"

/** Interfaces that can be named. */
#define SIM_REPLAY_BUSES 4

typedef struct {
    uint64_t time_us; /**< in the file */
    uint64_t time_ms; /**< station's clock: when it was received, or the time of the call that sent it */
    taper_frame_t frame;
    bool sent; /**< by the station */
} sim_replay_frame_t;

typedef struct {
    sim_replay_frame_t *frame; /**< as they stand in the file */
    size_t count, room;
    bool exact;        /**< the station's own recording: whole milliseconds, R or T on every line */
    uint64_t start_us; /**< station time 0 in the file */
    uint64_t end_ms;   /**< time of the last frame that the station sent */
    uint64_t stop_ms;  /**< when it was stopped; UINT64_MAX: it was not */
    char interface[SIM_REPLAY_BUSES][16]; /**< [bus] */
    unsigned interfaces;
} sim_replay_log_t;

/** Whether this identifier is one that only the station sends. */
bool sim_replay_is_of_station(uint16_t id);

/** Whether `frame` ends a control tick. */
bool sim_replay_is_status(const taper_frame_t *frame);

/**
 * Read a CAN log, and find the station's clock in it.
 * @param names [name_count] interfaces that are the station's buses, in order; none: by their first appearance
 * @param buses of the station
 * @return false, after one line on stderr, for a file that cannot be read or replayed.
 */
bool sim_replay_load(sim_replay_log_t *log, const char *file, const char *const *names, unsigned name_count,
                     unsigned buses, uint32_t tick_ms);

void sim_replay_free(sim_replay_log_t *log);

#endif
