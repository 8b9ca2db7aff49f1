#include "taper/membus.h"

#include <stddef.h>

_Static_assert((TAPER_MEMBUS_DEPTH & (TAPER_MEMBUS_DEPTH - 1u)) == 0u,
               "free-running indices wrap at a power of two");

static bool put(taper_membus_queue_t *queue, const taper_frame_t *frame) {
    if (queue->head - queue->tail == TAPER_MEMBUS_DEPTH) {
        if (queue->refused != UINT32_MAX) {
            queue->refused++;
        }
        return false;
    }
    queue->frame[queue->head % TAPER_MEMBUS_DEPTH] = *frame;
    queue->head++;
    return true;
}

static bool take(taper_membus_queue_t *queue, taper_frame_t *frame) {
    if (queue->head == queue->tail) {
        return false;
    }
    *frame = queue->frame[queue->tail % TAPER_MEMBUS_DEPTH];
    queue->tail++;
    return true;
}

static void empty(taper_membus_queue_t *queue) {
    queue->head = 0;
    queue->tail = 0;
    queue->refused = 0;
}

void taper_membus_init(taper_membus_t *bus) {
    empty(&bus->to_station);
    empty(&bus->to_world);
}

static bool station_receive(void *context, taper_frame_t *frame) {
    taper_membus_t *bus = context;
    return take(&bus->to_station, frame);
}

static bool station_send(void *context, const taper_frame_t *frame) {
    taper_membus_t *bus = context;
    return put(&bus->to_world, frame);
}

taper_port_t taper_membus_station_port(taper_membus_t *bus) {
    const taper_port_t port = {
        .context = bus,
        .receive = station_receive,
        .send = station_send,
        .kick_watchdog = NULL,
        .clock_us = NULL,
    };
    return port;
}

static bool world_receive(void *context, taper_frame_t *frame) {
    return taper_membus_world_receive(context, frame);
}

static bool world_send(void *context, const taper_frame_t *frame) {
    return taper_membus_world_send(context, frame);
}

taper_port_t taper_membus_world_port(taper_membus_t *bus) {
    const taper_port_t port = {.context = bus, .receive = world_receive, .send = world_send};
    return port;
}

bool taper_membus_world_receive(taper_membus_t *bus, taper_frame_t *frame) {
    return take(&bus->to_world, frame);
}

bool taper_membus_world_send(taper_membus_t *bus, const taper_frame_t *frame) {
    return put(&bus->to_station, frame);
}
