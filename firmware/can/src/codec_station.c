/* What gateway, controller and connectors say of themselves: limits, setpoints, state, meters, time. */
#include "codec_internal.h"
#include "taper/types.h"
#include "taper_dbc.h"

void taper_decode_site_limit(const uint8_t *data, taper_message_t *message, taper_decoding_t *decoding) {
    struct taper_dbc_site_limit_t raw;
    taper_site_limit_t *limit = &message->as.site_limit;
    (void)taper_dbc_site_limit_unpack(&raw, data, TAPER_FRAME_LENGTH);
    limit->active = raw.active != 0;
    limit->limit_W = taper_field_decode(&taper_field_site_limit_limit, raw.limit, decoding);
    limit->failsafe_W =
        taper_field_decode(&taper_field_site_limit_failsafe_limit, raw.failsafe_limit, decoding);
    limit->validity_s = taper_field_decode(&taper_field_site_limit_validity, raw.validity, decoding);
}

bool taper_encode_site_limit(const taper_message_t *message, uint8_t *data) {
    const taper_site_limit_t *limit = &message->as.site_limit;
    const struct taper_dbc_site_limit_t raw = {
        .active = limit->active,
        .limit = (int16_t)taper_field_encode(&taper_field_site_limit_limit, limit->limit_W),
        .failsafe_limit =
            (int16_t)taper_field_encode(&taper_field_site_limit_failsafe_limit, limit->failsafe_W),
        .failsafe_duration =
            (uint8_t)taper_field_encode(&taper_field_site_limit_failsafe_duration, TAPER_ABSENT),
        .validity = (uint8_t)taper_field_encode(&taper_field_site_limit_validity, limit->validity_s),
    };
    return taper_dbc_site_limit_pack(data, &raw, TAPER_FRAME_LENGTH) == TAPER_FRAME_LENGTH;
}

void taper_decode_setpoint(const uint8_t *data, taper_message_t *message, taper_decoding_t *decoding) {
    struct taper_dbc_setpoint_t raw;
    taper_setpoint_t *setpoint = &message->as.setpoint;
    (void)taper_dbc_setpoint_unpack(&raw, data, TAPER_FRAME_LENGTH);
    if (!taper_command_is_named(raw.command)) {
        taper_decoding_refuse(decoding);
        return;
    }
    setpoint->command = (taper_command_t)raw.command;
    setpoint->current_mA = taper_field_decode(&taper_field_setpoint_current, raw.current, decoding);
    setpoint->validity_ms = taper_field_decode(&taper_field_setpoint_validity, raw.validity, decoding);
    setpoint->fallback_mA =
        taper_field_decode(&taper_field_setpoint_fallback_current, raw.fallback_current, decoding);
    setpoint->phase_mask = raw.phase_mask;
    setpoint->session = raw.session;
}

bool taper_encode_setpoint(const taper_message_t *message, uint8_t *data) {
    const taper_setpoint_t *setpoint = &message->as.setpoint;
    const struct taper_dbc_setpoint_t raw = {
        .command = (uint8_t)setpoint->command,
        .current = (uint16_t)taper_field_encode(&taper_field_setpoint_current, setpoint->current_mA),
        .validity = (uint8_t)taper_field_encode(&taper_field_setpoint_validity, setpoint->validity_ms),
        .fallback_current =
            (uint8_t)taper_field_encode(&taper_field_setpoint_fallback_current, setpoint->fallback_mA),
        .phase_mask = (uint8_t)(setpoint->phase_mask & 0x07u),
        .session = setpoint->session,
    };
    return taper_command_is_named((unsigned)setpoint->command) &&
           taper_dbc_setpoint_pack(data, &raw, TAPER_FRAME_LENGTH) == TAPER_FRAME_LENGTH;
}

void taper_decode_evse_status(const uint8_t *data, taper_message_t *message, taper_decoding_t *decoding) {
    struct taper_dbc_evse_status_t raw;
    taper_evse_status_t *status = &message->as.evse_status;
    (void)taper_dbc_evse_status_unpack(&raw, data, TAPER_FRAME_LENGTH);
    if (!taper_pilot_is_named(raw.pilot_state)) {
        taper_decoding_refuse(decoding);
        return;
    }
    status->pilot = (taper_pilot_t)raw.pilot_state;
    status->current_mA[0] = taper_field_decode(&taper_field_evse_status_current_l1, raw.current_l1, decoding);
    status->current_mA[1] = taper_field_decode(&taper_field_evse_status_current_l2, raw.current_l2, decoding);
    status->current_mA[2] = taper_field_decode(&taper_field_evse_status_current_l3, raw.current_l3, decoding);
    status->contactor_closed = raw.contactor_closed != 0;
    status->locked = raw.locked != 0;
    status->fault = raw.fault != 0;
    status->derated = raw.derated != 0;
    status->fallback_active = raw.fallback_active != 0;
    status->ev_present = raw.ev_present != 0;
    status->setpoint_echo = raw.setpoint_echo;
    status->phases = raw.phases;
}

bool taper_encode_evse_status(const taper_message_t *message, uint8_t *data) {
    const taper_evse_status_t *status = &message->as.evse_status;
    const struct taper_dbc_evse_status_t raw = {
        .pilot_state = (uint8_t)status->pilot,
        .current_l1 =
            (uint16_t)taper_field_encode(&taper_field_evse_status_current_l1, status->current_mA[0]),
        .current_l2 =
            (uint16_t)taper_field_encode(&taper_field_evse_status_current_l2, status->current_mA[1]),
        .current_l3 =
            (uint16_t)taper_field_encode(&taper_field_evse_status_current_l3, status->current_mA[2]),
        .contactor_closed = status->contactor_closed,
        .locked = status->locked,
        .fault = status->fault,
        .derated = status->derated,
        .setpoint_echo = (uint8_t)(status->setpoint_echo & 0x0Fu),
        .phases = (uint8_t)(status->phases & 0x03u),
        .fallback_active = status->fallback_active,
        .ev_present = status->ev_present,
    };
    return taper_pilot_is_named((unsigned)status->pilot) &&
           taper_dbc_evse_status_pack(data, &raw, TAPER_FRAME_LENGTH) == TAPER_FRAME_LENGTH;
}

void taper_decode_evse_elec(const uint8_t *data, taper_message_t *message, taper_decoding_t *decoding) {
    struct taper_dbc_evse_elec_t raw;
    taper_evse_elec_t *elec = &message->as.evse_elec;
    (void)taper_dbc_evse_elec_unpack(&raw, data, TAPER_FRAME_LENGTH);
    elec->voltage_mV = taper_field_decode(&taper_field_evse_elec_voltage, raw.voltage, decoding);
    elec->power_W = taper_field_decode(&taper_field_evse_elec_power, raw.power, decoding);
    elec->energy_Wh = taper_field_decode(&taper_field_evse_elec_session_energy, raw.session_energy, decoding);
}

bool taper_encode_evse_elec(const taper_message_t *message, uint8_t *data) {
    const taper_evse_elec_t *elec = &message->as.evse_elec;
    const struct taper_dbc_evse_elec_t raw = {
        .voltage = (uint16_t)taper_field_encode(&taper_field_evse_elec_voltage, elec->voltage_mV),
        .power = (uint16_t)taper_field_encode(&taper_field_evse_elec_power, elec->power_W),
        .session_energy =
            (uint16_t)taper_field_encode(&taper_field_evse_elec_session_energy, elec->energy_Wh),
    };
    return taper_dbc_evse_elec_pack(data, &raw, TAPER_FRAME_LENGTH) == TAPER_FRAME_LENGTH;
}

void taper_decode_site_meter(const uint8_t *data, taper_message_t *message, taper_decoding_t *decoding) {
    struct taper_dbc_site_meter_t raw;
    taper_site_meter_t *meter = &message->as.site_meter;
    (void)taper_dbc_site_meter_unpack(&raw, data, TAPER_FRAME_LENGTH);
    meter->other_mA[0] = taper_field_decode(&taper_field_site_meter_current_l1, raw.current_l1, decoding);
    meter->other_mA[1] = taper_field_decode(&taper_field_site_meter_current_l2, raw.current_l2, decoding);
    meter->other_mA[2] = taper_field_decode(&taper_field_site_meter_current_l3, raw.current_l3, decoding);
}

bool taper_encode_site_meter(const taper_message_t *message, uint8_t *data) {
    const taper_site_meter_t *meter = &message->as.site_meter;
    const struct taper_dbc_site_meter_t raw = {
        .current_l1 = (int16_t)taper_field_encode(&taper_field_site_meter_current_l1, meter->other_mA[0]),
        .current_l2 = (int16_t)taper_field_encode(&taper_field_site_meter_current_l2, meter->other_mA[1]),
        .current_l3 = (int16_t)taper_field_encode(&taper_field_site_meter_current_l3, meter->other_mA[2]),
    };
    return taper_dbc_site_meter_pack(data, &raw, TAPER_FRAME_LENGTH) == TAPER_FRAME_LENGTH;
}

void taper_decode_time_sync(const uint8_t *data, taper_message_t *message, taper_decoding_t *decoding) {
    struct taper_dbc_time_sync_t raw;
    taper_time_sync_t *time = &message->as.time_sync;
    (void)taper_dbc_time_sync_unpack(&raw, data, TAPER_FRAME_LENGTH);
    time->unix_s = raw.unix_time;
    time->ms = (uint16_t)taper_field_decode(&taper_field_time_sync_millisecond, raw.millisecond, decoding);
    time->quality = raw.quality;
}

bool taper_encode_time_sync(const taper_message_t *message, uint8_t *data) {
    const taper_time_sync_t *time = &message->as.time_sync;
    const struct taper_dbc_time_sync_t raw = {
        .unix_time = time->unix_s,
        .millisecond = (uint16_t)taper_field_encode(&taper_field_time_sync_millisecond, time->ms),
        .quality = (uint8_t)taper_min_i32(time->quality, 63),
    };
    return taper_dbc_time_sync_pack(data, &raw, TAPER_FRAME_LENGTH) == TAPER_FRAME_LENGTH;
}

void taper_decode_ctrl_status(const uint8_t *data, taper_message_t *message, taper_decoding_t *decoding) {
    struct taper_dbc_ctrl_status_t raw;
    taper_ctrl_status_t *status = &message->as.ctrl_status;
    (void)taper_dbc_ctrl_status_unpack(&raw, data, TAPER_FRAME_LENGTH);
    if (!taper_mode_is_named(raw.mode)) {
        taper_decoding_refuse(decoding);
        return;
    }
    status->mode = raw.mode;
    status->verdict = raw.solver_verdict;
    status->limit_source = raw.limit_source;
    status->solve_ticks = raw.solve_ticks;
    status->iterations =
        (uint16_t)taper_field_decode(&taper_field_ctrl_status_iterations, raw.iterations, decoding);
    status->active = raw.active;
    status->waiting = raw.waiting;
    status->plan_version = raw.plan_version;
}

bool taper_encode_ctrl_status(const taper_message_t *message, uint8_t *data) {
    const taper_ctrl_status_t *status = &message->as.ctrl_status;
    const struct taper_dbc_ctrl_status_t raw = {
        .mode = status->mode,
        .solver_verdict = (uint8_t)(status->verdict & 0x0Fu),
        .limit_source = status->limit_source,
        .solve_ticks = status->solve_ticks,
        .iterations = (uint8_t)taper_field_encode(&taper_field_ctrl_status_iterations, status->iterations),
        .active = status->active,
        .waiting = status->waiting,
        .plan_version = status->plan_version,
    };
    return taper_mode_is_named(status->mode) &&
           taper_dbc_ctrl_status_pack(data, &raw, TAPER_FRAME_LENGTH) == TAPER_FRAME_LENGTH;
}
