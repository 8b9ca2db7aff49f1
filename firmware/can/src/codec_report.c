/* What is told for people and tools: EMCY, EVSE_INFO, PLAN, CTRL_DIAG. */
#include "codec_internal.h"
#include "taper/types.h"
#include "taper_dbc.h"

void taper_decode_emcy(const uint8_t *data, taper_message_t *message, taper_decoding_t *decoding) {
    struct taper_dbc_emcy_t raw;
    taper_emcy_t *emcy = &message->as.emcy;
    (void)taper_dbc_emcy_unpack(&raw, data, TAPER_FRAME_LENGTH);
    if (!taper_severity_is_named(raw.severity)) {
        taper_decoding_refuse(decoding);
        return;
    }
    emcy->severity = raw.severity;
    emcy->code = raw.code;
    emcy->reaction = raw.reaction;
    emcy->session = raw.session;
    emcy->about = raw.about;
    emcy->data = raw.data;
}

bool taper_encode_emcy(const taper_message_t *message, uint8_t *data) {
    const taper_emcy_t *emcy = &message->as.emcy;
    const struct taper_dbc_emcy_t raw = {
        .severity = emcy->severity,
        .code = emcy->code,
        .reaction = emcy->reaction,
        .session = emcy->session,
        .about = emcy->about,
        .data = emcy->data,
    };
    return taper_severity_is_named(emcy->severity) &&
           taper_dbc_emcy_pack(data, &raw, TAPER_FRAME_LENGTH) == TAPER_FRAME_LENGTH;
}

void taper_decode_evse_info(const uint8_t *data, taper_message_t *message, taper_decoding_t *decoding) {
    struct taper_dbc_evse_info_t raw;
    taper_evse_info_t *info = &message->as.evse_info;
    (void)taper_dbc_evse_info_unpack(&raw, data, TAPER_FRAME_LENGTH);
    info->protocol_version = raw.protocol_version;
    info->max_mA = taper_field_decode(&taper_field_evse_info_max_current, raw.max_current, decoding);
    info->min_mA = taper_field_decode(&taper_field_evse_info_min_current, raw.min_current, decoding);
    info->kind = raw.kind;
    info->rotation = raw.rotation;
    info->firmware = raw.firmware;
    if (!taper_kind_is_named(raw.kind)) {
        info->kind = TAPER_KIND_UNKNOWN;
        decoding->bad_field = true;
    }
    if (!taper_rotation_is_named(raw.rotation)) {
        info->rotation = TAPER_ROTATION_UNKNOWN;
        decoding->bad_field = true;
    }
}

bool taper_encode_evse_info(const taper_message_t *message, uint8_t *data) {
    const taper_evse_info_t *info = &message->as.evse_info;
    const struct taper_dbc_evse_info_t raw = {
        .protocol_version = (uint8_t)taper_min_i32(info->protocol_version, 15),
        .max_current = (uint16_t)taper_field_encode(&taper_field_evse_info_max_current, info->max_mA),
        .min_current = (uint8_t)taper_field_encode(&taper_field_evse_info_min_current, info->min_mA),
        .kind = info->kind,
        .rotation = info->rotation,
        .firmware = info->firmware,
    };
    return taper_kind_is_named(info->kind) && taper_rotation_is_named(info->rotation) &&
           taper_dbc_evse_info_pack(data, &raw, TAPER_FRAME_LENGTH) == TAPER_FRAME_LENGTH;
}

void taper_decode_plan(const uint8_t *data, taper_message_t *message, taper_decoding_t *decoding) {
    struct taper_dbc_plan_t raw;
    taper_plan_t *plan = &message->as.plan;
    (void)taper_dbc_plan_unpack(&raw, data, TAPER_FRAME_LENGTH);
    plan->power_W[0] = taper_field_decode(&taper_field_plan_power_0, raw.power_0, decoding);
    plan->power_W[1] = taper_field_decode(&taper_field_plan_power_1, raw.power_1, decoding);
    plan->power_W[2] = taper_field_decode(&taper_field_plan_power_2, raw.power_2, decoding);
}

bool taper_encode_plan(const taper_message_t *message, uint8_t *data) {
    const taper_plan_t *plan = &message->as.plan;
    const struct taper_dbc_plan_t raw = {
        .power_0 = (uint16_t)taper_field_encode(&taper_field_plan_power_0, plan->power_W[0]),
        .power_1 = (uint16_t)taper_field_encode(&taper_field_plan_power_1, plan->power_W[1]),
        .power_2 = (uint16_t)taper_field_encode(&taper_field_plan_power_2, plan->power_W[2]),
    };
    return taper_dbc_plan_pack(data, &raw, TAPER_FRAME_LENGTH) == TAPER_FRAME_LENGTH;
}

void taper_decode_outlook(const uint8_t *data, taper_message_t *message, taper_decoding_t *decoding) {
    struct taper_dbc_outlook_t raw;
    taper_outlook_t *outlook = &message->as.outlook;
    (void)taper_dbc_outlook_unpack(&raw, data, TAPER_FRAME_LENGTH);
    if (!taper_reason_is_named(raw.reason) || !taper_reason_is_named(raw.because)) {
        taper_decoding_refuse(decoding);
        return;
    }
    outlook->soc_estimated = raw.soc_estimated != 0;
    outlook->by_energy = raw.by_energy != 0;
    outlook->departure_passed = raw.departure_passed != 0;
    outlook->no_clock = raw.no_clock != 0;
    outlook->reason = raw.reason;
    outlook->waiting_place = raw.waiting_place;
    outlook->waiting_of = raw.waiting_of;
    outlook->soc_at_departure_permille =
        taper_field_decode(&taper_field_outlook_soc_at_departure, raw.soc_at_departure, decoding);
    outlook->short_Wh = taper_field_decode(&taper_field_outlook_short_energy, raw.short_energy, decoding);
    outlook->because = raw.because;
}

bool taper_encode_outlook(const taper_message_t *message, uint8_t *data) {
    const taper_outlook_t *outlook = &message->as.outlook;
    const struct taper_dbc_outlook_t raw = {
        .soc_estimated = outlook->soc_estimated,
        .by_energy = outlook->by_energy,
        .departure_passed = outlook->departure_passed,
        .no_clock = outlook->no_clock,
        .reason = outlook->reason,
        .waiting_place = (uint8_t)taper_min_i32(outlook->waiting_place, 15),
        .waiting_of = (uint8_t)taper_min_i32(outlook->waiting_of, 15),
        .soc_at_departure = (uint8_t)taper_field_encode(&taper_field_outlook_soc_at_departure,
                                                        outlook->soc_at_departure_permille),
        .short_energy = (uint16_t)taper_field_encode(&taper_field_outlook_short_energy, outlook->short_Wh),
        .because = outlook->because,
    };
    return taper_reason_is_named(outlook->reason) && taper_reason_is_named(outlook->because) &&
           taper_dbc_outlook_pack(data, &raw, TAPER_FRAME_LENGTH) == TAPER_FRAME_LENGTH;
}

/* An index without a name is passed on: a tool shows the number. */
void taper_decode_ctrl_diag(const uint8_t *data, taper_message_t *message, taper_decoding_t *decoding) {
    struct taper_dbc_ctrl_diag_t raw;
    (void)decoding; /* every value is good */
    (void)taper_dbc_ctrl_diag_unpack(&raw, data, TAPER_FRAME_LENGTH);
    message->as.ctrl_diag = (taper_ctrl_diag_t){raw.index, raw.auxiliary, raw.value};
}

bool taper_encode_ctrl_diag(const taper_message_t *message, uint8_t *data) {
    const taper_ctrl_diag_t *diag = &message->as.ctrl_diag;
    const struct taper_dbc_ctrl_diag_t raw = {
        .index = diag->index,
        .auxiliary = diag->auxiliary,
        .value = diag->value,
    };
    return taper_dbc_ctrl_diag_pack(data, &raw, TAPER_FRAME_LENGTH) == TAPER_FRAME_LENGTH;
}
