#include "evse.h"

#include <math.h>
#include <stddef.h>
#include <string.h>

#include "taper/codec.h"
#include "taper/session.h"

/** Less than this is not wanted: what sums of doubles leave over [kWh]. */
#define ENERGY_TOLERANCE_KWH 1e-6

void sim_evse_init(sim_evse_t *evse, const taper_connector_config_t *config, unsigned first_counter) {
    *evse = (sim_evse_t){.config = config};
    for (unsigned k = 0; k < SIM_EVSE_FRAMES; k++) {
        evse->counter[k] = (uint8_t)((first_counter + 3U * k) % 16U);
    }
}

static void forget_setpoint(sim_evse_t *evse) {
    evse->in_force = false;
    evse->setpoint_mA = 0;
    evse->told_mA = 0;
    evse->fallback_mA = 0;
    evse->validity_ms = 0;
}

static void begin_session(sim_evse_t *evse) {
    evse->session = (uint8_t)(evse->session == UINT8_MAX ? 1 : evse->session + 1);
    evse->revision = (uint8_t)((evse->revision + 1) % 16);
    evse->counted_from_kwh = evse->energy_kwh;
    evse->conductors_seen = false;
}

void sim_evse_plug(sim_evse_t *evse, const sim_session_t *session) {
    evse->vehicle = session;
    evse->energy_kwh = 0.0;
    if (evse->errors != NULL) {
        evse->wrong = sim_errors_of(evse->errors, session->id);
    }
    forget_setpoint(evse);
    begin_session(evse);
}

void sim_evse_unplug(sim_evse_t *evse) {
    evse->vehicle = NULL;
    evse->current_A = 0.0;
    evse->power_kw = 0.0;
    forget_setpoint(evse);
}

void sim_evse_restart(sim_evse_t *evse) {
    forget_setpoint(evse);
    begin_session(evse);
    evse->current_A = 0.0;
    evse->power_kw = 0.0;
    evse->setpoint_check = (taper_e2e_receiver_t){0};
    evse->setpoint_echo = 0;
    memset(evse->counter, 0, sizeof evse->counter);
}

double sim_evse_soc(const sim_evse_t *evse) {
    return evse->vehicle->soc_arrival + evse->energy_kwh / evse->vehicle->battery_kwh;
}

double sim_evse_missing_kwh(const sim_evse_t *evse) {
    return fmax(sim_session_request_kwh(evse->vehicle) - evse->energy_kwh, 0.0);
}

bool sim_evse_wants(const sim_evse_t *evse) {
    return evse->vehicle != NULL && sim_evse_missing_kwh(evse) > ENERGY_TOLERANCE_KWH;
}

uint8_t sim_evse_conductors(const sim_evse_t *evse) {
    const uint8_t own = evse->config->phases;
    const uint8_t vehicle = evse->vehicle == NULL ? 0 : evse->vehicle->phases;
    return vehicle == 0 || vehicle > own ? own : vehicle;
}

uint8_t sim_evse_told_conductors(const sim_evse_t *evse) {
    return evse->conductors_seen ? sim_evse_conductors(evse) : evse->config->phases;
}

double sim_evse_kw_per_A(const sim_evse_t *evse) {
    return (double)evse->config->voltage_mV * (double)sim_evse_conductors(evse) / 1e6;
}

double sim_evse_takes_kw(const sim_evse_t *evse) {
    return sim_session_takes_kw(evse->vehicle, sim_evse_soc(evse));
}

bool sim_evse_hear(sim_evse_t *evse, const taper_frame_t *frame) {
    const taper_e2e_check_t check = taper_e2e_check(&evse->setpoint_check, frame);
    taper_message_t message;
    bool bad_field = false;
    if ((check != TAPER_E2E_OK && check != TAPER_E2E_OK_SOME_LOST) ||
        !taper_e2e_is_valid(&evse->setpoint_check) || !taper_decode(frame, &message, &bad_field) ||
        bad_field) {
        return false;
    }
    const taper_setpoint_t *setpoint = &message.as.setpoint;
    if (setpoint->session != (evse->vehicle == NULL ? 0 : evse->session)) {
        return false;
    }
    const bool ends = setpoint->command == TAPER_COMMAND_STOP || setpoint->command == TAPER_COMMAND_EMERGENCY;
    evse->in_force = true;
    evse->setpoint_echo = evse->setpoint_check.counter;
    evse->told_mA = setpoint->command == TAPER_COMMAND_CHARGE ? setpoint->current_mA : 0;
    evse->fallback_mA = ends ? 0 : setpoint->fallback_mA;
    evse->validity_ms = setpoint->validity_ms;
    return true;
}

void sim_evse_obey(sim_evse_t *evse) {
    evse->setpoint_mA = evse->in_force ? evse->told_mA : evse->fallback_mA;
}

int32_t sim_evse_offered_mA(const sim_evse_t *evse, int32_t setpoint_mA) {
    // A duty cycle below the minimum does not exist on the control pilot: the vehicle takes it for "no".
    const int32_t allowed_mA = setpoint_mA < evse->config->min_mA ? 0 : setpoint_mA;
    return taper_min_i32(allowed_mA, evse->config->max_mA);
}

void sim_evse_draw(sim_evse_t *evse, int32_t offered_mA, double most_kw) {
    const double offered_kw = (double)offered_mA / 1000.0 * sim_evse_kw_per_A(evse);
    evse->power_kw = fmin(offered_kw, most_kw);
    evse->current_A = evse->power_kw / sim_evse_kw_per_A(evse);
    evse->conductors_seen = evse->conductors_seen || evse->power_kw > 0.0;
}

int sim_setpoint_connector(const taper_station_config_t *station, const taper_frame_t *frame) {
    if (frame->id >> 6 != TAPER_MESSAGE_SETPOINT) {
        return -1;
    }
    return taper_session_connector(station, frame->bus, (uint8_t)(frame->id & 0x3FU));
}
