#include "fleet.h"

#include <math.h>
#include <stddef.h>
#include <string.h>

#include "taper/codec.h"
#include "wire.h"

/** Less than this is not wanted: what sums of doubles leave over [kWh]. */
#define ENERGY_TOLERANCE_KWH 1e-6
/** EV_PARAM_C carries energies in steps of this. */
#define TARGET_STEP_WH 20.0
/** EV_PARAM_B carries the departure modulo 65535 minutes: a later one than this would be taken for a past one. */
#define LONGEST_TOLD_S      (20.0 * 86400.0)
#define MINUTES_ON_THE_WIRE 65535.0

void sim_fleet_init(sim_fleet_t *fleet, const taper_station_config_t *station, taper_membus_t *bus,
                    bool tells_taper, uint64_t seed) {
    *fleet = (sim_fleet_t){.station = station,
                           .bus = bus,
                           .tick_s = (double)station->tick_ms / 1000.0,
                           .tells_taper = tells_taper};
    for (unsigned i = 0; i < station->connector_count; i++) {
        sim_evse_t *evse = &fleet->evse[i];
        evse->config = &station->connectors[i];
        fleet->at[evse->config->bus][evse->config->node] = (uint8_t)(i + 1);
        for (unsigned k = 0; k < TAPER_FRAMES_PER_CONNECTOR; k++) {
            evse->counter[k] = (uint8_t)(((unsigned)(seed % 16U) + 7U * i + 3U * k) % 16U);
        }
    }
}

void sim_fleet_plug(sim_fleet_t *fleet, unsigned connector, const sim_session_t *session) {
    sim_evse_t *evse = &fleet->evse[connector];
    evse->vehicle = session;
    evse->energy_kwh = 0.0;
    evse->session = (uint8_t)(evse->session == UINT8_MAX ? 1 : evse->session + 1);
    evse->revision = (uint8_t)((evse->revision + 1) % 16);
}

void sim_fleet_unplug(sim_fleet_t *fleet, unsigned connector) {
    sim_evse_t *evse = &fleet->evse[connector];
    evse->vehicle = NULL;
    evse->setpoint_mA = 0;
    evse->current_A = 0.0;
    evse->power_kw = 0.0;
}

double sim_evse_soc(const sim_evse_t *evse) {
    return evse->vehicle->soc_arrival + evse->energy_kwh / evse->vehicle->battery_kwh;
}

static double missing_kwh(const sim_evse_t *evse) {
    return fmax(sim_session_request_kwh(evse->vehicle) - evse->energy_kwh, 0.0);
}

bool sim_evse_wants(const sim_evse_t *evse) {
    return evse->vehicle != NULL && missing_kwh(evse) > ENERGY_TOLERANCE_KWH;
}

/** Power of 1 A on every phase [kW]. */
static double kw_per_A(const sim_evse_t *evse) {
    return (double)evse->config->voltage_mV * (double)evse->config->phases / 1e6;
}

static int32_t nearest(double value) {
    return (int32_t)lround(value);
}

/** SOC as the bus carries it, in steps of 0.5 %. */
static int32_t soc_permille(double soc) {
    return 5 * nearest(soc * 200.0);
}

static taper_message_t evse_status(const sim_evse_t *evse) {
    taper_message_t message = {.kind = TAPER_MESSAGE_EVSE_STATUS};
    taper_evse_status_t *status = &message.as.evse_status;
    status->pilot = evse->vehicle == NULL  ? TAPER_PILOT_A
                    : sim_evse_wants(evse) ? TAPER_PILOT_C
                                           : TAPER_PILOT_B;
    for (unsigned phase = 0; phase < evse->config->phases && phase < 3; phase++) {
        status->current_mA[phase] = nearest(evse->current_A * 1000.0);
    }
    status->contactor_closed = evse->setpoint_mA > 0 && evse->vehicle != NULL;
    status->locked = evse->vehicle != NULL;
    status->fallback_active = !evse->setpoint_heard;
    status->ev_present = evse->vehicle != NULL;
    status->setpoint_echo = evse->setpoint_echo;
    status->phases = evse->config->phases;
    return message;
}

static taper_message_t ev_status(const sim_evse_t *evse) {
    // The limit of the on-board charger is flat: it says nothing about the taper of the battery.
    const double max_mA = evse->vehicle->max_kw / kw_per_A(evse) * 1000.0;
    return (taper_message_t){.kind = TAPER_MESSAGE_EV_STATUS,
                             .as.ev_status = {.soc_permille = soc_permille(sim_evse_soc(evse)),
                                              .soc_age_s = 0,
                                              .max_mA = (int32_t)ceil(max_mA - 1e-6),
                                              .complete = !sim_evse_wants(evse),
                                              .ready = true}};
}

static taper_message_t evse_elec(const sim_evse_t *evse) {
    return (taper_message_t){.kind = TAPER_MESSAGE_EVSE_ELEC,
                             .as.evse_elec = {.voltage_mV = evse->config->voltage_mV,
                                              .power_W = nearest(evse->power_kw * 1000.0),
                                              .energy_Wh = (int32_t)floor(evse->energy_kwh * 1000.0 + 1e-6)}};
}

static taper_message_t ev_param_a(const sim_evse_t *evse) {
    return (taper_message_t){
        .kind = TAPER_MESSAGE_EV_PARAM_A,
        .as.ev_param_a = {.revision = evse->revision,
                          .session = evse->session,
                          .capacity_Wh = nearest(evse->vehicle->battery_kwh * 1000.0),
                          .soc_target_permille = soc_permille(evse->vehicle->soc_target),
                          .soc_minimum_permille = TAPER_ABSENT,
                          .soc_plug_in_permille = soc_permille(evse->vehicle->soc_arrival)}};
}

/** Minute of the departure that the driver told; the clock of TIME_SYNC is the time of the simulation. */
static int32_t departure_min(const sim_session_t *vehicle) {
    const double told_s = fmin(vehicle->told_s, vehicle->arrival_s + LONGEST_TOLD_S);
    return (int32_t)fmod(floor(told_s / 60.0), MINUTES_ON_THE_WIRE);
}

static taper_message_t ev_param_b(const sim_evse_t *evse) {
    return (taper_message_t){.kind = TAPER_MESSAGE_EV_PARAM_B,
                             .as.ev_param_b = {.revision = evse->revision,
                                               .session = evse->session,
                                               .departure_min = departure_min(evse->vehicle),
                                               .peak_W = nearest(evse->vehicle->max_kw * 1000.0),
                                               .min_mA = TAPER_ABSENT}};
}

static taper_message_t ev_param_c(const sim_evse_t *evse) {
    const double request_Wh = sim_session_request_kwh(evse->vehicle) * 1000.0;
    const double target_Wh = ceil(request_Wh / TARGET_STEP_WH - 1e-6) * TARGET_STEP_WH;
    return (taper_message_t){.kind = TAPER_MESSAGE_EV_PARAM_C,
                             .as.ev_param_c = {.revision = evse->revision,
                                               .target_Wh = (int32_t)target_Wh,
                                               .maximum_Wh = TAPER_ABSENT,
                                               .minimum_Wh = TAPER_ABSENT}};
}

static taper_message_t ev_param_d(const sim_evse_t *evse) {
    return (taper_message_t){.kind = TAPER_MESSAGE_EV_PARAM_D,
                             .as.ev_param_d = {.revision = evse->revision,
                                               .session = evse->session,
                                               .taper_W = nearest(evse->vehicle->taper_kw * 1000.0)}};
}

bool sim_fleet_report(sim_fleet_t *fleet, unsigned connector) {
    typedef taper_message_t (*report_t)(const sim_evse_t *);
    static const report_t reports[TAPER_FRAMES_PER_CONNECTOR] = {
        evse_status, ev_status, evse_elec, ev_param_a, ev_param_b, ev_param_c, ev_param_d};
    sim_evse_t *evse = &fleet->evse[connector];
    // Without a vehicle the heartbeat alone; EV_PARAM_D, the last, only where the taper is told.
    const unsigned present = fleet->tells_taper ? TAPER_FRAMES_PER_CONNECTOR : TAPER_FRAMES_PER_CONNECTOR - 1;
    const unsigned count = evse->vehicle == NULL ? 1 : present;
    bool sent = true;
    for (unsigned i = 0; i < count; i++) {
        taper_message_t message = reports[i](evse);
        message.bus = evse->config->bus;
        message.node = evse->config->node;
        sent = sim_wire_send(fleet->bus, &message, &evse->counter[i]) && sent;
    }
    return sent;
}

/** A connector hears a SETPOINT frame. */
static void hear(sim_evse_t *evse, const taper_frame_t *frame) {
    const taper_e2e_check_t check = taper_e2e_check(&evse->setpoint_check, frame);
    taper_message_t message;
    bool bad_field = false;
    if ((check != TAPER_E2E_OK && check != TAPER_E2E_OK_SOME_LOST) ||
        !taper_decode(frame, &message, &bad_field) || bad_field) {
        return;
    }
    const taper_setpoint_t *setpoint = &message.as.setpoint;
    if (evse->vehicle != NULL && setpoint->session != evse->session) {
        return;
    }
    evse->setpoint_heard = true;
    evse->setpoint_echo = evse->setpoint_check.counter;
    evse->setpoint_mA = setpoint->command == TAPER_COMMAND_CHARGE ? setpoint->current_mA : 0;
    evse->fallback_mA = setpoint->fallback_mA;
}

void sim_fleet_listen(sim_fleet_t *fleet) {
    for (unsigned i = 0; i < fleet->station->connector_count; i++) {
        fleet->evse[i].setpoint_heard = false;
    }
    taper_frame_t frame;
    while (taper_membus_world_receive(fleet->bus, &frame)) {
        const unsigned node = frame.id & 0x3FU;
        if (frame.id >> 6 != TAPER_MESSAGE_SETPOINT || node > TAPER_NODES_PER_BUS ||
            frame.bus >= TAPER_MAX_BUSES) {
            continue;
        }
        const unsigned place = fleet->at[frame.bus][node];
        if (place != 0) {
            hear(&fleet->evse[place - 1], &frame);
        }
    }
    // Time stands still between ticks, so a setpoint is valid in the tick in which it came, and in no other.
    for (unsigned i = 0; i < fleet->station->connector_count; i++) {
        sim_evse_t *evse = &fleet->evse[i];
        evse->setpoint_mA = evse->setpoint_heard ? evse->setpoint_mA : evse->fallback_mA;
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
    if (!sim_evse_wants(evse)) {
        return;
    }
    const sim_session_t *vehicle = evse->vehicle;
    // A duty cycle below the minimum does not exist on the control pilot: the vehicle takes it for "no".
    const int32_t allowed_mA = evse->setpoint_mA < evse->config->min_mA ? 0 : evse->setpoint_mA;
    const int32_t offered_mA = taper_min_i32(allowed_mA, evse->config->max_mA);
    const double offered_kw = (double)offered_mA / 1000.0 * kw_per_A(evse);
    const double taper_kw = fmax(vehicle->max_kw - vehicle->taper_kw * sim_evse_soc(evse), 0.0);
    const double missing_kw = missing_kwh(evse) / stay_h(fleet, evse, now_s);
    evse->power_kw = fmin(fmin(offered_kw, taper_kw), missing_kw);
    evse->current_A = evse->power_kw / kw_per_A(evse);
}

void sim_fleet_charge(sim_fleet_t *fleet, unsigned connector, double now_s) {
    sim_evse_t *evse = &fleet->evse[connector];
    if (evse->vehicle != NULL) {
        evse->energy_kwh += evse->power_kw * stay_h(fleet, evse, now_s);
    }
}
