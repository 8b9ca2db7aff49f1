/** Private to the codec: fields with a step and a range, and one pair of functions per frame. */
#ifndef TAPER_CODEC_INTERNAL_H
#define TAPER_CODEC_INTERNAL_H

#include <stdbool.h>
#include <stdint.h>

#include "taper/frame.h"
#include "taper/message.h"
#include "taper/types.h"

typedef enum {
    TAPER_ROUND_DOWN,
    TAPER_ROUND_UP,
    TAPER_ROUND_NEAREST,
} taper_rounding_t;

/** A field that has no code for "absent". Never a raw value: no field is wider than 16 bits. */
#define TAPER_FIELD_ALWAYS INT32_MIN

/** A number on the wire. */
typedef struct {
    int32_t step;   /**< units per raw count */
    int32_t low;    /**< least raw value */
    int32_t high;   /**< greatest raw value */
    int32_t absent; /**< raw code for "absent", or TAPER_FIELD_ALWAYS */
    taper_rounding_t rounding;
} taper_field_t;

#include "taper_fields.h" /* generated: all fields, and which values have a name; needs the types above */

/** What decoding found wrong so far. Starts all false. */
typedef struct {
    bool bad_field; /**< a field was outside its range */
    bool refused;   /**< one that has no code for "absent": the frame cannot be used */
} taper_decoding_t;

/** Refuse a frame: what it says in some field nobody may guess. */
static inline void taper_decoding_refuse(taper_decoding_t *decoding) {
    decoding->bad_field = true;
    decoding->refused = true;
}

/**
 * @return the field in its unit, or TAPER_ABSENT; anything out of range is noted in `decoding`. In the header, since fields are
 * constants that leave little of it to do.
 */
static inline int32_t taper_field_decode(const taper_field_t *field, int32_t raw,
                                         taper_decoding_t *decoding) {
    if (raw >= field->low && raw <= field->high) {
        return raw * field->step;
    }
    if (field->absent == TAPER_FIELD_ALWAYS) {
        taper_decoding_refuse(decoding);
    } else if (raw != field->absent) {
        decoding->bad_field = true;
    }
    return TAPER_ABSENT;
}

/** @return the raw value for the wire: rounded, moved to the nearest end of the range, or the absent code. */
int32_t taper_field_encode(const taper_field_t *field, int32_t value);

void taper_decode_site_limit(const uint8_t *data, taper_message_t *message, taper_decoding_t *decoding);
void taper_decode_setpoint(const uint8_t *data, taper_message_t *message, taper_decoding_t *decoding);
void taper_decode_evse_status(const uint8_t *data, taper_message_t *message, taper_decoding_t *decoding);
void taper_decode_evse_elec(const uint8_t *data, taper_message_t *message, taper_decoding_t *decoding);
void taper_decode_site_meter(const uint8_t *data, taper_message_t *message, taper_decoding_t *decoding);
void taper_decode_time_sync(const uint8_t *data, taper_message_t *message, taper_decoding_t *decoding);
void taper_decode_ctrl_status(const uint8_t *data, taper_message_t *message, taper_decoding_t *decoding);
void taper_decode_ev_status(const uint8_t *data, taper_message_t *message, taper_decoding_t *decoding);
void taper_decode_ev_param_a(const uint8_t *data, taper_message_t *message, taper_decoding_t *decoding);
void taper_decode_ev_param_b(const uint8_t *data, taper_message_t *message, taper_decoding_t *decoding);
void taper_decode_ev_param_c(const uint8_t *data, taper_message_t *message, taper_decoding_t *decoding);
void taper_decode_ev_param_d(const uint8_t *data, taper_message_t *message, taper_decoding_t *decoding);
void taper_decode_ev_param_e(const uint8_t *data, taper_message_t *message, taper_decoding_t *decoding);
void taper_decode_emcy(const uint8_t *data, taper_message_t *message, taper_decoding_t *decoding);
void taper_decode_evse_info(const uint8_t *data, taper_message_t *message, taper_decoding_t *decoding);
void taper_decode_plan(const uint8_t *data, taper_message_t *message, taper_decoding_t *decoding);
void taper_decode_outlook(const uint8_t *data, taper_message_t *message, taper_decoding_t *decoding);
void taper_decode_ctrl_diag(const uint8_t *data, taper_message_t *message, taper_decoding_t *decoding);

/** Each: @return false for an enumeration that the wire does not have. */
bool taper_encode_site_limit(const taper_message_t *message, uint8_t *data);
bool taper_encode_setpoint(const taper_message_t *message, uint8_t *data);
bool taper_encode_evse_status(const taper_message_t *message, uint8_t *data);
bool taper_encode_evse_elec(const taper_message_t *message, uint8_t *data);
bool taper_encode_site_meter(const taper_message_t *message, uint8_t *data);
bool taper_encode_time_sync(const taper_message_t *message, uint8_t *data);
bool taper_encode_ctrl_status(const taper_message_t *message, uint8_t *data);
bool taper_encode_ev_status(const taper_message_t *message, uint8_t *data);
bool taper_encode_ev_param_a(const taper_message_t *message, uint8_t *data);
bool taper_encode_ev_param_b(const taper_message_t *message, uint8_t *data);
bool taper_encode_ev_param_c(const taper_message_t *message, uint8_t *data);
bool taper_encode_ev_param_d(const taper_message_t *message, uint8_t *data);
bool taper_encode_ev_param_e(const taper_message_t *message, uint8_t *data);
bool taper_encode_emcy(const taper_message_t *message, uint8_t *data);
bool taper_encode_evse_info(const taper_message_t *message, uint8_t *data);
bool taper_encode_plan(const taper_message_t *message, uint8_t *data);
bool taper_encode_outlook(const taper_message_t *message, uint8_t *data);
bool taper_encode_ctrl_diag(const taper_message_t *message, uint8_t *data);

#endif
