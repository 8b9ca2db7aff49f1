/**
 * The station bus once more, from docs/protocol.md and not from the firmware: bits of a frame, its protection, and what a
 * receiver makes of it. Shared by the world's nodes and the accountant.
 */
#ifndef HOSTILE_WIRE_H
#define HOSTILE_WIRE_H

#include <stdbool.h>
#include <stdint.h>

#include "taper/frame.h"

#define WIRE_GATEWAY 62u

/** Function codes: id = function << 6 | node. */
enum {
    WIRE_SITE_LIMIT = 2,
    WIRE_SETPOINT = 3,
    WIRE_EVSE_STATUS = 4,
    WIRE_EV_STATUS = 5,
    WIRE_EVSE_ELEC = 6,
    WIRE_SITE_METER = 7,
    WIRE_TIME_SYNC = 8,
    WIRE_EV_PARAM_A = 10,
    WIRE_EV_PARAM_B = 11,
    WIRE_EV_PARAM_C = 12,
    WIRE_EVSE_INFO = 13,
    WIRE_EV_PARAM_D = 16,
    WIRE_FUNCTIONS = 32,
};

/** Commands of a SETPOINT. */
enum { WIRE_PAUSE = 0, WIRE_CHARGE = 1, WIRE_STOP = 2, WIRE_EMERGENCY = 15 };

/** A SETPOINT in the units of this folder. */
typedef struct {
    unsigned command;
    int32_t current_mA;
    uint32_t validity_ms;
    int32_t fallback_mA;
    unsigned phase_mask;
    uint8_t session;
    uint8_t counter;
} wire_setpoint_t;

/** A receiver of one identifier. Zero-initialised: nothing heard yet. */
typedef struct {
    bool heard;
    uint8_t counter;
    uint8_t errors; /**< bit k: the frame k before the last was bad */
} wire_receiver_t;

/** An empty frame; its bits are set with wire_put(), and wire_seal() makes it whole. */
taper_frame_t wire_frame(unsigned function, unsigned node);

unsigned wire_function(const taper_frame_t *frame);
unsigned wire_node(const taper_frame_t *frame);

/** `length` bits, 1..32, from bit `start` on; little endian. */
void wire_put(taper_frame_t *frame, unsigned start, unsigned length, uint32_t value);
uint32_t wire_get(const taper_frame_t *frame, unsigned start, unsigned length);
int32_t wire_get_signed(const taper_frame_t *frame, unsigned start, unsigned length);

/** Set counter (modulo 16) and CRC. */
void wire_seal(taper_frame_t *frame, unsigned counter);

/** Whether length and CRC are right. */
bool wire_is_sound(const taper_frame_t *frame);

/** Whether a receiver uses this frame: sound, one to three counters on, and no more than two of the last five bad. */
bool wire_accepts(wire_receiver_t *receiver, const taper_frame_t *frame);

wire_setpoint_t wire_setpoint(const taper_frame_t *frame);

#endif
