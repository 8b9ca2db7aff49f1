/** What the files of the in-memory bus share. */
#ifndef TAPER_MEMBUS_INTERNAL_H
#define TAPER_MEMBUS_INTERNAL_H

#include "taper/membus.h"

/** Append to a queue, past all faults. @return false: a frame was lost, the oldest or (queue to the world) this one. */
bool taper_membus_put(taper_membus_queue_t *queue, const taper_frame_t *frame);

/** Append through the queue's injector. @return as taper_membus_put(); a frame that a fault took counts as sent. */
bool taper_membus_put_faulty(taper_membus_queue_t *queue, const taper_frame_t *frame);

/** The clock of a queue with an injector moves: delays end. */
void taper_membus_faults_set_time(taper_membus_queue_t *queue, uint32_t now_ms);

/** The next frame of the flood that is due until the injector's time. @return false: none is. */
bool taper_membus_next_of_flood(taper_membus_injector_t *injector, taper_frame_t *frame);

/** The store's part of the station's port. */
void taper_membus_store_init(taper_membus_t *bus);
bool taper_membus_store_read(void *context, unsigned area, unsigned copy, void *data, uint32_t length);
bool taper_membus_store_write(void *context, unsigned area, unsigned copy, const void *data, uint32_t length);

#endif
