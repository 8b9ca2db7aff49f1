#include "wire.h"

#include "taper/codec.h"
#include "taper/e2e.h"

bool sim_wire_send(const taper_port_t *port, const taper_message_t *message, uint8_t *counter) {
    taper_frame_t frame;
    if (!taper_encode(message, &frame)) {
        return false;
    }
    taper_e2e_protect(&frame, *counter);
    if (!port->send(port->context, &frame)) {
        return false;
    }
    *counter = (uint8_t)((*counter + 1) % 16);
    return true;
}
