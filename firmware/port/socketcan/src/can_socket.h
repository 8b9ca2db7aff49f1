/** One raw CAN socket: what the kernel is asked for, and what it gives. */
#ifndef CAN_SOCKET_H
#define CAN_SOCKET_H

#include <linux/can.h>
#include <stdbool.h>
#include <stdint.h>

#include "taper/socketcan.h"

/** Frames taken with one system call. */
#define CAN_SOCKET_BATCH 32

typedef struct {
    struct can_frame frame; /**< classic; data, or an error (CAN_ERR_FLAG) */
    uint32_t age_ms;        /**< since the kernel received it; 0 if it does not say */
    bool has_drops;
    uint32_t drops; /**< has_drops: frames that the socket has lost so far */
} can_socket_message_t;

/** A non-blocking socket with all options, not bound. @return file descriptor, or -1 and errno. */
int taper_can_socket_open(void);

/** Set the filters and bind to `interface`. Again, after an interface was gone. @return false: errno. */
bool taper_can_socket_bind(int fd, const char *interface, const taper_socketcan_filter_t *filters,
                           unsigned count);

/** Whether there is an interface of this name, and it is up. */
bool taper_can_socket_is_up(int fd, const char *interface);

/** Whether the last call failed because the interface is down or gone. */
bool taper_can_socket_lost(int error);

/**
 * Take what waits, at most CAN_SOCKET_BATCH; what is no classic frame is left out. @return how many entries of `messages`
 * are set. `*more`: the kernel may have more. `*error`: errno of a read that found nothing, or 0.
 */
unsigned taper_can_socket_read(int fd, can_socket_message_t messages[CAN_SOCKET_BATCH], bool *more,
                               int *error);

/** @return 0, or errno. */
int taper_can_socket_write(int fd, const struct can_frame *frame);

#endif
