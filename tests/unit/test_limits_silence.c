/* Gateways and meters that fall silent, beat only, or come back: faults 13 to 15 as the limits see them. */
#include <string.h>

#include "scene.h"
#include "taper/limits.h"
#include "unity.h"

static taper_limits_t limits;
static taper_event_log_t events;
static taper_station_config_t config;
static uint32_t now_ms;

void setUp(void) {
    config = *scene_four(); /* built for 25 kW, failsafe 4 kW */
    config.other_load_W = 6000;
    taper_limits_init(&limits, &config);
    memset(&events, 0, sizeof events);
    limits.log = &events;
    limits.time_scale = 600;
    now_ms = UINT32_MAX - 60000u; /* it wraps */
}
void tearDown(void) {}

static void say(bool active, int32_t limit_W) {
    const taper_site_limit_t message = {
        .active = active, .limit_W = limit_W, .failsafe_W = TAPER_ABSENT, .validity_s = TAPER_ABSENT};
    taper_limits_apply(&limits, &message, now_ms);
}

static void meter(int32_t l1_mA, int32_t l2_mA, int32_t l3_mA) {
    const taper_site_meter_t message = {{l1_mA, l2_mA, l3_mA}};
    taper_limits_apply_meter(&limits, &message, now_ms);
}

/** `seconds` go by, each with a tick, and with a heartbeat if the gateway `beats`. */
static void pass(uint32_t seconds, bool beats) {
    for (uint32_t k = 0; k < seconds; k++) {
        now_ms += 1000;
        if (beats) {
            say(true, TAPER_ABSENT);
        }
        taper_limits_update(&limits, now_ms);
    }
}

static bool alive(void) {
    return taper_limits_gateway_alive(&limits, now_ms);
}

static unsigned noted(taper_event_code_t code) {
    unsigned found = 0;
    for (uint32_t k = 0; k < events.count; k++) {
        found += events.event[k].code == code ? 1u : 0u;
    }
    return found;
}

static void test_heartbeats_alone_are_trusted_after_120_seconds_of_the_bus_at_any_time_scale(void) {
    say(true, 10000);
    pass(119, true);
    TEST_ASSERT_FALSE(alive());
    TEST_ASSERT_EQUAL_UINT(1, noted(TAPER_EVENT_GATEWAY_LOST));
    pass(1, true);
    TEST_ASSERT_TRUE(alive());
    TEST_ASSERT_EQUAL_UINT(1, noted(TAPER_EVENT_GATEWAY_BACK));
    TEST_ASSERT_EQUAL(TAPER_LIMIT_STATION, taper_limits_now(&limits, now_ms).source);
    pass(60, true);
    TEST_ASSERT_TRUE(alive()); /* and go on to be */
    pass(6, false);
    TEST_ASSERT_FALSE(alive());
}

static void test_a_pause_in_the_heartbeats_starts_the_120_seconds_anew(void) {
    say(true, 10000);
    pass(100, true);
    pass(6, false);
    pass(120, true);
    TEST_ASSERT_FALSE(alive());
    pass(1, true);
    TEST_ASSERT_TRUE(alive());
}

static void test_a_gateway_that_never_set_a_limit_is_trusted_after_120_seconds_too(void) {
    pass(120, true);
    TEST_ASSERT_FALSE(limits.heard);
    pass(1, true);
    TEST_ASSERT_TRUE(alive());
    TEST_ASSERT_EQUAL_UINT(0, noted(TAPER_EVENT_GATEWAY_BACK)); /* it was never lost */
}

static void test_a_gateway_that_says_that_it_sets_none_is_believed_at_once(void) {
    say(false, TAPER_ABSENT);
    TEST_ASSERT_TRUE(alive());
    pass(60, true); /* then heartbeats keep it so */
    TEST_ASSERT_TRUE(alive());
}

static void test_a_new_limit_ends_failsafe_and_starts_the_120_seconds_anew(void) {
    say(true, 10000);
    pass(100, true);
    say(true, 9000);
    TEST_ASSERT_TRUE(alive());
    pass(119, true);
    TEST_ASSERT_FALSE(alive());
}

static void test_the_meter_is_believed_for_three_seconds(void) {
    TEST_ASSERT_EQUAL_INT32(6000, taper_limits_other_W(&limits, now_ms)); /* never heard: the worst */
    meter(1000, 2000, 3000);
    TEST_ASSERT_EQUAL_INT32(1380, taper_limits_other_W(&limits, now_ms));
    now_ms += TAPER_SITE_METER_TIMEOUT_ms;
    taper_limits_update(&limits, now_ms);
    TEST_ASSERT_EQUAL_INT32(1380, taper_limits_other_W(&limits, now_ms));
    TEST_ASSERT_EQUAL_UINT(0, noted(TAPER_EVENT_METER_LOST));
    now_ms += 1;
    taper_limits_update(&limits, now_ms);
    TEST_ASSERT_EQUAL_INT32(6000, taper_limits_other_W(&limits, now_ms));
    TEST_ASSERT_EQUAL_UINT(1, noted(TAPER_EVENT_METER_LOST));
    meter(1000, 2000, 3000);
    TEST_ASSERT_EQUAL_UINT(1, noted(TAPER_EVENT_METER_BACK));
    for (uint32_t k = 0; k < events.count; k++) {
        TEST_ASSERT_EQUAL_UINT8(0, events.event[k].bus);
        TEST_ASSERT_EQUAL_UINT8(TAPER_NODE_GATEWAY, events.event[k].node);
        TEST_ASSERT_EQUAL_INT32(events.event[k].code == TAPER_EVENT_METER_LOST ? 6000 : 0,
                                events.event[k].data);
    }
    TEST_ASSERT_EQUAL_INT32(1380, taper_limits_other_W(&limits, now_ms));
}

static void test_a_meter_that_was_above_the_assumed_maximum_stays_there_when_lost(void) {
    meter(20000, 10000, 10000);
    now_ms += TAPER_SITE_METER_TIMEOUT_ms + 1;
    taper_limits_update(&limits, now_ms);
    TEST_ASSERT_EQUAL_INT32(9200, taper_limits_other_W(&limits, now_ms));
}

static void test_a_phase_without_a_value_counts_as_a_third_and_feeding_in_gives_nothing(void) {
    meter(TAPER_ABSENT, 1000, 1000);
    TEST_ASSERT_EQUAL_INT32(2460, taper_limits_other_W(&limits, now_ms));
    meter(-30000, 1000, 1000);
    TEST_ASSERT_EQUAL_INT32(0, taper_limits_other_W(&limits, now_ms));
}

static void test_other_load_above_the_limit_leaves_nothing(void) {
    say(true, 5000);
    TEST_ASSERT_EQUAL_INT32(0, taper_limits_now(&limits, now_ms).supply.site_W);
    TEST_ASSERT_EQUAL_INT32(6000, taper_limits_now(&limits, now_ms).other_W);
}

static void test_a_limit_that_stays_negative_is_noted_once(void) {
    for (unsigned k = 0; k < 10; k++) {
        say(true, -100);
        pass(1, false);
    }
    TEST_ASSERT_EQUAL_UINT(1, noted(TAPER_EVENT_LIMIT_NEGATIVE));
    TEST_ASSERT_EQUAL_UINT32(10, limits.negative);
    say(true, 5000);
    say(true, -100);
    TEST_ASSERT_EQUAL_UINT(2, noted(TAPER_EVENT_LIMIT_NEGATIVE));
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_heartbeats_alone_are_trusted_after_120_seconds_of_the_bus_at_any_time_scale);
    RUN_TEST(test_a_pause_in_the_heartbeats_starts_the_120_seconds_anew);
    RUN_TEST(test_a_gateway_that_never_set_a_limit_is_trusted_after_120_seconds_too);
    RUN_TEST(test_a_gateway_that_says_that_it_sets_none_is_believed_at_once);
    RUN_TEST(test_a_new_limit_ends_failsafe_and_starts_the_120_seconds_anew);
    RUN_TEST(test_the_meter_is_believed_for_three_seconds);
    RUN_TEST(test_a_meter_that_was_above_the_assumed_maximum_stays_there_when_lost);
    RUN_TEST(test_a_phase_without_a_value_counts_as_a_third_and_feeding_in_gives_nothing);
    RUN_TEST(test_other_load_above_the_limit_leaves_nothing);
    RUN_TEST(test_a_limit_that_stays_negative_is_noted_once);
    return UNITY_END();
}
