/* The guard of the fallback currents: what it refuses, to the milliampere and milliwatt. scene_four(), granted 32 A each. */
#include <string.h>

#include "scene.h"
#include "taper/ledger.h"
#include "unity.h"

#define NOW_ms 1000u

static taper_connector_config_t connectors[5]; /* the last one is not there */
static taper_station_config_t config;
static taper_ledger_t ledger;
static taper_snapshot_t snapshot;
static taper_setpoints_t granted, fallback;

void setUp(void) {
    const taper_evse_status_t empty = {.pilot = TAPER_PILOT_A};
    memcpy(connectors, scene_four()->connectors, 4 * sizeof connectors[0]);
    connectors[4] = connectors[0];
    config = *scene_four();
    config.connectors = connectors;
    snapshot = scene_snapshot(NOW_ms, 4);
    memset(&fallback, 0, sizeof fallback);
    taper_ledger_init(&ledger, &config, 3000, 1, NOW_ms);
    for (uint8_t i = 0; i < 4; i++) {
        granted.current_mA[i] = 32000;
        taper_ledger_hear(&ledger, i, &empty, NOW_ms); /* nothing of an earlier life is left */
    }
}
void tearDown(void) {}

/** In tenths of an ampere at 230 V. */
static int32_t W_of_dA(int32_t current_dA) {
    return current_dA * 23;
}

static bool passes(int32_t failsafe_W) {
    return taper_guard_fallback_passes(&ledger, &config, &snapshot, failsafe_W, &granted, &fallback);
}

static void test_the_guard_refuses_what_is_above_its_setpoint_or_below_nothing(void) {
    granted.current_mA[2] = 6000;
    fallback.current_mA[2] = 6000;
    TEST_ASSERT_TRUE(passes(10000));
    fallback.current_mA[2] = 6001;
    TEST_ASSERT_FALSE(passes(10000));
    fallback.current_mA[2] = -1;
    TEST_ASSERT_FALSE(passes(10000));
}

static void test_the_guard_refuses_any_while_the_sum_of_all_that_may_have_been_told_is_above_the_limit(void) {
    fallback.current_mA[0] = fallback.current_mA[3] = 10000;
    TEST_ASSERT_TRUE(passes(W_of_dA(200)));
    TEST_ASSERT_FALSE(passes(W_of_dA(200) - 1));
    taper_ledger_sent(&ledger, 0, 0, 32000, 10000, NOW_ms);
    taper_ledger_sent(&ledger, 3, 0, 32000, 10000, NOW_ms);
    TEST_ASSERT_TRUE(passes(W_of_dA(200)));
    TEST_ASSERT_FALSE(passes(W_of_dA(200) - 1));
    fallback.current_mA[0] = 0; /* may have been told still */
    TEST_ASSERT_FALSE(passes(W_of_dA(200) - 1));
    TEST_ASSERT_FALSE(passes(-1000));
    fallback.current_mA[3] = 0;
    TEST_ASSERT_TRUE(passes(W_of_dA(200) - 1));
    TEST_ASSERT_TRUE(passes(-1000));
}

static void test_the_guard_refuses_a_milliwatt_more_than_the_limit(void) {
    connectors[0].voltage_mV = 1000; /* 1 W for 1 A */
    snapshot.demand[0] = (taper_demand_t){0};
    fallback.current_mA[0] = 10000;
    TEST_ASSERT_TRUE(passes(10));
    fallback.current_mA[0] = 10001;
    TEST_ASSERT_FALSE(passes(10));
}

static void test_without_a_failsafe_limit_the_guard_lets_what_costs_nothing_pass(void) {
    connectors[0].voltage_mV = 0;
    snapshot.demand[0] = (taper_demand_t){0};
    fallback.current_mA[0] = 10000;
    TEST_ASSERT_TRUE(passes(0));
    TEST_ASSERT_TRUE(passes(-1));
}

static void test_the_guard_does_not_judge_who_is_not_there(void) {
    fallback.current_mA[4] = 777;
    TEST_ASSERT_TRUE(passes(0));
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_the_guard_refuses_what_is_above_its_setpoint_or_below_nothing);
    RUN_TEST(test_the_guard_refuses_any_while_the_sum_of_all_that_may_have_been_told_is_above_the_limit);
    RUN_TEST(test_the_guard_refuses_a_milliwatt_more_than_the_limit);
    RUN_TEST(test_without_a_failsafe_limit_the_guard_lets_what_costs_nothing_pass);
    RUN_TEST(test_the_guard_does_not_judge_who_is_not_there);
    return UNITY_END();
}
