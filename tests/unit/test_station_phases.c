/* Connectors whose vehicles use fewer or more phases than before, on a site that is limited on each phase. */
#include <string.h>

#include "scene.h"
#include "station_bench.h"
#include "taper/stations.h"
#include "unity.h"

#define LIMIT_mA    16000
#define REACTION_ms 5000u
/** Until a setpoint without an echo is over: its validity, waiting in a queue, and the vehicle. */
#define OVER_ms (3000u + 500u + REACTION_ms)

static taper_station_config_t config;
static taper_connector_config_t connectors[TAPER_MAX_CONNECTORS];
static taper_group_config_t groups[TAPER_MAX_GROUPS];
/** Phases that the connectors of vehicles 1 and 2 say are in use. */
static uint8_t phases[3];

/** Vehicle 1 on L1 L2 L3 or L1, vehicle 2 on L2 alone. */
static void start(void) {
    taper_station_options_t options = bench_options();
    config = *options.config;
    memcpy(connectors, config.connectors, config.connector_count * sizeof connectors[0]);
    memcpy(groups, config.groups, config.group_count * sizeof groups[0]);
    connectors[0].reaction_ms = REACTION_ms;
    connectors[1].reaction_ms = REACTION_ms;
    connectors[1].rotation = TAPER_ROTATION_231;
    groups[0].limit_mA = LIMIT_mA;
    config.connectors = connectors;
    config.groups = groups;
    config.other_load_W = 0;
    config.other_load_mA = 0;
    options.config = &config;
    bench_start(&options);
}

static void send_status(uint8_t node) {
    taper_message_t message = {.kind = TAPER_MESSAGE_EVSE_STATUS, .node = node};
    message.as.evse_status = (taper_evse_status_t){.pilot = TAPER_PILOT_C,
                                                   .ev_present = true,
                                                   .phases = phases[node],
                                                   .fallback_active = !bench.heard[node],
                                                   .setpoint_echo = bench.echo[node]};
    bench_send(&message);
}

static void tick(void) {
    bench_send_clock();
    bench_send_limit(50000);
    for (uint8_t node = 1; node <= config.connector_count; node++) {
        if (node <= 2) {
            send_status(node);
            bench_send_vehicle(node, 7, 500);
        } else {
            bench_send_status(node, false);
        }
    }
    bench_step();
}

static void run_ticks(unsigned ticks) {
    for (unsigned k = 0; k < ticks; k++) {
        tick();
    }
}

static int32_t current_mA(uint8_t node) {
    return bench.setpoint[node].current_mA;
}

void setUp(void) {
    start();
    phases[2] = 1;
}

void tearDown(void) {}

static void test_phases_that_a_setpoint_allows_are_not_given_away_before_it_is_over(void) {
    phases[1] = 3;
    run_ticks(20);
    const int32_t first_mA = current_mA(1);
    TEST_ASSERT_GREATER_OR_EQUAL_INT32(6000, first_mA);
    TEST_ASSERT_LESS_OR_EQUAL_INT32(LIMIT_mA, first_mA + current_mA(2));
    TEST_ASSERT_EQUAL_UINT8(7, bench.setpoint[1].phase_mask);
    phases[1] = 1; /* it says so; but it may still draw from all three */
    const uint32_t told_ms = bench.now_ms - config.tick_ms;
    while (taper_elapsed_ms(bench.now_ms, told_ms) < OVER_ms) {
        tick();
        TEST_ASSERT_EQUAL_UINT8(1, bench.setpoint[1].phase_mask);
        TEST_ASSERT_LESS_OR_EQUAL_INT32(LIMIT_mA, first_mA + current_mA(2));
    }
    run_ticks(3);
    TEST_ASSERT_EQUAL_INT32(LIMIT_mA, current_mA(1));
    TEST_ASSERT_EQUAL_INT32(LIMIT_mA, current_mA(2));
}

static void test_phases_that_come_into_use_again_meanwhile_are_still_there(void) {
    phases[1] = 3;
    run_ticks(20);
    for (unsigned k = 0; k < 7; k++) {
        phases[1] = k % 2 == 0 ? 1 : 3;
        tick();
        TEST_ASSERT_LESS_OR_EQUAL_INT32(LIMIT_mA, current_mA(1) + current_mA(2));
    }
}

static void test_a_setpoint_allows_more_phases_only_when_others_have_left_them(void) {
    phases[1] = 1;
    run_ticks(20);
    const int32_t second_mA = current_mA(2);
    TEST_ASSERT_EQUAL_INT32(LIMIT_mA, second_mA);
    phases[1] = 3;
    const uint32_t changed_ms = bench.now_ms;
    while (taper_elapsed_ms(bench.now_ms, changed_ms) < OVER_ms) {
        tick();
        TEST_ASSERT_EQUAL_UINT8(1, bench.setpoint[1].phase_mask);
        TEST_ASSERT_LESS_OR_EQUAL_INT32(LIMIT_mA, current_mA(1) + current_mA(2)); /* made room at once */
    }
    run_ticks(3);
    TEST_ASSERT_EQUAL_UINT8(7, bench.setpoint[1].phase_mask);
    TEST_ASSERT_LESS_OR_EQUAL_INT32(LIMIT_mA, current_mA(1) + current_mA(2));
}

static void test_the_next_vehicle_begins_with_all_phases(void) {
    phases[1] = 1;
    run_ticks(20);
    TEST_ASSERT_EQUAL_UINT8(1, bench.setpoint[1].phase_mask);
    bench_send_status(1, false);
    bench_send_status(2, false);
    bench_step();
    phases[1] = 3;
    run_ticks(2);
    TEST_ASSERT_EQUAL_UINT8(7, bench.setpoint[1].phase_mask);
    TEST_ASSERT_GREATER_OR_EQUAL_INT32(6000, current_mA(1));
}

/** What the setpoints of vehicles 1 and 2 put on L1 and L2 by their phase masks. */
static int32_t apart_mA(void) {
    const int32_t all_mA = current_mA(1); /* on L1, if no more */
    const bool three = bench.setpoint[1].phase_mask == 7;
    const int32_t line_mA[3] = {all_mA, current_mA(2) + (three ? all_mA : 0), three ? all_mA : 0};
    const int32_t most_mA = taper_max_i32(line_mA[0], line_mA[1]); /* L3 has the least */
    return taper_max_i32(most_mA, line_mA[2]) - taper_min_i32(line_mA[2], line_mA[0]);
}

static void test_a_setpoint_for_fewer_phases_than_before_does_not_balance_those_it_left(void) {
    groups[0].limit_mA = 0;
    groups[0].imbalance_mA = 10000;
    phases[1] = 3;
    run_ticks(20);
    TEST_ASSERT_GREATER_THAN_INT32(10000, current_mA(1));
    TEST_ASSERT_EQUAL_INT32(10000, current_mA(2));
    for (unsigned k = 0; k < 40; k++) {
        phases[1] = k < 20 ? 1 : 3;
        tick();
        TEST_ASSERT_LESS_OR_EQUAL_INT32(10000, apart_mA());
        TEST_ASSERT_GREATER_OR_EQUAL_INT32(10000,
                                           current_mA(1)); /* nobody has to make room for what it left */
        TEST_ASSERT_EQUAL_INT32(10000, current_mA(2));
    }
}

static void test_another_phase_mask_goes_out_at_once_though_the_current_stays(void) {
    phases[1] = 3;
    run_ticks(20);
    bench_poll(250); /* all setpoints go out, and are not due again for half a second */
    const int32_t before_mA = current_mA(1);
    TEST_ASSERT_EQUAL_UINT8(7, bench.setpoint[1].phase_mask);
    phases[1] = 1;
    tick();
    TEST_ASSERT_EQUAL_INT32(before_mA, current_mA(1));
    TEST_ASSERT_EQUAL_UINT8(1, bench.setpoint[1].phase_mask);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_phases_that_a_setpoint_allows_are_not_given_away_before_it_is_over);
    RUN_TEST(test_phases_that_come_into_use_again_meanwhile_are_still_there);
    RUN_TEST(test_a_setpoint_allows_more_phases_only_when_others_have_left_them);
    RUN_TEST(test_the_next_vehicle_begins_with_all_phases);
    RUN_TEST(test_another_phase_mask_goes_out_at_once_though_the_current_stays);
    RUN_TEST(test_a_setpoint_for_fewer_phases_than_before_does_not_balance_those_it_left);
    return UNITY_END();
}
