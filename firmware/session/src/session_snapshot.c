/* What each vehicle wants at one instant. */
#include <string.h>

#include "taper/rows.h"

#include "session_internal.h"

/* Unix minutes on the wire count modulo this (EV_PARAM_B). */
#define DEPARTURE_MODULUS_min 65535

/* A current above this flows: less is noise of the measurement. */
#define FLOWS_mA 500

static int32_t round_down_to_step(int32_t current_mA) {
    return current_mA - current_mA % TAPER_CURRENT_STEP_mA;
}

bool taper_session_is_online(const taper_session_table_t *table, uint8_t connector, uint32_t now_ms) {
    return taper_session_is_fresh(table->session[connector].status_heard, now_ms,
                                  TAPER_EVSE_STATUS_TIMEOUT_ms);
}

/* PLANNED: nothing speaks against charging. The first that applies, from the connector to the vehicle. */
static taper_reason_t obstacle(const taper_session_table_t *table, uint8_t connector, uint32_t now_ms) {
    const taper_session_t *session = &table->session[connector];
    const taper_ev_status_t *ev = &session->ev;
    if (!taper_session_is_online(table, connector, now_ms)) {
        return TAPER_REASON_OFFLINE;
    }
    if (session->info_known && session->info.protocol_version != TAPER_PROTOCOL_VERSION) {
        return TAPER_REASON_VERSION;
    }
    if (!session->vehicle_there) {
        return TAPER_REASON_NO_VEHICLE;
    }
    if (!taper_session_pilot_charges(session->status.pilot) || session->status.fault || ev->error != 0) {
        return TAPER_REASON_FAULT;
    }
    if (ev->complete) {
        return TAPER_REASON_COMPLETE;
    }
    if (ev->pause_requested || ev->stop_requested) {
        return TAPER_REASON_VEHICLE_PAUSE;
    }
    return session->in_session ? TAPER_REASON_PLANNED : TAPER_REASON_NO_PARAMETERS;
}

static int32_t max_current_mA(const taper_connector_config_t *connector, const taper_session_t *session,
                              uint32_t now_ms) {
    int32_t max_mA = connector->max_mA;
    const bool ev_fresh = taper_session_is_fresh(session->ev_heard, now_ms, TAPER_EV_STATUS_TIMEOUT_ms);
    if (ev_fresh && session->ev.max_mA != TAPER_ABSENT) {
        max_mA = taper_min_i32(max_mA, session->ev.max_mA);
    }
    return round_down_to_step(max_mA);
}

static int32_t min_current_mA(const taper_connector_config_t *connector, const taper_session_t *session) {
    /* An absent minimum is below any other. */
    const int32_t min_mA = taper_max_i32(connector->min_mA, session->used.b.min_mA);
    return round_down_to_step(min_mA + TAPER_CURRENT_STEP_mA - 1);
}

/* Booked by the higher of nominal and measured voltage: too little power offered rather than too much drawn. */
static int32_t volts(const taper_connector_config_t *connector, const taper_session_t *session,
                     uint32_t now_ms) {
    int32_t voltage_mV = connector->voltage_mV;
    if (taper_session_is_fresh(session->elec_heard, now_ms, TAPER_EVSE_ELEC_TIMEOUT_ms)) {
        voltage_mV = taper_max_i32(voltage_mV, session->elec.voltage_mV); /* absent is below any other */
    }
    return (voltage_mV + 999) / 1000;
}

/* Conductors with a current that cannot be noise. */
static uint8_t conductors_measured(const taper_session_t *session) {
    uint8_t most = 0;
    for (uint8_t k = 0; k < 3; k++) {
        most = session->status.current_mA[k] > FLOWS_mA ? (uint8_t)(k + 1)
                                                        : most; /* absent is below any other */
    }
    return most;
}

/* What the connector says, but no fewer than carry current. */
static uint8_t phases_in_use(const taper_connector_config_t *connector, const taper_session_t *session) {
    const int32_t told = session->status.phases > 0 ? session->status.phases : connector->phases;
    return (uint8_t)taper_min_i32(connector->phases, taper_max_i32(told, conductors_measured(session)));
}

/* Supply phases of the first `conductors`: by the description, and by what the connector says of its wiring; one that does
   not know counts on all of them. */
static uint8_t phases_booked(const taper_connector_config_t *connector, const taper_session_t *session,
                             uint8_t conductors) {
    const uint8_t described = taper_rotation_phases((taper_rotation_t)connector->rotation, conductors);
    if (!session->info_known) {
        return described;
    }
    const taper_rotation_t told = (taper_rotation_t)session->info.rotation;
    return told == TAPER_ROTATION_UNKNOWN ? 7 : described | taper_rotation_phases(told, conductors);
}

/* Those of the first `conductors` that it has by any wiring: by the description, and by what the connector says. One that
   does not know is sure of three only. */
static uint8_t phases_sure(const taper_connector_config_t *connector, const taper_session_t *session,
                           uint8_t conductors) {
    const uint8_t described = taper_rotation_phases((taper_rotation_t)connector->rotation, conductors);
    if (!session->info_known || conductors == 3) {
        return described;
    }
    const taper_rotation_t told = (taper_rotation_t)session->info.rotation;
    return told == TAPER_ROTATION_UNKNOWN ? 0 : described & taper_rotation_phases(told, conductors);
}

/* What 1 A of a connector counts with up to `most` conductors in use. One that does not know its wiring counts as three
   phases, in power too. */
taper_booking_t taper_session_booking(const taper_session_table_t *table, uint8_t connector, uint32_t now_ms,
                                      uint8_t allowed, uint8_t most) {
    const taper_connector_config_t *config = &table->config->connectors[connector];
    const taper_session_t *session = &table->session[connector];
    taper_booking_t booking = taper_booking_nominal(table->config, connector);
    const int32_t volts_V = volts(config, session, now_ms);
    if (config->is_dc) {
        const int32_t nominal_V = (config->voltage_mV + 999) / 1000;
        booking.W_per_A = (int32_t)(((int64_t)booking.W_per_A * volts_V + nominal_V - 1) / nominal_V);
        booking.permille = (int32_t)(((int64_t)booking.permille * volts_V + nominal_V - 1) / nominal_V);
        return booking;
    }
    const uint8_t wires = config->line_to_line ? 2 : allowed;
    booking.phases = phases_booked(config, session, config->line_to_line ? 2 : most);
    booking.idle = booking.phases & ~phases_booked(config, session, wires);
    booking.unsure = booking.phases & ~phases_sure(config, session, wires);
    const bool unknown = session->info_known && session->info.rotation == TAPER_ROTATION_UNKNOWN;
    booking.W_per_A = volts_V * (unknown ? 3 : most);
    return booking;
}

/* minimum <= target <= maximum, repaired by moving the target; where the bounds contradict, the maximum holds. */
static int32_t repaired_target(int32_t target, int32_t minimum, int32_t maximum) {
    if (target == TAPER_ABSENT) {
        return TAPER_ABSENT;
    }
    const int32_t raised = taper_max_i32(target, minimum); /* absent is below any other */
    return maximum == TAPER_ABSENT ? raised : taper_min_i32(raised, maximum);
}

/* Need of a vehicle that named no target: it takes until it says complete, so our account of its battery must not end
   it. Its own maximum may. */
static int64_t open_need_Wh(const taper_session_t *session, int32_t charged_Wh) {
    const int32_t capacity_Wh = taper_session_capacity_Wh(session);
    if (session->used.c.maximum_Wh != TAPER_ABSENT) {
        return (int64_t)session->used.c.maximum_Wh - charged_Wh;
    }
    if (capacity_Wh == 0) {
        return TAPER_OPEN_NEED_Wh;
    }
    const int32_t held_Wh = session->stored_Wh == TAPER_ABSENT ? charged_Wh : session->stored_Wh;
    return taper_max_i32(capacity_Wh - held_Wh, TAPER_OPEN_NEED_LEAST_Wh);
}

static int32_t need_Wh(const taper_session_t *session) {
    const taper_ev_param_a_t *a = &session->used.a;
    const taper_ev_param_c_t *c = &session->used.c;
    const int32_t charged_Wh = session->session_Wh == TAPER_ABSENT ? 0 : session->session_Wh;
    const int32_t target_Wh = repaired_target(c->target_Wh, c->minimum_Wh, c->maximum_Wh);
    if (target_Wh != TAPER_ABSENT) {
        return taper_saturate_i32((int64_t)target_Wh - charged_Wh);
    }
    const int32_t soc_permille =
        repaired_target(a->soc_target_permille, a->soc_minimum_permille, TAPER_ABSENT);
    if (soc_permille != TAPER_ABSENT && session->stored_Wh != TAPER_ABSENT) {
        const int64_t wanted_Wh = (int64_t)soc_permille * taper_session_capacity_Wh(session) / 1000;
        return taper_saturate_i32(wanted_Wh - session->stored_Wh);
    }
    return taper_saturate_i32(open_need_Wh(session, charged_Wh));
}

/* The minutes are known modulo 65535: of the possible departures, the one nearest to now, up to 22 days either way. */
static int32_t departure_in_s(int32_t departure_min, uint32_t unix_s) {
    const int32_t now_min = (int32_t)(unix_s / 60u % DEPARTURE_MODULUS_min);
    int32_t ahead_min = (departure_min - now_min + DEPARTURE_MODULUS_min) % DEPARTURE_MODULUS_min;
    if (ahead_min > DEPARTURE_MODULUS_min / 2) {
        ahead_min -= DEPARTURE_MODULUS_min;
    }
    return ahead_min * 60 - (int32_t)(unix_s % 60u);
}

static int32_t departs_in_s(const taper_session_table_t *table, const taper_session_t *session,
                            uint32_t now_ms) {
    const int32_t departure_min = session->used.b.departure_min;
    if (!table->clock_heard.heard || departure_min == TAPER_ABSENT) {
        const uint64_t here_ms =
            (uint64_t)taper_elapsed_ms(now_ms, session->plugged_in_ms) * table->time_scale;
        return taper_saturate_i32((int64_t)TAPER_DEFAULT_STAY_s - (int64_t)(here_ms / 1000u));
    }
    return departure_in_s(departure_min, taper_session_unix_s(table, now_ms));
}

/* Battery and taper, for a demand whose currents are set. */
static void fill_battery(taper_demand_t *demand, const taper_session_t *session, uint32_t now_ms) {
    const bool believed = session->jump_count == 0 && taper_session_soc_is_fresh(session, now_ms);
    demand->soc_estimated = !believed;
    demand->capacity_Wh = taper_session_capacity_Wh(session);
    demand->stored_Wh = taper_max_i32(session->stored_Wh, 0); /* absent becomes 0 */
    demand->peak_W = session->used.b.peak_W;
    if (demand->peak_W == TAPER_ABSENT) {
        demand->peak_W = taper_demand_allowed_W(demand);
    }
    if (demand->capacity_Wh > 0) {
        const taper_ev_param_e_t *second = &session->used.e;
        demand->taper_W = taper_clamp_i32(session->used.d.taper_W, 0, demand->peak_W); /* absent becomes 0 */
        demand->second_peak_W = taper_max_i32(second->peak_W, 0);
        demand->second_taper_W = taper_clamp_i32(second->taper_W, 0, demand->second_peak_W);
    }
}

taper_reason_t taper_session_idle_reason(const taper_session_table_t *table, uint8_t connector,
                                         uint32_t now_ms) {
    const taper_reason_t reason = obstacle(table, connector, now_ms);
    if (reason != TAPER_REASON_PLANNED) {
        return reason;
    }
    const taper_session_t *session = &table->session[connector];
    if (need_Wh(session) <= 0) {
        return TAPER_REASON_COMPLETE;
    }
    const taper_connector_config_t *config = &table->config->connectors[connector];
    const bool fits =
        max_current_mA(config, session, now_ms) >= taper_max_i32(min_current_mA(config, session), 1);
    return fits ? TAPER_REASON_PLANNED : TAPER_REASON_VEHICLE_LIMIT;
}

/** Fill in `demand`; all zero, but for its booking, unless active. */
static void fill_demand(const taper_session_table_t *table, uint8_t connector, uint32_t now_ms,
                        taper_demand_t *demand) {
    const taper_connector_config_t *config = &table->config->connectors[connector];
    const taper_session_t *session = &table->session[connector];
    memset(demand, 0, sizeof *demand);
    if (taper_session_idle_reason(table, connector, now_ms) != TAPER_REASON_PLANNED) {
        demand->booking = taper_session_booking(table, connector, now_ms, config->phases,
                                                config->phases); /* whatever its phases do by now */
        return;
    }
    demand->active = true;
    demand->session = session->used.a.session;
    demand->need_Wh = need_Wh(session);
    demand->max_mA = max_current_mA(config, session, now_ms);
    demand->min_mA = min_current_mA(config, session);
    demand->conductors = phases_in_use(config, session);
    demand->W_per_A = volts(config, session, now_ms) * demand->conductors;
    demand->booking = taper_session_booking(table, connector, now_ms, demand->conductors, demand->conductors);
    demand->departs_in_s = departs_in_s(table, session, now_ms);
    fill_battery(demand, session, now_ms);
}

void taper_session_snapshot(const taper_session_table_t *table, uint32_t now_ms, taper_snapshot_t *snapshot) {
    snapshot->now_ms = now_ms * table->time_scale;
    snapshot->count = table->config->connector_count;
    for (uint8_t i = 0; i < snapshot->count; i++) {
        fill_demand(table, i, now_ms, &snapshot->demand[i]);
    }
}
