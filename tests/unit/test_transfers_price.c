/* The price curve from the gateway: the envelope, the checks and the answers of a limit curve. */
#include <string.h>

#include "taper/limits.h"
#include "transfers_bench.h"
#include "unity.h"

#define HOUR 3600u

static uint8_t message[TAPER_ISOTP_LONGEST];
static const uint32_t times[] = {BENCH_UNIX_s + HOUR, BENCH_UNIX_s + 2 * HOUR, BENCH_UNIX_s + 3 * HOUR};
static const uint16_t prices[] = {312, 0xFFFE, 0x8001};

void setUp(void) {
    bench_start();
    scene.time_scale = 0; /* the station's clock stands still at 0, however long a transfer takes */
}
void tearDown(void) {}

/** A limit curve that calls itself one of prices. */
static uint16_t price_curve(uint16_t count, const uint32_t *unix_s, const uint16_t *milli) {
    const uint16_t length = bench_curve(message, count, unix_s, milli);
    return bench_seal(message, TAPER_TRANSFER_PRICE_CURVE, count, message + 4, (uint16_t)(length - 8u));
}

static taper_transfer_result_t take(uint16_t count, const uint32_t *unix_s, const uint16_t *milli) {
    return bench_transfer(&gateway, message, price_curve(count, unix_s, milli));
}

static void assert_point(uint16_t k, int64_t time_s, int32_t milli_per_kWh) {
    TEST_ASSERT_EQUAL_UINT32((uint32_t)(time_s * 1000), content.price.point[k].time_ms);
    TEST_ASSERT_EQUAL_INT32(milli_per_kWh, content.price.point[k].milli_per_kWh);
}

static void assert_refused_with(taper_transfer_answer_t answer, uint16_t length) {
    const taper_transfer_content_t before = content;
    const uint32_t refused = transfers.refused;
    TEST_ASSERT_EQUAL(TAPER_RESULT_REFUSED, bench_transfer(&gateway, message, length));
    bench_answered(&gateway, answer);
    TEST_ASSERT_EQUAL_UINT32(refused + 1, transfers.refused);
    TEST_ASSERT_EQUAL_MEMORY(&before, &content, sizeof content);
}

static void test_prices_arrive_in_the_stations_time_with_their_sign_and_are_answered(void) {
    /* By hand: version 1, type 2, one point, 1700003600 s, -2, CRC-32. */
    const uint8_t by_hand[] = {1, 2, 1, 0, 0x10, 0xFF, 0x53, 0x65, 0xFE, 0xFF};
    TEST_ASSERT_EQUAL_UINT16(14, price_curve(1, times, prices + 1));
    TEST_ASSERT_EQUAL_HEX8_ARRAY(by_hand, message, sizeof by_hand);
    TEST_ASSERT_EQUAL(TAPER_RESULT_PRICE, take(3, times, prices));
    TEST_ASSERT_EQUAL_UINT16(3, content.price.count);
    assert_point(0, HOUR, 312);
    assert_point(1, 2 * HOUR, -2);
    assert_point(2, 3 * HOUR, -32767);
    bench_answered(&gateway, TAPER_ANSWER_ACCEPTED);
    TEST_ASSERT_EQUAL_UINT32(1, transfers.accepted);
    TEST_ASSERT_EQUAL_UINT32(0, transfers.refused);
}

static void test_points_past_become_one_of_now(void) {
    const uint32_t past[] = {0, BENCH_UNIX_s - HOUR, BENCH_UNIX_s, BENCH_UNIX_s + 1};
    const uint16_t milli[] = {1, 2, 3, 4};
    TEST_ASSERT_EQUAL(TAPER_RESULT_PRICE, take(4, past, milli));
    TEST_ASSERT_EQUAL_UINT16(2, content.price.count);
    assert_point(0, 0, 3);
    assert_point(1, 1, 4);
}

static void test_a_last_price_that_is_past_keeps_its_time(void) {
    const uint32_t past[] = {BENCH_UNIX_s - 2 * HOUR, BENCH_UNIX_s - 1200};
    TEST_ASSERT_EQUAL(TAPER_RESULT_PRICE, take(2, past, prices));
    TEST_ASSERT_EQUAL_UINT16(1, content.price.count);
    assert_point(0, -1200, -2);
}

static void test_prices_that_ended_long_ago_say_nothing(void) {
    static taper_limits_t site;
    taper_course_t course;
    const uint32_t past[] = {5, BENCH_UNIX_s - 60 * 24 * HOUR}; /* the clock of ms went round since */
    TEST_ASSERT_EQUAL(TAPER_RESULT_PRICE, take(2, past, prices));
    taper_limits_init(&site, transfers.config);
    TEST_ASSERT_EQUAL(TAPER_OK, taper_limits_set_price(&site, &content.price));
    taper_limits_course(&site, 0, &course);
    TEST_ASSERT_FALSE(course.priced);
    taper_limits_update(&site, 0);
    TEST_ASSERT_EQUAL_UINT16(0, site.price.count);
}

static void test_a_curve_without_points_is_one_too_even_without_a_clock(void) {
    content.price.count = 7;
    scene.clock_is_set = false;
    TEST_ASSERT_EQUAL(TAPER_RESULT_PRICE, take(0, times, prices));
    TEST_ASSERT_EQUAL_UINT16(0, content.price.count);
}

static void test_the_longest_curve_is_taken_and_one_longer_refused(void) {
    uint32_t many[TAPER_MAX_PRICE_POINTS + 1];
    uint16_t milli[TAPER_MAX_PRICE_POINTS + 1];
    for (uint16_t k = 0; k <= TAPER_MAX_PRICE_POINTS; k++) {
        many[k] = BENCH_UNIX_s + k * 900u + 1;
        milli[k] = k;
    }
    TEST_ASSERT_EQUAL(TAPER_RESULT_PRICE, take(TAPER_MAX_PRICE_POINTS, many, milli));
    TEST_ASSERT_EQUAL_UINT16(TAPER_MAX_PRICE_POINTS, content.price.count);
    assert_point(199, 199 * 900 + 1, 199);
    assert_refused_with(TAPER_ANSWER_CONTENT, price_curve(TAPER_MAX_PRICE_POINTS + 1, many, milli));
}

static void test_what_would_be_wrong_with_limits_is_wrong_with_prices(void) {
    const uint32_t back[] = {BENCH_UNIX_s + 6, BENCH_UNIX_s + 5};
    const uint32_t far[] = {BENCH_UNIX_s, BENCH_UNIX_s + TAPER_CURVE_SPAN_ms / 1000 + 1};
    uint8_t items[12] = {0};
    assert_refused_with(TAPER_ANSWER_CONTENT, price_curve(2, back, prices));
    assert_refused_with(TAPER_ANSWER_CONTENT, price_curve(2, far, prices));
    assert_refused_with(TAPER_ANSWER_CRC, bench_seal(message, TAPER_TRANSFER_PRICE_CURVE, 1, items, 12));
    scene.clock_is_set = false;
    assert_refused_with(TAPER_ANSWER_CLOCK, price_curve(3, times, prices));
}

static void test_a_price_that_is_absent_is_refused(void) {
    const uint16_t absent[] = {1, 2, 0x8000};
    assert_refused_with(TAPER_ANSWER_CONTENT, price_curve(3, times, absent));
}

static void test_a_torn_or_damaged_one_changes_nothing(void) {
    taper_transfer_result_t result = TAPER_RESULT_NONE;
    TEST_ASSERT_EQUAL(TAPER_RESULT_PRICE, take(1, times, prices));
    const taper_transfer_content_t before = content;
    const uint16_t length = price_curve(3, times, prices);
    for (uint16_t i = 0; i < length; i++) {
        message[i] ^= 0x10u;
        assert_refused_with(TAPER_ANSWER_CRC, length);
        message[i] ^= 0x10u;
    }
    bench_send(&gateway, message, length);
    TEST_ASSERT_TRUE(bench_from_peer(&gateway, &result));
    taper_isotp_cancel(&gateway.link);
    TEST_ASSERT_EQUAL(TAPER_RESULT_NONE, bench_settle(&gateway)); /* it runs into the timeout */
    bench_not_answered(&gateway);
    TEST_ASSERT_EQUAL_MEMORY(&before, &content, sizeof content);
}

static void test_nobody_but_the_gateway_may_send_prices(void) {
    static bench_peer_t one;
    bench_open_peer(&one, 0, 1);
    const uint16_t length = bench_seal(message, TAPER_TRANSFER_PRICE_CURVE, 0, "", 0);
    TEST_ASSERT_EQUAL(TAPER_RESULT_REFUSED, bench_transfer(&one, message, length));
    bench_answered(&one, TAPER_ANSWER_VERSION);
    TEST_ASSERT_EQUAL(TAPER_RESULT_REFUSED, bench_transfer(&tool, message, length));
    bench_answered(&tool, TAPER_ANSWER_VERSION);
}

static void test_the_station_has_the_last_word(void) {
    taper_transfer_result_t result = TAPER_RESULT_NONE;
    bench_send(&gateway, message, price_curve(1, times, prices));
    while (result == TAPER_RESULT_NONE) {
        (void)bench_from_peer(&gateway, &result);
        (void)bench_to_peer(&gateway);
        scene.now_ms++;
    }
    TEST_ASSERT_EQUAL(TAPER_RESULT_PRICE, result);
    taper_transfers_answer(&transfers, TAPER_ANSWER_CONTENT, scene.now_ms);
    (void)bench_settle(&gateway);
    bench_answered(&gateway, TAPER_ANSWER_CONTENT);
    TEST_ASSERT_EQUAL_UINT32(1, transfers.refused);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_prices_arrive_in_the_stations_time_with_their_sign_and_are_answered);
    RUN_TEST(test_points_past_become_one_of_now);
    RUN_TEST(test_a_last_price_that_is_past_keeps_its_time);
    RUN_TEST(test_prices_that_ended_long_ago_say_nothing);
    RUN_TEST(test_a_curve_without_points_is_one_too_even_without_a_clock);
    RUN_TEST(test_the_longest_curve_is_taken_and_one_longer_refused);
    RUN_TEST(test_what_would_be_wrong_with_limits_is_wrong_with_prices);
    RUN_TEST(test_a_price_that_is_absent_is_refused);
    RUN_TEST(test_a_torn_or_damaged_one_changes_nothing);
    RUN_TEST(test_nobody_but_the_gateway_may_send_prices);
    RUN_TEST(test_the_station_has_the_last_word);
    return UNITY_END();
}
