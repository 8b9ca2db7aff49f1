/** The way of a message of the simulated field onto the bus. */
#ifndef SIM_WIRE_H
#define SIM_WIRE_H

#include <stdbool.h>
#include <stdint.h>

#include "taper/message.h"
#include "taper/port.h"

/**
 * Encode a message, protect it with `*counter` and send it. `*counter` (0..15) moves on by one if the bus took it: a
 * frame that was never sent leaves no gap. @return false: the bus is full.
 */
bool sim_wire_send(const taper_port_t *port, const taper_message_t *message, uint8_t *counter);

#endif
