/* EMCY, SITE_METER, EVSE_INFO, PLAN and CTRL_DIAG over the wire: bytes by hand, ends, rounding, values without a name. */
#include <string.h>

#include "support/codec_bench.h"
#include "taper/planner.h"
#include "taper/types.h"
#include "taper_dbc.h"
#include "unity.h"

void setUp(void) {}
void tearDown(void) {}

/* Decodes the bytes, and demands that the message becomes the same bytes again. */
static taper_message_t there_and_back(uint16_t id, const uint8_t *data) {
    taper_frame_t frame = {.id = id, .length = TAPER_FRAME_LENGTH, .time_ms = 5};
    memcpy(frame.data, data, TAPER_FRAME_LENGTH);
    const taper_message_t message = codec_bench_decode(&frame);
    const taper_frame_t again = codec_bench_encode(&message);
    TEST_ASSERT_EQUAL_HEX16(id, again.id);
    TEST_ASSERT_EQUAL_UINT32(0, again.time_ms);
    TEST_ASSERT_EQUAL_HEX8_ARRAY(data, again.data, TAPER_FRAME_LENGTH);
    return message;
}

static bool encodes(const taper_message_t *message) {
    taper_frame_t frame;
    return taper_encode(message, &frame);
}

static void test_an_emcy_by_hand(void) {
    static const uint8_t data[8] = {0, 0x10, 0x04, 0x01, 0x02, 0x07, 0x21, 0x10};
    const taper_message_t message = there_and_back(0x040, data);
    TEST_ASSERT_EQUAL(TAPER_MESSAGE_EMCY, message.kind);
    TEST_ASSERT_EQUAL_UINT8(TAPER_NODE_CONTROLLER, message.node);
    TEST_ASSERT_EQUAL_UINT8(TAPER_SEVERITY_WARNING, message.as.emcy.severity);
    TEST_ASSERT_EQUAL_HEX16(0x0104, message.as.emcy.code);
    TEST_ASSERT_EQUAL_UINT8(2, message.as.emcy.reaction);
    TEST_ASSERT_EQUAL_UINT8(7, message.as.emcy.session);
    TEST_ASSERT_EQUAL_UINT8(33, message.as.emcy.about);
    TEST_ASSERT_EQUAL_UINT8(16, message.as.emcy.data);
}

static void test_an_emcy_comes_from_controller_connectors_and_gateway_only(void) {
    static const uint8_t data[8] = {0};
    TEST_ASSERT_EQUAL_UINT8(1, there_and_back(0x041, data).node);
    TEST_ASSERT_EQUAL_UINT8(60, there_and_back(0x07C, data).node);
    TEST_ASSERT_EQUAL_UINT8(TAPER_NODE_GATEWAY, there_and_back(0x07E, data).node);
    static const uint16_t others[] = {0x07D, 0x07F};
    for (size_t i = 0; i < 2; i++) {
        const taper_frame_t frame = {.id = others[i], .length = TAPER_FRAME_LENGTH};
        taper_message_t message;
        bool bad = false;
        TEST_ASSERT_FALSE(taper_decode(&frame, &message, &bad));
        TEST_ASSERT_FALSE(bad);
    }
}

static void test_an_emcy_without_a_named_severity_is_refused(void) {
    for (unsigned severity = 0; severity < 16; severity++) {
        taper_frame_t frame = codec_bench_frame_of(TAPER_MESSAGE_EMCY);
        frame.data[1] = (uint8_t)(severity << 4);
        taper_message_t message;
        bool bad = false;
        TEST_ASSERT_EQUAL(severity <= TAPER_SEVERITY_FAULT, taper_decode(&frame, &message, &bad));
        TEST_ASSERT_EQUAL(severity > TAPER_SEVERITY_FAULT, bad);
    }
    taper_message_t message = codec_bench_message_of(TAPER_MESSAGE_EMCY);
    message.as.emcy.severity = TAPER_SEVERITY_FAULT + 1;
    TEST_ASSERT_FALSE(encodes(&message));
}

static void test_a_site_meter_by_hand(void) {
    static const uint8_t data[8] = {0, 0, 0x7B, 0x00, 0xCE, 0xFF, 0x00, 0x80};
    const taper_site_meter_t meter = there_and_back(0x1FE, data).as.site_meter;
    TEST_ASSERT_EQUAL_INT32(12300, meter.other_mA[0]);
    TEST_ASSERT_EQUAL_INT32(-5000, meter.other_mA[1]);
    TEST_ASSERT_EQUAL_INT32(TAPER_ABSENT, meter.other_mA[2]);
}

static void test_other_load_is_rounded_up_and_kept_to_the_range(void) {
    static const int32_t sent[] = {12301, -99, -101, 3276701, -3276701, INT32_MAX};
    static const int32_t expected[] = {12400, 0, -100, 3276700, -3276700, 3276700};
    for (size_t i = 0; i < sizeof sent / sizeof sent[0]; i++) {
        taper_message_t message = codec_bench_message_of(TAPER_MESSAGE_SITE_METER);
        message.as.site_meter.other_mA[1] = sent[i];
        const taper_frame_t frame = codec_bench_encode(&message);
        TEST_ASSERT_EQUAL_INT32(expected[i], codec_bench_decode(&frame).as.site_meter.other_mA[1]);
    }
}

static void test_an_evse_info_by_hand(void) {
    static const uint8_t data[8] = {0, 0x10, 0x40, 0x01, 0x0C, 0x16, 0x03, 0x02};
    const taper_message_t message = there_and_back(0x34A, data);
    const taper_evse_info_t *info = &message.as.evse_info;
    TEST_ASSERT_EQUAL_UINT8(10, message.node);
    TEST_ASSERT_EQUAL_UINT8(TAPER_PROTOCOL_VERSION, info->protocol_version);
    TEST_ASSERT_EQUAL_INT32(32000, info->max_mA);
    TEST_ASSERT_EQUAL_INT32(6000, info->min_mA);
    TEST_ASSERT_EQUAL_UINT8(TAPER_KIND_AC3, info->kind);
    TEST_ASSERT_EQUAL_UINT8(TAPER_ROTATION_213, info->rotation);
    TEST_ASSERT_EQUAL_HEX16(0x0203, info->firmware);
}

static void test_an_evse_info_may_leave_its_currents_out(void) {
    static const uint8_t data[8] = {0, 0, 0xFF, 0xFF, 0xFF, 0x03, 0, 0};
    const taper_evse_info_t info = there_and_back(0x37C, data).as.evse_info;
    TEST_ASSERT_EQUAL_INT32(TAPER_ABSENT, info.max_mA);
    TEST_ASSERT_EQUAL_INT32(TAPER_ABSENT, info.min_mA);
    TEST_ASSERT_EQUAL_UINT8(TAPER_KIND_DC, info.kind);
}

static void test_a_connector_does_not_tell_more_than_its_hardware_can(void) {
    taper_message_t message = codec_bench_message_of(TAPER_MESSAGE_EVSE_INFO);
    message.as.evse_info.max_mA = 31999;
    message.as.evse_info.min_mA = 6001;
    message.as.evse_info.protocol_version = 17;
    const taper_frame_t frame = codec_bench_encode(&message);
    const taper_evse_info_t info = codec_bench_decode(&frame).as.evse_info;
    TEST_ASSERT_EQUAL_INT32(31900, info.max_mA);
    TEST_ASSERT_EQUAL_INT32(6500, info.min_mA);
    TEST_ASSERT_EQUAL_UINT8(15, info.protocol_version); /* not 1, which is ours */
}

static void test_an_unnamed_rotation_is_unknown_and_a_bad_field(void) {
    taper_frame_t frame = codec_bench_frame_of(TAPER_MESSAGE_EVSE_INFO);
    frame.data[5] = 0x1E; /* rotation 7, kind AC3 */
    taper_message_t message;
    bool bad = false;
    TEST_ASSERT_TRUE(taper_decode(&frame, &message, &bad));
    TEST_ASSERT_TRUE(bad);
    TEST_ASSERT_EQUAL_UINT8(TAPER_ROTATION_UNKNOWN, message.as.evse_info.rotation);
    TEST_ASSERT_EQUAL_UINT8(TAPER_KIND_AC3, message.as.evse_info.kind);
}

static void test_an_unnamed_kind_or_rotation_is_not_encoded(void) {
    taper_message_t message = codec_bench_message_of(TAPER_MESSAGE_EVSE_INFO);
    message.as.evse_info.kind = TAPER_KIND_DC + 1;
    TEST_ASSERT_FALSE(encodes(&message));
    message.as.evse_info.kind = TAPER_KIND_DC;
    TEST_ASSERT_TRUE(encodes(&message));
    message.as.evse_info.rotation = TAPER_ROTATION_321 + 1;
    TEST_ASSERT_FALSE(encodes(&message));
}

static void test_a_plan_by_hand(void) {
    static const uint8_t data[8] = {0, 0, 0x50, 0x04, 0xFF, 0xFF, 0xFE, 0xFF};
    const taper_message_t message = there_and_back(0x3BC, data);
    TEST_ASSERT_EQUAL_UINT8(60, message.node);
    TEST_ASSERT_EQUAL_INT32(11040, message.as.plan.power_W[0]);
    TEST_ASSERT_EQUAL_INT32(TAPER_ABSENT, message.as.plan.power_W[1]);
    TEST_ASSERT_EQUAL_INT32(655340, message.as.plan.power_W[2]);
}

static void test_planned_power_is_rounded_to_the_nearest_and_kept_to_the_range(void) {
    taper_message_t message = codec_bench_message_of(TAPER_MESSAGE_PLAN);
    message.as.plan = (taper_plan_t){.power_W = {11044, 11045, 700000}};
    const taper_frame_t frame = codec_bench_encode(&message);
    const taper_plan_t plan = codec_bench_decode(&frame).as.plan;
    TEST_ASSERT_EQUAL_INT32(11040, plan.power_W[0]);
    TEST_ASSERT_EQUAL_INT32(11050, plan.power_W[1]);
    TEST_ASSERT_EQUAL_INT32(655340, plan.power_W[2]);
}

static void test_an_outlook_by_hand(void) {
    /* estimated, no clock; waiting, 2nd of 3; 61.5 % at departure, 12.34 kWh short because of a phase */
    static const uint8_t data[8] = {0, 0x90, 0x06, 0x32, 0x7B, 0xD2, 0x04, 0x10};
    const taper_message_t message = there_and_back(0x440 + 9, data);
    const taper_outlook_t *outlook = &message.as.outlook;
    TEST_ASSERT_EQUAL_UINT8(9, message.node);
    TEST_ASSERT_TRUE(outlook->soc_estimated && outlook->no_clock);
    TEST_ASSERT_FALSE(outlook->by_energy || outlook->departure_passed);
    TEST_ASSERT_EQUAL_UINT8(TAPER_REASON_WAITING, outlook->reason);
    TEST_ASSERT_EQUAL_UINT8(2, outlook->waiting_place);
    TEST_ASSERT_EQUAL_UINT8(3, outlook->waiting_of);
    TEST_ASSERT_EQUAL_INT32(615, outlook->soc_at_departure_permille);
    TEST_ASSERT_EQUAL_INT32(12340, outlook->short_Wh);
    TEST_ASSERT_EQUAL_UINT8(TAPER_REASON_PHASE_LIMIT, outlook->because);
}

static void test_an_outlook_without_a_named_reason_is_refused(void) {
    taper_frame_t frame = codec_bench_frame_of(TAPER_MESSAGE_OUTLOOK);
    frame.data[2] = 0xF0;
    taper_message_t refused;
    bool bad = false;
    TEST_ASSERT_FALSE(taper_decode(&frame, &refused, &bad));
    TEST_ASSERT_TRUE(bad);
    taper_message_t message = codec_bench_message_of(TAPER_MESSAGE_OUTLOOK);
    TEST_ASSERT_TRUE(encodes(&message));
    message.as.outlook.reason = 0xFF;
    TEST_ASSERT_FALSE(encodes(&message));
    message.as.outlook.reason = TAPER_REASON_PLANNED;
    message.as.outlook.because = 0xFF;
    TEST_ASSERT_FALSE(encodes(&message));
}

static void test_more_than_fifteen_that_wait_are_fifteen(void) {
    taper_message_t message = codec_bench_message_of(TAPER_MESSAGE_OUTLOOK);
    message.as.outlook.waiting_place = 16;
    message.as.outlook.waiting_of = 200;
    const taper_frame_t frame = codec_bench_encode(&message);
    const taper_outlook_t outlook = codec_bench_decode(&frame).as.outlook;
    TEST_ASSERT_EQUAL_UINT8(15, outlook.waiting_place);
    TEST_ASSERT_EQUAL_UINT8(15, outlook.waiting_of);
}

static void test_a_ctrl_diag_by_hand(void) {
    static const uint8_t data[8] = {0, 0, 0x03, 0x09, 0x78, 0x56, 0x34, 0x12};
    const taper_ctrl_diag_t diag = there_and_back(0x3C0, data).as.ctrl_diag;
    TEST_ASSERT_EQUAL_UINT8(TAPER_COUNTER_CRC_ERRORS, diag.index);
    TEST_ASSERT_EQUAL_UINT8(9, diag.auxiliary);
    TEST_ASSERT_EQUAL_HEX32(0x12345678, diag.value);
}

static void test_a_counter_without_a_name_is_passed_on_and_carried_whole(void) {
    static const uint8_t data[8] = {0, 0, 0xFE, 0, 0xFF, 0xFF, 0xFF, 0xFF};
    const taper_ctrl_diag_t diag = there_and_back(0x3C0, data).as.ctrl_diag;
    TEST_ASSERT_EQUAL_UINT8(0xFE, diag.index);
    TEST_ASSERT_EQUAL_HEX32(UINT32_MAX, diag.value);
}

static void test_the_bus_names_the_verdicts_of_the_planner(void) {
    TEST_ASSERT_EQUAL(TAPER_VERDICT_NONE, TAPER_DBC_CTRL_STATUS_SOLVER_VERDICT_NONE_CHOICE);
    TEST_ASSERT_EQUAL(TAPER_VERDICT_SOLVING, TAPER_DBC_CTRL_STATUS_SOLVER_VERDICT_SOLVING_CHOICE);
    TEST_ASSERT_EQUAL(TAPER_VERDICT_SOLVED, TAPER_DBC_CTRL_STATUS_SOLVER_VERDICT_SOLVED_CHOICE);
    TEST_ASSERT_EQUAL(TAPER_VERDICT_INACCURATE, TAPER_DBC_CTRL_STATUS_SOLVER_VERDICT_INACCURATE_CHOICE);
    TEST_ASSERT_EQUAL(TAPER_VERDICT_LATE, TAPER_DBC_CTRL_STATUS_SOLVER_VERDICT_LATE_CHOICE);
    TEST_ASSERT_EQUAL(TAPER_VERDICT_NOT_FINITE, TAPER_DBC_CTRL_STATUS_SOLVER_VERDICT_NOT_FINITE_CHOICE);
    TEST_ASSERT_EQUAL(TAPER_VERDICT_REFUSED, TAPER_DBC_CTRL_STATUS_SOLVER_VERDICT_REFUSED_CHOICE);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_an_emcy_by_hand);
    RUN_TEST(test_an_emcy_comes_from_controller_connectors_and_gateway_only);
    RUN_TEST(test_an_emcy_without_a_named_severity_is_refused);
    RUN_TEST(test_a_site_meter_by_hand);
    RUN_TEST(test_other_load_is_rounded_up_and_kept_to_the_range);
    RUN_TEST(test_an_evse_info_by_hand);
    RUN_TEST(test_an_evse_info_may_leave_its_currents_out);
    RUN_TEST(test_a_connector_does_not_tell_more_than_its_hardware_can);
    RUN_TEST(test_an_unnamed_rotation_is_unknown_and_a_bad_field);
    RUN_TEST(test_an_unnamed_kind_or_rotation_is_not_encoded);
    RUN_TEST(test_a_plan_by_hand);
    RUN_TEST(test_planned_power_is_rounded_to_the_nearest_and_kept_to_the_range);
    RUN_TEST(test_an_outlook_by_hand);
    RUN_TEST(test_an_outlook_without_a_named_reason_is_refused);
    RUN_TEST(test_more_than_fifteen_that_wait_are_fifteen);
    RUN_TEST(test_a_ctrl_diag_by_hand);
    RUN_TEST(test_a_counter_without_a_name_is_passed_on_and_carried_whole);
    RUN_TEST(test_the_bus_names_the_verdicts_of_the_planner);
    return UNITY_END();
}
