#include "node.h"

#include <math.h>
#include <string.h>

#define RISES_ms 3000

void node_init(node_t *node, const taper_connector_config_t *config, random_t *random) {
    memset(node, 0, sizeof *node);
    node->config = config;
    node->random = random;
    node->link_in = true;
    node->link_out = true;
    node->fell_back = true;
    node->plug_ms = random_in(random, 0, 60000);
    node->voltage_mV = (uint32_t)config->voltage_mV;
}

/** No setpoint, no memory of one. */
static void forget(node_t *node) {
    node->level_mA = 0;
    node->fallback_mA = 0;
    node->highest_mA = 0;
    node->fell_back = true;
    node->open = false;
    node->lates = 0;
    node->rises_ms = 0;
}

static void next_session(node_t *node) {
    node->session = (uint8_t)(node->session % 255u + 1u);
    node->revision = (uint8_t)((node->revision + 1u) & 0x0Fu);
    node->drawn_Wh = 0.0;
    forget(node);
}

void node_reboot(node_t *node) {
    memset(&node->receiver, 0, sizeof node->receiver);
    node->echo = 0;
    memset(node->counter, 0, sizeof node->counter);
    if (node->plugged) {
        next_session(node);
    } else {
        forget(node);
    }
}

/** What the vehicle uses, and what it says that it uses. */
static void choose_conductors(node_t *node) {
    const uint8_t wired = node->config->phases;
    const uint8_t some = (uint8_t)random_in(node->random, 1, 3);
    node->conductors = wired == 1 || random_once_in(node->random, 2) ? wired : some;
    node->claimed = node->conductors;
    node->allowed = 0;
    if (wired == 3 && node->lie == LIE_CLAIMS_MORE) {
        node->conductors = 1;
        node->claimed = 3;
    } else if (wired == 3 && node->lie == LIE_CLAIMS_FEWER) {
        node->conductors = 3;
        node->claimed = 1;
    }
}

void node_plug(node_t *node, lie_t lie) {
    random_t *random = node->random;
    const int32_t most_mA = node->config->max_mA;
    next_session(node);
    node->plugged = true;
    node->lie = lie;
    choose_conductors(node);
    node->own_mA = random_once_in(random, 3) ? most_mA : random_in(random, most_mA / 5, most_mA * 3 / 2);
    node->min_mA = random_once_in(random, 5) ? random_in(random, 0, 16000) : 6000;
    node->over_factor = 1.0 + random_in(random, 10, 150) / 100.0;
    node->capacity_Wh = random_in(random, 10, 100) * 1000.0;
    node->wanted_Wh = random_once_in(random, 6) ? 500.0 : node->capacity_Wh * 0.6;
    node->absurd = random_once_in(random, 12);
    node->pauses = random_once_in(random, 15);
    node->voltage_mV = (uint32_t)(node->config->voltage_mV / 100 * random_in(random, 95, 103));
    for (unsigned k = 0; k < 4; k++) {
        node->absurd_bits[k] = random_bits(random);
    }
}

void node_unplug(node_t *node) {
    forget(node);
    node->plugged = false;
    node->lie = LIE_NONE;
    memset(node->drawn_mA, 0, sizeof node->drawn_mA);
}

/** What the vehicle has understood so far. */
static int32_t understood_mA(const node_t *node, int64_t now_ms) {
    if (now_ms >= node->rises_ms || node->level_mA < node->risen_from_mA) {
        return node->level_mA;
    }
    return node->risen_from_mA;
}

static void remember(node_t *node, int32_t mA, int64_t until_ms) {
    if (node->lates < NODE_LATE) {
        node->late[node->lates] = (late_t){mA, until_ms};
        node->lates++;
    }
}

/** A new level on the pilot. A lower one is followed just in time, or sooner. */
static void show(node_t *node, int32_t level_mA, int64_t now_ms) {
    const int32_t before_mA = understood_mA(node, now_ms);
    const int32_t longest_ms = (int32_t)node->config->reaction_ms;
    if (level_mA < before_mA) {
        const bool lazy = random_once_in(node->random, 2);
        remember(node, before_mA, now_ms + (lazy ? longest_ms : random_in(node->random, 0, longest_ms)));
    } else if (level_mA > node->level_mA) {
        node->risen_from_mA = before_mA;
        node->rises_ms = now_ms + random_in(node->random, 0, RISES_ms);
    }
    node->level_mA = level_mA;
    node->highest_mA = level_mA > node->highest_mA ? level_mA : node->highest_mA;
}

void node_hear(node_t *node, const taper_frame_t *frame, int64_t now_ms) {
    if (wire_function(frame) != WIRE_SETPOINT || !wire_accepts(&node->receiver, frame)) {
        return;
    }
    const wire_setpoint_t setpoint = wire_setpoint(frame);
    if (setpoint.session != (node->plugged ? node->session : 0)) {
        return;
    }
    node->echo = setpoint.counter;
    node->fallback_mA = setpoint.fallback_mA;
    if (setpoint.current_mA > 0) {
        node->allowed = setpoint.phase_mask == 7 ? 3 : setpoint.phase_mask == 3 ? 2 : 1;
    }
    node->expires_ms = now_ms + setpoint.validity_ms;
    node->fell_back = false;
    node->open = setpoint.command == WIRE_STOP || setpoint.command == WIRE_EMERGENCY;
    show(node, setpoint.command == WIRE_CHARGE ? setpoint.current_mA : 0, now_ms);
}

static double legal_mA(node_t *node, int64_t now_ms) {
    int32_t most_mA = understood_mA(node, now_ms);
    unsigned kept = 0;
    for (unsigned k = 0; k < node->lates; k++) {
        if (node->late[k].until_ms > now_ms) {
            most_mA = node->late[k].mA > most_mA ? node->late[k].mA : most_mA;
            node->late[kept] = node->late[k];
            kept++;
        }
    }
    node->lates = kept;
    return most_mA;
}

/** Falls from the own limit at three quarters full to a tenth of it. */
static double taper_mA(const node_t *node) {
    const double filled = node->drawn_Wh / node->wanted_Wh;
    if (filled >= 1.0) {
        return 0.0;
    }
    return node->own_mA * (filled < 0.75 ? 1.0 : 1.0 - 3.6 * (filled - 0.75));
}

static double drawn_mA(node_t *node, int64_t now_ms) {
    const double legal = legal_mA(node, now_ms);
    const double wish = taper_mA(node);
    if (!node->plugged || node->open || node->pauses) {
        return 0.0;
    }
    switch (node->lie) {
    case LIE_OVER_DRAWS: return legal > 0.0 ? fmin(legal * node->over_factor, 80000.0) : 0.0;
    case LIE_IGNORES: return node->highest_mA;
    case LIE_UNDER_DRAWS: return fmin(fmin(legal, wish), 6000.0);
    case LIE_NONE:
    case LIE_CLAIMS_MORE:
    case LIE_CLAIMS_FEWER:
    case LIE_MEASURES:
    case LIES:
    default: return fmin(legal, wish);
    }
}

void node_run(node_t *node, int64_t now_ms, int64_t passed_ms) {
    if (!node->fell_back && now_ms >= node->expires_ms) {
        node->fell_back = true;
        show(node, node->fallback_mA, now_ms);
    }
    const double mA = drawn_mA(node, now_ms);
    const bool obeys =
        node->lie != LIE_CLAIMS_FEWER && node->allowed != 0 && node->allowed < node->conductors;
    const unsigned conductors = obeys ? node->allowed : node->conductors;
    for (unsigned k = 0; k < 3; k++) {
        node->drawn_mA[k] = k < conductors ? mA : 0.0;
    }
    const double power_W = mA / 1000.0 * node->config->voltage_mV / 1000.0 * conductors;
    node->drawn_Wh += power_W * (double)passed_ms / 3.6e6;
}

bool node_wants(const node_t *node) {
    return node->plugged && node->lie == LIE_NONE && !node->absurd && !node->pauses && !node->info_odd &&
           node->drawn_Wh < node->wanted_Wh && node->min_mA <= node->config->min_mA &&
           node->own_mA >= node->config->min_mA;
}
