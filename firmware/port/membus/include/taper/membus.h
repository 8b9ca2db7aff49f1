/**
 * An in-memory CAN bus between a station and its world, for host simulation and tests: two bounded queues in fixed memory,
 * and a store in RAM. Order is kept. Time stands still unless the owner sets it.
 *
 * The world can break it: taper_membus_bus_off() and the store's functions below, and `taper/membus_faults.h` for what
 * happens to single frames. A bus without injected faults pays a NULL check per frame.
 */
#ifndef TAPER_MEMBUS_H
#define TAPER_MEMBUS_H

#include <stdbool.h>
#include <stdint.h>

#include "taper/frame.h"
#include "taper/port.h"
#include "taper/types.h"

/** Frames one direction holds: a tick's worth from every node of the largest station. A power of two. */
#define TAPER_MEMBUS_DEPTH 2048u

/** Faults of one direction (`taper/membus_faults.h`). */
typedef struct taper_membus_injector taper_membus_injector_t;

typedef struct {
    taper_frame_t frame[TAPER_MEMBUS_DEPTH];
    uint32_t head, tail; /**< free-running */
    uint32_t overflows;  /**< frames lost because the queue was full; saturating */
    bool keeps_newest;   /**< a full queue drops its oldest frame; else it refuses the new one */
    taper_membus_injector_t *injector; /**< NULL: no faults */
} taper_membus_queue_t;

/** The station's CAN controller on one bus. */
typedef struct {
    bool is_off;
    uint32_t restarts_needed;  /**< requests until it comes back; 0: it comes back only when told */
    uint32_t restart_requests; /**< ever made; saturating */
    uint32_t lost;             /**< frames from the world that nobody heard; saturating */
} taper_membus_controller_t;

/** One copy of a record. Memory that was never written reads as 0xFF. */
typedef struct {
    uint8_t data[TAPER_STORE_RECORD_MAX];
    bool written;
} taper_membus_copy_t;

typedef struct {
    taper_membus_queue_t to_station, to_world;
    taper_membus_controller_t controller[TAPER_MAX_BUSES];
    taper_membus_copy_t store[TAPER_STORE_AREAS][TAPER_STORE_COPIES];
    bool tear_next; /**< the next write stops after `tear_after` bytes */
    uint32_t tear_after;
    uint32_t store_writes; /**< tried, ever; saturating */
    uint32_t now_ms;
    bool stamps; /**< frames to the station get `now_ms`; set by the first taper_membus_set_time() */
} taper_membus_t;

/** Empty both directions and the store; every bus is on, no faults, no clock. */
void taper_membus_init(taper_membus_t *bus);

/** Power goes and comes back at the station: both directions are emptied, all else stays. */
void taper_membus_power_cycle(taper_membus_t *bus);

/**
 * Set the time. From the first call on, frames to the station are stamped with it; before, they keep the `time_ms` that
 * their sender gave. Delayed and flooding frames move here. The clock may wrap; it does not go back.
 */
void taper_membus_set_time(taper_membus_t *bus, uint32_t now_ms);

/** The station's end as a port (no watchdog, no microseconds). `bus` must outlive it. */
taper_port_t taper_membus_station_port(taper_membus_t *bus);

/** The world's end as a port of the same kind. It takes every frame: see taper_membus_world_send(). */
taper_port_t taper_membus_world_port(taper_membus_t *bus);

/** The world's end. @return false: nothing waiting. */
bool taper_membus_world_receive(taper_membus_t *bus, taper_frame_t *frame);

/** @return false: the queue was full, so its oldest frame was lost and counted. The new one is always taken. */
bool taper_membus_world_send(taper_membus_t *bus, const taper_frame_t *frame);

/**
 * The station's controller leaves `can_bus` (0..TAPER_MAX_BUSES-1, others are ignored): its sends are refused, and frames
 * from the world are lost to it. It comes back with the station's `restarts_needed`th request from now on; 0: only with
 * taper_membus_bus_on(). Frames already queued stay.
 */
void taper_membus_bus_off(taper_membus_t *bus, uint8_t can_bus, uint32_t restarts_needed);
void taper_membus_bus_on(taper_membus_t *bus, uint8_t can_bus);

/** Power goes during the next write, after `bytes` of it: the copy is left torn and the write answers false. */
void taper_membus_tear_next_write(taper_membus_t *bus, uint32_t bytes);

/** One bit (0..8 * TAPER_STORE_RECORD_MAX - 1) of a copy (0..TAPER_STORE_COPIES-1) of an area flips; others are ignored. */
void taper_membus_rot(taper_membus_t *bus, unsigned area, unsigned copy, uint32_t bit);

#endif
