#include "field.h"

#include <math.h>
#include <stddef.h>

#include "field_send.h"
#include "taper/bus.h"

/** Frames taken in one poll. A babbling bus cannot hold it up. */
#define MOST_FRAMES 4096

static void start_curve(sim_field_t *field) {
    sim_curve_init(&field->curve, field->options.limits);
    sim_curve_set_prices(&field->curve, field->options.prices);
}

void sim_field_init(sim_field_t *field, const sim_field_options_t *options, uint32_t now_ms) {
    *field = (sim_field_t){.options = *options, .last_ms = now_ms, .queue_s = INT64_MIN};
    sim_field_options_t *own = &field->options;
    own->time_scale = own->time_scale == 0 ? 1 : own->time_scale;
    const taper_station_config_t *station = own->station;
    for (unsigned i = 0; i < station->connector_count; i++) {
        sim_evse_init(&field->evse[i], &station->connectors[i], (unsigned)(own->seed % 16U) + 7U * i);
        field->evse[i].closed = own->closed != NULL && own->closed[i];
        sim_field_start_connector(field, i);
    }
    sim_queue_init(&field->queue, own->sessions, field->evse, station->connector_count, own->outcome);
    sim_gateway_init(&field->gateway, own->limits, own->port, 0, own->seed);
    start_curve(field);
    sim_field_start_gateway(field);
    sim_tracker_init(&field->tracker, station, own->grace_ms == 0 ? SIM_GRACE_ms : own->grace_ms);
}

void sim_field_free(sim_field_t *field) {
    sim_queue_free(&field->queue);
    sim_watch_free(&field->watch);
}

double sim_field_world_s(const sim_field_t *field) {
    return field->options.world_start_s + (double)field->options.time_scale * (double)field->now_ms / 1000.0;
}

bool sim_field_is_over(const sim_field_t *field) {
    return sim_queue_is_over(&field->queue);
}

void sim_field_finish(sim_field_t *field) {
    sim_queue_finish(&field->queue);
}

double sim_field_limit_kw(const sim_field_t *field) {
    if (field->options.no_gateway) {
        return (double)INFINITY;
    }
    const bool holds =
        field->limit_told && field->now_ms - field->limit_told_ms <= TAPER_SITE_LIMIT_TIMEOUT_ms;
    return holds ? field->limit_told_kw : (double)field->options.station->failsafe_W / 1000.0;
}

/** Batteries get what was drawn since the last poll. */
static void charge(sim_field_t *field, int64_t passed_ms) {
    const double passed_h = (double)field->options.time_scale * (double)passed_ms / 3.6e6;
    for (unsigned i = 0; i < field->options.station->connector_count; i++) {
        sim_evse_t *evse = &field->evse[i];
        if (evse->vehicle != NULL) {
            evse->energy_kwh += fmin(evse->power_kw * passed_h, sim_evse_missing_kwh(evse));
        }
    }
}

static void move_vehicles(sim_field_t *field) {
    const int64_t second = (int64_t)floor(sim_field_world_s(field));
    if (second != field->queue_s) {
        sim_queue_advance(&field->queue, second);
        field->queue_s = second;
    }
}

static void gateway_listens(sim_field_t *field, const taper_frame_t *frame) {
    if (!field->options.no_gateway && !field->gateway_dead) {
        sim_curve_watch(&field->curve, frame, (uint32_t)field->now_ms);
        (void)sim_curve_take(&field->curve, frame, (uint32_t)field->now_ms);
    }
}

static void listen(sim_field_t *field) {
    const taper_port_t *port = field->options.port;
    taper_frame_t frame;
    for (unsigned taken = 0; taken < MOST_FRAMES && port->receive(port->context, &frame); taken++) {
        sim_watch_take(&field->watch, &frame);
        gateway_listens(field, &frame);
        const int i = sim_setpoint_connector(field->options.station, &frame);
        if (i >= 0 && !field->evse[i].closed && !field->node[i].dead &&
            sim_evse_hear(&field->evse[i], &frame)) {
            field->node[i].accepted_ms = field->now_ms;
        }
    }
}

/** The vehicle follows the offer, after its time of reaction. */
static void follow(const sim_field_t *field, sim_node_t *node, const sim_evse_t *evse) {
    const int32_t offered_mA = sim_evse_offered_mA(evse, evse->setpoint_mA);
    if (evse->vehicle == NULL || node->session != evse->session) {
        node->session = evse->session;
        node->followed_mA = 0;
        node->changing = false;
    }
    if (node->followed_mA == offered_mA) {
        node->changing = false;
        return;
    }
    if (!node->changing) {
        node->changing = true;
        node->follow_ms = field->now_ms + field->options.vehicle_delay_ms;
    }
    if (field->now_ms >= node->follow_ms) {
        node->followed_mA = offered_mA;
        node->changing = false;
    }
}

static void draw(sim_field_t *field, unsigned i) {
    sim_evse_t *evse = &field->evse[i];
    sim_node_t *node = &field->node[i];
    if (evse->in_force && field->now_ms - node->accepted_ms >= evse->validity_ms) {
        evse->in_force = false;
    }
    sim_evse_obey(evse);
    follow(field, node, evse);
    evse->power_kw = 0.0;
    evse->current_A = 0.0;
    if (sim_evse_wants(evse)) {
        sim_evse_draw(evse, node->followed_mA, sim_evse_takes_kw(evse));
    }
}

/** Most that a connector lets its vehicle draw, whatever that wants [A]. */
static double may_A(const sim_evse_t *evse) {
    return evse->vehicle == NULL ? 0.0 : (double)sim_evse_offered_mA(evse, evse->setpoint_mA) / 1000.0;
}

static void look(sim_field_t *field) {
    const taper_station_config_t *station = field->options.station;
    sim_load_t drawn[TAPER_MAX_CONNECTORS];
    sim_load_t may[TAPER_MAX_CONNECTORS];
    for (unsigned i = 0; i < station->connector_count; i++) {
        const sim_evse_t *evse = &field->evse[i];
        drawn[i] = sim_load_of(station, i, sim_evse_conductors(evse), evse->current_A);
        may[i] = sim_load_of(station, i, sim_evse_conductors(evse), may_A(evse));
    }
    sim_tracker_look(&field->tracker, (uint64_t)field->now_ms, sim_field_limit_kw(field), drawn, may);
}

void sim_field_poll(sim_field_t *field, uint32_t now_ms) {
    const int64_t passed_ms = (int64_t)(uint32_t)(now_ms - field->last_ms);
    field->last_ms = now_ms;
    field->now_ms += passed_ms;
    charge(field, passed_ms);
    move_vehicles(field);
    listen(field);
    for (unsigned i = 0; i < field->options.station->connector_count; i++) {
        draw(field, i);
    }
    sim_field_send(field);
    look(field);
}

void sim_field_kill(sim_field_t *field, unsigned node) {
    if (node == SIM_GATEWAY) {
        field->gateway_dead = true;
    } else {
        field->node[node].dead = true;
    }
}

void sim_field_power_off(sim_field_t *field, unsigned node) {
    sim_field_kill(field, node);
    if (node == SIM_GATEWAY) {
        field->gateway.counter[0] = 0;
        field->gateway.counter[1] = 0;
        start_curve(field);
        sim_field_start_gateway(field);
    } else {
        sim_evse_restart(&field->evse[node]);
        sim_field_start_connector(field, node);
    }
}

void sim_field_revive(sim_field_t *field, unsigned node) {
    if (node == SIM_GATEWAY) {
        field->gateway_dead = false;
    } else {
        field->node[node].dead = false;
    }
}
