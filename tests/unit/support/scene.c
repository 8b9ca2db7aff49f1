#include "scene.h"

#include <string.h>

#define CONNECTOR(index, owner, least_mA) \
    {.min_mA = (least_mA),                \
     .max_mA = 32000,                     \
     .voltage_mV = 230000,                \
     .phases = 1,                         \
     .group = (owner),                    \
     .bus = 0,                            \
     .node = (index) + 1}

static const taper_group_config_t groups[] = {
    {.limit_W = 25000, .parent = TAPER_NO_GROUP},
    {.limit_W = 11960, .parent = 0}, /* 52 A */
    {.limit_W = 11960, .parent = 0}, /* 52 A */
};

static const taper_connector_config_t connectors[] = {CONNECTOR(0, 1, 6000), CONNECTOR(1, 1, 6000),
                                                      CONNECTOR(2, 2, 6000), CONNECTOR(3, 2, 6000)};

static const taper_connector_config_t continuous_connectors[] = {CONNECTOR(0, 1, 0), CONNECTOR(1, 1, 0),
                                                                 CONNECTOR(2, 2, 0), CONNECTOR(3, 2, 0)};

#define STATION(table)          \
    {.name = "scene",           \
     .connectors = (table),     \
     .groups = groups,          \
     .failsafe_W = 4000,        \
     .site_voltage_mV = 230000, \
     .tick_ms = 1000,           \
     .min_on_ms = 300000,       \
     .min_off_ms = 300000,      \
     .step_s = 900,             \
     .steps = 24,               \
     .connector_count = 4,      \
     .group_count = 3}

const taper_station_config_t *scene_four(void) {
    static const taper_station_config_t station = STATION(connectors);
    return &station;
}

const taper_station_config_t *scene_four_continuous(void) {
    static const taper_station_config_t station = STATION(continuous_connectors);
    return &station;
}

taper_demand_t scene_demand(void) {
    return (taper_demand_t){
        .active = true,
        .session = 1,
        .stored_Wh = 30000,
        .capacity_Wh = 60000,
        .need_Wh = 10000,
        .peak_W = 7360,
        .taper_W = 0,
        .max_mA = 32000,
        .min_mA = 6000,
        .W_per_A = 230,
        .departs_in_s = 7200,
    };
}

taper_snapshot_t scene_snapshot(uint32_t now_ms, uint8_t active) {
    taper_snapshot_t snapshot;
    memset(&snapshot, 0, sizeof snapshot);
    snapshot.now_ms = now_ms;
    snapshot.count = 4;
    for (uint8_t i = 0; i < active; i++) {
        snapshot.demand[i] = scene_demand();
    }
    return snapshot;
}

taper_proposal_t scene_proposal(int32_t wish_W) {
    taper_proposal_t proposal;
    memset(&proposal, 0, sizeof proposal);
    for (uint8_t i = 0; i < TAPER_MAX_CONNECTORS; i++) {
        proposal.wish_W[i] = wish_W;
        proposal.ceiling_W[i] = wish_W;
        proposal.rank[i] = i;
    }
    return proposal;
}

const taper_rows_t *scene_rows(const taper_station_config_t *station, const taper_snapshot_t *snapshot,
                               const taper_supply_t *supply) {
    static taper_rows_t rows;
    taper_rows_now(&rows, station, snapshot, supply);
    return &rows;
}

uint32_t scene_random(uint32_t *state) {
    *state ^= *state << 13;
    *state ^= *state >> 17;
    *state ^= *state << 5;
    return *state;
}

const taper_station_config_t *scene_free_moving(const taper_station_config_t *station) {
    static taper_station_config_t copy;
    static taper_connector_config_t copies[TAPER_MAX_CONNECTORS];
    copy = *station;
    for (uint8_t i = 0; i < station->connector_count; i++) {
        copies[i] = station->connectors[i];
        copies[i].fallback_mA = 0;
        copies[i].reaction_ms = 0;
    }
    copy.connectors = copies;
    copy.change_ms = 0;
    copy.ramp_mA_per_s = 0;
    copy.deadband_mA = 0;
    return &copy;
}
