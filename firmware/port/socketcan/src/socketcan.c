#include "taper/socketcan.h"

#include <errno.h>
#include <linux/can/error.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "can_restart.h"
#include "can_socket.h"

_Static_assert((TAPER_SOCKETCAN_QUEUE & (TAPER_SOCKETCAN_QUEUE - 1u)) == 0u,
               "free-running indices wrap at a power of two");

/* ---- Opening */

static const char *explain(int error) {
    switch (error) {
    case EAFNOSUPPORT:
    case EPROTONOSUPPORT:
        return "this kernel has no CAN sockets; try: sudo modprobe can-raw, or tools/with-vcan";
    case ENXIO: return "no such interface; `ip link` lists them, tools/with-vcan makes one";
    case ENODEV: return "not a CAN interface";
    default: return strerror(error);
    }
}

static bool attach(const taper_socketcan_t *can, taper_socketcan_bus_t *bus) {
    return taper_can_socket_bind(bus->fd, bus->interface, can->filters, can->filter_count);
}

static bool open_bus(taper_socketcan_t *can, const char *interface) {
    taper_socketcan_bus_t *bus = &can->bus[can->bus_count];
    if (strlen(interface) >= sizeof bus->interface) {
        errno = ENXIO;
        return false;
    }
    *bus =
        (taper_socketcan_bus_t){.fd = taper_can_socket_open(), .emptied_ms = can->now_ms(can->clock_context)};
    if (bus->fd < 0) {
        return false;
    }
    memcpy(bus->interface, interface, strlen(interface) + 1);
    can->bus_count++;
    return attach(can, bus);
}

bool taper_socketcan_open(taper_socketcan_t *can, const taper_socketcan_options_t *options, char *reason,
                          size_t reason_size) {
    if (options->count < 1 || options->count > TAPER_SOCKETCAN_BUSES ||
        options->filter_count > TAPER_SOCKETCAN_FILTERS) {
        snprintf(reason, reason_size, "needs 1 to %d interfaces and at most %d filters",
                 TAPER_SOCKETCAN_BUSES, TAPER_SOCKETCAN_FILTERS);
        return false;
    }
    can->bus_count = 0;
    can->head = can->tail = 0;
    can->dry = false;
    can->now_ms = options->now_ms;
    can->clock_context = options->clock_context;
    can->filter_count = options->filter_count;
    for (unsigned i = 0; i < options->filter_count; i++) {
        can->filters[i] = options->filters[i];
    }
    for (unsigned i = 0; i < options->count; i++) {
        if (!open_bus(can, options->interfaces[i])) {
            snprintf(reason, reason_size, "%s: %s", options->interfaces[i], explain(errno));
            taper_socketcan_close(can);
            return false;
        }
    }
    return true;
}

void taper_socketcan_close(taper_socketcan_t *can) {
    for (unsigned i = 0; i < can->bus_count; i++) {
        close(can->bus[i].fd);
    }
    can->bus_count = 0;
}

/* ---- An interface that is down or gone */

static void lose(const taper_socketcan_t *can, taper_socketcan_bus_t *bus) {
    if (!bus->down) {
        bus->down = true;
        bus->counters.downs++;
        bus->look_at_ms = can->now_ms(can->clock_context);
    }
    bus->off = false; /* a controller starts afresh with its interface */
}

/* The socket forgot its filters and what it was bound to if the interface was gone. */
static void look_for(const taper_socketcan_t *can, taper_socketcan_bus_t *bus) {
    if (!bus->down) { /* before the clock is asked: this is in the way of every frame */
        return;
    }
    const uint32_t now_ms = can->now_ms(can->clock_context);
    if ((int32_t)(now_ms - bus->look_at_ms) < 0) {
        return;
    }
    bus->look_at_ms = now_ms + TAPER_SOCKETCAN_RETRY_MS;
    if (taper_can_socket_is_up(bus->fd, bus->interface) && attach(can, bus)) {
        bus->down = false;
    }
}

static bool is_off(const taper_socketcan_t *can, taper_socketcan_bus_t *bus) {
    look_for(can, bus);
    return bus->off || bus->down;
}

/* ---- Receiving */

static bool is_wanted(const taper_socketcan_t *can, canid_t id) {
    if ((id & (CAN_EFF_FLAG | CAN_RTR_FLAG)) != 0) {
        return false;
    }
    for (unsigned i = 0; i < can->filter_count; i++) {
        if (((id ^ can->filters[i].id) & can->filters[i].mask & CAN_SFF_MASK) == 0) {
            return true;
        }
    }
    return can->filter_count == 0;
}

static void put(taper_socketcan_t *can, const taper_frame_t *frame) {
    if (can->head - can->tail == TAPER_SOCKETCAN_QUEUE) {
        can->bus[can->queue[can->tail % TAPER_SOCKETCAN_QUEUE].bus].counters.queue_drops++;
        can->tail++;
    }
    can->queue[can->head % TAPER_SOCKETCAN_QUEUE] = *frame;
    can->head++;
}

static void take_error(taper_socketcan_bus_t *bus, canid_t id) {
    bus->counters.error_frames++;
    if ((id & CAN_ERR_BUSOFF) != 0) {
        bus->counters.bus_off += bus->off ? 0u : 1u;
        bus->off = true;
    }
    if ((id & CAN_ERR_RESTARTED) != 0) {
        bus->off = false;
    }
}

static void take_data(taper_socketcan_t *can, taper_socketcan_bus_t *bus, const can_socket_message_t *message,
                      uint32_t now_ms) {
    const uint32_t longest_ms = now_ms - bus->emptied_ms;
    taper_frame_t frame = {
        .id = (uint16_t)(message->frame.can_id & CAN_SFF_MASK),
        .bus = (uint8_t)(bus - can->bus),
        .length = message->frame.can_dlc <= TAPER_FRAME_LENGTH ? message->frame.can_dlc : TAPER_FRAME_LENGTH,
        .time_ms = now_ms - (message->age_ms < longest_ms ? message->age_ms : longest_ms),
    };
    memcpy(frame.data, message->frame.data, frame.length);
    bus->off = false; /* who hears is on the bus */
    bus->counters.received++;
    put(can, &frame);
}

static void take(taper_socketcan_t *can, taper_socketcan_bus_t *bus, const can_socket_message_t *message,
                 uint32_t now_ms) {
    if (message->has_drops) {
        bus->counters.kernel_drops += message->drops - bus->kernel_drops;
        bus->kernel_drops = message->drops;
    }
    if ((message->frame.can_id & CAN_ERR_FLAG) != 0) {
        take_error(bus, message->frame.can_id);
    } else if (is_wanted(can, message->frame.can_id)) {
        take_data(can, bus, message, now_ms);
    }
}

static bool drain_batch(taper_socketcan_t *can, taper_socketcan_bus_t *bus) {
    can_socket_message_t messages[CAN_SOCKET_BATCH];
    bool more;
    int error;
    const uint32_t began_ms = can->now_ms(can->clock_context);
    const unsigned count = taper_can_socket_read(bus->fd, messages, &more, &error);
    const uint32_t now_ms = can->now_ms(can->clock_context);
    for (unsigned i = 0; i < count; i++) {
        take(can, bus, &messages[i], now_ms);
    }
    if (!more) {
        bus->emptied_ms = began_ms;
    }
    if (taper_can_socket_lost(error)) {
        lose(can, bus);
    }
    return more;
}

void taper_socketcan_drain(taper_socketcan_t *can) {
    for (unsigned i = 0; i < can->bus_count; i++) {
        look_for(can, &can->bus[i]);
        unsigned batches = TAPER_SOCKETCAN_QUEUE / CAN_SOCKET_BATCH; /* a flood must not hold us here */
        while (batches > 0 && drain_batch(can, &can->bus[i])) {
            batches--;
        }
    }
}

/* ---- The port */

static bool port_receive(void *context, taper_frame_t *frame) {
    taper_socketcan_t *can = context;
    if (can->head == can->tail && !can->dry) {
        taper_socketcan_drain(can);
        can->dry = true; /* who takes until there is nothing asks the kernel once, not twice */
    }
    if (can->head == can->tail) {
        can->dry = false;
        return false;
    }
    *frame = can->queue[can->tail % TAPER_SOCKETCAN_QUEUE];
    can->tail++;
    return true;
}

static bool transmit(const taper_socketcan_t *can, taper_socketcan_bus_t *bus, const taper_frame_t *frame) {
    struct can_frame out = {.can_id = frame->id, .can_dlc = frame->length};
    if (frame->id > CAN_SFF_MASK || frame->length > TAPER_FRAME_LENGTH || is_off(can, bus)) {
        return false;
    }
    memcpy(out.data, frame->data, frame->length);
    const int error = taper_can_socket_write(bus->fd, &out);
    if (taper_can_socket_lost(error)) {
        lose(can, bus);
    }
    return error == 0;
}

static bool port_send(void *context, const taper_frame_t *frame) {
    taper_socketcan_t *can = context;
    if (frame->bus >= can->bus_count) {
        return false;
    }
    taper_socketcan_bus_t *bus = &can->bus[frame->bus];
    const bool sent = transmit(can, bus, frame);
    *(sent ? &bus->counters.sent : &bus->counters.send_refused) += 1;
    return sent;
}

static bool port_bus_is_off(void *context, uint8_t bus) {
    taper_socketcan_t *can = context;
    return bus >= can->bus_count || is_off(can, &can->bus[bus]);
}

static void port_restart_bus(void *context, uint8_t bus) {
    taper_socketcan_t *can = context;
    if (bus < can->bus_count) {
        taper_can_restart(can->bus[bus].interface);
        can->bus[bus].counters.restarts++;
        can->bus[bus].off = false;
    }
}

static uint32_t port_receive_overflows(void *context) {
    const taper_socketcan_t *can = context;
    uint32_t lost = 0;
    for (unsigned i = 0; i < can->bus_count; i++) {
        lost += can->bus[i].counters.kernel_drops + can->bus[i].counters.queue_drops;
    }
    return lost;
}

taper_port_t taper_socketcan_port(taper_socketcan_t *can) {
    const taper_port_t port = {
        .context = can,
        .receive = port_receive,
        .send = port_send,
        .bus_is_off = port_bus_is_off,
        .restart_bus = port_restart_bus,
        .receive_overflows = port_receive_overflows,
    };
    return port;
}

int taper_socketcan_fd(const taper_socketcan_t *can, uint8_t bus) {
    return can->bus[bus].fd;
}

const taper_socketcan_counters_t *taper_socketcan_counters(const taper_socketcan_t *can, uint8_t bus) {
    return &can->bus[bus].counters;
}
