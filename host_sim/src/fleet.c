#include "fleet.h"

#include <math.h>
#include <stddef.h>

#include "wire.h"

void sim_fleet_init(sim_fleet_t *fleet, const taper_station_config_t *station, const taper_port_t *port,
                    bool tells_taper, uint64_t seed) {
    *fleet = (sim_fleet_t){.station = station,
                           .port = port,
                           .tick_s = (double)station->tick_ms / 1000.0,
                           .tells_taper = tells_taper};
    for (unsigned i = 0; i < station->connector_count; i++) {
        sim_evse_init(&fleet->evse[i], &station->connectors[i], (unsigned)(seed % 16U) + 7U * i);
    }
}

void sim_fleet_set_errors(sim_fleet_t *fleet, const sim_errors_t *errors) {
    for (unsigned i = 0; i < fleet->station->connector_count; i++) {
        fleet->evse[i].errors = errors;
    }
}

/** Send the first `count` kinds of frames. */
static bool send_first(sim_fleet_t *fleet, sim_evse_t *evse, unsigned count) {
    bool sent = true;
    for (unsigned k = 0; k < count; k++) {
        if (evse->errors != NULL) {
            sim_errors_measure(evse->errors, &evse->wrong);
        }
        const taper_message_t message = sim_evse_message(evse, (sim_evse_frame_t)k);
        sent = sim_wire_send(fleet->port, &message, &evse->counter[k]) && sent;
    }
    return sent;
}

bool sim_fleet_report(sim_fleet_t *fleet, unsigned connector) {
    sim_evse_t *evse = &fleet->evse[connector];
    unsigned count = SIM_EVSE_STATUS + 1; // without a vehicle the heartbeat alone
    if (evse->vehicle != NULL) {
        const unsigned lines = !fleet->tells_taper ? 0 : evse->vehicle->second_max_kw > 0.0 ? 2 : 1;
        count = SIM_EV_PARAM_D + lines; // EV_PARAM_D and E, the last, have a line each
    }
    return send_first(fleet, evse, count);
}

bool sim_fleet_echo(sim_fleet_t *fleet, unsigned connector, bool whole) {
    sim_evse_t *evse = &fleet->evse[connector];
    const unsigned count = whole && evse->vehicle != NULL ? SIM_EVSE_ELEC + 1 : SIM_EVSE_STATUS + 1;
    return send_first(fleet, evse, count);
}

void sim_fleet_begin(sim_fleet_t *fleet, int64_t now_s) {
    fleet->begin_s = (double)now_s;
    for (unsigned i = 0; i < fleet->station->connector_count; i++) {
        sim_evse_t *evse = &fleet->evse[i];
        evse->in_force = false;
        fleet->takes_kw[i] = evse->vehicle == NULL ? 0.0 : sim_evse_takes_kw(evse);
        fleet->offered_mA[i] = -1;
    }
}

void sim_fleet_take(sim_fleet_t *fleet, const taper_frame_t *frame) {
    const int connector = sim_setpoint_connector(fleet->station, frame);
    if (connector >= 0) {
        (void)sim_evse_hear(&fleet->evse[connector], frame);
    }
}

void sim_fleet_hear(sim_fleet_t *fleet) {
    taper_frame_t frame;
    while (fleet->port->receive(fleet->port->context, &frame)) {
        sim_fleet_take(fleet, &frame);
    }
    // Time stands still between ticks, so a setpoint is valid in the tick in which it came, and in no other.
    for (unsigned i = 0; i < fleet->station->connector_count; i++) {
        sim_evse_obey(&fleet->evse[i]);
    }
}

/** How long the vehicle is there between two times of the present tick [h]. */
static double stay_h(const sim_evse_t *evse, double from_s, double to_s) {
    return fmax(fmin(to_s, evse->vehicle->departure_s) - from_s, 0.0) / 3600.0;
}

bool sim_fleet_draw(sim_fleet_t *fleet, unsigned connector, double now_s) {
    sim_evse_t *evse = &fleet->evse[connector];
    const int32_t offered_mA = sim_evse_wants(evse) ? sim_evse_offered_mA(evse, evse->setpoint_mA) : 0;
    if (offered_mA == fleet->offered_mA[connector]) {
        return false;
    }
    fleet->offered_mA[connector] = offered_mA;
    evse->power_kw = 0.0;
    evse->current_A = 0.0;
    const double left_h = evse->vehicle == NULL ? 0.0 : stay_h(evse, now_s, fleet->begin_s + fleet->tick_s);
    if (offered_mA > 0 && left_h > 0.0) {
        const double missing_kw = sim_evse_missing_kwh(evse) / left_h;
        sim_evse_draw(evse, offered_mA, fmin(fleet->takes_kw[connector], missing_kw));
    }
    return true;
}

double sim_fleet_charge(sim_fleet_t *fleet, unsigned connector, double from_s, double to_s) {
    sim_evse_t *evse = &fleet->evse[connector];
    if (evse->vehicle == NULL) {
        return 0.0;
    }
    const double energy_kwh = evse->power_kw * stay_h(evse, from_s, to_s);
    evse->energy_kwh += energy_kwh;
    return energy_kwh;
}
