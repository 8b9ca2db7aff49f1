/**
 * A connector's controller and its vehicle, written anew for this test. The controller takes a setpoint if its frame is
 * right and its session the present one; holds it for its validity and then falls back. The vehicle follows a lower one as
 * late as it may and a higher one sooner or later, and takes no more than its own limit. Some vehicles lie.
 */
#ifndef HOSTILE_NODE_H
#define HOSTILE_NODE_H

#include "random.h"
#include "wire.h"

#include "taper/types.h"

typedef enum {
    LIE_NONE,
    LIE_OVER_DRAWS,
    LIE_IGNORES,      /**< goes on with the highest setpoint that it ever had */
    LIE_CLAIMS_MORE,  /**< conductors than it uses */
    LIE_CLAIMS_FEWER, /**< conductors than it uses */
    LIE_UNDER_DRAWS,
    LIE_MEASURES, /**< its connector reports absurd currents */
    LIES,
} lie_t;

#define NODE_LATE 16u

typedef struct {
    int32_t mA;
    int64_t until_ms;
} late_t;

typedef struct {
    const taper_connector_config_t *config;
    random_t *random;
    bool link_in, link_out; /**< the bus reaches it; it reaches the bus */
    int64_t in_dead_until_ms, out_dead_until_ms;

    bool plugged;
    uint8_t session, revision;
    int64_t plug_ms; /**< when the next vehicle comes, or this one goes */
    lie_t lie;
    uint8_t conductors, claimed; /**< used, if the phase mask allows it; told */
    uint8_t allowed; /**< by the phase mask of the last setpoint with a current; 0: none came yet */
    int32_t own_mA, min_mA;
    double over_factor, drawn_Wh, wanted_Wh, capacity_Wh;
    bool absurd, pauses, info_odd;
    uint32_t voltage_mV; /**< told */
    uint64_t absurd_bits[4];

    wire_receiver_t receiver;
    uint8_t echo;
    int32_t level_mA, fallback_mA, highest_mA;
    int64_t expires_ms;
    bool fell_back, open;

    int32_t risen_from_mA;
    int64_t rises_ms;
    late_t late[NODE_LATE];
    unsigned lates;
    double drawn_mA[3];

    uint8_t counter[WIRE_FUNCTIONS];
    uint64_t sent;
} node_t;

/** Takes a frame to the station's end of the bus. */
typedef void (*node_send_t)(void *context, node_t *node, const taper_frame_t *frame);

void node_init(node_t *node, const taper_connector_config_t *config, random_t *random);

/** Power goes and comes back: what it was told is forgotten; a vehicle begins a new session. */
void node_reboot(node_t *node);

void node_plug(node_t *node, lie_t lie);
void node_unplug(node_t *node);

/** A frame came over the bus. */
void node_hear(node_t *node, const taper_frame_t *frame, int64_t now_ms);

/** Setpoints expire and the vehicle draws, `passed_ms` since the last call. */
void node_run(node_t *node, int64_t now_ms, int64_t passed_ms);

/** Whether its vehicle wants current, says so and does not lie. */
bool node_wants(const node_t *node);

/** Reports, by the poll within a tick. */
void node_report(node_t *node, uint64_t tick, unsigned poll, node_send_t send, void *context);

#endif
