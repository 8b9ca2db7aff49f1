/* The rows of a station: what bounds them, what a connector counts in them, and which of them are planned. */
#include <string.h>

#include "taper/rows.h"
#include "unity.h"

#define L1 1u
#define L2 2u
#define L3 4u

static taper_snapshot_t snapshot;

void setUp(void) {
    memset(&snapshot, 0, sizeof snapshot);
}
void tearDown(void) {}

enum { SOCKET, AB, BC, FAST, PLAIN };

static const taper_group_config_t groups[] = {
    {.limit_W = 50000, .limit_mA = 200000, .parent = TAPER_NO_GROUP},
    {.delta_mA = 90000, .imbalance_mA = 20000, .parent = 0},
    {.limit_mA = 63000, .parent = 0},
};
static const taper_connector_config_t connectors[] = {
    [SOCKET] =
        {.max_mA = 32000, .voltage_mV = 230000, .phases = 3, .rotation = TAPER_ROTATION_231, .group = 0},
    [AB] = {.max_mA = 32000,
            .voltage_mV = 208000,
            .phases = 1,
            .rotation = TAPER_ROTATION_123,
            .line_to_line = true,
            .group = 1},
    [BC] = {.max_mA = 32000,
            .voltage_mV = 208000,
            .phases = 1,
            .rotation = TAPER_ROTATION_231,
            .line_to_line = true,
            .group = 1},
    [FAST] = {.max_mA = 125000,
              .voltage_mV = 400000,
              .efficiency_permille = 950,
              .phases = 1,
              .group = 0,
              .is_dc = true},
    [PLAIN] =
        {.max_mA = 32000, .voltage_mV = 230500, .phases = 1, .rotation = TAPER_ROTATION_312, .group = 2},
};
static taper_station_config_t station = {
    .name = "rows",
    .connectors = connectors,
    .groups = groups,
    .site_voltage_mV = 230000,
    .line_to_line = true,
    .steps = 24,
    .connector_count = 5,
    .group_count = 3,
};

static void test_limits_come_from_the_description(void) {
    TEST_ASSERT_EQUAL_INT32(50000, taper_row_limit(&station, 0, TAPER_ROW_POWER));
    TEST_ASSERT_EQUAL_INT32(200000, taper_row_limit(&station, 0, TAPER_ROW_L2));
    TEST_ASSERT_EQUAL_INT32(200000, taper_row_limit(&station, 0, TAPER_ROW_L3_B));
    TEST_ASSERT_EQUAL_INT32(90000, taper_row_limit(&station, 1, TAPER_ROW_DELTA_L3));
    TEST_ASSERT_EQUAL_INT32(90000, taper_row_limit(&station, 1, TAPER_ROW_DELTA_L1_B));
    TEST_ASSERT_EQUAL_INT32(20000, taper_row_limit(&station, 1, TAPER_ROW_L3_L1));
    TEST_ASSERT_EQUAL_INT32(TAPER_NO_LIMIT, taper_row_limit(&station, 0, TAPER_ROW_DELTA_L1));
    TEST_ASSERT_EQUAL_INT32(TAPER_NO_LIMIT, taper_row_limit(&station, 0, TAPER_ROW_L1_L2));
    TEST_ASSERT_EQUAL_INT32(TAPER_NO_LIMIT, taper_row_limit(&station, 2, TAPER_ROW_POWER));
}

static void test_without_connectors_between_lines_there_is_no_second_row(void) {
    station.line_to_line = false;
    TEST_ASSERT_EQUAL_INT32(TAPER_NO_LIMIT, taper_row_limit(&station, 0, TAPER_ROW_L1_B));
    TEST_ASSERT_EQUAL_INT32(TAPER_NO_LIMIT, taper_row_limit(&station, 1, TAPER_ROW_DELTA_L3_B));
    TEST_ASSERT_EQUAL_INT32(90000, taper_row_limit(&station, 1, TAPER_ROW_DELTA_L3));
    station.line_to_line = true;
}

static void test_the_supply_bounds_what_the_site_has_limits_for(void) {
    const taper_supply_t supply = {.site_W = 40000, .phase_mA = {150000, -5, TAPER_NO_LIMIT}};
    TEST_ASSERT_EQUAL_INT32(40000, taper_row_limit_now(&station, &supply, 0, TAPER_ROW_POWER));
    TEST_ASSERT_EQUAL_INT32(150000, taper_row_limit_now(&station, &supply, 0, TAPER_ROW_L1));
    TEST_ASSERT_EQUAL_INT32(150000, taper_row_limit_now(&station, &supply, 0, TAPER_ROW_L1_B));
    TEST_ASSERT_EQUAL_INT32(0, taper_row_limit_now(&station, &supply, 0, TAPER_ROW_L2));
    TEST_ASSERT_EQUAL_INT32(200000, taper_row_limit_now(&station, &supply, 0, TAPER_ROW_L3));
    TEST_ASSERT_EQUAL_INT32(63000, taper_row_limit_now(&station, &supply, 2, TAPER_ROW_L1));
    taper_station_config_t below_a_transformer = station;
    below_a_transformer.groups = &groups[1];
    TEST_ASSERT_EQUAL_INT32(90000, taper_row_limit_now(&below_a_transformer, &supply, 0, TAPER_ROW_DELTA_L2));
    TEST_ASSERT_EQUAL_INT32(20000, taper_row_limit_now(&below_a_transformer, &supply, 0, TAPER_ROW_L2_L3));
    const taper_supply_t little = {.site_W = -5, .phase_mA = {10000, 10000, 10000}};
    TEST_ASSERT_EQUAL_INT32(0, taper_row_limit_now(&station, &little, 0, TAPER_ROW_POWER));
    TEST_ASSERT_EQUAL_INT32(63000, taper_row_limit_now(&station, &little, 2, TAPER_ROW_L1));
    TEST_ASSERT_EQUAL_INT32(TAPER_NO_LIMIT,
                            taper_row_limit_now(&below_a_transformer, &little, 0, TAPER_ROW_POWER));
    const taper_supply_t ample = taper_supply_of_W(90000);
    TEST_ASSERT_EQUAL_INT32(50000, taper_row_limit_now(&station, &ample, 0, TAPER_ROW_POWER));
}

static void test_the_rows_of_now_are_those_that_some_group_limits_sums_first(void) {
    static const uint8_t kinds[] = {
        TAPER_ROW_POWER,      TAPER_ROW_L1,       TAPER_ROW_L2,         TAPER_ROW_L3,
        TAPER_ROW_L1_B,       TAPER_ROW_L2_B,     TAPER_ROW_L3_B,       TAPER_ROW_DELTA_L1,
        TAPER_ROW_DELTA_L2,   TAPER_ROW_DELTA_L3, TAPER_ROW_DELTA_L1_B, TAPER_ROW_DELTA_L2_B,
        TAPER_ROW_DELTA_L3_B, TAPER_ROW_L1_L2,    TAPER_ROW_L2_L3,      TAPER_ROW_L3_L1};
    const taper_supply_t ample = taper_supply_of_W(90000);
    taper_rows_t rows;
    taper_rows_now(&rows, &station, &snapshot, &ample);
    TEST_ASSERT_EQUAL_UINT8(16, rows.count);
    TEST_ASSERT_EQUAL_UINT8(13, rows.sums);
    TEST_ASSERT_EQUAL_MEMORY(kinds, rows.kind, sizeof kinds);
    taper_station_config_t alone = station;
    alone.group_count = 1;
    alone.line_to_line = false;
    taper_rows_now(&rows, &alone, &snapshot, &ample);
    TEST_ASSERT_EQUAL_UINT8(4, rows.count);
    TEST_ASSERT_EQUAL_UINT8(4, rows.sums);
    TEST_ASSERT_EQUAL_MEMORY(kinds, rows.kind, 4);
}

static void test_the_rows_of_now_are_bounded_by_what_the_site_may_have_now(void) {
    const taper_supply_t supply = {.site_W = 40000, .phase_mA = {150000, -5, TAPER_NO_LIMIT}};
    taper_rows_t rows;
    taper_rows_now(&rows, &station, &snapshot, &supply);
    for (uint8_t k = 0; k < station.group_count; k++) {
        for (uint8_t row = 0; row < rows.count; row++) {
            const taper_row_kind_t kind = (taper_row_kind_t)rows.kind[row];
            TEST_ASSERT_EQUAL_INT32(taper_row_limit_now(&station, &supply, k, kind), rows.limit[k][row]);
        }
    }
    TEST_ASSERT_EQUAL_INT32(150000, rows.limit[0][1]);
    TEST_ASSERT_EQUAL_INT32(63000, rows.limit[2][1]);
}

static void test_what_counts_in_the_rows_of_now_is_what_the_snapshot_says(void) {
    const taper_supply_t ample = taper_supply_of_W(90000);
    taper_rows_t rows;
    snapshot.demand[PLAIN].booking = (taper_booking_t){.W_per_A = 250, .permille = 1000, .phases = L2};
    taper_rows_now(&rows, &station, &snapshot, &ample);
    for (uint8_t i = 0; i < station.connector_count; i++) {
        const taper_booking_t booking = taper_booking_now(&station, &snapshot, i);
        TEST_ASSERT_EQUAL_INT32(booking.W_per_A, rows.booking[i].W_per_A);
        TEST_ASSERT_EQUAL_UINT8(booking.phases, rows.booking[i].phases);
        for (uint8_t row = 0; row < rows.count; row++) {
            TEST_ASSERT_EQUAL_INT32(taper_row_weight(&booking, (taper_row_kind_t)rows.kind[row]),
                                    rows.weight[i][row]);
        }
    }
    TEST_ASSERT_EQUAL_INT32(250, rows.weight[PLAIN][0]);
    TEST_ASSERT_EQUAL_INT32(0, rows.weight[PLAIN][1]);
    TEST_ASSERT_EQUAL_INT32(1000, rows.weight[PLAIN][2]);
}

static void assert_booking(int32_t W_per_A, int32_t permille, uint8_t phases, uint8_t i) {
    const taper_booking_t booking = taper_booking_nominal(&station, i);
    TEST_ASSERT_EQUAL_INT32(W_per_A, booking.W_per_A);
    TEST_ASSERT_EQUAL_INT32(permille, booking.permille);
    TEST_ASSERT_EQUAL_UINT8(phases, booking.phases);
}

static void test_a_connector_counts_by_its_description_with_volts_and_losses_rounded_up(void) {
    assert_booking(690, 1000, L1 | L2 | L3, SOCKET);
    assert_booking(208, 1000, L1 | L2, AB);
    assert_booking(208, 1000, L2 | L3, BC);
    assert_booking(422, 612, L1 | L2 | L3, FAST); /* 400 V / 0.95; 422 W / 690 V */
    assert_booking(231, 1000, L3, PLAIN);
    TEST_ASSERT_TRUE(taper_booking_nominal(&station, AB).line_to_line);
    TEST_ASSERT_FALSE(taper_booking_nominal(&station, FAST).line_to_line);
}

static void test_what_a_converter_counts_is_exact_where_nothing_is_to_be_rounded(void) {
    static const struct {
        int32_t voltage_mV;
        uint16_t efficiency_permille;
        int32_t W_per_A, permille;
    } cases[] = {
        {380000, 950, 400, 580},     /* 579.7 */
        {345000, 1000, 345, 500},    /* half of 690 V */
        {1000000, 1000, 1000, 1450}, /* 1449.3 */
    };
    taper_connector_config_t fast = connectors[FAST];
    taper_station_config_t with_fast = station;
    with_fast.connectors = &fast;
    for (unsigned k = 0; k < sizeof cases / sizeof cases[0]; k++) {
        fast.voltage_mV = cases[k].voltage_mV;
        fast.efficiency_permille = cases[k].efficiency_permille;
        const taper_booking_t booking = taper_booking_nominal(&with_fast, 0);
        TEST_ASSERT_EQUAL_INT32(cases[k].W_per_A, booking.W_per_A);
        TEST_ASSERT_EQUAL_INT32(cases[k].permille, booking.permille);
    }
}

static void test_what_is_told_of_who_is_not_active_counts_however_little(void) {
    snapshot.demand[SOCKET].booking = (taper_booking_t){.W_per_A = 250, .permille = 1000, .phases = L1};
    TEST_ASSERT_EQUAL_INT32(250, taper_booking_now(&station, &snapshot, SOCKET).W_per_A);
    snapshot.demand[SOCKET].booking.W_per_A = 1;
    TEST_ASSERT_EQUAL_INT32(1, taper_booking_now(&station, &snapshot, SOCKET).W_per_A);
    snapshot.demand[SOCKET].booking.phases = 0; /* without lines it says nothing */
    TEST_ASSERT_EQUAL_INT32(690, taper_booking_now(&station, &snapshot, SOCKET).W_per_A);
}

static void test_what_the_snapshot_leaves_open_is_by_the_description(void) {
    TEST_ASSERT_EQUAL_INT32(690, taper_booking_now(&station, &snapshot, SOCKET).W_per_A);
    snapshot.demand[SOCKET].active = true;
    snapshot.demand[SOCKET].W_per_A = 240;
    TEST_ASSERT_EQUAL_INT32(240, taper_booking_now(&station, &snapshot, SOCKET).W_per_A);
    TEST_ASSERT_EQUAL_UINT8(L1 | L2 | L3, taper_booking_now(&station, &snapshot, SOCKET).phases);
    snapshot.demand[SOCKET].booking = (taper_booking_t){.permille = 1000, .phases = L2};
    TEST_ASSERT_EQUAL_INT32(240, taper_booking_now(&station, &snapshot, SOCKET).W_per_A);
    TEST_ASSERT_EQUAL_UINT8(L2, taper_booking_now(&station, &snapshot, SOCKET).phases);
    snapshot.demand[SOCKET].active = false;
    TEST_ASSERT_EQUAL_INT32(690, taper_booking_now(&station, &snapshot, SOCKET).W_per_A);
    snapshot.demand[SOCKET].booking.W_per_A = 250;
    TEST_ASSERT_EQUAL_INT32(250, taper_booking_now(&station, &snapshot, SOCKET).W_per_A);
}

static void test_a_demand_on_direct_current_counts_with_its_losses(void) {
    snapshot.demand[FAST].active = true;
    snapshot.demand[FAST].W_per_A = 380;
    TEST_ASSERT_EQUAL_INT32(400, taper_booking_now(&station, &snapshot, FAST).W_per_A);
}

static void test_rows_are_planned_where_a_limit_meets_a_connector(void) {
    TEST_ASSERT_TRUE(taper_row_is_planned(&station, 0, TAPER_ROW_POWER));
    TEST_ASSERT_TRUE(taper_row_is_planned(&station, 0, TAPER_ROW_L1_B));
    TEST_ASSERT_FALSE(taper_row_is_planned(&station, 0, TAPER_ROW_DELTA_L1)); /* no limit */
    TEST_ASSERT_FALSE(taper_row_is_planned(&station, 1, TAPER_ROW_POWER));
    TEST_ASSERT_TRUE(taper_row_is_planned(&station, 1, TAPER_ROW_DELTA_L2));   /* AB twice, and BC */
    TEST_ASSERT_TRUE(taper_row_is_planned(&station, 1, TAPER_ROW_DELTA_L3_B)); /* BC twice, and AB */
    TEST_ASSERT_FALSE(taper_row_is_planned(&station, 1, TAPER_ROW_DELTA_L1));  /* AB once: by L2 */
    TEST_ASSERT_TRUE(taper_row_is_planned(&station, 1, TAPER_ROW_L1_L2));
    TEST_ASSERT_FALSE(taper_row_is_planned(&station, 2, TAPER_ROW_L1)); /* nobody there is on it */
    TEST_ASSERT_TRUE(taper_row_is_planned(&station, 2, TAPER_ROW_L3));
}

static void test_of_lines_of_a_feeder_that_carry_the_same_one_is_planned(void) {
    static const taper_connector_config_t sockets[] = {
        {.voltage_mV = 230000, .phases = 3, .rotation = TAPER_ROTATION_231, .group = 1},
        {.voltage_mV = 230000, .phases = 1, .rotation = TAPER_ROTATION_231, .group = 1},
    };
    static const taper_group_config_t tree[] = {
        {.limit_W = 69000, .limit_mA = 100000, .parent = TAPER_NO_GROUP},
        {.limit_W = 69000, .limit_mA = 100000, .imbalance_mA = 20000, .parent = 0},
    };
    taper_station_config_t feeder = station;
    feeder.connectors = sockets;
    feeder.connector_count = 2;
    feeder.groups = tree;
    feeder.group_count = 2;
    feeder.line_to_line = false;
    TEST_ASSERT_TRUE(taper_row_is_planned(&feeder, 1, TAPER_ROW_POWER));
    TEST_ASSERT_FALSE(taper_row_is_planned(&feeder, 1, TAPER_ROW_L1));
    TEST_ASSERT_TRUE(taper_row_is_planned(&feeder, 1, TAPER_ROW_L2)); /* both */
    TEST_ASSERT_FALSE(taper_row_is_planned(&feeder, 1, TAPER_ROW_L3));
    TEST_ASSERT_TRUE(taper_row_is_planned(&feeder, 1, TAPER_ROW_L1_L2)); /* a difference is never implied */
    TEST_ASSERT_TRUE(taper_row_is_planned(&feeder, 0, TAPER_ROW_L1));    /* nor a line of the site */
    TEST_ASSERT_TRUE(taper_row_is_planned(&feeder, 0, TAPER_ROW_L3));
    feeder.connector_count = 1; /* all three carry the same: the first is planned */
    TEST_ASSERT_TRUE(taper_row_is_planned(&feeder, 1, TAPER_ROW_L1));
    TEST_ASSERT_FALSE(taper_row_is_planned(&feeder, 1, TAPER_ROW_L2));
}

static void test_a_line_that_the_first_connector_alone_is_on_is_planned(void) {
    static const taper_connector_config_t sockets[] = {
        {.voltage_mV = 230000, .phases = 1, .rotation = TAPER_ROTATION_312, .group = 1},
        {.voltage_mV = 230000, .phases = 3, .rotation = TAPER_ROTATION_123, .group = 1},
    };
    static const taper_group_config_t tree[] = {
        {.limit_W = 69000, .limit_mA = 100000, .parent = TAPER_NO_GROUP},
        {.limit_mA = 100000, .imbalance_mA = 20000, .parent = 0},
    };
    taper_station_config_t feeder = station;
    feeder.connectors = sockets;
    feeder.connector_count = 2;
    feeder.groups = tree;
    feeder.group_count = 2;
    feeder.line_to_line = false;
    TEST_ASSERT_TRUE(taper_row_is_planned(&feeder, 1, TAPER_ROW_L3));
    TEST_ASSERT_FALSE(taper_row_is_planned(&feeder, 1, TAPER_ROW_L1));
    TEST_ASSERT_TRUE(taper_row_is_planned(&feeder, 1, TAPER_ROW_L3_L1));
    feeder.connector_count = 1; /* the next one does not count */
    TEST_ASSERT_FALSE(taper_row_is_planned(&feeder, 0, TAPER_ROW_L1));
    TEST_ASSERT_TRUE(taper_row_is_planned(&feeder, 0, TAPER_ROW_L3));
}

static void test_differences_imply_nothing(void) {
    static const taper_connector_config_t socket = {
        .voltage_mV = 230000, .phases = 1, .rotation = TAPER_ROTATION_123, .group = 1};
    static const taper_group_config_t tree[] = {
        {.limit_W = 69000, .parent = TAPER_NO_GROUP},
        {.imbalance_mA = 20000, .parent = 0},
    };
    taper_station_config_t feeder = station;
    feeder.connectors = &socket;
    feeder.connector_count = 1;
    feeder.groups = tree;
    feeder.group_count = 2;
    TEST_ASSERT_TRUE(taper_row_is_planned(&feeder, 1, TAPER_ROW_L1_L2));
    TEST_ASSERT_FALSE(taper_row_is_planned(&feeder, 1, TAPER_ROW_L2_L3)); /* it has no weight there */
    TEST_ASSERT_TRUE(taper_row_is_planned(&feeder, 1, TAPER_ROW_L3_L1));
}

static void test_a_planned_row_has_those_below_its_group_with_a_weight(void) {
    TEST_ASSERT_TRUE(taper_row_plans(&station, 0, TAPER_ROW_L3, PLAIN));
    TEST_ASSERT_FALSE(taper_row_plans(&station, 0, TAPER_ROW_L2, PLAIN));
    TEST_ASSERT_TRUE(taper_row_plans(&station, 0, TAPER_ROW_L2, AB));
    TEST_ASSERT_FALSE(taper_row_plans(&station, 1, TAPER_ROW_DELTA_L1, SOCKET)); /* hangs above */
    TEST_ASSERT_TRUE(taper_row_plans(&station, 1, TAPER_ROW_DELTA_L2, AB));
    TEST_ASSERT_FALSE(taper_row_plans(&station, 1, TAPER_ROW_L1_L2, AB)); /* on both alike */
    TEST_ASSERT_TRUE(taper_row_plans(&station, 1, TAPER_ROW_L1_L2, BC));
}

static void test_a_group_contains_what_hangs_below_it(void) {
    TEST_ASSERT_TRUE(taper_group_contains(&station, 0, AB));
    TEST_ASSERT_TRUE(taper_group_contains(&station, 1, AB));
    TEST_ASSERT_FALSE(taper_group_contains(&station, 2, AB));
    TEST_ASSERT_FALSE(taper_group_contains(&station, 1, SOCKET));
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_limits_come_from_the_description);
    RUN_TEST(test_without_connectors_between_lines_there_is_no_second_row);
    RUN_TEST(test_the_supply_bounds_what_the_site_has_limits_for);
    RUN_TEST(test_the_rows_of_now_are_those_that_some_group_limits_sums_first);
    RUN_TEST(test_the_rows_of_now_are_bounded_by_what_the_site_may_have_now);
    RUN_TEST(test_what_counts_in_the_rows_of_now_is_what_the_snapshot_says);
    RUN_TEST(test_a_connector_counts_by_its_description_with_volts_and_losses_rounded_up);
    RUN_TEST(test_what_a_converter_counts_is_exact_where_nothing_is_to_be_rounded);
    RUN_TEST(test_what_is_told_of_who_is_not_active_counts_however_little);
    RUN_TEST(test_what_the_snapshot_leaves_open_is_by_the_description);
    RUN_TEST(test_a_demand_on_direct_current_counts_with_its_losses);
    RUN_TEST(test_rows_are_planned_where_a_limit_meets_a_connector);
    RUN_TEST(test_of_lines_of_a_feeder_that_carry_the_same_one_is_planned);
    RUN_TEST(test_a_line_that_the_first_connector_alone_is_on_is_planned);
    RUN_TEST(test_differences_imply_nothing);
    RUN_TEST(test_a_planned_row_has_those_below_its_group_with_a_weight);
    RUN_TEST(test_a_group_contains_what_hangs_below_it);
    return UNITY_END();
}
