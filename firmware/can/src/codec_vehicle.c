/* What the vehicle says, passed on by its connector: EV_STATUS and EV_PARAM_A..E. */
#include "codec_internal.h"
#include "taper/types.h"
#include "taper_dbc.h"

void taper_decode_ev_status(const uint8_t *data, taper_message_t *message, taper_decoding_t *decoding) {
    struct taper_dbc_ev_status_t raw;
    taper_ev_status_t *ev = &message->as.ev_status;
    (void)taper_dbc_ev_status_unpack(&raw, data, TAPER_FRAME_LENGTH);
    ev->error = raw.error;
    ev->soc_permille = taper_field_decode(&taper_field_ev_status_soc, raw.soc, decoding);
    ev->soc_age_s = taper_field_decode(&taper_field_ev_status_soc_age, raw.soc_age, decoding);
    ev->max_mA = taper_field_decode(&taper_field_ev_status_max_current, raw.max_current, decoding);
    ev->complete = raw.complete != 0;
    ev->ready = raw.ready != 0;
    ev->pause_requested = raw.pause_requested != 0;
    ev->stop_requested = raw.stop_requested != 0;
}

bool taper_encode_ev_status(const taper_message_t *message, uint8_t *data) {
    const taper_ev_status_t *ev = &message->as.ev_status;
    const bool has_soc = ev->soc_permille != TAPER_ABSENT;
    const struct taper_dbc_ev_status_t raw = {
        .error = (uint8_t)(ev->error & 0x0Fu),
        .soc = (uint8_t)taper_field_encode(&taper_field_ev_status_soc, ev->soc_permille),
        .soc_age = (uint8_t)taper_field_encode(&taper_field_ev_status_soc_age, ev->soc_age_s),
        .max_current = (uint16_t)taper_field_encode(&taper_field_ev_status_max_current, ev->max_mA),
        .time_to_target = (uint8_t)taper_field_encode(&taper_field_ev_status_time_to_target, TAPER_ABSENT),
        .complete = ev->complete,
        .ready = ev->ready,
        .soc_source = has_soc ? TAPER_DBC_EV_STATUS_SOC_SOURCE_VEHICLE_CHOICE
                              : TAPER_DBC_EV_STATUS_SOC_SOURCE_NONE_CHOICE,
        .stop_requested = ev->stop_requested,
        .pause_requested = ev->pause_requested,
    };
    return taper_dbc_ev_status_pack(data, &raw, TAPER_FRAME_LENGTH) == TAPER_FRAME_LENGTH;
}

void taper_decode_ev_param_a(const uint8_t *data, taper_message_t *message, taper_decoding_t *decoding) {
    struct taper_dbc_ev_param_a_t raw;
    taper_ev_param_a_t *param = &message->as.ev_param_a;
    (void)taper_dbc_ev_param_a_unpack(&raw, data, TAPER_FRAME_LENGTH);
    param->revision = raw.revision;
    param->session = raw.session;
    param->capacity_Wh = taper_field_decode(&taper_field_ev_param_a_capacity, raw.capacity, decoding);
    param->soc_target_permille =
        taper_field_decode(&taper_field_ev_param_a_target_soc, raw.target_soc, decoding);
    param->soc_minimum_permille =
        taper_field_decode(&taper_field_ev_param_a_minimum_soc, raw.minimum_soc, decoding);
    param->soc_plug_in_permille =
        taper_field_decode(&taper_field_ev_param_a_plug_in_soc, raw.plug_in_soc, decoding);
}

bool taper_encode_ev_param_a(const taper_message_t *message, uint8_t *data) {
    const taper_ev_param_a_t *param = &message->as.ev_param_a;
    /* No battery holds nothing: a capacity of zero says that it is not known, not that it is the least of the range. */
    const int32_t capacity = param->capacity_Wh > 0 ? param->capacity_Wh : TAPER_ABSENT;
    const struct taper_dbc_ev_param_a_t raw = {
        .revision = (uint8_t)(param->revision & 0x0Fu),
        .session = param->session,
        .capacity = (uint16_t)taper_field_encode(&taper_field_ev_param_a_capacity, capacity),
        .target_soc =
            (uint8_t)taper_field_encode(&taper_field_ev_param_a_target_soc, param->soc_target_permille),
        .minimum_soc =
            (uint8_t)taper_field_encode(&taper_field_ev_param_a_minimum_soc, param->soc_minimum_permille),
        .plug_in_soc =
            (uint8_t)taper_field_encode(&taper_field_ev_param_a_plug_in_soc, param->soc_plug_in_permille),
    };
    return taper_dbc_ev_param_a_pack(data, &raw, TAPER_FRAME_LENGTH) == TAPER_FRAME_LENGTH;
}

void taper_decode_ev_param_b(const uint8_t *data, taper_message_t *message, taper_decoding_t *decoding) {
    struct taper_dbc_ev_param_b_t raw;
    taper_ev_param_b_t *param = &message->as.ev_param_b;
    (void)taper_dbc_ev_param_b_unpack(&raw, data, TAPER_FRAME_LENGTH);
    param->revision = raw.revision;
    param->session = raw.session;
    param->departure_min = taper_field_decode(&taper_field_ev_param_b_departure, raw.departure, decoding);
    param->peak_W = taper_field_decode(&taper_field_ev_param_b_peak_power, raw.peak_power, decoding);
    param->min_mA = taper_field_decode(&taper_field_ev_param_b_min_current, raw.min_current, decoding);
}

bool taper_encode_ev_param_b(const taper_message_t *message, uint8_t *data) {
    const taper_ev_param_b_t *param = &message->as.ev_param_b;
    const struct taper_dbc_ev_param_b_t raw = {
        .revision = (uint8_t)(param->revision & 0x0Fu),
        .session = param->session,
        .departure = (uint16_t)taper_field_encode(&taper_field_ev_param_b_departure, param->departure_min),
        .peak_power = (uint16_t)taper_field_encode(&taper_field_ev_param_b_peak_power, param->peak_W),
        .min_current = (uint8_t)taper_field_encode(&taper_field_ev_param_b_min_current, param->min_mA),
    };
    return taper_dbc_ev_param_b_pack(data, &raw, TAPER_FRAME_LENGTH) == TAPER_FRAME_LENGTH;
}

void taper_decode_ev_param_c(const uint8_t *data, taper_message_t *message, taper_decoding_t *decoding) {
    struct taper_dbc_ev_param_c_t raw;
    taper_ev_param_c_t *param = &message->as.ev_param_c;
    (void)taper_dbc_ev_param_c_unpack(&raw, data, TAPER_FRAME_LENGTH);
    param->revision = raw.revision;
    param->target_Wh = taper_field_decode(&taper_field_ev_param_c_target_energy, raw.target_energy, decoding);
    param->maximum_Wh =
        taper_field_decode(&taper_field_ev_param_c_maximum_energy, raw.maximum_energy, decoding);
    param->minimum_Wh =
        taper_field_decode(&taper_field_ev_param_c_minimum_energy, raw.minimum_energy, decoding);
}

bool taper_encode_ev_param_c(const taper_message_t *message, uint8_t *data) {
    const taper_ev_param_c_t *param = &message->as.ev_param_c;
    const struct taper_dbc_ev_param_c_t raw = {
        .revision = (uint8_t)(param->revision & 0x0Fu),
        .target_energy = (int16_t)taper_field_encode(&taper_field_ev_param_c_target_energy, param->target_Wh),
        .maximum_energy =
            (int16_t)taper_field_encode(&taper_field_ev_param_c_maximum_energy, param->maximum_Wh),
        .minimum_energy =
            (int16_t)taper_field_encode(&taper_field_ev_param_c_minimum_energy, param->minimum_Wh),
    };
    return taper_dbc_ev_param_c_pack(data, &raw, TAPER_FRAME_LENGTH) == TAPER_FRAME_LENGTH;
}

void taper_decode_ev_param_d(const uint8_t *data, taper_message_t *message, taper_decoding_t *decoding) {
    struct taper_dbc_ev_param_d_t raw;
    taper_ev_param_d_t *param = &message->as.ev_param_d;
    (void)taper_dbc_ev_param_d_unpack(&raw, data, TAPER_FRAME_LENGTH);
    param->revision = raw.revision;
    param->session = raw.session;
    param->taper_W = taper_field_decode(&taper_field_ev_param_d_taper_power, raw.taper_power, decoding);
}

bool taper_encode_ev_param_d(const taper_message_t *message, uint8_t *data) {
    const taper_ev_param_d_t *param = &message->as.ev_param_d;
    const struct taper_dbc_ev_param_d_t raw = {
        .revision = (uint8_t)(param->revision & 0x0Fu),
        .session = param->session,
        .taper_power = (uint16_t)taper_field_encode(&taper_field_ev_param_d_taper_power, param->taper_W),
    };
    return taper_dbc_ev_param_d_pack(data, &raw, TAPER_FRAME_LENGTH) == TAPER_FRAME_LENGTH;
}

void taper_decode_ev_param_e(const uint8_t *data, taper_message_t *message, taper_decoding_t *decoding) {
    struct taper_dbc_ev_param_e_t raw;
    taper_ev_param_e_t *param = &message->as.ev_param_e;
    (void)taper_dbc_ev_param_e_unpack(&raw, data, TAPER_FRAME_LENGTH);
    param->revision = raw.revision;
    param->session = raw.session;
    param->peak_W = taper_field_decode(&taper_field_ev_param_e_peak_power, raw.peak_power, decoding);
    param->taper_W = taper_field_decode(&taper_field_ev_param_e_taper_power, raw.taper_power, decoding);
}

bool taper_encode_ev_param_e(const taper_message_t *message, uint8_t *data) {
    const taper_ev_param_e_t *param = &message->as.ev_param_e;
    const struct taper_dbc_ev_param_e_t raw = {
        .revision = (uint8_t)(param->revision & 0x0Fu),
        .session = param->session,
        .peak_power = (uint16_t)taper_field_encode(&taper_field_ev_param_e_peak_power, param->peak_W),
        .taper_power = (uint16_t)taper_field_encode(&taper_field_ev_param_e_taper_power, param->taper_W),
    };
    return taper_dbc_ev_param_e_pack(data, &raw, TAPER_FRAME_LENGTH) == TAPER_FRAME_LENGTH;
}
