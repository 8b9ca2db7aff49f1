/**
 * CAN on Linux: one raw SocketCAN socket per bus of the station, behind the port interface. Needs no root, and no other
 * right than that of opening a CAN_RAW socket.
 *
 * Frames are taken from the kernel in batches into a queue that drops its oldest. Reception times are the kernel's. CAN
 * error frames tell bus-off and recovery. The kernel filters: what was not asked for does not wake the process.
 */
#ifndef TAPER_SOCKETCAN_H
#define TAPER_SOCKETCAN_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "taper/port.h"

/** Buses that one port can have. */
#define TAPER_SOCKETCAN_BUSES 4
/** Received frames that wait for the station. A power of two. */
#define TAPER_SOCKETCAN_QUEUE 4096u

/** Take identifiers with `(id & mask) == (this->id & mask)`. */
typedef struct {
    uint16_t id, mask;
} taper_socketcan_filter_t;

typedef struct {
    const char *const *interfaces; /**< [count]: names, bus 0 first, such as "can0" */
    uint8_t count;                 /**< 1..TAPER_SOCKETCAN_BUSES */
    const taper_socketcan_filter_t *filters; /**< [filter_count]; 0: everything */
    uint8_t filter_count;
    /** The clock of frame.time_ms. A frame's age, by the kernel's time stamp, is taken off it. */
    uint32_t (*now_ms)(void *context);
    void *clock_context;
} taper_socketcan_options_t;

/** What happened on one bus. They never fall. */
typedef struct {
    uint32_t received, sent;
    uint32_t kernel_drops;  /**< lost in the socket's queue (SO_RXQ_OVFL) */
    uint32_t queue_drops;   /**< lost in our own queue */
    uint32_t send_refused;  /**< ENOBUFS and the like */
    uint32_t error_frames;
    uint32_t bus_off;       /**< times */
    uint32_t restarts;      /**< asked for */
} taper_socketcan_counters_t;

typedef struct {
    int fd;
    char interface[16];
    bool off;               /**< bus-off, by error frames */
    bool down;              /**< the interface is down or gone */
    uint32_t kernel_drops_seen;
    taper_socketcan_counters_t counters;
} taper_socketcan_bus_t;

/** Private; in the header because the caller owns the memory. */
typedef struct {
    taper_socketcan_options_t options;
    taper_socketcan_bus_t bus[TAPER_SOCKETCAN_BUSES];
    taper_frame_t queue[TAPER_SOCKETCAN_QUEUE];
    uint32_t head, tail; /**< free-running */
} taper_socketcan_t;

/**
 * Open all buses. `can` must stay where it is; strings and filters are only read here, the clock for good.
 * @return false, with a line for people in `reason` ("can0: no such interface; ..."), and nothing is left open.
 */
bool taper_socketcan_open(taper_socketcan_t *can, const taper_socketcan_options_t *options, char *reason,
                          size_t reason_size);

void taper_socketcan_close(taper_socketcan_t *can);

/** The port's callbacks for `can`: receive, send, bus_is_off, restart_bus, receive_overflows. The others are NULL. */
taper_port_t taper_socketcan_port(taper_socketcan_t *can);

/** File descriptor of a bus, to wait on (readable). */
int taper_socketcan_fd(const taper_socketcan_t *can, uint8_t bus);

/** Take all that the kernel has into the queue. receive() does it too when the queue is empty. */
void taper_socketcan_drain(taper_socketcan_t *can);

const taper_socketcan_counters_t *taper_socketcan_counters(const taper_socketcan_t *can, uint8_t bus);

#endif
