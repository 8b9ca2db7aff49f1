/* The known course of the limit on its way from the gateway to the station. */
#include <string.h>

#include "curve.h"
#include "live_bench.h"
#include "taper/membus_faults.h"
#include "unity.h"

#define MANY   1000u
#define FALL_S 1500.0
#define RISE_S 4500.0

static double time_s[MANY];
static double limit_kw[MANY];
static sim_course_t limits;
static taper_membus_injector_t injector;

void setUp(void) {
    limits = (sim_course_t){.time_s = time_s, .value = limit_kw, .count = 0};
}

void tearDown(void) {
    live_bench_end();
}

static void add(double after_s, double kw) {
    time_s[limits.count] = LIVE_START_S + after_s;
    limit_kw[limits.count] = kw;
    limits.count++;
}

static void start_under_limits(uint32_t time_scale) {
    const sim_session_t session = live_vehicle(0.0);
    live_options_t options = live_options(-1.0);
    options.limits = &limits;
    options.time_scale = time_scale;
    live_bench_start(&options, &session, 1);
}

/** A station under a limit of 60 kW that will be 9 kW for a while. */
static void start(uint32_t time_scale) {
    add(-1000.0, 60.0);
    add(FALL_S, 9.0);
    add(RISE_S, 60.0);
    start_under_limits(time_scale);
}

/** The same, and what comes later makes the transfer one of 38 frames. */
static void start_with_a_longer_course(void) {
    add(-1000.0, 60.0);
    add(FALL_S, 9.0);
    for (unsigned k = 0; k < 40; k++) {
        add(RISE_S + 600.0 * k, 60.0 - k);
    }
    start_under_limits(1);
}

/** What the planner would be given for the step that holds `after_s`, without what the site itself takes [W]. */
static int32_t course_W(double after_s) {
    taper_course_t course;
    taper_limits_course(&live.station.limits, live.now_ms, &course);
    const double ahead_s = after_s - (sim_field_world_s(&live.field) - LIVE_START_S);
    const unsigned step = (unsigned)(ahead_s / live.config.step_s);
    TEST_ASSERT_LESS_THAN_UINT32(live.config.steps, step);
    return course.limit_W[step] + taper_limits_other_W(&live.station.limits, live.now_ms);
}

static unsigned curves_noted(void) {
    const taper_event_log_t *log = taper_station_events(&live.station);
    unsigned count = 0;
    for (uint32_t k = 0; k < log->count && k < TAPER_EVENTS; k++) {
        count += log->event[k].code == TAPER_EVENT_CURVE_SET ? 1 : 0;
    }
    return count;
}

static void assert_the_fall_is_known(void) {
    TEST_ASSERT_EQUAL_INT32(60000, course_W(0.0));
    TEST_ASSERT_EQUAL_INT32(9000, course_W((FALL_S + RISE_S) / 2.0));
}

static void assert_nothing_is_known(void) {
    TEST_ASSERT_EQUAL_UINT16(0, live.station.limits.curve[TAPER_CURVE_OF_GATEWAY].count);
}

static void lose(uint16_t id, uint16_t drop_permille) {
    const taper_membus_faults_t faults = {
        .seed = 1, .id = id, .mask = TAPER_MEMBUS_MASK_ID, .drop_permille = drop_permille};
    taper_membus_inject(&live.bus, &live.bus.to_station, &injector, &faults);
}

static void lose_nothing(void) {
    taper_membus_inject(&live.bus, &live.bus.to_station, &injector, NULL);
}

static void test_a_fall_of_the_limit_is_known_before_it_comes(void) {
    start(1);
    live_bench_run_ms(2000);
    assert_the_fall_is_known();
    TEST_ASSERT_EQUAL_UINT32(1, live.field.curve.accepted);
    TEST_ASSERT_EQUAL_UINT32(1, live.field.curve.tries);
    TEST_ASSERT_EQUAL_UINT32(1, curves_noted());
}

static void test_it_is_not_sent_again_for_nothing(void) {
    start(1);
    live_bench_run_ms(600000);
    TEST_ASSERT_EQUAL_UINT32(1, live.field.curve.tries);
}

static void test_it_is_sent_again_each_day_of_the_world(void) {
    start(600);
    live_bench_run_ms(2u * 144000u + 5000u);
    TEST_ASSERT_EQUAL_UINT32(3, live.field.curve.accepted);
}

static void test_a_constant_limit_is_not_sent(void) {
    const live_options_t options = live_options(30.0);
    const sim_session_t session = live_vehicle(0.0);
    live_bench_start(&options, &session, 1);
    live_bench_run_ms(10000);
    TEST_ASSERT_EQUAL_UINT32(0, live.field.curve.tries);
}

static void test_a_station_that_was_away_is_told_again(void) {
    start(1);
    live_bench_run_ms(5000);
    live_bench_kill_station();
    live_bench_run_ms(10000);
    live_bench_revive_station();
    assert_nothing_is_known();
    live_bench_run_ms(5000);
    assert_the_fall_is_known();
    TEST_ASSERT_EQUAL_UINT32(1, curves_noted());
}

static void test_a_station_that_restarts_at_once_is_told_again(void) {
    start(1);
    live_bench_run_ms(5000);
    live_bench_revive_station();
    assert_nothing_is_known();
    live_bench_run_ms(5000);
    assert_the_fall_is_known();
}

static void test_a_station_that_restarts_in_the_middle_of_it_is_told_again(void) {
    start_with_a_longer_course();
    live_bench_run_ms(500);
    TEST_ASSERT_EQUAL(SIM_CURVE_SENDING, live.field.curve.state);
    live_bench_revive_station();
    live_bench_run_ms(15000);
    TEST_ASSERT_EQUAL_UINT32(1, curves_noted());
}

static void test_a_gateway_that_forgot_tells_it_again(void) {
    start(1);
    live_bench_run_ms(5000);
    sim_field_power_off(&live.field, SIM_GATEWAY);
    live_bench_run_ms(1000);
    sim_field_revive(&live.field, SIM_GATEWAY);
    live_bench_run_ms(5000);
    TEST_ASSERT_EQUAL_UINT32(2, curves_noted());
}

static void test_a_dead_gateway_tells_nothing(void) {
    start(1);
    sim_field_kill(&live.field, SIM_GATEWAY);
    live_bench_run_ms(5000);
    assert_nothing_is_known();
    sim_field_revive(&live.field, SIM_GATEWAY);
    live_bench_run_ms(5000);
    assert_the_fall_is_known();
}

static void test_a_lost_frame_delays_it_and_breaks_nothing(void) {
    start(1);
    lose(0x67E, 1000);
    live_bench_run_ms(6000);
    assert_nothing_is_known();
    lose_nothing();
    live_bench_run_ms(5000);
    assert_the_fall_is_known();
    TEST_ASSERT_GREATER_THAN_UINT32(1, live.field.curve.tries);
}

static void test_on_a_bad_bus_it_comes_through_in_the_end(void) {
    start_with_a_longer_course();
    lose(0x67E, 50);
    live_bench_run_ms(120000);
    assert_the_fall_is_known();
    TEST_ASSERT_EQUAL_UINT32(1, live.field.curve.accepted);
    TEST_ASSERT_GREATER_THAN_UINT32(1, live.field.curve.tries);
}

static void test_a_lost_answer_is_asked_for_again(void) {
    const taper_membus_faults_t faults = {
        .seed = 1, .id = 0x63E, .mask = TAPER_MEMBUS_MASK_ID, .drop_permille = 1000};
    start(1);
    while (live.field.curve.state != SIM_CURVE_WAITING && live.now_ms < 10000) {
        live_bench_run_ms(LIVE_POLL_ms);
    }
    taper_membus_inject(&live.bus, &live.bus.to_world, &injector, &faults);
    live_bench_run_ms(1000);
    TEST_ASSERT_EQUAL_UINT32(1, curves_noted());
    TEST_ASSERT_EQUAL_UINT32(0, live.field.curve.accepted);
    taper_membus_inject(&live.bus, &live.bus.to_world, &injector, NULL);
    live_bench_run_ms(5000);
    TEST_ASSERT_EQUAL_UINT32(2, curves_noted());
    TEST_ASSERT_EQUAL_UINT32(1, live.field.curve.accepted);
}

static void test_a_station_without_a_clock_is_told_when_it_has_one(void) {
    start(1);
    lose(TAPER_MESSAGE_TIME_SYNC << 6 | TAPER_NODE_GATEWAY, 1000);
    live_bench_run_ms(10000);
    assert_nothing_is_known();
    TEST_ASSERT_GREATER_THAN_UINT32(0, taper_station_counter(&live.station, TAPER_COUNTER_TRANSFERS_REFUSED));
    lose_nothing();
    live_bench_run_ms(5000);
    assert_the_fall_is_known();
}

static void test_a_course_too_long_for_one_transfer_comes_in_parts(void) {
    for (unsigned k = 0; k < MANY; k++) {
        add(120.0 * k, 20.0 + (k % 2 == 0 ? 0.0 : 10.0));
    }
    start_under_limits(60);
    live_bench_run_ms(12000);
    TEST_ASSERT_EQUAL_UINT32(1, curves_noted());
    TEST_ASSERT_GREATER_THAN_UINT16(TAPER_MAX_LIMIT_POINTS - 10, live.station.limits.curve[TAPER_CURVE_OF_GATEWAY].count);
    live_bench_run_ms(120000);
    TEST_ASSERT_GREATER_THAN_UINT32(4, curves_noted());
    TEST_ASSERT_GREATER_THAN_UINT16(TAPER_MAX_LIMIT_POINTS - 20, live.station.limits.curve[TAPER_CURVE_OF_GATEWAY].count);
}

/** Begin to send to nobody, so that the message can be looked at. */
static const uint8_t *message_at(sim_curve_t *curve, double after_s) {
    taper_frame_t frame;
    sim_curve_init(curve, &limits);
    TEST_ASSERT_TRUE(sim_curve_next(curve, LIVE_START_S + after_s, 0, &frame));
    TEST_ASSERT_EQUAL_HEX16(0x67E, frame.id);
    return curve->message;
}

static void assert_point(const uint8_t *message, unsigned k, double after_s, uint16_t limit) {
    const uint8_t *item = message + 4 + 6 * (size_t)k;
    const uint32_t unix_s =
        item[0] | (uint32_t)item[1] << 8 | (uint32_t)item[2] << 16 | (uint32_t)item[3] << 24;
    TEST_ASSERT_EQUAL_UINT32((uint32_t)(LIVE_START_S + after_s), unix_s);
    TEST_ASSERT_EQUAL_UINT16(limit, item[4] | item[5] << 8);
}

static void test_limits_are_rounded_down_and_what_the_wire_cannot_say_is_its_most(void) {
    static sim_curve_t curve;
    add(-10.0, 25.37);
    add(100.0, 0.3);
    add(200.0, 1e6);
    const uint8_t *message = message_at(&curve, 0.0);
    TEST_ASSERT_EQUAL_UINT8(3, message[2]);
    assert_point(message, 0, 0.0, 253);
    assert_point(message, 1, 100.0, 3);
    assert_point(message, 2, 200.0, 65535);
}

static void test_a_change_within_a_second_counts_to_the_side_of_the_lower_limit(void) {
    static sim_curve_t curve;
    add(-10.0, 20.0);
    add(100.5, 10.0);
    add(200.5, 20.0);
    add(300.2, 5.0);
    add(300.4, 20.0);
    const uint8_t *message = message_at(&curve, 0.7);
    TEST_ASSERT_EQUAL_UINT8(5, message[2]);
    assert_point(message, 0, 0.0, 200);
    assert_point(message, 1, 100.0, 100);
    assert_point(message, 2, 201.0, 200);
    assert_point(message, 3, 300.0, 50);
    assert_point(message, 4, 301.0, 200);
}

static void test_what_is_past_or_far_ahead_stays_out(void) {
    static sim_curve_t curve;
    add(-100.0, 20.0);
    add(50.0, 10.0);
    add(100.0, 30.0);
    add(20.0 * 86400.0, 40.0);
    const uint8_t *message = message_at(&curve, 60.0);
    TEST_ASSERT_EQUAL_UINT8(2, message[2]);
    assert_point(message, 0, 60.0, 100);
    assert_point(message, 1, 100.0, 300);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_a_fall_of_the_limit_is_known_before_it_comes);
    RUN_TEST(test_it_is_not_sent_again_for_nothing);
    RUN_TEST(test_it_is_sent_again_each_day_of_the_world);
    RUN_TEST(test_a_constant_limit_is_not_sent);
    RUN_TEST(test_a_station_that_was_away_is_told_again);
    RUN_TEST(test_a_station_that_restarts_at_once_is_told_again);
    RUN_TEST(test_a_station_that_restarts_in_the_middle_of_it_is_told_again);
    RUN_TEST(test_a_gateway_that_forgot_tells_it_again);
    RUN_TEST(test_a_dead_gateway_tells_nothing);
    RUN_TEST(test_a_lost_frame_delays_it_and_breaks_nothing);
    RUN_TEST(test_on_a_bad_bus_it_comes_through_in_the_end);
    RUN_TEST(test_a_lost_answer_is_asked_for_again);
    RUN_TEST(test_a_station_without_a_clock_is_told_when_it_has_one);
    RUN_TEST(test_a_course_too_long_for_one_transfer_comes_in_parts);
    RUN_TEST(test_limits_are_rounded_down_and_what_the_wire_cannot_say_is_its_most);
    RUN_TEST(test_a_change_within_a_second_counts_to_the_side_of_the_lower_limit);
    RUN_TEST(test_what_is_past_or_far_ahead_stays_out);
    return UNITY_END();
}
