/* Curves that come to a whole station over ISO-TP, torn ones too (fault 40), and the curve of the site's own file. */
#include <limits.h>

#include "station_bench.h"
#include "unity.h"

#define NOW_s 600001u /* the bench's clock at the first tick */

static taper_isotp_t gateway;
static uint8_t gateway_buffer[16];

void setUp(void) {
    const taper_station_options_t options = bench_options();
    const taper_isotp_options_t link = {.send_id = 0x67E,
                                        .receive_id = 0x63E,
                                        .timeout_ms = 1000,
                                        .buffer = gateway_buffer,
                                        .capacity = sizeof gateway_buffer};
    bench_start(&options);
    bench.deaf = true; /* the gateway reads the bus itself */
    TEST_ASSERT_EQUAL(TAPER_OK, taper_isotp_init(&gateway, &link));
    bench_send_all(1, 50000);
    bench_step();
}
void tearDown(void) {}

/** An envelope around points of 6 bytes: Unix time, value. @return its length. */
static uint16_t write_curve(uint8_t *message, uint8_t type, uint16_t count, const uint32_t (*point)[2]) {
    uint16_t at = 4;
    message[0] = 1;
    message[1] = type;
    message[2] = (uint8_t)count;
    message[3] = 0;
    for (uint16_t k = 0; k < count; k++) {
        for (unsigned i = 0; i < 6; i++) {
            message[at++] = (uint8_t)(i < 4 ? point[k][0] >> 8 * i : point[k][1] >> 8 * (i - 4));
        }
    }
    const uint32_t crc = taper_crc32(message, at);
    for (unsigned i = 0; i < 4; i++) {
        message[at++] = (uint8_t)(crc >> 8 * i);
    }
    return at;
}

static void hear_station(void) {
    taper_frame_t frame;
    while (taper_membus_world_receive(&bench.bus, &frame)) {
        (void)taper_isotp_take(&gateway, &frame, bench.now_ms);
    }
}

/** Send at most `most_frames` of a message. @return whether it was answered. */
static bool send_frames(const uint8_t *message, uint16_t length, unsigned most_frames) {
    uint16_t got = 0;
    taper_frame_t frame;
    taper_isotp_release(&gateway, bench.now_ms);
    taper_isotp_cancel(&gateway);
    TEST_ASSERT_EQUAL(TAPER_OK, taper_isotp_send(&gateway, message, length, bench.now_ms));
    for (unsigned k = 0; k < 100 && taper_isotp_received(&gateway, &got) != TAPER_ISOTP_DONE; k++) {
        if (most_frames > 0 && taper_isotp_next(&gateway, bench.now_ms, &frame)) {
            TEST_ASSERT_TRUE(taper_membus_world_send(&bench.bus, &frame));
            taper_isotp_sent(&gateway, bench.now_ms);
            most_frames--;
        }
        bench_poll(2);
        hear_station();
    }
    return taper_isotp_received(&gateway, &got) == TAPER_ISOTP_DONE;
}

/** Send a curve to its end. @return the station's answer. */
static uint8_t send_curve(uint8_t type, uint16_t count, const uint32_t (*point)[2]) {
    uint8_t message[64];
    const uint16_t length = write_curve(message, type, count, point);
    TEST_ASSERT_TRUE(send_frames(message, length, UINT_MAX));
    return gateway_buffer[4];
}

static void tick(void) {
    bench_send_clock();
    bench_send_limit(50000);
    bench_step();
}

static void assert_limit(int32_t limit_W, taper_limit_source_t source) {
    tick();
    TEST_ASSERT_EQUAL_INT32(limit_W, taper_station_site_limit_W(&bench.station));
    TEST_ASSERT_EQUAL(source, bench.station.limit_now.source);
}

static void test_prices_are_answered_noted_and_in_the_course(void) {
    static const uint32_t point[][2] = {{NOW_s, 300}, {NOW_s + 3 * 3600, 0xFFFF}, {NOW_s + 6 * 3600, 0}};
    taper_course_t course;
    TEST_ASSERT_EQUAL_UINT8(TAPER_ANSWER_ACCEPTED, send_curve(TAPER_TRANSFER_PRICE_CURVE, 3, point));
    TEST_ASSERT_EQUAL_UINT(1, bench_events(TAPER_EVENT_PRICE_SET));
    TEST_ASSERT_EQUAL_UINT(0, bench_events(TAPER_EVENT_CURVE_SET));
    taper_limits_course(&bench.station.limits, bench.now_ms, &course);
    TEST_ASSERT_TRUE(course.priced);
    TEST_ASSERT_EQUAL_INT32(300, course.milli_per_kWh[0]);
    TEST_ASSERT_EQUAL_INT32(-1, course.milli_per_kWh[13]);
}

static void test_prices_that_are_refused_change_nothing(void) {
    static const uint32_t good[][2] = {{NOW_s, 300}}, bad[][2] = {{NOW_s + 60, 5}, {NOW_s, 5}};
    TEST_ASSERT_EQUAL_UINT8(TAPER_ANSWER_ACCEPTED, send_curve(TAPER_TRANSFER_PRICE_CURVE, 1, good));
    TEST_ASSERT_EQUAL_UINT8(TAPER_ANSWER_CONTENT, send_curve(TAPER_TRANSFER_PRICE_CURVE, 2, bad));
    TEST_ASSERT_EQUAL_UINT(1, bench_events(TAPER_EVENT_PRICE_SET));
    TEST_ASSERT_EQUAL_UINT16(1, bench.station.limits.price.count);
    TEST_ASSERT_EQUAL_INT32(300, bench.station.limits.price.point[0].milli_per_kWh);
}

static void test_the_gateways_curve_and_the_sites_own_stand_side_by_side(void) {
    static const uint32_t point[][2] = {{NOW_s, 200}};
    taper_limit_curve_t own = {.count = 1, .point = {{bench.now_ms, 10000}}};
    assert_limit(50000, TAPER_LIMIT_GATEWAY);
    TEST_ASSERT_EQUAL_UINT8(TAPER_ANSWER_ACCEPTED, send_curve(TAPER_TRANSFER_LIMIT_CURVE, 1, point));
    assert_limit(20000, TAPER_LIMIT_CURVE);
    TEST_ASSERT_EQUAL(TAPER_OK, taper_station_set_limit_curve(&bench.station, &own));
    assert_limit(10000, TAPER_LIMIT_FILE);
    TEST_ASSERT_EQUAL_UINT8(TAPER_ANSWER_ACCEPTED, send_curve(TAPER_TRANSFER_LIMIT_CURVE, 0, point));
    assert_limit(10000, TAPER_LIMIT_FILE);
    own.count = 0;
    TEST_ASSERT_EQUAL(TAPER_OK, taper_station_set_limit_curve(&bench.station, &own));
    assert_limit(50000, TAPER_LIMIT_GATEWAY);
}

static void test_prices_do_not_touch_limits_nor_limits_prices(void) {
    static const uint32_t limit[][2] = {{NOW_s, 200}}, price[][2] = {{NOW_s, 300}};
    (void)send_curve(TAPER_TRANSFER_LIMIT_CURVE, 1, limit);
    (void)send_curve(TAPER_TRANSFER_PRICE_CURVE, 1, price);
    assert_limit(20000, TAPER_LIMIT_CURVE);
    (void)send_curve(TAPER_TRANSFER_LIMIT_CURVE, 0, limit);
    TEST_ASSERT_EQUAL_UINT16(1, bench.station.limits.price.count);
    assert_limit(50000, TAPER_LIMIT_GATEWAY);
}

/** 20 kW for 20 s, then 40 kW: the curve that stays. */
static void set_the_old_curve(void) {
    static const uint32_t point[][2] = {{NOW_s, 200}, {NOW_s + 20, 400}};
    TEST_ASSERT_EQUAL_UINT8(TAPER_ANSWER_ACCEPTED, send_curve(TAPER_TRANSFER_LIMIT_CURVE, 2, point));
    assert_limit(20000, TAPER_LIMIT_CURVE);
}

/** It is followed as if nothing had come, to its end and beyond. */
static void assert_the_old_curve_goes_on(void) {
    TEST_ASSERT_EQUAL_UINT(1, bench_events(TAPER_EVENT_CURVE_SET));
    TEST_ASSERT_EQUAL_UINT(1, bench_events(TAPER_EVENT_TRANSFER_REFUSED)); /* once a minute */
    while (bench.now_ms < 20500) {
        assert_limit(20000, TAPER_LIMIT_CURVE);
    }
    tick();
    for (unsigned k = 0; k < 30; k++) {
        assert_limit(40000, TAPER_LIMIT_CURVE);
    }
}

/** A curve that would let the site have nothing. @return its length. */
static uint16_t write_new_curve(uint8_t *message) {
    static const uint32_t point[][2] = {{NOW_s, 0}, {NOW_s + 10, 0}, {NOW_s + 30, 0}};
    return write_curve(message, TAPER_TRANSFER_LIMIT_CURVE, 3, point);
}

static void test_row_40_of_a_curve_with_a_wrong_crc_32_nothing_is_used(void) {
    uint8_t message[64];
    set_the_old_curve();
    const uint16_t length = write_new_curve(message);
    for (uint16_t byte = 4; byte < length; byte = (uint16_t)(byte + 3)) { /* of points and of the CRC-32 */
        message[byte] ^= 0x10u;
        TEST_ASSERT_TRUE(send_frames(message, length, UINT_MAX));
        TEST_ASSERT_EQUAL_UINT8(TAPER_ANSWER_CRC, gateway_buffer[4]);
        message[byte] ^= 0x10u;
    }
    TEST_ASSERT_EQUAL_UINT32(8, taper_station_counter(&bench.station, TAPER_COUNTER_TRANSFERS_REFUSED));
    assert_the_old_curve_goes_on();
}

static void test_row_40_of_a_curve_that_is_cut_short_nothing_is_used(void) {
    uint8_t message[64];
    set_the_old_curve();
    const uint16_t length = write_new_curve(message);
    TEST_ASSERT_FALSE(send_frames(message, length, 3)); /* of four */
    for (unsigned k = 0; k < 3; k++) {
        assert_limit(20000, TAPER_LIMIT_CURVE); /* the time-out of ISO-TP is over */
    }
    TEST_ASSERT_EQUAL_UINT32(1, taper_station_counter(&bench.station, TAPER_COUNTER_TRANSFERS_REFUSED));
    assert_the_old_curve_goes_on();
}

static void test_row_40_of_a_curve_without_its_last_point_nothing_is_used(void) {
    uint8_t message[64];
    set_the_old_curve();
    const uint16_t length = write_new_curve(message);
    TEST_ASSERT_TRUE(send_frames(message, (uint16_t)(length - 6), UINT_MAX)); /* whole for ISO-TP */
    TEST_ASSERT_EQUAL_UINT8(TAPER_ANSWER_CRC, gateway_buffer[4]);
    assert_the_old_curve_goes_on();
}

static void test_row_40_a_whole_curve_after_a_torn_one_is_used(void) {
    static const uint32_t point[][2] = {{NOW_s, 100}};
    uint8_t message[64];
    set_the_old_curve();
    TEST_ASSERT_FALSE(send_frames(message, write_new_curve(message), 2));
    TEST_ASSERT_EQUAL_UINT8(TAPER_ANSWER_ACCEPTED, send_curve(TAPER_TRANSFER_LIMIT_CURVE, 1, point));
    assert_limit(10000, TAPER_LIMIT_CURVE);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_prices_are_answered_noted_and_in_the_course);
    RUN_TEST(test_prices_that_are_refused_change_nothing);
    RUN_TEST(test_the_gateways_curve_and_the_sites_own_stand_side_by_side);
    RUN_TEST(test_prices_do_not_touch_limits_nor_limits_prices);
    RUN_TEST(test_row_40_of_a_curve_with_a_wrong_crc_32_nothing_is_used);
    RUN_TEST(test_row_40_of_a_curve_that_is_cut_short_nothing_is_used);
    RUN_TEST(test_row_40_of_a_curve_without_its_last_point_nothing_is_used);
    RUN_TEST(test_row_40_a_whole_curve_after_a_torn_one_is_used);
    return UNITY_END();
}
