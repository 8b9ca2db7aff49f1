/* What the vehicle says, passed on by its connector: EV_STATUS and EV_PARAM_A..D. */
#include "codec_internal.h"
#include "taper/types.h"
#include "taper_dbc.h"

/* What a vehicle wants or can take is rounded up, so that nobody gets less than asked for by the wire's step. A state
   of charge or a capacity describes, it does not ask: nearest. The taper lowers what a vehicle can take: down. */
static const taper_field_t soc_permille = {5, 0, 200, 0xFF, TAPER_ROUND_NEAREST};
static const taper_field_t soc_wish_permille = {5, 0, 200, 0xFF, TAPER_ROUND_UP};
static const taper_field_t soc_age_s = {1, 0, 254, 0xFF, TAPER_ROUND_DOWN};
static const taper_field_t max_current_mA = {100, 0, 65534, 0xFFFF, TAPER_ROUND_UP};
static const taper_field_t time_to_target_min = {5, 0, 254, 0xFF, TAPER_ROUND_UP};
static const taper_field_t capacity_Wh = {100, 1, 65534, 0xFFFF, TAPER_ROUND_NEAREST};
static const taper_field_t departure_min = {1, 0, 65534, 0xFFFF, TAPER_ROUND_DOWN};
static const taper_field_t peak_W = {10, 0, 65534, 0xFFFF, TAPER_ROUND_UP};
static const taper_field_t min_current_mA = {500, 0, 254, 0xFF, TAPER_ROUND_UP};
static const taper_field_t energy_Wh = {20, -32767, 32767, -32768, TAPER_ROUND_UP};
static const taper_field_t taper_W = {10, 0, 65534, 0xFFFF, TAPER_ROUND_DOWN};

void taper_decode_ev_status(const uint8_t *data, taper_message_t *message, taper_decoding_t *decoding) {
    struct taper_dbc_ev_status_t raw;
    taper_ev_status_t *ev = &message->as.ev_status;
    (void)taper_dbc_ev_status_unpack(&raw, data, TAPER_FRAME_LENGTH);
    ev->error = raw.error;
    ev->soc_permille = taper_field_decode(&soc_permille, raw.soc, decoding);
    ev->soc_age_s = taper_field_decode(&soc_age_s, raw.soc_age, decoding);
    ev->max_mA = taper_field_decode(&max_current_mA, raw.max_current, decoding);
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
        .soc = (uint8_t)taper_field_encode(&soc_permille, ev->soc_permille),
        .soc_age = (uint8_t)taper_field_encode(&soc_age_s, ev->soc_age_s),
        .max_current = (uint16_t)taper_field_encode(&max_current_mA, ev->max_mA),
        .time_to_target = (uint8_t)taper_field_encode(&time_to_target_min, TAPER_ABSENT),
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
    param->capacity_Wh = taper_field_decode(&capacity_Wh, raw.capacity, decoding);
    param->soc_target_permille = taper_field_decode(&soc_wish_permille, raw.target_soc, decoding);
    param->soc_minimum_permille = taper_field_decode(&soc_wish_permille, raw.minimum_soc, decoding);
    param->soc_plug_in_permille = taper_field_decode(&soc_permille, raw.plug_in_soc, decoding);
}

bool taper_encode_ev_param_a(const taper_message_t *message, uint8_t *data) {
    const taper_ev_param_a_t *param = &message->as.ev_param_a;
    /* No battery holds nothing: a capacity of zero says that it is not known, not that it is the least of the range. */
    const int32_t capacity = param->capacity_Wh > 0 ? param->capacity_Wh : TAPER_ABSENT;
    const struct taper_dbc_ev_param_a_t raw = {
        .revision = (uint8_t)(param->revision & 0x0Fu),
        .session = param->session,
        .capacity = (uint16_t)taper_field_encode(&capacity_Wh, capacity),
        .target_soc = (uint8_t)taper_field_encode(&soc_wish_permille, param->soc_target_permille),
        .minimum_soc = (uint8_t)taper_field_encode(&soc_wish_permille, param->soc_minimum_permille),
        .plug_in_soc = (uint8_t)taper_field_encode(&soc_permille, param->soc_plug_in_permille),
    };
    return taper_dbc_ev_param_a_pack(data, &raw, TAPER_FRAME_LENGTH) == TAPER_FRAME_LENGTH;
}

void taper_decode_ev_param_b(const uint8_t *data, taper_message_t *message, taper_decoding_t *decoding) {
    struct taper_dbc_ev_param_b_t raw;
    taper_ev_param_b_t *param = &message->as.ev_param_b;
    (void)taper_dbc_ev_param_b_unpack(&raw, data, TAPER_FRAME_LENGTH);
    param->revision = raw.revision;
    param->session = raw.session;
    param->departure_min = taper_field_decode(&departure_min, raw.departure, decoding);
    param->peak_W = taper_field_decode(&peak_W, raw.peak_power, decoding);
    param->min_mA = taper_field_decode(&min_current_mA, raw.min_current, decoding);
}

bool taper_encode_ev_param_b(const taper_message_t *message, uint8_t *data) {
    const taper_ev_param_b_t *param = &message->as.ev_param_b;
    const struct taper_dbc_ev_param_b_t raw = {
        .revision = (uint8_t)(param->revision & 0x0Fu),
        .session = param->session,
        .departure = (uint16_t)taper_field_encode(&departure_min, param->departure_min),
        .peak_power = (uint16_t)taper_field_encode(&peak_W, param->peak_W),
        .min_current = (uint8_t)taper_field_encode(&min_current_mA, param->min_mA),
    };
    return taper_dbc_ev_param_b_pack(data, &raw, TAPER_FRAME_LENGTH) == TAPER_FRAME_LENGTH;
}

void taper_decode_ev_param_c(const uint8_t *data, taper_message_t *message, taper_decoding_t *decoding) {
    struct taper_dbc_ev_param_c_t raw;
    taper_ev_param_c_t *param = &message->as.ev_param_c;
    (void)taper_dbc_ev_param_c_unpack(&raw, data, TAPER_FRAME_LENGTH);
    param->revision = raw.revision;
    param->target_Wh = taper_field_decode(&energy_Wh, raw.target_energy, decoding);
    param->maximum_Wh = taper_field_decode(&energy_Wh, raw.maximum_energy, decoding);
    param->minimum_Wh = taper_field_decode(&energy_Wh, raw.minimum_energy, decoding);
}

bool taper_encode_ev_param_c(const taper_message_t *message, uint8_t *data) {
    const taper_ev_param_c_t *param = &message->as.ev_param_c;
    const struct taper_dbc_ev_param_c_t raw = {
        .revision = (uint8_t)(param->revision & 0x0Fu),
        .target_energy = (int16_t)taper_field_encode(&energy_Wh, param->target_Wh),
        .maximum_energy = (int16_t)taper_field_encode(&energy_Wh, param->maximum_Wh),
        .minimum_energy = (int16_t)taper_field_encode(&energy_Wh, param->minimum_Wh),
    };
    return taper_dbc_ev_param_c_pack(data, &raw, TAPER_FRAME_LENGTH) == TAPER_FRAME_LENGTH;
}

void taper_decode_ev_param_d(const uint8_t *data, taper_message_t *message, taper_decoding_t *decoding) {
    struct taper_dbc_ev_param_d_t raw;
    taper_ev_param_d_t *param = &message->as.ev_param_d;
    (void)taper_dbc_ev_param_d_unpack(&raw, data, TAPER_FRAME_LENGTH);
    param->revision = raw.revision;
    param->session = raw.session;
    param->taper_W = taper_field_decode(&taper_W, raw.taper_power, decoding);
}

bool taper_encode_ev_param_d(const taper_message_t *message, uint8_t *data) {
    const taper_ev_param_d_t *param = &message->as.ev_param_d;
    const struct taper_dbc_ev_param_d_t raw = {
        .revision = (uint8_t)(param->revision & 0x0Fu),
        .session = param->session,
        .taper_power = (uint16_t)taper_field_encode(&taper_W, param->taper_W),
    };
    return taper_dbc_ev_param_d_pack(data, &raw, TAPER_FRAME_LENGTH) == TAPER_FRAME_LENGTH;
}
