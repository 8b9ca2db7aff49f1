/* What a value becomes after a trip over the wire: rounding, ends, and any bytes at all. */
#include "support/codec_bench.h"
#include "taper/types.h"
#include "unity.h"

void setUp(void) {}
void tearDown(void) {}

static taper_message_t over_the_wire(const taper_message_t *message) {
    const taper_frame_t frame = codec_bench_encode(message);
    return codec_bench_decode(&frame);
}

static int32_t trip_limit(int32_t value) {
    taper_message_t message = codec_bench_message_of(TAPER_MESSAGE_SITE_LIMIT);
    message.as.site_limit.limit_W = value;
    return over_the_wire(&message).as.site_limit.limit_W;
}

static void test_a_limit_is_rounded_down_also_below_zero(void) {
    TEST_ASSERT_EQUAL_INT32(10000, trip_limit(10000));
    TEST_ASSERT_EQUAL_INT32(10000, trip_limit(10099));
    TEST_ASSERT_EQUAL_INT32(0, trip_limit(99));
    TEST_ASSERT_EQUAL_INT32(-100, trip_limit(-1));
    TEST_ASSERT_EQUAL_INT32(-200, trip_limit(-101));
    TEST_ASSERT_EQUAL_INT32(-200, trip_limit(-200));
}

static void test_a_limit_out_of_range_becomes_its_nearest_end(void) {
    TEST_ASSERT_EQUAL_INT32(3276700, trip_limit(3276701));
    TEST_ASSERT_EQUAL_INT32(3276700, trip_limit(INT32_MAX));
    TEST_ASSERT_EQUAL_INT32(-3276700, trip_limit(-INT32_MAX));
    TEST_ASSERT_EQUAL_INT32(TAPER_ABSENT, trip_limit(TAPER_ABSENT));
}

static void test_a_setpoint_is_never_rounded_up(void) {
    taper_message_t message = codec_bench_message_of(TAPER_MESSAGE_SETPOINT);
    message.as.setpoint.current_mA = 15999;
    message.as.setpoint.validity_ms = 2999;
    message.as.setpoint.fallback_mA = 5999;
    const taper_setpoint_t arrived = over_the_wire(&message).as.setpoint;
    TEST_ASSERT_EQUAL_INT32(15900, arrived.current_mA);
    TEST_ASSERT_EQUAL_INT32(2500, arrived.validity_ms);
    TEST_ASSERT_EQUAL_INT32(5500, arrived.fallback_mA);
}

static void test_an_absent_or_negative_setpoint_is_zero(void) {
    taper_message_t message = codec_bench_message_of(TAPER_MESSAGE_SETPOINT);
    message.as.setpoint.current_mA = TAPER_ABSENT;
    message.as.setpoint.validity_ms = -1;
    message.as.setpoint.fallback_mA = TAPER_ABSENT;
    const taper_setpoint_t arrived = over_the_wire(&message).as.setpoint;
    TEST_ASSERT_EQUAL_INT32(0, arrived.current_mA);
    TEST_ASSERT_EQUAL_INT32(0, arrived.validity_ms);
    TEST_ASSERT_EQUAL_INT32(0, arrived.fallback_mA);
}

static void test_measured_current_voltage_and_power_are_rounded_up(void) {
    taper_message_t message = codec_bench_message_of(TAPER_MESSAGE_EVSE_STATUS);
    message.as.evse_status.current_mA[0] = 15901;
    message.as.evse_status.current_mA[1] = 500000;
    message.as.evse_status.current_mA[2] = -200;
    const taper_evse_status_t status = over_the_wire(&message).as.evse_status;
    TEST_ASSERT_EQUAL_INT32(16000, status.current_mA[0]);
    TEST_ASSERT_EQUAL_INT32(409400, status.current_mA[1]);
    TEST_ASSERT_EQUAL_INT32(0, status.current_mA[2]);

    message = codec_bench_message_of(TAPER_MESSAGE_EVSE_ELEC);
    message.as.evse_elec = (taper_evse_elec_t){.voltage_mV = 230001, .power_W = 11041, .energy_Wh = 1239};
    const taper_evse_elec_t elec = over_the_wire(&message).as.evse_elec;
    TEST_ASSERT_EQUAL_INT32(230100, elec.voltage_mV);
    TEST_ASSERT_EQUAL_INT32(11050, elec.power_W);
    TEST_ASSERT_EQUAL_INT32(1230, elec.energy_Wh); /* measured energy: down */
}

static void test_a_reported_soc_is_the_nearest_half_percent(void) {
    static const int32_t sent[] = {0, 2, 3, 497, 498, 502, 998, 1000, 1001, -3};
    static const int32_t expected[] = {0, 0, 5, 495, 500, 500, 1000, 1000, 1000, 0};
    for (size_t i = 0; i < sizeof sent / sizeof sent[0]; i++) {
        taper_message_t message = codec_bench_message_of(TAPER_MESSAGE_EV_STATUS);
        message.as.ev_status.soc_permille = sent[i];
        TEST_ASSERT_EQUAL_INT32(expected[i], over_the_wire(&message).as.ev_status.soc_permille);
    }
}

static void test_what_a_vehicle_wants_or_can_take_is_rounded_up(void) {
    taper_message_t message = codec_bench_message_of(TAPER_MESSAGE_EV_STATUS);
    message.as.ev_status.max_mA = 15901;
    TEST_ASSERT_EQUAL_INT32(16000, over_the_wire(&message).as.ev_status.max_mA);

    message = codec_bench_message_of(TAPER_MESSAGE_EV_PARAM_A);
    message.as.ev_param_a.soc_target_permille = 801;
    message.as.ev_param_a.soc_minimum_permille = 296;
    message.as.ev_param_a.soc_plug_in_permille = 201;
    const taper_ev_param_a_t a = over_the_wire(&message).as.ev_param_a;
    TEST_ASSERT_EQUAL_INT32(805, a.soc_target_permille);
    TEST_ASSERT_EQUAL_INT32(300, a.soc_minimum_permille);
    TEST_ASSERT_EQUAL_INT32(200, a.soc_plug_in_permille);

    message = codec_bench_message_of(TAPER_MESSAGE_EV_PARAM_B);
    message.as.ev_param_b.peak_W = 11001;
    message.as.ev_param_b.min_mA = 6001;
    const taper_ev_param_b_t b = over_the_wire(&message).as.ev_param_b;
    TEST_ASSERT_EQUAL_INT32(11010, b.peak_W);
    TEST_ASSERT_EQUAL_INT32(6500, b.min_mA);

    message = codec_bench_message_of(TAPER_MESSAGE_EV_PARAM_C);
    message.as.ev_param_c = (taper_ev_param_c_t){.target_Wh = 20001, .maximum_Wh = 700000, .minimum_Wh = -1};
    const taper_ev_param_c_t c = over_the_wire(&message).as.ev_param_c;
    TEST_ASSERT_EQUAL_INT32(20020, c.target_Wh);
    TEST_ASSERT_EQUAL_INT32(655340, c.maximum_Wh);
    TEST_ASSERT_EQUAL_INT32(0, c.minimum_Wh);
}

static void test_the_taper_is_rounded_down(void) {
    taper_message_t message = codec_bench_message_of(TAPER_MESSAGE_EV_PARAM_D);
    message.as.ev_param_d.taper_W = 4409;
    TEST_ASSERT_EQUAL_INT32(4400, over_the_wire(&message).as.ev_param_d.taper_W);
}

static void test_the_second_line_is_rounded_as_the_first(void) {
    taper_message_t message = codec_bench_message_of(TAPER_MESSAGE_EV_PARAM_E);
    message.as.ev_param_e = (taper_ev_param_e_t){.peak_W = 300001, .taper_W = 290009};
    const taper_ev_param_e_t e = over_the_wire(&message).as.ev_param_e;
    TEST_ASSERT_EQUAL_INT32(300010, e.peak_W);
    TEST_ASSERT_EQUAL_INT32(290000, e.taper_W);
}

static void test_a_capacity_is_rounded_to_the_nearest_and_zero_is_unknown(void) {
    static const int32_t sent[] = {60049, 60050, 120, 1, 0, -5, 9000000};
    static const int32_t expected[] = {60000, 60100, 100, 100, TAPER_ABSENT, TAPER_ABSENT, 6553400};
    for (size_t i = 0; i < sizeof sent / sizeof sent[0]; i++) {
        taper_message_t message = codec_bench_message_of(TAPER_MESSAGE_EV_PARAM_A);
        message.as.ev_param_a.capacity_Wh = sent[i];
        TEST_ASSERT_EQUAL_INT32(expected[i], over_the_wire(&message).as.ev_param_a.capacity_Wh);
    }
}

static void test_iterations_are_rounded_up_to_what_fits(void) {
    static const uint16_t sent[] = {0, 1, 2, 509, 510, 511, 65535};
    static const uint16_t expected[] = {0, 2, 2, 510, 510, 510, 510};
    for (size_t i = 0; i < sizeof sent / sizeof sent[0]; i++) {
        taper_message_t message = codec_bench_message_of(TAPER_MESSAGE_CTRL_STATUS);
        message.as.ctrl_status.iterations = sent[i];
        TEST_ASSERT_EQUAL_UINT16(expected[i], over_the_wire(&message).as.ctrl_status.iterations);
    }
}

/* ---- Any bytes at all. */

static uint32_t next_random(uint32_t *state) {
    *state ^= *state << 13;
    *state ^= *state >> 17;
    *state ^= *state << 5;
    return *state;
}

static void test_any_bytes_are_refused_or_stay_what_they_were_decoded_to(void) {
    uint32_t state = 0x5ee2;
    for (int i = 0; i < 200000; i++) {
        const taper_message_kind_t kind = codec_bench_kinds[next_random(&state) % CODEC_BENCH_KINDS];
        taper_frame_t frame = {.id = taper_can_id(kind, codec_bench_node_of(kind)),
                               .length = TAPER_FRAME_LENGTH};
        for (unsigned byte = 0; byte < TAPER_FRAME_LENGTH; byte++) {
            frame.data[byte] = (uint8_t)(next_random(&state) >> 11);
        }
        taper_message_t message;
        bool bad = false;
        if (taper_decode(&frame, &message, &bad)) {
            const taper_frame_t once = codec_bench_encode(&message);
            const taper_message_t again = codec_bench_decode(&once);
            const taper_frame_t twice = codec_bench_encode(&again);
            TEST_ASSERT_EQUAL_HEX8_ARRAY(once.data, twice.data, TAPER_FRAME_LENGTH);
        } else {
            TEST_ASSERT_TRUE(bad);
        }
    }
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_a_limit_is_rounded_down_also_below_zero);
    RUN_TEST(test_a_limit_out_of_range_becomes_its_nearest_end);
    RUN_TEST(test_a_setpoint_is_never_rounded_up);
    RUN_TEST(test_an_absent_or_negative_setpoint_is_zero);
    RUN_TEST(test_measured_current_voltage_and_power_are_rounded_up);
    RUN_TEST(test_a_reported_soc_is_the_nearest_half_percent);
    RUN_TEST(test_what_a_vehicle_wants_or_can_take_is_rounded_up);
    RUN_TEST(test_the_taper_is_rounded_down);
    RUN_TEST(test_the_second_line_is_rounded_as_the_first);
    RUN_TEST(test_a_capacity_is_rounded_to_the_nearest_and_zero_is_unknown);
    RUN_TEST(test_iterations_are_rounded_up_to_what_fits);
    RUN_TEST(test_any_bytes_are_refused_or_stay_what_they_were_decoded_to);
    return UNITY_END();
}
