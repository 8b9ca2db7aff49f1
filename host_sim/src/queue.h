/** The vehicles that have come and the connectors that they wait for. */
#ifndef SIM_QUEUE_H
#define SIM_QUEUE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "evse.h"
#include "results.h"
#include "sessions.h"

/** A vehicle that waits. */
typedef struct {
    size_t session;
    int64_t since_s; /**< first tick that saw it */
} sim_waiting_t;

typedef struct {
    const sim_sessions_t *sessions;
    sim_evse_t *evse; /**< [connectors] */
    unsigned connectors;
    sim_outcome_t *outcome; /**< [sessions->count] */
    size_t *order;          /**< [sessions->count] by arrival, equal ones by their place in the file */
    size_t next;            /**< in `order`: the first that has not come */
    sim_waiting_t *waiting; /**< [waiting_count] by arrival */
    size_t waiting_count, waiting_room;
    size_t at[TAPER_MAX_CONNECTORS]; /**< session on each connector, where there is one */
    unsigned free;                   /**< connectors without a vehicle, but open */
} sim_queue_t;

/** Nobody has come. `sessions`, `evse[connectors]` and `outcome` must outlive the queue; who is closed stays so. */
void sim_queue_init(sim_queue_t *queue, const sim_sessions_t *sessions, sim_evse_t *evse, unsigned connectors,
                    sim_outcome_t *outcome);

/** The first half of sim_queue_advance(): who has to leave by `now_s` does. */
void sim_queue_leave(sim_queue_t *queue, int64_t now_s);

/**
 * Bring everything to `now_s`: whose departure has come leaves first, then who has come is plugged in, by arrival: at
 * its own connector or else the lowest that is free. Who finds none waits, and holds up nobody who does.
 */
void sim_queue_advance(sim_queue_t *queue, int64_t now_s);

/** Whether nobody is there, waits or is still to come. */
bool sim_queue_is_over(const sim_queue_t *queue);

/** The end of the run: everybody leaves. */
void sim_queue_finish(sim_queue_t *queue);

void sim_queue_free(sim_queue_t *queue);

#endif
