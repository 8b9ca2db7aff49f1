/**
 * A TCP connection as a stream of bytes (taper/slcan.h), such as the UART of an emulated board. Nagle's delay is off: with it
 * an answer takes 40 ms.
 */
#ifndef SIM_TCP_STREAM_H
#define SIM_TCP_STREAM_H

#include <stdbool.h>
#include <stddef.h>

#include "taper/slcan.h"

typedef struct {
    int fd; /**< non-blocking; to wait on, too; -1: not connected */
    bool
        is_broken; /**< the other side closed the connection, or it failed: reads and writes do nothing any more */
} tcp_stream_t;

/**
 * Connect to `address`, "HOST:PORT"; tried again until `timeout_ms` have passed, for a program that is still starting.
 * @return false, with a line for people in `reason` ("localhost:4000: Connection refused").
 */
bool tcp_stream_connect(tcp_stream_t *tcp, const char *address, unsigned timeout_ms, char *reason,
                        size_t reason_size);

/** Its bytes; nothing blocks, and no signal is raised. `tcp` must outlive it. */
taper_stream_t tcp_stream_bytes(tcp_stream_t *tcp);

/**
 * Wait until there is something to read (or the connection is broken), or `for_writing` until there is room as well.
 * @return false: not within `timeout_ms`.
 */
bool tcp_stream_wait(const tcp_stream_t *tcp, bool for_writing, unsigned timeout_ms);

/** Close it, if it is connected. */
void tcp_stream_close(tcp_stream_t *tcp);

#endif
