/**
 * An in-memory CAN bus between two ends, for host simulation and tests: two bounded queues, no clock, no heap.
 * End A is by convention the station, end B the world. Order is kept; a full queue refuses, and counts it.
 */
#ifndef TAPER_MEMBUS_H
#define TAPER_MEMBUS_H

#include <stdbool.h>
#include <stdint.h>

#include "taper/frame.h"
#include "taper/port.h"

/** Frames one direction holds: a tick's worth from every node of the largest station. A power of two. */
#define TAPER_MEMBUS_DEPTH 2048u

typedef struct {
    taper_frame_t frame[TAPER_MEMBUS_DEPTH];
    uint32_t head, tail; /**< free-running */
    uint32_t refused;    /**< frames not taken because the queue was full */
} taper_membus_queue_t;

typedef struct {
    taper_membus_queue_t to_station, to_world;
} taper_membus_t;

/** Empty both directions. */
void taper_membus_init(taper_membus_t *bus);

/** The station's end as a port (no watchdog, no clock). `bus` must outlive it. */
taper_port_t taper_membus_station_port(taper_membus_t *bus);

/** The world's end as a port of the same kind. */
taper_port_t taper_membus_world_port(taper_membus_t *bus);

/** The world's end. @return false: nothing waiting / queue full. */
bool taper_membus_world_receive(taper_membus_t *bus, taper_frame_t *frame);
bool taper_membus_world_send(taper_membus_t *bus, const taper_frame_t *frame);

#endif
