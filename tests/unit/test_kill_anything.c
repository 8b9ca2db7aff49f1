/*
 * Whatever dies, and whenever: what the connectors may draw together stays within the limit, and charging goes on by itself
 * when it is back. Eight vehicles on the hub under 30 kW.
 */
#include <stdio.h>

#include "live_bench.h"
#include "unity.h"

#define KILLS       (200 / TEST_SHARE)
#define VEHICLES    8u
#define LIMIT_KW    30.0
#define RESUMES_ms  30000u
#define LONGEST_ms  20000u
#define SHORTEST_ms 500u
/* If two die, nobody may be left to lower a current before it expires: the last tick before (1 s), the validity of a
   setpoint (3 s), and what the polls of both sides take. */
#define GRACE_OF_TWO_ms 4200u
/* Charging has resumed when this much is drawn again. */
#define RESUMED_KW 25.0
/* The hub leaves a connector that was switched off so for five minutes; one kill after the other would leave none. */
#define SWITCH_ms 5000u

enum { STATION = 100 };

static uint64_t random_state;

/** The splitmix64 generator. @return 0..below-1 */
static uint32_t random_below(uint32_t below) {
    random_state += UINT64_C(0x9E3779B97F4A7C15);
    uint64_t z = random_state;
    z = (z ^ (z >> 30)) * UINT64_C(0xBF58476D1CE4E5B9);
    z = (z ^ (z >> 27)) * UINT64_C(0x94D049BB133111EB);
    return (uint32_t)((z ^ (z >> 31)) % below);
}

static uint32_t random_ms(uint32_t low_ms, uint32_t high_ms) {
    return low_ms + random_below((high_ms - low_ms) / LIVE_POLL_ms) * LIVE_POLL_ms;
}

/** The station, the gateway, or a connector, each as often. */
static unsigned random_node(void) {
    switch (random_below(3)) {
    case 0: return STATION;
    case 1: return SIM_GATEWAY;
    default: return random_below(VEHICLES);
    }
}

static void kill(unsigned node, bool forgets) {
    if (node == STATION) {
        live_bench_kill_station();
    } else if (forgets) {
        sim_field_power_off(&live.field, node);
    } else {
        sim_field_kill(&live.field, node);
    }
}

static void revive(unsigned node) {
    if (node == STATION) {
        live_bench_revive_station();
    } else {
        sim_field_revive(&live.field, node);
    }
}

/** @return how long it took, or RESUMES_ms and more: it did not. */
static uint32_t wait_until_charging(void) {
    uint32_t waited_ms = 0;
    while (live.field.tracker.drawn_kw < RESUMED_KW && waited_ms < RESUMES_ms) {
        live_bench_run_ms(LIVE_POLL_ms);
        waited_ms += LIVE_POLL_ms;
    }
    return waited_ms;
}

void setUp(void) {}

static void start(uint32_t grace_ms) {
    live_options_t options = live_options(LIMIT_KW);
    sim_session_t sessions[VEHICLES];
    for (unsigned i = 0; i < VEHICLES; i++) {
        sessions[i] = live_vehicle(0.0);
    }
    options.grace_ms = grace_ms;
    live_bench_start(&options, sessions, VEHICLES);
    live.config.min_on_ms = SWITCH_ms;
    live.config.min_off_ms = SWITCH_ms;
    live_bench_run_ms(20000);
    random_state = 1;
}

void tearDown(void) {
    live_bench_end();
}

static void test_whatever_dies_the_limit_holds_and_charging_resumes(void) {
    static const char *const fates[] = {"cable", "power"};
    start(SIM_GRACE_ms);
    for (int k = 0; k < KILLS; k++) {
        live_bench_run_ms(random_ms(LIVE_POLL_ms, 5000));
        const unsigned node = random_node();
        const bool forgets = random_below(2) == 1;
        const uint32_t outage_ms = random_ms(SHORTEST_ms, LONGEST_ms);
        kill(node, forgets);
        live_bench_run_ms(outage_ms);
        revive(node);
        const uint32_t waited_ms = wait_until_charging();
        char where[160];
        snprintf(where, sizeof where, "kill %d: node %u (%s) for %u ms; worst %.3f kW at %llu ms", k, node,
                 fates[forgets], (unsigned)outage_ms, live.field.tracker.may.worst_kw,
                 (unsigned long long)live.field.tracker.may.first_ms);
        TEST_ASSERT_EQUAL_UINT32_MESSAGE(0, live.field.tracker.may.times, where);
        TEST_ASSERT_EQUAL_UINT32_MESSAGE(0, live.field.tracker.drawn.times, where);
        TEST_ASSERT_LESS_THAN_UINT32_MESSAGE(RESUMES_ms, waited_ms, where);
    }
    TEST_ASSERT_EQUAL_UINT32(0, taper_station_counter(&live.station, TAPER_COUNTER_GUARD_VIOLATIONS));
}

static void test_two_that_die_within_each_others_outage_do_no_harm_either(void) {
    start(GRACE_OF_TWO_ms);
    for (int k = 0; k < KILLS / 4; k++) {
        const unsigned first = random_node();
        const unsigned second = random_node();
        live_bench_run_ms(random_ms(LIVE_POLL_ms, 5000));
        kill(first, random_below(2) == 1);
        live_bench_run_ms(random_ms(LIVE_POLL_ms, 10000));
        kill(second, random_below(2) == 1);
        live_bench_run_ms(random_ms(SHORTEST_ms, LONGEST_ms));
        revive(first);
        live_bench_run_ms(random_ms(LIVE_POLL_ms, 10000));
        revive(second);
        const uint32_t waited_ms = wait_until_charging();
        char where[160];
        snprintf(where, sizeof where, "kill %d: nodes %u and %u; worst %.3f kW at %llu ms", k, first, second,
                 live.field.tracker.may.worst_kw, (unsigned long long)live.field.tracker.may.first_ms);
        TEST_ASSERT_EQUAL_UINT32_MESSAGE(0, live.field.tracker.may.times, where);
        TEST_ASSERT_LESS_THAN_UINT32_MESSAGE(RESUMES_ms, waited_ms, where);
    }
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_whatever_dies_the_limit_holds_and_charging_resumes);
    RUN_TEST(test_two_that_die_within_each_others_outage_do_no_harm_either);
    return UNITY_END();
}
