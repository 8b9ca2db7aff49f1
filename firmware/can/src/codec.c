#include "taper/codec.h"

#include <string.h>

#include "codec_internal.h"
#include "taper/types.h"

#define KINDS 32u

/* Which nodes a function may carry in its identifier; bits. */
#define NODE_CONNECTOR  1u
#define NODE_GATEWAY    2u
#define NODE_CONTROLLER 4u
#define NODE_ANY        7u /* that speaks on the bus by itself: all of these */

typedef struct {
    uint8_t nodes;
    void (*decode)(const uint8_t *data, taper_message_t *message, taper_decoding_t *decoding);
    bool (*encode)(const taper_message_t *message, uint8_t *data);
} route_t;

/** By kind, which is the five bits of the function in an identifier; those that are not decoded here are empty. */
static const route_t routes[KINDS] = {
    [TAPER_MESSAGE_EMCY] = {NODE_ANY, taper_decode_emcy, taper_encode_emcy},
    [TAPER_MESSAGE_SITE_LIMIT] = {NODE_GATEWAY, taper_decode_site_limit, taper_encode_site_limit},
    [TAPER_MESSAGE_SETPOINT] = {NODE_CONNECTOR, taper_decode_setpoint, taper_encode_setpoint},
    [TAPER_MESSAGE_EVSE_STATUS] = {NODE_CONNECTOR, taper_decode_evse_status, taper_encode_evse_status},
    [TAPER_MESSAGE_EV_STATUS] = {NODE_CONNECTOR, taper_decode_ev_status, taper_encode_ev_status},
    [TAPER_MESSAGE_EVSE_ELEC] = {NODE_CONNECTOR, taper_decode_evse_elec, taper_encode_evse_elec},
    [TAPER_MESSAGE_SITE_METER] = {NODE_GATEWAY, taper_decode_site_meter, taper_encode_site_meter},
    [TAPER_MESSAGE_TIME_SYNC] = {NODE_GATEWAY, taper_decode_time_sync, taper_encode_time_sync},
    [TAPER_MESSAGE_CTRL_STATUS] = {NODE_CONTROLLER, taper_decode_ctrl_status, taper_encode_ctrl_status},
    [TAPER_MESSAGE_EV_PARAM_A] = {NODE_CONNECTOR, taper_decode_ev_param_a, taper_encode_ev_param_a},
    [TAPER_MESSAGE_EV_PARAM_B] = {NODE_CONNECTOR, taper_decode_ev_param_b, taper_encode_ev_param_b},
    [TAPER_MESSAGE_EV_PARAM_C] = {NODE_CONNECTOR, taper_decode_ev_param_c, taper_encode_ev_param_c},
    [TAPER_MESSAGE_EVSE_INFO] = {NODE_CONNECTOR, taper_decode_evse_info, taper_encode_evse_info},
    [TAPER_MESSAGE_PLAN] = {NODE_CONNECTOR, taper_decode_plan, taper_encode_plan},
    [TAPER_MESSAGE_OUTLOOK] = {NODE_CONNECTOR, taper_decode_outlook, taper_encode_outlook},
    [TAPER_MESSAGE_CTRL_DIAG] = {NODE_CONTROLLER, taper_decode_ctrl_diag, taper_encode_ctrl_diag},
    [TAPER_MESSAGE_EV_PARAM_D] = {NODE_CONNECTOR, taper_decode_ev_param_d, taper_encode_ev_param_d},
    [TAPER_MESSAGE_EV_PARAM_E] = {NODE_CONNECTOR, taper_decode_ev_param_e, taper_encode_ev_param_e},
};

/* The bit of a node, 0 for one that nobody has. */
static unsigned bit_of(unsigned node) {
    if (node >= 1 && node <= TAPER_NODES_PER_BUS) {
        return NODE_CONNECTOR;
    }
    return node == TAPER_NODE_GATEWAY ? NODE_GATEWAY : node == TAPER_NODE_CONTROLLER ? NODE_CONTROLLER : 0u;
}

/* NULL for a kind that is not decoded here, or a node that it does not allow. */
static const route_t *find_route(unsigned kind, unsigned node) {
    return kind < KINDS && (routes[kind].nodes & bit_of(node)) != 0u ? &routes[kind] : NULL;
}

bool taper_decode(const taper_frame_t *frame, taper_message_t *message, bool *bad_field) {
    const unsigned node = frame->id & 0x3Fu;
    const unsigned kind = (unsigned)frame->id >> 6;
    const route_t *route = find_route(kind, node);
    if (route == NULL || frame->length != TAPER_FRAME_LENGTH) {
        return false;
    }
    memset(message, 0, sizeof *message);
    message->kind = (taper_message_kind_t)kind;
    message->bus = frame->bus;
    message->node = (uint8_t)node;

    taper_decoding_t decoding = {.bad_field = false, .refused = false};
    route->decode(frame->data, message, &decoding);
    if (decoding.bad_field) {
        *bad_field = true;
    }
    if (decoding.refused) {
        memset(message, 0, sizeof *message); /* nothing to act on, even for a caller that does not look */
    }
    return !decoding.refused;
}

bool taper_encode(const taper_message_t *message, taper_frame_t *frame) {
    const route_t *route = find_route((unsigned)message->kind, message->node);
    if (route == NULL) {
        return false;
    }
    memset(frame, 0, sizeof *frame);
    frame->id = taper_can_id(message->kind, message->node);
    frame->bus = message->bus;
    frame->length = TAPER_FRAME_LENGTH;
    return route->encode(message, frame->data);
}
