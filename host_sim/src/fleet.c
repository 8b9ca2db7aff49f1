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

bool sim_fleet_report(sim_fleet_t *fleet, unsigned connector) {
    sim_evse_t *evse = &fleet->evse[connector];
    // Without a vehicle the heartbeat alone; EV_PARAM_D, the last, only where the taper is told.
    const unsigned present = fleet->tells_taper ? SIM_EV_PARAM_D + 1 : SIM_EV_PARAM_D;
    const unsigned count = evse->vehicle == NULL ? SIM_EVSE_STATUS + 1 : present;
    bool sent = true;
    for (unsigned k = 0; k < count; k++) {
        const taper_message_t message = sim_evse_message(evse, (sim_evse_frame_t)k);
        sent = sim_wire_send(fleet->port, &message, &evse->counter[k]) && sent;
    }
    return sent;
}

bool sim_fleet_echo(sim_fleet_t *fleet, unsigned connector) {
    sim_evse_t *evse = &fleet->evse[connector];
    const taper_message_t message = sim_evse_message(evse, SIM_EVSE_STATUS);
    return sim_wire_send(fleet->port, &message, &evse->counter[SIM_EVSE_STATUS]);
}

void sim_fleet_begin(sim_fleet_t *fleet) {
    for (unsigned i = 0; i < fleet->station->connector_count; i++) {
        fleet->evse[i].in_force = false;
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

/** How long the vehicle is there in the tick that begins at `now_s` [h]. */
static double stay_h(const sim_fleet_t *fleet, const sim_evse_t *evse, double now_s) {
    return fmin(fleet->tick_s, evse->vehicle->departure_s - now_s) / 3600.0;
}

void sim_fleet_draw(sim_fleet_t *fleet, unsigned connector, double now_s) {
    sim_evse_t *evse = &fleet->evse[connector];
    evse->power_kw = 0.0;
    evse->current_A = 0.0;
    if (sim_evse_wants(evse)) {
        const double missing_kw = sim_evse_missing_kwh(evse) / stay_h(fleet, evse, now_s);
        sim_evse_draw(evse, sim_evse_offered_mA(evse, evse->setpoint_mA), missing_kw);
    }
}

void sim_fleet_charge(sim_fleet_t *fleet, unsigned connector, double now_s) {
    sim_evse_t *evse = &fleet->evse[connector];
    if (evse->vehicle != NULL) {
        evse->energy_kwh += evse->power_kw * stay_h(fleet, evse, now_s);
    }
}
