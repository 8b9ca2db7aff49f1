#include "evse.h"

#include <math.h>
#include <stddef.h>

/** EV_PARAM_C carries energies in steps of this. */
#define TARGET_STEP_WH 20.0
/** EV_PARAM_B carries the departure modulo 65535 minutes: a later one than this would be taken for a past one. */
#define LONGEST_TOLD_S      (20.0 * 86400.0)
#define MINUTES_ON_THE_WIRE 65535.0
/** Version of the simulated controller's firmware, major << 8 | minor. */
#define FIRMWARE 0x0100

static int32_t nearest(double value) {
    return (int32_t)lround(value);
}

/** SOC as the bus carries it, in steps of 0.5 %. */
static int32_t soc_permille(double soc) {
    return 5 * nearest(soc * 200.0);
}

/** A SOC as the vehicle tells it, or absent. */
static int32_t told_soc_permille(const sim_evse_t *evse, double soc) {
    if (evse->errors == NULL) {
        return soc_permille(soc);
    }
    return evse->errors->soc_absent ? TAPER_ABSENT
                                    : soc_permille(fmin(fmax(soc + evse->wrong.soc, 0.0), 1.0));
}

/** What the meter makes of a quantity, as a factor. */
static double metered(const sim_evse_t *evse) {
    return evse->errors == NULL ? 1.0 : evse->wrong.metered;
}

static taper_message_t evse_status(const sim_evse_t *evse) {
    taper_message_t message = {.kind = TAPER_MESSAGE_EVSE_STATUS};
    taper_evse_status_t *status = &message.as.evse_status;
    status->pilot = evse->vehicle == NULL  ? TAPER_PILOT_A
                    : sim_evse_wants(evse) ? TAPER_PILOT_C
                                           : TAPER_PILOT_B;
    const double metered_A = evse->current_A * metered(evse);
    for (unsigned phase = 0; phase < sim_evse_conductors(evse) && phase < 3; phase++) {
        status->current_mA[phase] = nearest(metered_A * 1000.0);
    }
    status->contactor_closed = evse->vehicle != NULL && sim_evse_offered_mA(evse, evse->setpoint_mA) > 0;
    status->locked = evse->vehicle != NULL;
    status->fallback_active = !evse->in_force;
    status->ev_present = evse->vehicle != NULL;
    status->setpoint_echo = evse->setpoint_echo;
    status->phases = sim_evse_told_conductors(evse);
    return message;
}

static taper_message_t ev_status(const sim_evse_t *evse) {
    // The limit of the charger is flat: it says nothing about the taper of the battery.
    const double max_mA = sim_session_most_kw(evse->vehicle) / sim_evse_kw_per_A(evse) * 1000.0;
    return (taper_message_t){.kind = TAPER_MESSAGE_EV_STATUS,
                             .as.ev_status = {.soc_permille = told_soc_permille(evse, sim_evse_soc(evse)),
                                              .soc_age_s = 0,
                                              .max_mA = (int32_t)ceil(max_mA - 1e-6),
                                              .complete = !sim_evse_wants(evse),
                                              .ready = true}};
}

static taper_message_t evse_elec(const sim_evse_t *evse) {
    const double counted_kwh = evse->energy_kwh - evse->counted_from_kwh;
    return (taper_message_t){.kind = TAPER_MESSAGE_EVSE_ELEC,
                             .as.evse_elec = {.voltage_mV = evse->config->voltage_mV,
                                              .power_W = nearest(evse->power_kw * metered(evse) * 1000.0),
                                              .energy_Wh = (int32_t)floor(counted_kwh * 1000.0 + 1e-6)}};
}

static taper_message_t ev_param_a(const sim_evse_t *evse) {
    const double soc_from = evse->vehicle->soc_arrival + evse->counted_from_kwh / evse->vehicle->battery_kwh;
    return (taper_message_t){.kind = TAPER_MESSAGE_EV_PARAM_A,
                             .as.ev_param_a = {.revision = evse->revision,
                                               .session = evse->session,
                                               .capacity_Wh = nearest(evse->vehicle->battery_kwh * 1000.0),
                                               .soc_target_permille = soc_permille(evse->vehicle->soc_target),
                                               .soc_minimum_permille = TAPER_ABSENT,
                                               .soc_plug_in_permille = told_soc_permille(evse, soc_from)}};
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
    const double request_Wh = (sim_session_request_kwh(evse->vehicle) - evse->counted_from_kwh) * 1000.0;
    const double target_Wh = ceil(request_Wh / TARGET_STEP_WH - 1e-6) * TARGET_STEP_WH;
    return (taper_message_t){.kind = TAPER_MESSAGE_EV_PARAM_C,
                             .as.ev_param_c = {.revision = evse->revision,
                                               .target_Wh = (int32_t)target_Wh,
                                               .maximum_Wh = TAPER_ABSENT,
                                               .minimum_Wh = TAPER_ABSENT}};
}

static taper_message_t ev_param_d(const sim_evse_t *evse) {
    const sim_session_t *vehicle = evse->vehicle;
    const double factor = evse->errors == NULL ? 1.0 : evse->wrong.taper;
    const double taper_kw = fmin(vehicle->taper_kw * factor, vehicle->max_kw);
    return (taper_message_t){.kind = TAPER_MESSAGE_EV_PARAM_D,
                             .as.ev_param_d = {.revision = evse->revision,
                                               .session = evse->session,
                                               .taper_W = nearest(taper_kw * 1000.0)}};
}

static taper_message_t ev_param_e(const sim_evse_t *evse) {
    return (taper_message_t){.kind = TAPER_MESSAGE_EV_PARAM_E,
                             .as.ev_param_e = {.revision = evse->revision,
                                               .session = evse->session,
                                               .peak_W = nearest(evse->vehicle->second_max_kw * 1000.0),
                                               .taper_W = nearest(evse->vehicle->second_taper_kw * 1000.0)}};
}

static taper_message_t evse_info(const sim_evse_t *evse) {
    const taper_connector_config_t *config = evse->config;
    return (taper_message_t){.kind = TAPER_MESSAGE_EVSE_INFO,
                             .as.evse_info = {.protocol_version = TAPER_PROTOCOL_VERSION,
                                              .max_mA = config->max_mA,
                                              .min_mA = config->min_mA,
                                              .kind = config->is_dc         ? TAPER_KIND_DC
                                                      : config->phases == 3 ? TAPER_KIND_AC3
                                                                            : TAPER_KIND_AC1,
                                              .rotation = evse->config->rotation,
                                              .firmware = FIRMWARE}};
}

taper_message_t sim_evse_message(const sim_evse_t *evse, sim_evse_frame_t frame) {
    typedef taper_message_t (*message_t)(const sim_evse_t *);
    static const message_t messages[SIM_EVSE_FRAMES] = {evse_status, ev_status,  evse_elec,
                                                        ev_param_a,  ev_param_b, ev_param_c,
                                                        ev_param_d,  ev_param_e, evse_info};
    taper_message_t message = messages[frame](evse);
    message.bus = evse->config->bus;
    message.node = evse->config->node;
    return message;
}
