/**
 * CAN on Linux: one raw SocketCAN socket per bus of the station, behind the port interface. Needs no root, and no other
 * right than that of opening a CAN_RAW socket.
 *
 * Frames are taken from the kernel in batches into a queue that drops its oldest. Reception times are the kernel's. CAN
 * error frames tell bus-off and recovery. The kernel filters: what was not asked for does not wake the process. An option
 * that the kernel refuses (qemu-user refuses all of CAN_RAW's) is done without: all is filtered here once more.
 *
 * An interface that goes down, or away, counts as off the bus. It is looked for every TAPER_SOCKETCAN_RETRY_MS, and taken
 * up again with the same file descriptor when a CAN interface of that name is up.
 *
 * Remote frames, 29-bit identifiers and CAN FD frames are not received. The design leaves CAN FD open: it would take 64
 * bytes in taper_frame_t, the option CAN_RAW_FD_FRAMES, and buffers of struct canfd_frame; how much was read (CAN_MTU or
 * CANFD_MTU) tells the two kinds apart.
 *
 * Not for several threads at once. No call blocks (a restart waits for the kernel's lock on its interfaces).
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
/** Frames that wait in one bus's socket to be sent, about: 8 ms at 500 kbit/s. More are refused, so that none is old. */
#define TAPER_SOCKETCAN_SEND_QUEUE 32
/** Filters of one port. */
#define TAPER_SOCKETCAN_FILTERS 64
/** How often an interface that is down or gone is looked for. */
#define TAPER_SOCKETCAN_RETRY_MS 200u

/** Take identifiers with `(id & mask) == (this->id & mask)`. */
typedef struct {
    uint16_t id, mask;
} taper_socketcan_filter_t;

typedef struct {
    const char *const *interfaces;           /**< [count]: names, bus 0 first, such as "can0" */
    uint8_t count;                           /**< 1..TAPER_SOCKETCAN_BUSES */
    const taper_socketcan_filter_t *filters; /**< [filter_count]; 0: everything */
    uint8_t filter_count;                    /**< 0..TAPER_SOCKETCAN_FILTERS */
    /**
     * The clock of frame.time_ms. A frame's age, by the kernel's time stamp, is taken off it. The age is at most the
     * time since the socket was last found empty, so that a step of the system's clock does little.
     */
    uint32_t (*now_ms)(void *context);
    void *clock_context;
} taper_socketcan_options_t;

/** What happened on one bus. They never fall, and wrap. */
typedef struct {
    uint32_t received;     /**< frames that passed the filters */
    uint32_t sent;         /**< frames that the kernel took */
    uint32_t kernel_drops; /**< lost in the socket's queue (SO_RXQ_OVFL) */
    uint32_t queue_drops;  /**< lost in our own queue */
    uint32_t send_refused; /**< queue full, bus off, interface down, or no classic frame */
    uint32_t error_frames; /**< bus-off, restarts, and changes of the controller's error state */
    uint32_t bus_off;      /**< times */
    uint32_t downs;        /**< times that the interface was found down or gone */
    uint32_t restarts;     /**< asked for by restart_bus() */
} taper_socketcan_counters_t;

/** Private, as all members of taper_socketcan_t. */
typedef struct {
    int fd;
    char interface[16];
    bool off;              /**< bus-off, by error frames */
    bool down;             /**< the interface is down or gone */
    uint32_t look_at_ms;   /**< down: when to look for it next */
    uint32_t emptied_ms;   /**< when the socket was last found empty */
    uint32_t kernel_drops; /**< of the socket's own count, seen already */
    taper_socketcan_counters_t counters;
} taper_socketcan_bus_t;

/** Private; in the header because the caller owns the memory. About 100 KB. */
typedef struct {
    taper_socketcan_bus_t bus[TAPER_SOCKETCAN_BUSES];
    uint8_t bus_count;
    taper_socketcan_filter_t filters[TAPER_SOCKETCAN_FILTERS];
    uint8_t filter_count;
    uint32_t (*now_ms)(void *context);
    void *clock_context;
    taper_frame_t queue[TAPER_SOCKETCAN_QUEUE];
    uint32_t head, tail; /**< free-running */
    bool dry; /**< the kernel had no more when the queue was last filled: the next "empty" needs no look */
} taper_socketcan_t;

/**
 * Open all buses. `can` must stay where it is; of the options only the clock is used later. An interface has to exist, but
 * may be down.
 * @return false, with a line for people in `reason` ("can0: no such interface; ..."), and nothing is left open.
 */
bool taper_socketcan_open(taper_socketcan_t *can, const taper_socketcan_options_t *options, char *reason,
                          size_t reason_size);

void taper_socketcan_close(taper_socketcan_t *can);

/**
 * The port's callbacks for `can`: receive, send, bus_is_off, restart_bus, receive_overflows. The others are NULL.
 *
 * - bus_is_off() is true from a bus-off error frame to the controller's restart, the next frame received, or a call of
 *   restart_bus(), and while the interface is down or gone.
 * - restart_bus() asks the kernel, which wants CAP_NET_ADMIN for it. Without, the interface's own restart-ms has to bring
 *   the controller back. In both cases sending is tried again.
 */
taper_port_t taper_socketcan_port(taper_socketcan_t *can);

/** File descriptor of a bus, to wait on (readable); the same until close. */
int taper_socketcan_fd(const taper_socketcan_t *can, uint8_t bus);

/** Take all that the kernel has into the queue, at most a queue full. receive() does it too when the queue is empty. */
void taper_socketcan_drain(taper_socketcan_t *can);

const taper_socketcan_counters_t *taper_socketcan_counters(const taper_socketcan_t *can, uint8_t bus);

#endif
