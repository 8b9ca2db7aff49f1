#include "taper/membus.h"

#include <stddef.h>
#include <string.h>

#include "membus_internal.h"

#define LARGEST_ID 0x7FFu

_Static_assert((TAPER_MEMBUS_DEPTH & (TAPER_MEMBUS_DEPTH - 1u)) == 0u,
               "free-running indices wrap at a power of two");

bool taper_membus_put(taper_membus_queue_t *queue, const taper_frame_t *frame) {
    const bool is_full = queue->head - queue->tail == TAPER_MEMBUS_DEPTH;
    if (is_full) {
        taper_count(&queue->overflows);
        if (!queue->keeps_newest) {
            return false;
        }
        queue->tail++;
    }
    queue->frame[queue->head % TAPER_MEMBUS_DEPTH] = *frame;
    queue->head++;
    return !is_full;
}

static bool take(taper_membus_queue_t *queue, taper_frame_t *frame) {
    if (queue->head == queue->tail) {
        return false;
    }
    *frame = queue->frame[queue->tail % TAPER_MEMBUS_DEPTH];
    queue->tail++;
    return true;
}

static void init_queue(taper_membus_queue_t *queue, bool keeps_newest) {
    queue->head = 0;
    queue->tail = 0;
    queue->overflows = 0;
    queue->keeps_newest = keeps_newest;
    queue->injector = NULL;
}

void taper_membus_init(taper_membus_t *bus) {
    init_queue(&bus->to_station, true);
    init_queue(&bus->to_world, false);
    memset(bus->controller, 0, sizeof bus->controller);
    taper_membus_store_init(bus);
    bus->now_ms = 0;
    bus->stamps = false;
}

void taper_membus_power_cycle(taper_membus_t *bus) {
    bus->to_station.tail = bus->to_station.head;
    bus->to_world.tail = bus->to_world.head;
}

/** The station's controller on a CAN bus; NULL: there is no such bus, so nothing can happen to it. */
static taper_membus_controller_t *controller_of(taper_membus_t *bus, uint8_t can_bus) {
    return can_bus < TAPER_MAX_BUSES ? &bus->controller[can_bus] : NULL;
}

static bool is_off(void *context, uint8_t can_bus) {
    const taper_membus_controller_t *controller = controller_of(context, can_bus);
    return controller != NULL && controller->is_off;
}

static bool put(taper_membus_queue_t *queue, const taper_frame_t *frame) {
    return queue->injector == NULL ? taper_membus_put(queue, frame) : taper_membus_put_faulty(queue, frame);
}

static bool station_receive(void *context, taper_frame_t *frame) {
    taper_membus_t *bus = context;
    return take(&bus->to_station, frame);
}

static bool is_carried(const taper_frame_t *frame) {
    return frame->bus < TAPER_MAX_BUSES && frame->id <= LARGEST_ID && frame->length <= TAPER_FRAME_LENGTH;
}

static bool station_send(void *context, const taper_frame_t *frame) {
    taper_membus_t *bus = context;
    return is_carried(frame) && !is_off(bus, frame->bus) && put(&bus->to_world, frame);
}

static void restart(void *context, uint8_t can_bus) {
    taper_membus_controller_t *controller = controller_of(context, can_bus);
    if (controller == NULL) {
        return;
    }
    taper_count(&controller->restart_requests);
    if (controller->is_off && controller->restarts_needed > 0) {
        controller->restarts_needed--;
        controller->is_off = controller->restarts_needed > 0;
    }
}

static uint32_t receive_overflows(void *context) {
    const taper_membus_t *bus = context;
    return bus->to_station.overflows;
}

taper_port_t taper_membus_station_port(taper_membus_t *bus) {
    const taper_port_t port = {
        .context = bus,
        .receive = station_receive,
        .send = station_send,
        .kick_watchdog = NULL,
        .clock_us = NULL,
        .bus_is_off = is_off,
        .restart_bus = restart,
        .receive_overflows = receive_overflows,
        .store_read = taper_membus_store_read,
        .store_write = taper_membus_store_write,
    };
    return port;
}

static bool world_receive(void *context, taper_frame_t *frame) {
    return taper_membus_world_receive(context, frame);
}

static bool world_send(void *context, const taper_frame_t *frame) {
    (void)taper_membus_world_send(context, frame); /* a full queue lost another frame, not this one */
    return true;
}

taper_port_t taper_membus_world_port(taper_membus_t *bus) {
    const taper_port_t port = {.context = bus, .receive = world_receive, .send = world_send};
    return port;
}

bool taper_membus_world_receive(taper_membus_t *bus, taper_frame_t *frame) {
    return take(&bus->to_world, frame);
}

/** @return whether the station's controller cannot hear the frame; it is counted then. */
static bool is_unheard(taper_membus_t *bus, const taper_frame_t *frame) {
    if (!is_off(bus, frame->bus)) {
        return false;
    }
    taper_count(&bus->controller[frame->bus].lost);
    return true;
}

bool taper_membus_world_send(taper_membus_t *bus, const taper_frame_t *frame) {
    taper_frame_t arriving = *frame;
    if (is_unheard(bus, frame)) {
        return true;
    }
    if (bus->stamps) {
        arriving.time_ms = bus->now_ms;
    }
    return put(&bus->to_station, &arriving);
}

static void let_flood_in(taper_membus_t *bus) {
    taper_frame_t frame;
    while (taper_membus_next_of_flood(bus->to_station.injector, &frame)) {
        if (!is_unheard(bus, &frame)) {
            (void)taper_membus_put(&bus->to_station, &frame);
        }
    }
}

void taper_membus_set_time(taper_membus_t *bus, uint32_t now_ms) {
    bus->now_ms = now_ms;
    bus->stamps = true;
    if (bus->to_world.injector != NULL) {
        taper_membus_faults_set_time(&bus->to_world, now_ms);
    }
    if (bus->to_station.injector != NULL) {
        taper_membus_faults_set_time(&bus->to_station, now_ms);
        let_flood_in(bus);
    }
}

void taper_membus_bus_off(taper_membus_t *bus, uint8_t can_bus, uint32_t restarts_needed) {
    taper_membus_controller_t *controller = controller_of(bus, can_bus);
    if (controller != NULL) {
        controller->is_off = true;
        controller->restarts_needed = restarts_needed;
    }
}

void taper_membus_bus_on(taper_membus_t *bus, uint8_t can_bus) {
    taper_membus_controller_t *controller = controller_of(bus, can_bus);
    if (controller != NULL) {
        controller->is_off = false;
    }
}
