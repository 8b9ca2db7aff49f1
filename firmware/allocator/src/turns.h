/** Private to the layer: who is to have its minimum current, and in which order (taper/allocator.h). */
#ifndef TAPER_TURNS_H
#define TAPER_TURNS_H

#include "taper/allocator.h"

/** In this order. */
typedef enum {
    TAPER_STAGE_HELD,    /**< on for less than `min_on_ms` */
    TAPER_STAGE_TURN,    /**< on, and its turn is not over */
    TAPER_STAGE_OVERDUE, /**< waited for `turn_ms`; longest first, the others by laxity */
    TAPER_STAGE_REST,
    TAPER_STAGE_KEPT_OFF, /**< off for less than `min_off_ms` */
} taper_stage_t;

/** A connector with a minimum current that is to have it. */
typedef struct {
    uint8_t stage; /**< taper_stage_t */
    uint8_t connector;
    uint32_t key; /**< within the stage, least first */
} taper_candidate_t;

/** All of them: those with a wish that calls for the minimum now, then those for whom it is good if there is room left over. */
typedef struct {
    uint8_t wishing; /**< so many of the first kind */
    uint8_t count;
    taper_candidate_t candidate[TAPER_MAX_CONNECTORS];
} taper_queue_t;

/** Least current that a connector can be given, in whole steps of the wire. */
int32_t taper_turns_least_mA(const taper_demand_t *demand);

/** Begin an allocation: forget what belonged to other sessions, and book what was wished and not given since the last. */
void taper_turns_begin(taper_allocator_t *allocator, const taper_station_config_t *config,
                       const taper_snapshot_t *snapshot);

/** Line up. */
void taper_turns_line_up(const taper_allocator_t *allocator, const taper_station_config_t *config,
                         const taper_snapshot_t *snapshot, const taper_proposal_t *proposal,
                         taper_queue_t *queue);

/** End an allocation: note who was switched, and who waits. */
void taper_turns_end(taper_allocator_t *allocator, const taper_station_config_t *config,
                     const taper_snapshot_t *snapshot, const taper_proposal_t *proposal,
                     const taper_queue_t *queue, const taper_setpoints_t *setpoints);

#endif
