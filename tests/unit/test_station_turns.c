/* Turns on the whole station, where a hand-over takes as long as vehicles take to follow. */
#include <string.h>

#include "station_bench.h"
#include "unity.h"

#define VEHICLES 2
/** Room for one minimum of three phases. */
#define LIMIT_W 5000
#define TICKS   1800u

static taper_station_config_t config;
static taper_connector_config_t connectors[TAPER_MAX_CONNECTORS];
/** Ticks with current, by node. */
static unsigned on[VEHICLES + 1];

void setUp(void) {
    memset(on, 0, sizeof on);
}

void tearDown(void) {}

static void start(uint32_t turn_ms, uint32_t min_off_ms, uint32_t reaction_ms) {
    taper_station_options_t options = bench_options();
    config = *options.config;
    memcpy(connectors, config.connectors, config.connector_count * sizeof connectors[0]);
    for (uint8_t i = 0; i < config.connector_count; i++) {
        connectors[i].reaction_ms = reaction_ms;
    }
    config.connectors = connectors;
    config.change_ms = 5000;
    config.turn_ms = turn_ms;
    config.min_on_ms = turn_ms;
    config.min_off_ms = min_off_ms;
    options.config = &config;
    bench_start(&options);
}

/** A vehicle that draws what it is told. */
static void send_status(uint8_t node) {
    const int32_t drawn_mA = bench.setpoint[node].current_mA;
    taper_message_t message = {.kind = TAPER_MESSAGE_EVSE_STATUS, .node = node};
    message.as.evse_status = (taper_evse_status_t){.pilot = TAPER_PILOT_C,
                                                   .ev_present = true,
                                                   .phases = 3,
                                                   .fallback_active = !bench.heard[node],
                                                   .setpoint_echo = bench.echo[node],
                                                   .current_mA = {drawn_mA, drawn_mA, drawn_mA}};
    bench_send(&message);
    bench_send_vehicle(node, 7, 500);
}

static void tick(void) {
    bench_send_clock();
    bench_send_limit(LIMIT_W);
    for (uint8_t node = 1; node <= VEHICLES; node++) {
        send_status(node);
    }
    for (uint8_t node = VEHICLES + 1; node <= config.connector_count; node++) {
        bench_send_status(node, false);
    }
    bench_step();
    for (uint8_t node = 1; node <= VEHICLES; node++) {
        on[node] += bench.setpoint[node].current_mA > 0 ? 1u : 0u;
    }
}

static void assert_both_charge(uint32_t turn_ms, uint32_t min_off_ms, uint32_t reaction_ms) {
    setUp();
    memset(bench.setpoint, 0, sizeof bench.setpoint);
    start(turn_ms, min_off_ms, reaction_ms);
    for (unsigned k = 0; k < TICKS; k++) {
        tick();
    }
    for (uint8_t node = 1; node <= VEHICLES; node++) {
        TEST_ASSERT_GREATER_THAN_UINT(TICKS / 5, on[node]);
    }
}

static void test_turns_shorter_than_a_hand_over_starve_nobody(void) {
    assert_both_charge(0, 0, 5000);
    assert_both_charge(2000, 0, 5000);
    assert_both_charge(30000, 0, 60000);
    assert_both_charge(60000, 0, 60000);
}

static void test_least_times_off_longer_than_a_turn_starve_nobody(void) {
    assert_both_charge(0, 60000, 5000);
    assert_both_charge(60000, 300000, 5000);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_turns_shorter_than_a_hand_over_starve_nobody);
    RUN_TEST(test_least_times_off_longer_than_a_turn_starve_nobody);
    return UNITY_END();
}
