#include "field_send.h"

#include "taper/bus.h"
#include "wire.h"

/** Least time between two frames that tell of charging: at a high time scale it moves faster than is worth telling. */
#define GAP_ms 100
/** The gateway grants the longest validity that stations do. */
#define LIMIT_VALIDITY_S (TAPER_SITE_LIMIT_TIMEOUT_ms / 1000)
/** Steps of EVSE_ELEC and EV_STATUS on the wire. */
#define ENERGY_STEP_WH    10
#define SOC_STEP_PERMILLE 5
/** Most that is ever due at once: a flow control, and the next frame of the curve. */
#define CURVE_FRAMES 2

static const sim_cycle_t cycles[SIM_EVSE_FRAMES] = {
    [SIM_EVSE_STATUS] = {TAPER_EVSE_STATUS_CYCLE_ms, 0},
    [SIM_EV_STATUS] = {TAPER_EV_STATUS_CYCLE_ms, GAP_ms},
    [SIM_EVSE_ELEC] = {TAPER_EVSE_ELEC_CYCLE_ms, GAP_ms},
    [SIM_EV_PARAM_A] = {TAPER_EV_PARAM_A_CYCLE_ms, 0},
    [SIM_EV_PARAM_B] = {TAPER_EV_PARAM_B_CYCLE_ms, 0},
    [SIM_EV_PARAM_C] = {TAPER_EV_PARAM_C_CYCLE_ms, 0},
    [SIM_EV_PARAM_D] = {TAPER_EV_PARAM_D_CYCLE_ms, 0},
    [SIM_EV_PARAM_E] = {TAPER_EV_PARAM_E_CYCLE_ms, 0},
    [SIM_EVSE_INFO] = {TAPER_EVSE_INFO_CYCLE_ms, 0},
};
static const sim_cycle_t time_cycle = {TAPER_TIME_SYNC_CYCLE_ms, 0};
static const sim_cycle_t limit_cycle = {TAPER_SITE_LIMIT_CYCLE_ms, 0};

/** Phase of connector `i` of `n` in a period. */
static int64_t phase_ms(int64_t period_ms, unsigned i, unsigned n) {
    return period_ms * (int64_t)i / (int64_t)n;
}

void sim_field_start_connector(sim_field_t *field, unsigned connector) {
    const unsigned n = field->options.station->connector_count;
    const int64_t first_ms = field->now_ms + phase_ms(TAPER_EVSE_STATUS_CYCLE_ms, connector, n);
    for (unsigned k = 0; k < SIM_EVSE_FRAMES; k++) {
        sim_slot_start(&field->node[connector].slot[k], &cycles[k], first_ms,
                       phase_ms(cycles[k].period_ms, connector, n));
    }
}

void sim_field_start_gateway(sim_field_t *field) {
    sim_slot_start(&field->time_slot, &time_cycle, field->now_ms, 0);
    sim_slot_start(&field->limit_slot, &limit_cycle, field->now_ms, limit_cycle.period_ms / 2);
}

static uint32_t status_key(const taper_evse_status_t *status) {
    return (uint32_t)status->pilot | (uint32_t)status->setpoint_echo << 4 |
           (uint32_t)status->contactor_closed << 8 | (uint32_t)status->fallback_active << 9 |
           (uint32_t)status->ev_present << 10;
}

/**
 * What of a message is worth a frame when it changes. Never 0, with which slots start. A message is made only where its
 * content tells: this is asked at every poll, of every connector.
 */
static uint32_t key_of(const sim_evse_t *evse, sim_evse_frame_t frame) {
    const uint32_t session = (uint32_t)evse->session << 24;
    switch (frame) {
    case SIM_EVSE_STATUS: {
        const taper_message_t message = sim_evse_message(evse, frame);
        return 1u << 23 | status_key(&message.as.evse_status);
    }
    case SIM_EV_STATUS: {
        const taper_message_t message = sim_evse_message(evse, frame);
        return session | (uint32_t)(message.as.ev_status.soc_permille / SOC_STEP_PERMILLE) << 1 |
               (uint32_t)message.as.ev_status.complete;
    }
    case SIM_EVSE_ELEC: {
        const taper_message_t message = sim_evse_message(evse, frame);
        return session | (uint32_t)(message.as.evse_elec.energy_Wh / ENERGY_STEP_WH);
    }
    case SIM_EVSE_INFO: return 1;
    default: return session | evse->revision; // EV_PARAM_A..E
    }
}

static bool is_said(const sim_field_t *field, const sim_evse_t *evse, unsigned frame) {
    if (frame == SIM_EVSE_STATUS || frame == SIM_EVSE_INFO) {
        return true;
    }
    if (evse->vehicle == NULL || (frame == SIM_EV_PARAM_E && evse->vehicle->second_max_kw <= 0.0)) {
        return false;
    }
    return (frame != SIM_EV_PARAM_D && frame != SIM_EV_PARAM_E) || field->options.tells_taper;
}

static void send_connector(sim_field_t *field, unsigned connector) {
    sim_evse_t *evse = &field->evse[connector];
    for (unsigned k = 0; k < SIM_EVSE_FRAMES; k++) {
        sim_slot_t *slot = &field->node[connector].slot[k];
        if (!is_said(field, evse, k)) {
            continue;
        }
        const uint32_t key = key_of(evse, (sim_evse_frame_t)k);
        if (!sim_slot_is_due(slot, &cycles[k], field->now_ms, key)) {
            continue;
        }
        const taper_message_t message = sim_evse_message(evse, (sim_evse_frame_t)k);
        if (sim_wire_send(field->options.port, &message, &evse->counter[k])) {
            sim_slot_sent(slot, &cycles[k], field->now_ms, key);
        } else {
            field->send_refused++;
        }
    }
}

static void send_time(sim_field_t *field) {
    if (!sim_slot_is_due(&field->time_slot, &time_cycle, field->now_ms, 0)) {
        return;
    }
    if (sim_gateway_send_time(&field->gateway, sim_field_world_s(field))) {
        sim_slot_sent(&field->time_slot, &time_cycle, field->now_ms, 0);
    } else {
        field->send_refused++;
    }
}

/** The key is the place of the limit in its course. */
static void send_limit(sim_field_t *field) {
    const double world_s = sim_field_world_s(field);
    const double limit_kw = sim_gateway_limit_at_kw(&field->gateway, world_s);
    const sim_course_t *limits = field->options.limits;
    const uint32_t key = limits == NULL ? 1 : (uint32_t)sim_course_point(limits, world_s) + 1;
    if (!sim_slot_is_due(&field->limit_slot, &limit_cycle, field->now_ms, key)) {
        return;
    }
    if (!sim_gateway_send_limit(&field->gateway, limit_kw, LIMIT_VALIDITY_S)) {
        field->send_refused++;
        return;
    }
    sim_slot_sent(&field->limit_slot, &limit_cycle, field->now_ms, key);
    field->limit_told = true;
    field->limit_told_ms = field->now_ms;
    field->limit_told_kw = limit_kw;
}

static void send_curve(sim_field_t *field) {
    const taper_port_t *port = field->options.port;
    const uint32_t now_ms = (uint32_t)field->now_ms;
    taper_frame_t frame;
    for (unsigned k = 0;
         k < CURVE_FRAMES && sim_curve_next(&field->curve, sim_field_world_s(field), now_ms, &frame); k++) {
        if (!port->send(port->context, &frame)) {
            field->send_refused++;
            return;
        }
        sim_curve_sent(&field->curve, now_ms);
    }
}

void sim_field_send(sim_field_t *field) {
    if (!field->options.no_gateway && !field->gateway_dead) {
        send_time(field);
        send_limit(field);
        send_curve(field);
    }
    for (unsigned i = 0; i < field->options.station->connector_count; i++) {
        if (!field->evse[i].closed && !field->node[i].dead) {
            send_connector(field, i);
        }
    }
}
