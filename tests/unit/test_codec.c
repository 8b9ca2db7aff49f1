/* Frame <-> message: every raw value of every field, absent codes, enumerations, routing. */
#include "taper/codec.h"

#include <stdio.h>
#include <string.h>

#include "support/codec_bench.h"
#include "taper/e2e.h"
#include "taper/types.h"
#include "taper_dbc.h"
#include "unity.h"

#define NO_CODE INT32_MIN /* the field has no code for "absent" */

/* Lower-case names for the field list. */
enum {
    KIND_emcy = TAPER_MESSAGE_EMCY,
    KIND_site_limit = TAPER_MESSAGE_SITE_LIMIT,
    KIND_setpoint = TAPER_MESSAGE_SETPOINT,
    KIND_evse_status = TAPER_MESSAGE_EVSE_STATUS,
    KIND_ev_status = TAPER_MESSAGE_EV_STATUS,
    KIND_evse_elec = TAPER_MESSAGE_EVSE_ELEC,
    KIND_site_meter = TAPER_MESSAGE_SITE_METER,
    KIND_time_sync = TAPER_MESSAGE_TIME_SYNC,
    KIND_ctrl_status = TAPER_MESSAGE_CTRL_STATUS,
    KIND_ev_param_a = TAPER_MESSAGE_EV_PARAM_A,
    KIND_ev_param_b = TAPER_MESSAGE_EV_PARAM_B,
    KIND_ev_param_c = TAPER_MESSAGE_EV_PARAM_C,
    KIND_ev_param_d = TAPER_MESSAGE_EV_PARAM_D,
    KIND_ev_param_e = TAPER_MESSAGE_EV_PARAM_E,
    KIND_evse_info = TAPER_MESSAGE_EVSE_INFO,
    KIND_plan = TAPER_MESSAGE_PLAN,
    KIND_outlook = TAPER_MESSAGE_OUTLOOK,
    KIND_ctrl_diag = TAPER_MESSAGE_CTRL_DIAG,
};

/* One number on the wire. */
typedef struct {
    const char *name;
    taper_message_kind_t kind;
    unsigned start, bits;
    int32_t absent, low, high, step;
    int32_t (*value)(const taper_message_t *message);
    bool (*dbc_allows)(const uint8_t *data); /* by the code that cantools made of the DBC */
} field_t;

#define FIELD(message, member, signal, start, bits, absent, low, high, step)       \
    static int32_t value_of_##message##_##signal(const taper_message_t *decoded) { \
        return (int32_t)decoded->as.message.member;                                \
    }                                                                              \
    static bool dbc_allows_##message##_##signal(const uint8_t *data) {             \
        struct taper_dbc_##message##_t raw;                                        \
        (void)taper_dbc_##message##_unpack(&raw, data, TAPER_FRAME_LENGTH);        \
        return taper_dbc_##message##_##signal##_is_in_range(raw.signal);           \
    }
#include "support/codec_fields.inc"
#undef FIELD

#define FIELD(message, member, signal, start, bits, absent, low, high, step) \
    {#message "." #signal,                                                   \
     (taper_message_kind_t)KIND_##message,                                   \
     start,                                                                  \
     bits,                                                                   \
     absent,                                                                 \
     low,                                                                    \
     high,                                                                   \
     step,                                                                   \
     value_of_##message##_##signal,                                          \
     dbc_allows_##message##_##signal},
static const field_t fields[] = {
#include "support/codec_fields.inc"
};
#undef FIELD
#define FIELDS (sizeof fields / sizeof fields[0])

void setUp(void) {}
void tearDown(void) {}

/* Little endian, as all signals of the DBC. */
static void poke(taper_frame_t *frame, unsigned start, unsigned bits, uint32_t raw) {
    for (unsigned i = 0; i < bits; i++) {
        const unsigned at = start + i;
        const unsigned mask = 1u << (at % 8u);
        const unsigned bit = ((raw >> i) & 1u) != 0u ? mask : 0u;
        frame->data[at / 8u] = (uint8_t)((frame->data[at / 8u] & ~mask) | bit);
    }
}

static void check_raw_value(const field_t *field, int32_t raw) {
    char where[80];
    (void)snprintf(where, sizeof where, "%s, raw %ld", field->name, (long)raw);
    taper_frame_t frame = codec_bench_frame_of(field->kind);
    poke(&frame, field->start, field->bits, (uint32_t)raw);
    const bool in_range = raw >= field->low && raw <= field->high;
    const bool is_absent = raw == field->absent;
    const bool refused = !in_range && field->absent == NO_CODE;

    taper_message_t message;
    bool bad = false;
    TEST_ASSERT_EQUAL_MESSAGE(in_range, field->dbc_allows(frame.data), where);
    TEST_ASSERT_EQUAL_MESSAGE(!refused, taper_decode(&frame, &message, &bad), where);
    TEST_ASSERT_EQUAL_MESSAGE(!in_range && !is_absent, bad, where);
    if (refused) {
        return;
    }
    const int32_t expected = in_range ? raw * field->step : TAPER_ABSENT;
    TEST_ASSERT_EQUAL_INT32_MESSAGE(expected, field->value(&message), where);
    if (in_range || is_absent) {
        taper_frame_t again = codec_bench_encode(&message);
        if (field->kind == TAPER_MESSAGE_EV_STATUS) {
            poke(&again, 60, 2, 1); /* the source follows from the SOC being there */
        }
        TEST_ASSERT_EQUAL_HEX8_ARRAY_MESSAGE(frame.data, again.data, TAPER_FRAME_LENGTH, where);
    }
}

static void test_every_raw_value_of_every_field_goes_round(void) {
    for (size_t i = 0; i < FIELDS; i++) {
        const int32_t count = (int32_t)1 << fields[i].bits;
        const int32_t first = fields[i].low < 0 ? -count / 2 : 0;
        for (int32_t raw = first; raw < first + count; raw++) {
            check_raw_value(&fields[i], raw);
        }
    }
}

static void test_a_bad_field_stays_noted_over_good_frames(void) {
    const taper_frame_t frame = codec_bench_frame_of(TAPER_MESSAGE_EV_STATUS);
    taper_message_t message;
    bool bad = true;
    TEST_ASSERT_TRUE(taper_decode(&frame, &message, &bad));
    TEST_ASSERT_TRUE(bad);
}

static void test_one_bad_field_leaves_the_others_alone(void) {
    taper_message_t message = codec_bench_message_of(TAPER_MESSAGE_EV_STATUS);
    message.as.ev_status.soc_age_s = 7;
    message.as.ev_status.max_mA = 16000;
    taper_frame_t frame = codec_bench_encode(&message);
    frame.data[2] = 201; /* 100.5 % */
    bool bad = false;
    TEST_ASSERT_TRUE(taper_decode(&frame, &message, &bad));
    TEST_ASSERT_TRUE(bad);
    TEST_ASSERT_EQUAL_INT32(TAPER_ABSENT, message.as.ev_status.soc_permille);
    TEST_ASSERT_EQUAL_INT32(7, message.as.ev_status.soc_age_s);
    TEST_ASSERT_EQUAL_INT32(16000, message.as.ev_status.max_mA);
}

static bool may_have(taper_message_kind_t kind, unsigned node) {
    if (kind == TAPER_MESSAGE_EMCY) {
        return node <= 60 || node == 62;
    }
    const uint8_t usual = codec_bench_node_of(kind);
    return usual == CODEC_BENCH_CONNECTOR ? node >= 1 && node <= 60 : node == usual;
}

static void test_only_the_nodes_that_a_function_allows_are_decoded(void) {
    uint16_t ids[CODEC_BENCH_IDS];
    codec_bench_identifiers(ids);
    for (size_t i = 0; i < CODEC_BENCH_IDS; i++) {
        const taper_frame_t frame = {.id = ids[i], .length = TAPER_FRAME_LENGTH};
        taper_message_t message;
        bool bad = false; /* a capacity of 0 is */
        TEST_ASSERT_TRUE(taper_decode(&frame, &message, &bad));
        TEST_ASSERT_EQUAL_HEX16(ids[i], taper_can_id(message.kind, message.node));
        TEST_ASSERT_EQUAL_UINT8(ids[i] & 0x3Fu, message.node);
        TEST_ASSERT_TRUE(may_have(message.kind, message.node));
    }
}

static void test_iso_tp_is_not_decoded(void) {
    for (unsigned node = 0; node < 64; node++) {
        taper_frame_t frame = {.id = taper_can_id(TAPER_MESSAGE_ISOTP_TO, (uint8_t)node),
                               .length = TAPER_FRAME_LENGTH};
        taper_message_t message;
        bool bad = false;
        TEST_ASSERT_FALSE(taper_decode(&frame, &message, &bad));
        frame.id = taper_can_id(TAPER_MESSAGE_ISOTP_FROM, (uint8_t)node);
        TEST_ASSERT_FALSE(taper_decode(&frame, &message, &bad));
        TEST_ASSERT_FALSE(bad);
    }
}

static void test_an_identifier_beyond_11_bits_is_refused(void) {
    const taper_frame_t frame = {.id = 0x101 | 0x800, .length = TAPER_FRAME_LENGTH};
    taper_message_t message;
    bool bad = false;
    TEST_ASSERT_FALSE(taper_decode(&frame, &message, &bad));
}

static void test_a_short_frame_is_refused(void) {
    for (uint8_t length = 0; length < TAPER_FRAME_LENGTH; length++) {
        taper_frame_t frame = codec_bench_frame_of(TAPER_MESSAGE_EVSE_STATUS);
        frame.length = length;
        taper_message_t message;
        bool bad = false;
        TEST_ASSERT_FALSE(taper_decode(&frame, &message, &bad));
        TEST_ASSERT_FALSE(bad);
    }
}

static void test_identifier_and_bus_go_round_for_every_node(void) {
    for (size_t k = 0; k < CODEC_BENCH_KINDS; k++) {
        for (unsigned node = 0; node < 64; node++) {
            taper_message_t message = codec_bench_message_of(codec_bench_kinds[k]);
            const bool allowed = may_have(codec_bench_kinds[k], node);
            taper_frame_t frame;
            message.node = (uint8_t)node;
            message.bus = 2;
            TEST_ASSERT_EQUAL(allowed, taper_encode(&message, &frame));
            if (allowed) {
                TEST_ASSERT_EQUAL_HEX16((unsigned)codec_bench_kinds[k] << 6 | node, frame.id);
                TEST_ASSERT_EQUAL_UINT8(TAPER_FRAME_LENGTH, frame.length);
                const taper_message_t again = codec_bench_decode(&frame);
                TEST_ASSERT_EQUAL(codec_bench_kinds[k], again.kind);
                TEST_ASSERT_EQUAL_UINT8(node, again.node);
                TEST_ASSERT_EQUAL_UINT8(2, again.bus);
            }
        }
    }
}

static void test_an_unknown_kind_is_not_encoded(void) {
    taper_message_t message = codec_bench_message_of(TAPER_MESSAGE_SETPOINT);
    taper_frame_t frame;
    message.kind = (taper_message_kind_t)0x1F;
    message.node = 1;
    TEST_ASSERT_FALSE(taper_encode(&message, &frame));
}

static void test_golden_setpoints_come_out(void) {
    static const uint8_t charge[8] = {0x76, 0x10, 0xa0, 0x00, 0x06, 0x0c, 0x07, 0x07};
    static const uint8_t pause[8] = {0x67, 0x0f, 0x00, 0x00, 0x06, 0x00, 0x07, 0x07};
    taper_message_t message = {.kind = TAPER_MESSAGE_SETPOINT, .node = 1};
    message.as.setpoint = (taper_setpoint_t){
        .command = TAPER_COMMAND_CHARGE,
        .current_mA = 16000,
        .validity_ms = 3000,
        .fallback_mA = 6000,
        .phase_mask = 7,
        .session = 7,
    };
    taper_frame_t frame = codec_bench_encode(&message);
    taper_e2e_protect(&frame, 0);
    TEST_ASSERT_EQUAL_HEX16(0x0C1, frame.id);
    TEST_ASSERT_EQUAL_HEX8_ARRAY(charge, frame.data, 8);

    message.as.setpoint.command = TAPER_COMMAND_PAUSE;
    message.as.setpoint.current_mA = 0;
    message.as.setpoint.fallback_mA = 0;
    frame = codec_bench_encode(&message);
    taper_e2e_protect(&frame, 15);
    TEST_ASSERT_EQUAL_HEX8_ARRAY(pause, frame.data, 8);
}

static void test_an_evse_status_by_hand(void) {
    /* Pilot C; 16.0, 15.9 A and absent; contactor, fault; echo 9, 3 phases, vehicle there. */
    const taper_frame_t frame = {
        .id = 0x102, .length = 8, .data = {0, 0x20, 0xA0, 0xF0, 0x09, 0xFF, 0x5F, 0xB9}};
    const taper_message_t message = codec_bench_decode(&frame);
    const taper_evse_status_t *status = &message.as.evse_status;
    TEST_ASSERT_EQUAL_UINT8(2, message.node);
    TEST_ASSERT_EQUAL(TAPER_PILOT_C, status->pilot);
    TEST_ASSERT_EQUAL_INT32(16000, status->current_mA[0]);
    TEST_ASSERT_EQUAL_INT32(15900, status->current_mA[1]);
    TEST_ASSERT_EQUAL_INT32(TAPER_ABSENT, status->current_mA[2]);
    TEST_ASSERT_TRUE(status->contactor_closed);
    TEST_ASSERT_FALSE(status->locked);
    TEST_ASSERT_TRUE(status->fault);
    TEST_ASSERT_FALSE(status->derated);
    TEST_ASSERT_EQUAL_UINT8(9, status->setpoint_echo);
    TEST_ASSERT_EQUAL_UINT8(3, status->phases);
    TEST_ASSERT_FALSE(status->fallback_active);
    TEST_ASSERT_TRUE(status->ev_present);
    const taper_frame_t again = codec_bench_encode(&message);
    TEST_ASSERT_EQUAL_HEX8_ARRAY(frame.data, again.data, 8);
}

static void test_every_flag_of_evse_status_has_its_own_bit(void) {
    for (unsigned bit = 52; bit < 64; bit++) {
        taper_frame_t frame = codec_bench_frame_of(TAPER_MESSAGE_EVSE_STATUS);
        poke(&frame, bit, 1, 1);
        const taper_message_t message = codec_bench_decode(&frame);
        const taper_evse_status_t *status = &message.as.evse_status;
        TEST_ASSERT_EQUAL(bit == 52, status->contactor_closed);
        TEST_ASSERT_EQUAL(bit == 53, status->locked);
        TEST_ASSERT_EQUAL(bit == 54, status->fault);
        TEST_ASSERT_EQUAL(bit == 55, status->derated);
        TEST_ASSERT_EQUAL(bit == 62, status->fallback_active);
        TEST_ASSERT_EQUAL(bit == 63, status->ev_present);
        const taper_frame_t again = codec_bench_encode(&message);
        TEST_ASSERT_EQUAL_HEX8_ARRAY(frame.data, again.data, 8);
    }
}

static void test_every_flag_of_ev_status_has_its_own_bit(void) {
    static const unsigned bits[] = {56, 58, 62, 63};
    for (size_t i = 0; i < sizeof bits / sizeof bits[0]; i++) {
        taper_frame_t frame = codec_bench_frame_of(TAPER_MESSAGE_EV_STATUS);
        poke(&frame, bits[i], 1, 1);
        const taper_message_t message = codec_bench_decode(&frame);
        const taper_ev_status_t *ev = &message.as.ev_status;
        TEST_ASSERT_EQUAL(bits[i] == 56, ev->complete);
        TEST_ASSERT_EQUAL(bits[i] == 58, ev->ready);
        TEST_ASSERT_EQUAL(bits[i] == 62, ev->stop_requested);
        TEST_ASSERT_EQUAL(bits[i] == 63, ev->pause_requested);
        const taper_frame_t again = codec_bench_encode(&message);
        TEST_ASSERT_EQUAL_HEX8_ARRAY(frame.data, again.data, 8);
    }
}

static void test_the_limit_flag_goes_round(void) {
    taper_message_t message = codec_bench_message_of(TAPER_MESSAGE_SITE_LIMIT);
    message.as.site_limit.active = true;
    const taper_frame_t frame = codec_bench_encode(&message);
    TEST_ASSERT_EQUAL_HEX8(0x10, frame.data[1]);
    TEST_ASSERT_TRUE(codec_bench_decode(&frame).as.site_limit.active);
}

static void test_unix_time_is_carried_whole(void) {
    static const uint32_t times[] = {0, 1, 0x12345678, 0x80000000u, UINT32_MAX};
    for (size_t i = 0; i < sizeof times / sizeof times[0]; i++) {
        taper_message_t message = codec_bench_message_of(TAPER_MESSAGE_TIME_SYNC);
        message.as.time_sync = (taper_time_sync_t){.unix_s = times[i], .ms = 999, .quality = 63};
        const taper_frame_t frame = codec_bench_encode(&message);
        const taper_message_t again = codec_bench_decode(&frame);
        TEST_ASSERT_EQUAL_UINT32(times[i], again.as.time_sync.unix_s);
        TEST_ASSERT_EQUAL_UINT16(999, again.as.time_sync.ms);
        TEST_ASSERT_EQUAL_UINT8(63, again.as.time_sync.quality);
    }
}

static void test_a_connector_never_sees_an_unnamed_command(void) {
    for (unsigned command = 0; command < 16; command++) {
        const bool named = command <= 2 || command == 15;
        taper_frame_t frame = codec_bench_frame_of(TAPER_MESSAGE_SETPOINT);
        poke(&frame, 12, 4, command);
        taper_message_t message;
        bool bad = false;
        TEST_ASSERT_EQUAL(named, taper_decode(&frame, &message, &bad));
        TEST_ASSERT_EQUAL(!named, bad);
        if (named) {
            TEST_ASSERT_EQUAL(command, message.as.setpoint.command);
        }
    }
}

static void test_a_refused_frame_leaves_nothing_to_act_on(void) {
    taper_frame_t frame = codec_bench_frame_of(TAPER_MESSAGE_EVSE_STATUS);
    poke(&frame, 12, 4, 6); /* no such pilot state */
    taper_message_t message = codec_bench_message_of(TAPER_MESSAGE_EVSE_STATUS);
    bool bad = false;
    TEST_ASSERT_FALSE(taper_decode(&frame, &message, &bad));
    TEST_ASSERT_TRUE(bad);
    TEST_ASSERT_EQUAL(0, message.kind);
    TEST_ASSERT_EQUAL_UINT8(0, message.node);
}

static void test_unnamed_enumerations_are_not_encoded(void) {
    taper_frame_t frame;
    taper_message_t message = codec_bench_message_of(TAPER_MESSAGE_SETPOINT);
    static const int commands[] = {3, 14, 16, 17, 257};
    for (size_t i = 0; i < sizeof commands / sizeof commands[0]; i++) {
        message.as.setpoint.command = (taper_command_t)commands[i];
        TEST_ASSERT_FALSE(taper_encode(&message, &frame));
    }
    message = codec_bench_message_of(TAPER_MESSAGE_EVSE_STATUS);
    message.as.evse_status.pilot = (taper_pilot_t)6;
    TEST_ASSERT_FALSE(taper_encode(&message, &frame));
    message = codec_bench_message_of(TAPER_MESSAGE_CTRL_STATUS);
    message.as.ctrl_status.mode = 4;
    TEST_ASSERT_FALSE(taper_encode(&message, &frame));
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_every_raw_value_of_every_field_goes_round);
    RUN_TEST(test_a_bad_field_stays_noted_over_good_frames);
    RUN_TEST(test_one_bad_field_leaves_the_others_alone);
    RUN_TEST(test_only_the_nodes_that_a_function_allows_are_decoded);
    RUN_TEST(test_iso_tp_is_not_decoded);
    RUN_TEST(test_an_identifier_beyond_11_bits_is_refused);
    RUN_TEST(test_a_short_frame_is_refused);
    RUN_TEST(test_identifier_and_bus_go_round_for_every_node);
    RUN_TEST(test_an_unknown_kind_is_not_encoded);
    RUN_TEST(test_golden_setpoints_come_out);
    RUN_TEST(test_an_evse_status_by_hand);
    RUN_TEST(test_every_flag_of_evse_status_has_its_own_bit);
    RUN_TEST(test_every_flag_of_ev_status_has_its_own_bit);
    RUN_TEST(test_the_limit_flag_goes_round);
    RUN_TEST(test_unix_time_is_carried_whole);
    RUN_TEST(test_a_connector_never_sees_an_unnamed_command);
    RUN_TEST(test_a_refused_frame_leaves_nothing_to_act_on);
    RUN_TEST(test_unnamed_enumerations_are_not_encoded);
    return UNITY_END();
}
