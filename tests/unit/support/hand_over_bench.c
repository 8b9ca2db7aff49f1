#include "hand_over_bench.h"

#include <string.h>

#include "scene.h"
#include "taper/rows.h"
#include "unity.h"

#define NOW_ms 3500 /* nothing of an earlier life is left */

taper_connector_config_t connectors[CONNECTORS];
taper_group_config_t groups[3];
taper_station_config_t config;
taper_ledger_t ledger;
taper_snapshot_t snapshot;
taper_supply_t supply;
taper_setpoints_t granted;

void bench_start(void) {
    memset(connectors, 0, sizeof connectors);
    memset(groups, 0, sizeof groups);
    memset(&snapshot, 0, sizeof snapshot);
    memset(&granted, 0, sizeof granted);
    config = *scene_four();
    config.connectors = connectors;
    config.connector_count = CONNECTORS;
    config.groups = groups;
    groups[0] = (taper_group_config_t){.limit_W = 1000000, .parent = TAPER_NO_GROUP};
    groups[1].limit_W = groups[2].limit_W = 1000000;
    for (uint8_t i = 0; i < CONNECTORS; i++) {
        connectors[i] = (taper_connector_config_t){.max_mA = 100000,
                                                   .voltage_mV = 230000,
                                                   .efficiency_permille = 1000,
                                                   .phases = 1,
                                                   .rotation = TAPER_ROTATION_123,
                                                   .group = i < 3 ? 1 : 2};
    }
    supply = taper_supply_of_W(1000000);
    taper_ledger_init(&ledger, &config, 3000, 1, 0);
    taper_ledger_update(&ledger, NOW_ms);
}

void bench_grant(uint8_t i, int32_t current_mA) {
    granted.current_mA[i] = current_mA;
}

void bench_may_draw(uint8_t i, int32_t current_mA) {
    taper_ledger_sent(&ledger, i, 0, current_mA, 0, NOW_ms);
}

void bench_put_between(uint8_t i, int pair) {
    static const uint8_t rotation[3] = {TAPER_ROTATION_123, TAPER_ROTATION_231, TAPER_ROTATION_312};
    connectors[i].line_to_line = true;
    connectors[i].rotation = rotation[pair];
    config.line_to_line = true;
}

bool bench_passes(void) {
    return taper_guard_hand_over_passes(&ledger, &config, &snapshot, &supply, &granted);
}

void bench_assert_bound(uint8_t i, int32_t most_mA) {
    bench_grant(i, most_mA);
    TEST_ASSERT_TRUE(bench_passes());
    bench_grant(i, most_mA + 1);
    TEST_ASSERT_FALSE(bench_passes());
}
