/* What a connector says on the bus. */
#include <math.h>

#include "node.h"

#define PILOT_A 0u
#define PILOT_C 2u

static void seal_and_send(node_t *node, taper_frame_t *frame, node_send_t send, void *context) {
    const unsigned function = wire_function(frame);
    wire_seal(frame, node->counter[function]);
    node->counter[function] = (uint8_t)((node->counter[function] + 1u) & 0x0Fu);
    node->sent++;
    send(context, node, frame);
}

/** A current in steps of the wire, rounded up; in a lie anything. */
static uint32_t measured_dA(node_t *node, unsigned conductor) {
    if (node->lie == LIE_MEASURES && random_once_in(node->random, 2)) {
        return random_below(node->random, 0x1000);
    }
    return (uint32_t)ceil(fmin(node->drawn_mA[conductor] / 100.0, 4094.0));
}

static void send_status(node_t *node, node_send_t send, void *context) {
    taper_frame_t frame = wire_frame(WIRE_EVSE_STATUS, node->config->node);
    wire_put(&frame, 12, 4, node->plugged ? PILOT_C : PILOT_A);
    for (unsigned k = 0; k < 3; k++) {
        wire_put(&frame, 16 + 12 * k, 12, measured_dA(node, k));
    }
    wire_put(&frame, 52, 1, node->plugged && !node->open);
    wire_put(&frame, 56, 4, node->echo);
    wire_put(&frame, 60, 2, node->plugged ? node->claimed : 0u);
    wire_put(&frame, 62, 1, node->fell_back);
    wire_put(&frame, 63, 1, node->plugged);
    seal_and_send(node, &frame, send, context);
}

static void send_ev_status(node_t *node, node_send_t send, void *context) {
    taper_frame_t frame = wire_frame(WIRE_EV_STATUS, node->config->node);
    const double soc = fmin(0.2 + node->drawn_Wh / node->capacity_Wh, 1.0);
    wire_put(&frame, 16, 8, (uint32_t)(soc * 200.0));
    wire_put(&frame, 24, 8, random_below(node->random, 3));
    wire_put(&frame, 32, 16, (uint32_t)(node->own_mA + 99) / 100u);
    wire_put(&frame, 48, 8, 0xFF);
    wire_put(&frame, 56, 1, node->drawn_Wh >= node->wanted_Wh);
    wire_put(&frame, 58, 1, 1);
    wire_put(&frame, 63, 1, node->pauses);
    if (node->absurd) {
        wire_put(&frame, 16, 16, (uint32_t)random_bits(node->random));
        wire_put(&frame, 32, 16, (uint32_t)node->absurd_bits[3]);
    }
    seal_and_send(node, &frame, send, context);
}

static void send_elec(node_t *node, node_send_t send, void *context) {
    taper_frame_t frame = wire_frame(WIRE_EVSE_ELEC, node->config->node);
    const double power_W = node->drawn_mA[0] / 1000.0 * node->config->voltage_mV / 1000.0 * node->conductors;
    wire_put(&frame, 16, 16, (node->voltage_mV + 99u) / 100u);
    wire_put(&frame, 32, 16, (uint32_t)ceil(power_W / 10.0));
    wire_put(&frame, 48, 16, (uint32_t)(node->drawn_Wh / 10.0));
    seal_and_send(node, &frame, send, context);
}

static taper_frame_t param(const node_t *node, unsigned function) {
    taper_frame_t frame = wire_frame(function, node->config->node);
    wire_put(&frame, 16, 32, (uint32_t)node->absurd_bits[function & 3u]);
    wire_put(&frame, 32, 32, (uint32_t)(node->absurd_bits[function & 3u] >> 32));
    wire_put(&frame, 12, 4, node->revision);
    return frame;
}

static void send_param_a(node_t *node, node_send_t send, void *context) {
    taper_frame_t frame = param(node, WIRE_EV_PARAM_A);
    wire_put(&frame, 16, 8, node->session);
    if (!node->absurd) {
        wire_put(&frame, 24, 16, (uint32_t)(node->capacity_Wh / 100.0));
        wire_put(&frame, 40, 8, 160);
        wire_put(&frame, 48, 8, 0xFF);
        wire_put(&frame, 56, 8, 40);
    }
    seal_and_send(node, &frame, send, context);
}

static void send_param_b(node_t *node, node_send_t send, void *context) {
    taper_frame_t frame = param(node, WIRE_EV_PARAM_B);
    if (!node->absurd) {
        const double peak_W = node->own_mA / 1000.0 * node->config->voltage_mV / 1000.0 * node->conductors;
        wire_put(&frame, 32, 16, (uint32_t)ceil(peak_W / 10.0));
        wire_put(&frame, 48, 8, (uint32_t)(node->min_mA + 499) / 500u);
    }
    wire_put(&frame, 56, 8, node->session);
    seal_and_send(node, &frame, send, context);
}

static void send_param_c(node_t *node, node_send_t send, void *context) {
    taper_frame_t frame = param(node, WIRE_EV_PARAM_C);
    if (!node->absurd) {
        wire_put(&frame, 16, 16, (uint32_t)ceil(node->wanted_Wh / 20.0));
        wire_put(&frame, 32, 32, 0x80008000u);
    }
    seal_and_send(node, &frame, send, context);
}

static void send_param_d(node_t *node, node_send_t send, void *context) {
    taper_frame_t frame = param(node, WIRE_EV_PARAM_D);
    wire_put(&frame, 56, 8, node->session);
    seal_and_send(node, &frame, send, context);
}

static void send_info(node_t *node, node_send_t send, void *context) {
    taper_frame_t frame = wire_frame(WIRE_EVSE_INFO, node->config->node);
    const unsigned kind = node->config->is_dc ? 3u : node->config->phases == 3 ? 2u : 1u;
    wire_put(&frame, 12, 4, node->info_odd ? random_below(node->random, 3) : 1u);
    wire_put(&frame, 16, 16, (uint32_t)node->config->max_mA / 100u);
    wire_put(&frame, 32, 8, (uint32_t)node->config->min_mA / 500u);
    wire_put(&frame, 40, 2, kind);
    wire_put(&frame, 42, 3, node->info_odd ? random_below(node->random, 8) : node->config->rotation);
    seal_and_send(node, &frame, send, context);
}

void node_report(node_t *node, uint64_t tick, unsigned poll, node_send_t send, void *context) {
    send_status(node, send, context);
    if (poll == 1 && (tick + node->config->node) % 5u == 0) {
        send_info(node, send, context);
    }
    if (!node->plugged) {
        return;
    }
    if (poll % 2u == 0) {
        send_ev_status(node, send, context);
    }
    if (poll == 0) {
        send_elec(node, send, context);
    }
    if (poll == 3 && (tick + node->config->node) % 2u == 0) {
        send_param_a(node, send, context);
        send_param_b(node, send, context);
        send_param_c(node, send, context);
        send_param_d(node, send, context);
    }
}
