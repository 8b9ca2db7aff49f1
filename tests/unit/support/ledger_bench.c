#include "ledger_bench.h"

#include <string.h>

#include "scene.h"
#include "unity.h"

#define START_ms (UINT32_MAX - 4000u)

taper_connector_config_t connectors[5];
taper_station_config_t config;
taper_ledger_t ledger;
uint32_t now_ms;

void bench_begin(void) {
    memcpy(connectors, scene_four()->connectors, 4 * sizeof connectors[0]);
    connectors[4] = connectors[0];
    for (unsigned i = 0; i < 5; i++) {
        connectors[i].reaction_ms = REACTION_ms;
    }
    config = *scene_four();
    config.connectors = connectors;
    bench_start(1);
    bench_hear_no_vehicle();
}

void bench_start(uint32_t time_scale) {
    now_ms = START_ms;
    taper_ledger_init(&ledger, &config, VALIDITY_ms, time_scale, now_ms);
}

void bench_wait_ms(uint32_t ms) {
    now_ms += ms;
    taper_ledger_update(&ledger, now_ms);
}

void bench_send(uint8_t counter, int32_t current_mA, int32_t told_fallback_mA) {
    taper_ledger_sent(&ledger, 0, counter, current_mA, told_fallback_mA, now_ms);
}

taper_evse_status_t bench_status(uint8_t echo) {
    return (taper_evse_status_t){.pilot = TAPER_PILOT_C,
                                 .ev_present = true,
                                 .setpoint_echo = echo,
                                 .current_mA = {TAPER_ABSENT, TAPER_ABSENT, TAPER_ABSENT}};
}

static void hear(const taper_evse_status_t *status) {
    taper_ledger_hear(&ledger, 0, status, now_ms);
}

void bench_hear_echo(uint8_t counter) {
    const taper_evse_status_t status = bench_status(counter);
    hear(&status);
}

void bench_hear_fallback(void) {
    taper_evse_status_t status = bench_status(0);
    status.fallback_active = true;
    hear(&status);
}

void bench_hear_no_vehicle(void) {
    const taper_evse_status_t status = {.pilot = TAPER_PILOT_A};
    hear(&status);
}

void bench_hear_draw(uint8_t echo, int32_t L1_mA, int32_t L2_mA, int32_t L3_mA) {
    taper_evse_status_t status = bench_status(echo);
    status.current_mA[0] = L1_mA;
    status.current_mA[1] = L2_mA;
    status.current_mA[2] = L3_mA;
    hear(&status);
}

int32_t bench_may_mA(void) {
    return taper_ledger_may_mA(&ledger, 0);
}

int32_t bench_told_mA(void) {
    return taper_ledger_told_mA(&ledger, 0);
}

int32_t bench_fallback_mA(void) {
    return taper_ledger_fallback_mA(&ledger, 0);
}

void bench_assert_changes_after(uint32_t ms, int32_t before_mA, int32_t then_mA) {
    bench_wait_ms(ms - 1);
    TEST_ASSERT_EQUAL_INT32(before_mA, bench_may_mA());
    bench_wait_ms(1);
    TEST_ASSERT_EQUAL_INT32(then_mA, bench_may_mA());
}
