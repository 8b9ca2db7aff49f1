/** The way of a message of the simulated field onto the bus. */
#ifndef SIM_WIRE_H
#define SIM_WIRE_H

#include <stdbool.h>
#include <stdint.h>

#include "taper/membus.h"
#include "taper/message.h"

/** Encode a message, protect it with `*counter`, which moves on by one (0..15), and send it. @return false: bus full. */
bool sim_wire_send(taper_membus_t *bus, const taper_message_t *message, uint8_t *counter);

#endif
