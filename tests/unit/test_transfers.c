/* The limit curve from the gateway: whole and right, or not at all. */
#include <string.h>

#include "taper/limits.h"
#include "transfers_bench.h"
#include "unity.h"

#define HOUR 3600u

static uint8_t message[TAPER_ISOTP_LONGEST];
static const uint32_t times[] = {BENCH_UNIX_s + 10, BENCH_UNIX_s + HOUR, BENCH_UNIX_s + 2 * HOUR};
static const uint16_t limits[] = {110, 0, 65535};

void setUp(void) {
    bench_start();
}
void tearDown(void) {}

static void assert_point(uint16_t k, uint32_t time_ms, int32_t limit_W) {
    TEST_ASSERT_EQUAL_UINT32(time_ms, content.curve.point[k].time_ms);
    TEST_ASSERT_EQUAL_INT32(limit_W, content.curve.point[k].limit_W);
}

/** Send points to the station, whose clock stands still. */
static taper_transfer_result_t take_points(uint16_t count, const uint32_t *unix_s,
                                           const uint16_t *limits_100W) {
    const uint16_t length = bench_curve(message, count, unix_s, limits_100W);
    return bench_transfer(&gateway, message, length);
}

static void assert_refused_with(taper_transfer_answer_t answer, uint16_t length) {
    const taper_transfer_content_t before = content;
    const uint32_t refused = transfers.refused;
    TEST_ASSERT_EQUAL(TAPER_RESULT_REFUSED, bench_transfer(&gateway, message, length));
    bench_answered(&gateway, answer);
    TEST_ASSERT_EQUAL_UINT32(refused + 1, transfers.refused);
    TEST_ASSERT_EQUAL_MEMORY(&before, &content, sizeof content);
}

static void test_a_curve_arrives_in_the_stations_time_and_is_answered(void) {
    /* By hand: version 1, type 1, one point, 1700000010 s, 110 x 100 W, CRC-32. */
    const uint8_t by_hand[] = {1, 1, 1, 0, 0x0A, 0xF1, 0x53, 0x65, 0x6E, 0x00, 0x00, 0x00, 0x00, 0x00};
    memcpy(message, by_hand, 10);
    TEST_ASSERT_EQUAL_UINT16(sizeof by_hand, bench_curve(message, 1, times, limits));
    TEST_ASSERT_EQUAL_HEX8_ARRAY(by_hand, message, 10);
    TEST_ASSERT_EQUAL(TAPER_RESULT_CURVE, bench_transfer(&gateway, message, sizeof by_hand));
    TEST_ASSERT_EQUAL_UINT16(1, content.curve.count);
    TEST_ASSERT_EQUAL_INT32(11000, content.curve.point[0].limit_W);
    bench_answered(&gateway, TAPER_ANSWER_ACCEPTED);
    TEST_ASSERT_EQUAL_UINT32(1, transfers.accepted);
    TEST_ASSERT_EQUAL_UINT32(0, transfers.refused);
}

/** The frame that completes the message comes at scene.now_ms, where the scene says what time it is. */
static taper_transfer_result_t take_at_once(uint16_t length) {
    taper_transfer_result_t result = TAPER_RESULT_NONE;
    bench_send(&gateway, message, length);
    while (taper_isotp_sending(&gateway.link) == TAPER_ISOTP_BUSY) {
        const taper_transfer_scene_t now = scene;
        if (gateway.link.out.sent + 7u < gateway.link.out.length) {
            scene.unix_s = 0; /* the time of the other frames does not matter */
        }
        const bool moved = bench_from_peer(&gateway, &result);
        scene = now;
        if (!moved && !bench_to_peer(&gateway)) {
            gateway.link.out.gap_ms = 0; /* the station's separation */
        }
    }
    return result;
}

static void test_times_become_the_stations_clock(void) {
    TEST_ASSERT_EQUAL(TAPER_RESULT_CURVE, take_at_once(bench_curve(message, 3, times, limits)));
    TEST_ASSERT_EQUAL_UINT16(3, content.curve.count);
    assert_point(0, BENCH_NOW_ms + 10000, 11000);
    assert_point(1, BENCH_NOW_ms + HOUR * 1000, 0);
    assert_point(2, BENCH_NOW_ms + 2 * HOUR * 1000, 6553500);
}

static void test_a_world_that_runs_faster_has_its_own_clock(void) {
    scene.time_scale = 60;
    TEST_ASSERT_EQUAL(TAPER_RESULT_CURVE, take_at_once(bench_curve(message, 3, times, limits)));
    assert_point(0, 60 * BENCH_NOW_ms + 10000, 11000);
    assert_point(2, 60 * BENCH_NOW_ms + 2 * HOUR * 1000, 6553500);
}

static void test_times_go_across_the_wrap_of_the_clock(void) {
    scene.now_ms = UINT32_MAX - 2999;
    TEST_ASSERT_EQUAL(TAPER_RESULT_CURVE, take_at_once(bench_curve(message, 3, times, limits)));
    assert_point(0, 7000, 11000);
    setUp();
    scene.now_ms = 71582789; /* times 60: 44 ms after the wrap */
    scene.time_scale = 60;
    TEST_ASSERT_EQUAL(TAPER_RESULT_CURVE, take_at_once(bench_curve(message, 3, times, limits)));
    assert_point(0, 44 + 10000, 11000);
}

static void test_points_past_become_one_of_now(void) {
    const uint32_t past[] = {0, BENCH_UNIX_s - 100 * 24 * HOUR, BENCH_UNIX_s - 1, BENCH_UNIX_s + 1};
    const uint16_t watts[] = {1, 2, 3, 4};
    TEST_ASSERT_EQUAL(TAPER_RESULT_CURVE, take_at_once(bench_curve(message, 4, past, watts)));
    TEST_ASSERT_EQUAL_UINT16(2, content.curve.count);
    assert_point(0, BENCH_NOW_ms, 300);
    assert_point(1, BENCH_NOW_ms + 1000, 400);
}

static void test_a_point_of_now_supersedes_those_before_it(void) {
    const uint32_t past[] = {BENCH_UNIX_s - 1, BENCH_UNIX_s};
    TEST_ASSERT_EQUAL(TAPER_RESULT_CURVE, take_at_once(bench_curve(message, 2, past, limits)));
    TEST_ASSERT_EQUAL_UINT16(1, content.curve.count);
    assert_point(0, BENCH_NOW_ms, 0);
}

static void test_a_curve_without_points_is_a_curve_too_even_without_a_clock(void) {
    content.curve.count = 7;
    scene.clock_is_set = false;
    TEST_ASSERT_EQUAL(TAPER_RESULT_CURVE, take_points(0, times, limits));
    TEST_ASSERT_EQUAL_UINT16(0, content.curve.count);
}

static void test_the_longest_curve_is_taken_and_the_limits_accept_it(void) {
    uint32_t many[TAPER_MAX_LIMIT_POINTS];
    uint16_t watts[TAPER_MAX_LIMIT_POINTS];
    for (uint16_t k = 0; k < TAPER_MAX_LIMIT_POINTS; k++) {
        many[k] = BENCH_UNIX_s + 100 + k * 5000u;
        watts[k] = k;
    }
    many[TAPER_MAX_LIMIT_POINTS - 1] = BENCH_UNIX_s + TAPER_CURVE_SPAN_ms / 1000;
    TEST_ASSERT_EQUAL(TAPER_RESULT_CURVE, take_points(TAPER_MAX_LIMIT_POINTS, many, watts));
    TEST_ASSERT_EQUAL_UINT16(TAPER_MAX_LIMIT_POINTS, content.curve.count);
    TEST_ASSERT_EQUAL_INT32(38300, content.curve.point[TAPER_MAX_LIMIT_POINTS - 1].limit_W);
    static taper_limits_t site;
    taper_limits_init(&site, transfers.config);
    TEST_ASSERT_EQUAL(TAPER_OK, taper_limits_set_curve(&site, TAPER_CURVE_OF_GATEWAY, &content.curve));
}

static void test_a_curve_with_a_point_too_many_is_told_that_there_is_no_room(void) {
    static uint8_t items[(TAPER_MAX_LIMIT_POINTS + 1) * 6];
    const uint16_t length =
        bench_seal(message, TAPER_TRANSFER_LIMIT_CURVE, TAPER_MAX_LIMIT_POINTS + 1, items, sizeof items);
    TEST_ASSERT_EQUAL(TAPER_RESULT_REFUSED, bench_transfer(&gateway, message, length));
    TEST_ASSERT_EQUAL(TAPER_ISOTP_OVERFLOW, taper_isotp_sending(&gateway.link));
    TEST_ASSERT_EQUAL_UINT32(1, transfers.refused);
    bench_not_answered(&gateway);
}

static void test_a_point_beyond_24_days_is_refused(void) {
    const uint32_t far[] = {BENCH_UNIX_s + 5, BENCH_UNIX_s + TAPER_CURVE_SPAN_ms / 1000 + 1};
    assert_refused_with(TAPER_ANSWER_CONTENT, bench_curve(message, 2, far, limits));
}

static void test_times_that_do_not_ascend_are_refused_past_or_not(void) {
    const uint32_t equal[] = {BENCH_UNIX_s + 5, BENCH_UNIX_s + 5};
    const uint32_t back[] = {BENCH_UNIX_s + 6, BENCH_UNIX_s + 5};
    const uint32_t past[] = {BENCH_UNIX_s - 5, BENCH_UNIX_s - 6};
    assert_refused_with(TAPER_ANSWER_CONTENT, bench_curve(message, 2, equal, limits));
    assert_refused_with(TAPER_ANSWER_CONTENT, bench_curve(message, 2, back, limits));
    assert_refused_with(TAPER_ANSWER_CONTENT, bench_curve(message, 2, past, limits));
}

static void test_without_a_clock_there_is_no_curve(void) {
    scene.clock_is_set = false;
    assert_refused_with(TAPER_ANSWER_CLOCK, bench_curve(message, 3, times, limits));
}

static void test_a_count_that_is_not_the_length_is_refused(void) {
    uint8_t items[12] = {0};
    assert_refused_with(TAPER_ANSWER_CRC, bench_seal(message, TAPER_TRANSFER_LIMIT_CURVE, 1, items, 12));
    assert_refused_with(TAPER_ANSWER_CRC, bench_seal(message, TAPER_TRANSFER_LIMIT_CURVE, 2, items, 11));
    assert_refused_with(TAPER_ANSWER_CRC, 7); /* shorter than its envelope: one frame */
}

static void test_another_version_and_types_that_are_not_the_gateways_are_refused(void) {
    const uint8_t other[] = {
        0,  TAPER_TRANSFER_IDENTIFIER, TAPER_TRANSFER_LOG_REQUEST, TAPER_TRANSFER_LOG, TAPER_TRANSFER_ANSWER,
        255};
    for (unsigned k = 0; k < sizeof other; k++) {
        assert_refused_with(TAPER_ANSWER_VERSION, bench_seal(message, other[k], 0, "", 0));
    }
    const uint16_t length = bench_curve(message, 3, times, limits);
    message[0] = 2;
    const uint32_t crc = taper_crc32(message, length - 4u);
    for (unsigned i = 0; i < 4; i++) {
        message[length - 4u + i] = (uint8_t)(crc >> 8 * i);
    }
    assert_refused_with(TAPER_ANSWER_VERSION, length);
}

static void test_any_byte_that_is_flipped_makes_the_whole_curve_refused(void) {
    const uint16_t length = bench_curve(message, 3, times, limits);
    for (uint16_t i = 0; i < length; i++) {
        for (unsigned bit = 0; bit < 8; bit++) {
            message[i] ^= (uint8_t)(1u << bit);
            assert_refused_with(TAPER_ANSWER_CRC, length);
            message[i] ^= (uint8_t)(1u << bit);
        }
    }
    TEST_ASSERT_EQUAL(TAPER_RESULT_CURVE, bench_transfer(&gateway, message, length));
}

static void test_a_transfer_torn_at_any_frame_leaves_nothing(void) {
    taper_transfer_result_t result = TAPER_RESULT_NONE;
    uint8_t whole[sizeof message];
    uint32_t torn = 0;
    const uint16_t length = bench_curve(whole, 3, times, limits);
    for (uint16_t frames = 1; frames < 1u + (length - 6u + 6u) / 7u; frames++) {
        bench_send(&gateway, whole, length);
        uint16_t sent = 0;
        while (sent < frames) {
            sent = (uint16_t)(sent + bench_from_peer(&gateway, &result));
            (void)bench_to_peer(&gateway);
            scene.now_ms++;
        }
        taper_isotp_cancel(&gateway.link);
        torn++;
        TEST_ASSERT_EQUAL(TAPER_RESULT_NONE, bench_settle(&gateway)); /* it runs into the timeout */
        TEST_ASSERT_EQUAL_UINT32(torn, transfers.refused);
        TEST_ASSERT_EQUAL_UINT16(0, content.curve.count);
        bench_not_answered(&gateway);
    }
    TEST_ASSERT_EQUAL_UINT32(3, torn); /* first, and two of three consecutive frames */
    TEST_ASSERT_EQUAL(TAPER_RESULT_CURVE, bench_transfer(&gateway, whole, length));
}

static void test_a_lost_frame_is_told_as_refused(void) {
    taper_frame_t frame;
    taper_transfer_result_t result = TAPER_RESULT_NONE;
    bench_send(&gateway, message, bench_curve(message, 3, times, limits));
    TEST_ASSERT_TRUE(bench_from_peer(&gateway, &result));
    TEST_ASSERT_TRUE(bench_to_peer(&gateway));
    TEST_ASSERT_TRUE(taper_isotp_next(&gateway.link, scene.now_ms, &frame));
    taper_isotp_sent(&gateway.link, scene.now_ms);
    scene.now_ms += 10;
    TEST_ASSERT_TRUE(bench_from_peer(&gateway, &result));
    TEST_ASSERT_EQUAL(TAPER_RESULT_REFUSED, result);
    TEST_ASSERT_EQUAL_UINT32(1, transfers.refused);
}

static void test_the_station_has_the_last_word(void) {
    taper_transfer_result_t result = TAPER_RESULT_NONE;
    bench_send(&gateway, message, bench_curve(message, 1, times, limits));
    while (result == TAPER_RESULT_NONE) {
        (void)bench_from_peer(&gateway, &result);
        (void)bench_to_peer(&gateway);
        scene.now_ms++;
    }
    TEST_ASSERT_EQUAL(TAPER_RESULT_CURVE, result);
    TEST_ASSERT_FALSE(bench_to_peer(&gateway));
    taper_transfers_answer(&transfers, TAPER_ANSWER_CONTENT, scene.now_ms);
    (void)bench_settle(&gateway);
    bench_answered(&gateway, TAPER_ANSWER_CONTENT);
    TEST_ASSERT_EQUAL_UINT32(0, transfers.accepted);
    TEST_ASSERT_EQUAL_UINT32(1, transfers.refused);
}

static void test_a_new_curve_ends_an_answer_that_nobody_takes(void) {
    const uint16_t length = bench_curve(message, 3, times, limits);
    TEST_ASSERT_EQUAL(TAPER_RESULT_CURVE, take_at_once(length));
    taper_transfers_answer(&transfers, TAPER_ANSWER_ACCEPTED, scene.now_ms);
    taper_frame_t frame;
    TEST_ASSERT_TRUE(taper_transfers_next(&transfers, scene.now_ms, &frame)); /* and it is lost */
    taper_transfers_sent(&transfers, &frame, scene.now_ms);
    message[8] ^= 1u;
    assert_refused_with(TAPER_ANSWER_CRC, length);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_a_curve_arrives_in_the_stations_time_and_is_answered);
    RUN_TEST(test_times_become_the_stations_clock);
    RUN_TEST(test_a_world_that_runs_faster_has_its_own_clock);
    RUN_TEST(test_times_go_across_the_wrap_of_the_clock);
    RUN_TEST(test_points_past_become_one_of_now);
    RUN_TEST(test_a_point_of_now_supersedes_those_before_it);
    RUN_TEST(test_a_curve_without_points_is_a_curve_too_even_without_a_clock);
    RUN_TEST(test_the_longest_curve_is_taken_and_the_limits_accept_it);
    RUN_TEST(test_a_curve_with_a_point_too_many_is_told_that_there_is_no_room);
    RUN_TEST(test_a_point_beyond_24_days_is_refused);
    RUN_TEST(test_times_that_do_not_ascend_are_refused_past_or_not);
    RUN_TEST(test_without_a_clock_there_is_no_curve);
    RUN_TEST(test_a_count_that_is_not_the_length_is_refused);
    RUN_TEST(test_another_version_and_types_that_are_not_the_gateways_are_refused);
    RUN_TEST(test_any_byte_that_is_flipped_makes_the_whole_curve_refused);
    RUN_TEST(test_a_transfer_torn_at_any_frame_leaves_nothing);
    RUN_TEST(test_a_lost_frame_is_told_as_refused);
    RUN_TEST(test_the_station_has_the_last_word);
    RUN_TEST(test_a_new_curve_ends_an_answer_that_nobody_takes);
    return UNITY_END();
}
