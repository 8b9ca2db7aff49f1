#include "tree.h"

#include <string.h>

#include "unity.h"

void tree_init(tree_t *tree) {
    memset(tree, 0, sizeof *tree);
    tree->group[0] = (taper_group_config_t){.limit_W = 1000000, .parent = TAPER_NO_GROUP};
    tree->config = (taper_station_config_t){.name = "tree",
                                            .connectors = tree->connector,
                                            .groups = tree->group,
                                            .site_voltage_mV = 230000,
                                            .tick_ms = 1000,
                                            .min_on_ms = 300000,
                                            .min_off_ms = 300000,
                                            .turn_ms = 900000,
                                            .step_s = 900,
                                            .steps = 24,
                                            .group_count = 1};
    tree->supply = taper_supply_of_W(INT32_MAX);
    tree->snapshot.now_ms = 10000;
    taper_allocator_init(&tree->allocator);
}

uint8_t tree_add_group(tree_t *tree, uint8_t parent) {
    tree->group[tree->config.group_count] = (taper_group_config_t){.parent = parent};
    return tree->config.group_count++;
}

static uint8_t add(tree_t *tree, taper_connector_config_t connector, uint8_t lines) {
    const uint8_t i = tree->config.connector_count++;
    const int32_t volts_V = connector.voltage_mV / 1000 * connector.phases;
    tree->connector[i] = connector;
    tree->snapshot.count = tree->config.connector_count;
    tree->snapshot.demand[i] = (taper_demand_t){
        .active = true,
        .session = 1,
        .need_Wh = 50000,
        .peak_W = 100000,
        .max_mA = connector.max_mA,
        .min_mA = connector.min_mA,
        .W_per_A = volts_V,
        .departs_in_s = 8 * 3600,
        .booking = {
            .W_per_A = volts_V, .permille = 1000, .phases = lines, .line_to_line = connector.line_to_line}};
    tree->proposal.rank[i] = i;
    tree_wish(tree, i, connector.max_mA, connector.max_mA);
    return i;
}

uint8_t tree_add(tree_t *tree, uint8_t group, uint8_t lines) {
    return add(tree,
               (taper_connector_config_t){.min_mA = 6000,
                                          .max_mA = 32000,
                                          .voltage_mV = 230000,
                                          .phases = lines == (L1 | L2 | L3) ? 3 : 1,
                                          .rotation = lines == L2   ? TAPER_ROTATION_231
                                                      : lines == L3 ? TAPER_ROTATION_312
                                                                    : TAPER_ROTATION_123,
                                          .group = group},
               lines);
}

uint8_t tree_add_pair(tree_t *tree, uint8_t group, uint8_t lines) {
    tree->config.line_to_line = true;
    return add(tree,
               (taper_connector_config_t){.min_mA = 6000,
                                          .max_mA = 32000,
                                          .voltage_mV = 208000,
                                          .phases = 1,
                                          .line_to_line = true,
                                          .rotation = lines == (L2 | L3)   ? TAPER_ROTATION_231
                                                      : lines == (L3 | L1) ? TAPER_ROTATION_312
                                                                           : TAPER_ROTATION_123,
                                          .group = group},
               lines);
}

void tree_wish(tree_t *tree, uint8_t i, int32_t wish_mA, int32_t ceiling_mA) {
    const int32_t W_per_A = tree->snapshot.demand[i].W_per_A;
    tree->proposal.wish_W[i] = wish_mA * W_per_A / 1000;
    tree->proposal.ceiling_W[i] = ceiling_mA * W_per_A / 1000;
}

void tree_laxity(tree_t *tree, uint8_t i, int32_t laxity_s) {
    taper_demand_t *demand = &tree->snapshot.demand[i];
    demand->departs_in_s =
        laxity_s + (int32_t)((int64_t)demand->need_Wh * 3600 / taper_demand_allowed_W(demand));
}

bool tree_guard(const tree_t *tree) {
    return taper_guard_passes(&tree->config, &tree->snapshot, &tree->supply, &tree->setpoints);
}

void tree_assert_just_enough(const tree_t *tree, int32_t *limit, int32_t enough) {
    *limit = enough;
    TEST_ASSERT_TRUE(tree_guard(tree));
    *limit = enough - 1;
    TEST_ASSERT_FALSE(tree_guard(tree));
    *limit = enough + 1;
    TEST_ASSERT_TRUE(tree_guard(tree));
    *limit = enough;
}

const taper_rows_t *tree_rows(const tree_t *tree) {
    static taper_rows_t rows;
    taper_rows_now(&rows, &tree->config, &tree->snapshot, &tree->supply);
    return &rows;
}

int32_t tree_allocate(tree_t *tree) {
    taper_allocate(&tree->allocator, &tree->config, &tree->snapshot, &tree->proposal, tree_rows(tree), NULL,
                   &tree->setpoints);
    TEST_ASSERT_TRUE(tree_guard(tree));
    return tree->setpoints.current_mA[0];
}

int32_t tree_allocate_after(tree_t *tree, uint32_t ms) {
    tree->snapshot.now_ms += ms;
    return tree_allocate(tree);
}

uint32_t tree_random(uint32_t *state, uint32_t bound) {
    *state ^= *state << 13;
    *state ^= *state >> 17;
    *state ^= *state << 5;
    return *state % bound;
}

void tree_start(tree_t *tree, unsigned vehicles, int32_t places) {
    for (unsigned i = 0; i < vehicles; i++) {
        tree_laxity(tree, tree_add(tree, 0, L1), (int32_t)i * 3600);
    }
    tree->group[0].limit_mA = places * 6000;
}

bool tree_is_on(const tree_t *tree, uint8_t i) {
    return tree->setpoints.current_mA[i] > 0;
}

void tree_assert_on(const tree_t *tree, const char *expected) {
    char on[TAPER_MAX_CONNECTORS + 1];
    unsigned count = 0;
    for (uint8_t i = 0; i < tree->config.connector_count; i++) {
        if (tree_is_on(tree, i)) {
            on[count++] = (char)('0' + i);
        }
    }
    on[count] = '\0';
    TEST_ASSERT_EQUAL_STRING(expected, on);
}

void tree_assert_waiting(const tree_t *tree, uint8_t i, uint8_t place, uint8_t of) {
    const taper_waiting_t waiting = taper_allocator_waiting(&tree->allocator, i);
    TEST_ASSERT_EQUAL_UINT8(place, waiting.place);
    TEST_ASSERT_EQUAL_UINT8(of, waiting.of);
}
