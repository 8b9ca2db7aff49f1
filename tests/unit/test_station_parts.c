/* Small parts of the station by themselves: node guard, alarms, event log. */
#include <string.h>

#include "station_bench.h"
#include "station_internal.h"
#include "taper/codec.h"
#include "unity.h"

#define PER_SECOND 30u

static taper_node_guard_t guard;
static uint32_t now_ms;

void setUp(void) {
    const taper_station_options_t options = bench_options();
    bench_start(&options);
    memset(&guard, 0, sizeof guard);
    now_ms = UINT32_MAX - 700u; /* it wraps */
}
void tearDown(void) {}

/** Frames at the same millisecond. @return how many pass. */
static unsigned offer(unsigned frames) {
    const taper_frame_t frame = {
        .id = taper_can_id(TAPER_MESSAGE_EVSE_STATUS, 3), .length = 8, .time_ms = now_ms};
    unsigned passed = 0;
    bench.station.events.now_ms = now_ms;
    for (unsigned k = 0; k < frames; k++) {
        passed += taper_node_guard_passes(&bench.station, &guard, PER_SECOND, &frame) ? 1u : 0u;
    }
    return passed;
}

static void test_a_node_may_send_a_seconds_worth_at_once_and_no_frame_more(void) {
    TEST_ASSERT_EQUAL_UINT(PER_SECOND, offer(PER_SECOND + 1));
    TEST_ASSERT_EQUAL_UINT32(1, taper_station_counter(&bench.station, TAPER_COUNTER_FRAMES_BABBLED));
    now_ms += 33; /* 0.99 of a frame */
    TEST_ASSERT_EQUAL_UINT(0, offer(1));
    now_ms += 1;
    TEST_ASSERT_EQUAL_UINT(1, offer(2));
}

static void test_the_bucket_holds_no_more_than_a_second(void) {
    TEST_ASSERT_EQUAL_UINT(PER_SECOND, offer(PER_SECOND));
    now_ms += 3600000;
    TEST_ASSERT_EQUAL_UINT(PER_SECOND, offer(2 * PER_SECOND));
    now_ms += 999;
    TEST_ASSERT_EQUAL_UINT(PER_SECOND - 1, offer(2 * PER_SECOND)); /* 29.97 frames */
}

static void test_at_the_full_rate_for_ever_nothing_is_dropped(void) {
    for (unsigned k = 0; k < 1000; k++) {
        now_ms += 100;
        TEST_ASSERT_EQUAL_UINT(3, offer(3));
    }
    TEST_ASSERT_FALSE(guard.babbling);
}

static void test_a_burst_is_cut_but_is_no_babbling(void) {
    (void)offer(10 * PER_SECOND);
    now_ms += 999;
    TEST_ASSERT_GREATER_THAN_UINT(0, offer(1));
    TEST_ASSERT_FALSE(guard.babbling);
    TEST_ASSERT_EQUAL_UINT(0, bench_events(TAPER_EVENT_BABBLING));
}

static void test_an_excess_that_lasts_a_second_is_babbling_and_ends_after_a_second_of_quiet(void) {
    unsigned ms = 0;
    while (!guard.babbling && ms < 3000) {
        (void)offer(1);
        now_ms += 10; /* 100 a second */
        ms += 10;
    }
    TEST_ASSERT_UINT_WITHIN(150, 1430, ms); /* the bucket is empty after 0.43 s */
    TEST_ASSERT_EQUAL_UINT(1, bench_events(TAPER_EVENT_BABBLING));
    TEST_ASSERT_EQUAL_UINT(0, offer(1)); /* not even what is within the rate */
    now_ms += 999;
    TEST_ASSERT_EQUAL_UINT(0, offer(1));
    now_ms += 1000;
    TEST_ASSERT_EQUAL_UINT(1, offer(1));
    TEST_ASSERT_FALSE(guard.babbling);
}

/** EMCY frames that the station sent since the last call. */
static unsigned emcys(taper_emcy_t *last) {
    taper_frame_t frame;
    taper_message_t message;
    bool bad_field = false;
    unsigned found = 0;
    while (taper_membus_world_receive(&bench.bus, &frame)) {
        TEST_ASSERT_TRUE(taper_decode(&frame, &message, &bad_field));
        TEST_ASSERT_EQUAL(TAPER_MESSAGE_EMCY, message.kind);
        *last = message.as.emcy;
        found++;
    }
    return found;
}

static void test_an_alarm_is_told_three_times_then_every_second_until_it_is_over(void) {
    static const uint32_t due_ms[] = {0, 20, 40, 1040, 2040};
    taper_emcy_t last;
    unsigned next = 0;
    for (uint32_t ms = 0; ms <= 2500; ms += 10) {
        if (ms <= 500) { /* seen last at 500 ms: over at 2.5 s */
            taper_alarm_raise(&bench.station, TAPER_EVENT_BABBLING, 0, 5, now_ms + ms);
        }
        taper_alarm_update(&bench.station, now_ms + ms);
        const unsigned told = emcys(&last);
        const bool due = next < 5 && ms == due_ms[next];
        TEST_ASSERT_EQUAL_UINT(due ? 1 : 0, told);
        next += due ? 1u : 0u;
    }
    TEST_ASSERT_EQUAL_UINT(5, next);
    TEST_ASSERT_EQUAL_UINT16(TAPER_EVENT_BABBLING, last.code);
    TEST_ASSERT_EQUAL_UINT8(5, last.about);
    TEST_ASSERT_EQUAL_UINT8(0, bench.station.alarm[0].code);
}

static void test_an_alarm_that_could_not_be_sent_waits_for_the_bus(void) {
    taper_emcy_t last;
    taper_membus_bus_off(&bench.bus, 0, 0);
    taper_alarm_raise(&bench.station, TAPER_EVENT_BAD_FRAMES, 0, 5, now_ms);
    taper_alarm_update(&bench.station, now_ms);
    TEST_ASSERT_EQUAL_UINT(0, emcys(&last));
    taper_membus_bus_on(&bench.bus, 0);
    taper_alarm_update(&bench.station, now_ms + 500);
    TEST_ASSERT_EQUAL_UINT(1, emcys(&last));
}

static void test_more_alarms_than_places_lose_the_last_and_no_other(void) {
    taper_emcy_t last;
    for (uint8_t node = 1; node <= TAPER_ALARMS + 1; node++) {
        taper_alarm_raise(&bench.station, TAPER_EVENT_BABBLING, 0, node, now_ms);
        taper_alarm_raise(&bench.station, TAPER_EVENT_BABBLING, 0, node, now_ms); /* one place each */
    }
    taper_alarm_update(&bench.station, now_ms);
    TEST_ASSERT_EQUAL_UINT(TAPER_ALARMS, emcys(&last));
    TEST_ASSERT_EQUAL_UINT8(TAPER_ALARMS, last.about);
}

static void test_the_event_log_keeps_the_newest(void) {
    static taper_event_log_t log;
    memset(&log, 0, sizeof log);
    for (uint32_t k = 0; k < TAPER_EVENTS + 10; k++) {
        log.now_ms = 1000 + k;
        log.unix_s = 5000 + k;
        taper_event_note(&log, TAPER_EVENT_SOC_JUMP, 1, 2, (int32_t)k);
    }
    TEST_ASSERT_EQUAL_UINT32(TAPER_EVENTS + 10, log.count);
    for (uint32_t k = 10; k < TAPER_EVENTS + 10; k++) {
        const taper_event_t *event = &log.event[k % TAPER_EVENTS];
        TEST_ASSERT_EQUAL_INT32((int32_t)k, event->data);
        TEST_ASSERT_EQUAL_UINT32(1000 + k, event->time_ms);
        TEST_ASSERT_EQUAL_UINT32(5000 + k, event->unix_s);
        TEST_ASSERT_EQUAL_UINT8(TAPER_EVENT_SOC_JUMP, event->code);
        TEST_ASSERT_EQUAL_UINT8(1, event->bus);
        TEST_ASSERT_EQUAL_UINT8(2, event->node);
    }
}

static void test_the_event_log_goes_on_when_its_count_wraps(void) {
    static taper_event_log_t log;
    log.count = UINT32_MAX;
    taper_event_note(&log, TAPER_EVENT_STARTED, 0, 0, 1);
    taper_event_note(&log, TAPER_EVENT_STARTED, 0, 0, 2);
    TEST_ASSERT_EQUAL_INT32(1, log.event[TAPER_EVENTS - 1].data);
    TEST_ASSERT_EQUAL_INT32(2, log.event[0].data);
    taper_event_note(NULL, TAPER_EVENT_STARTED, 0, 0, 3); /* no log keeps nothing */
}

static void test_a_store_keeps_the_gateways_failsafe_limit_and_not_the_descriptions(void) {
    taper_station_options_t options = bench_options();
    taper_station_config_t lower = *options.config;
    lower.failsafe_W = options.config->failsafe_W / 2;
    options.config = &lower; /* the same store, written by the start before */
    TEST_ASSERT_EQUAL(TAPER_OK, taper_station_init(&bench.station, &options));
    TEST_ASSERT_EQUAL_INT32(lower.failsafe_W, bench.station.limits.failsafe_W);
}

static void test_increases_without_an_echo_leave_a_counter_for_the_decrease(void) {
    bench.deaf = true;
    taper_station_poll(&bench.station, now_ms); /* the ledger begins */
    for (int32_t k = 0; k < 20; k++) {
        now_ms += 20;
        bench.station.setpoints.current_mA[0] = 6000 + 100 * k;
        taper_station_send_setpoints(&bench.station, now_ms);
    }
    bench.station.setpoints.current_mA[0] = 0;
    taper_station_send_setpoints(&bench.station, now_ms);
    TEST_ASSERT_EQUAL_INT32(0, bench.station.sent_mA[0]);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_a_node_may_send_a_seconds_worth_at_once_and_no_frame_more);
    RUN_TEST(test_the_bucket_holds_no_more_than_a_second);
    RUN_TEST(test_at_the_full_rate_for_ever_nothing_is_dropped);
    RUN_TEST(test_a_burst_is_cut_but_is_no_babbling);
    RUN_TEST(test_an_excess_that_lasts_a_second_is_babbling_and_ends_after_a_second_of_quiet);
    RUN_TEST(test_an_alarm_is_told_three_times_then_every_second_until_it_is_over);
    RUN_TEST(test_an_alarm_that_could_not_be_sent_waits_for_the_bus);
    RUN_TEST(test_more_alarms_than_places_lose_the_last_and_no_other);
    RUN_TEST(test_the_event_log_keeps_the_newest);
    RUN_TEST(test_the_event_log_goes_on_when_its_count_wraps);
    RUN_TEST(test_a_store_keeps_the_gateways_failsafe_limit_and_not_the_descriptions);
    RUN_TEST(test_increases_without_an_echo_leave_a_counter_for_the_decrease);
    return UNITY_END();
}
