/** Time, signals, and the search for a controller: what taper-ev waits for. */
#ifndef SIM_EV_WAIT_H
#define SIM_EV_WAIT_H

#include <stdbool.h>
#include <stdint.h>

#include "ev_options.h"
#include "taper/port.h"

/** Period of the loop. */
#define EV_POLL_ms 10

/** Let SIGINT and SIGTERM only be noted, and start the timer. @return its file descriptor; -1: none, errno says why. */
int ev_wait_init(void);

/** Wait for the next period. @return false: the program was told to end. */
bool ev_wait_period(int timer);

/** Milliseconds of the monotonic clock; wraps. */
uint32_t ev_now_ms(void *unused);

/**
 * Wait for a controller, and find out whose field it needs: the station with exactly the connectors that it sends SETPOINT
 * to. A station that was given on the command line need not match.
 * @return its index in taper_stations[]; taper_station_count: the program was told to end, or (with a line on stderr and
 *         `*failed`) there is none or more than one, or it has fewer connectors than are to be played.
 */
unsigned ev_wait_for_controller(int timer, const taper_port_t *port, const ev_options_t *options,
                                bool *failed);

#endif
