/**
 * Frame <-> message. Packing and unpacking of bits is generated from `codegen/bus.toml` by cantools; this layer turns
 * raw values into integers with units, and refuses what is out of range.
 */
#ifndef TAPER_CODEC_H
#define TAPER_CODEC_H

#include <stdbool.h>

#include "taper/frame.h"
#include "taper/message.h"

/**
 * Decode a frame whose end-to-end check was good.
 * A field outside its range becomes TAPER_ABSENT and sets `*bad_field` (never cleared); no field is clamped.
 * @return false, and `*message` is not to be used, for
 *         - an id that the bus does not have, or with a node that its function does not allow (connectors 1..60,
 *           gateway 62, controller 0; EMCY all of these), an id of ISO-TP, or a length other than 8: `*bad_field` is left
 *           alone;
 *         - an out-of-range value where there is no code for "absent" and no layer could do without it (severity, pilot
 *           state, command, mode, reason, the currents and times of a SETPOINT, milliseconds): `*bad_field` is set.
 * An unnamed kind or rotation of EVSE_INFO becomes unknown, and sets `*bad_field`.
 */
bool taper_decode(const taper_frame_t *frame, taper_message_t *message, bool *bad_field);

/**
 * Encode a message; counter and CRC are left zero for taper_e2e_protect(). Values are rounded to the step of the wire
 * in the safe direction: limits, setpoints, measured energy and the taper down; what a vehicle wants or can take, and
 * measured current, voltage and power, up; states of charge, the capacity and planned power to the nearest.
 * A value the wire cannot hold becomes its nearest end, TAPER_ABSENT becomes "absent" (0 in a SETPOINT, which has no
 * code for it), and so does a capacity that is not positive.
 * @return false for an unknown kind, a node that its function does not allow, or an unnamed severity,
 *         command, pilot state, mode, reason, kind or rotation.
 */
bool taper_encode(const taper_message_t *message, taper_frame_t *frame);

/** 11-bit identifier of a message kind from or for a node. */
static inline uint16_t taper_can_id(taper_message_kind_t kind, uint8_t node) {
    return (uint16_t)(((unsigned)kind << 6) | node);
}

#endif
