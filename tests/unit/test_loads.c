/* Loads as phasors, against cases that can be drawn on paper; and that the measure finds what is above a limit. */
#include "loads.h"
#include "unity.h"

#include <math.h>

#define CONNECTORS 6
#define NO_TOLD_kW 1e9

enum { STAR_L1, STAR_L2, THREE, PAIR_12, PAIR_31, DIRECT };

static taper_connector_config_t connector[CONNECTORS];
static taper_group_config_t group[2];
static taper_station_config_t station;
static double current_A[CONNECTORS];
static unsigned conductors[CONNECTORS];
static sim_load_t sum[2];

void setUp(void) {
    const taper_connector_config_t plain = {.voltage_mV = 230000,
                                            .efficiency_permille = 1000,
                                            .phases = 1,
                                            .rotation = TAPER_ROTATION_123,
                                            .group = 1};
    for (unsigned i = 0; i < CONNECTORS; i++) {
        connector[i] = plain;
        current_A[i] = 0.0;
        conductors[i] = 1;
    }
    connector[STAR_L2].rotation = TAPER_ROTATION_231;
    connector[THREE].phases = 3;
    connector[PAIR_12].line_to_line = connector[PAIR_31].line_to_line = true;
    connector[PAIR_12].voltage_mV = connector[PAIR_31].voltage_mV = 400000;
    connector[PAIR_31].rotation = TAPER_ROTATION_312;
    connector[DIRECT].is_dc = true;
    connector[DIRECT].efficiency_permille = 920;
    connector[DIRECT].voltage_mV = 400000;
    group[0] = (taper_group_config_t){.limit_W = 100000, .parent = TAPER_NO_GROUP};
    group[1] = (taper_group_config_t){.parent = 0};
    station = (taper_station_config_t){.connectors = connector,
                                       .groups = group,
                                       .site_voltage_mV = 230000,
                                       .connector_count = CONNECTORS,
                                       .group_count = 2};
}

void tearDown(void) {}

static sim_breach_t check(double told_kw) {
    sim_load_t load[CONNECTORS];
    for (unsigned i = 0; i < CONNECTORS; i++) {
        load[i] = sim_load_of(&station, i, conductors[i], current_A[i]);
    }
    return sim_loads_check(&station, load, told_kw, sum);
}

static void assert_lines(double l1_A, double l2_A, double l3_A) {
    (void)check(NO_TOLD_kW);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, l1_A, cabs(sum[0].line_A[0]));
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, l2_A, cabs(sum[0].line_A[1]));
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, l3_A, cabs(sum[0].line_A[2]));
}

static void test_one_phase_carries_its_own_current(void) {
    current_A[STAR_L1] = 16.0;
    current_A[STAR_L2] = 10.0;
    assert_lines(16.0, 10.0, 0.0);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 5.98, sum[0].kw);
}

static void test_a_one_phase_vehicle_on_three_conductors_draws_from_the_first(void) {
    connector[THREE].rotation = TAPER_ROTATION_312;
    current_A[THREE] = 16.0;
    assert_lines(0.0, 0.0, 16.0);
    conductors[THREE] = 3;
    assert_lines(16.0, 16.0, 16.0);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 11.04, sum[0].kw);
}

static void test_two_pairs_that_share_a_line_add_up_to_sqrt_three(void) {
    current_A[PAIR_12] = current_A[PAIR_31] = 10.0;
    assert_lines(10.0 * sqrt(3.0), 10.0, 10.0);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 8.0, sum[0].kw);
}

static void test_a_pair_counts_alike_in_both_directions(void) {
    current_A[PAIR_12] = current_A[PAIR_31] = 10.0;
    connector[PAIR_12].rotation = TAPER_ROTATION_213;
    assert_lines(10.0 * sqrt(3.0), 10.0, 10.0);
}

static void test_a_pair_and_a_phase_meet_at_thirty_degrees(void) {
    current_A[PAIR_12] = 10.0;
    current_A[STAR_L1] = 10.0;
    assert_lines(20.0 * cos(acos(-1.0) / 12.0), 10.0, 0.0);
}

static void test_a_converter_s_losses_count_on_all_three_phases(void) {
    current_A[DIRECT] = 100.0;
    const double kw = 40.0 / 0.92;
    assert_lines(kw / 0.69, kw / 0.69, kw / 0.69);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, kw, sum[0].kw);
}

/** Exactly at `limit` nothing is found; a thousandth of an ampere below it, the excess. */
static void assert_found(int32_t *limit_mA, double limit_A, sim_limit_kind_t kind, unsigned line) {
    *limit_mA = (int32_t)ceil(limit_A * 1000.0);
    TEST_ASSERT_EQUAL(SIM_WITHIN, check(NO_TOLD_kW).kind);
    *limit_mA -= 2;
    const sim_breach_t found = check(NO_TOLD_kW);
    TEST_ASSERT_EQUAL(kind, found.kind);
    TEST_ASSERT_EQUAL_UINT(1, found.group);
    TEST_ASSERT_EQUAL_UINT(line, found.line);
    TEST_ASSERT_DOUBLE_WITHIN(0.0011, 0.0015, found.by);
}

static void test_a_line_above_its_limit_is_found_though_the_power_is_not(void) {
    current_A[PAIR_12] = current_A[PAIR_31] = 10.0;
    assert_found(&group[1].limit_mA, 10.0 * sqrt(3.0), SIM_PHASE, 0);
}

static void test_the_delta_side_carries_differences_of_lines(void) {
    current_A[PAIR_31] = 10.0; // lines 3 and 1: the winding between them carries both
    assert_found(&group[1].delta_mA, 20.0, SIM_DELTA, 0);
}

static void test_balanced_load_is_sqrt_three_on_the_delta_side(void) {
    conductors[THREE] = 3;
    current_A[THREE] = 10.0;
    group[1].delta_mA = (int32_t)(10000.0 * sqrt(3.0)) + 1;
    TEST_ASSERT_EQUAL(SIM_WITHIN, check(NO_TOLD_kW).kind);
    group[1].delta_mA -= 2;
    TEST_ASSERT_EQUAL(SIM_DELTA, check(NO_TOLD_kW).kind);
}

static void test_power_is_held_against_the_description_and_what_is_told(void) {
    current_A[DIRECT] = 230.0; // 100 kW
    TEST_ASSERT_EQUAL(SIM_WITHIN, check(NO_TOLD_kW).kind);
    TEST_ASSERT_EQUAL(SIM_POWER, check(99.9).kind);
    current_A[DIRECT] = 230.1;
    const sim_breach_t found = check(NO_TOLD_kW);
    TEST_ASSERT_EQUAL(SIM_POWER, found.kind);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0.1 * 0.4 / 0.92, found.by_kw);
}

static void test_a_breach_says_where_and_by_how_much(void) {
    char text[80];
    current_A[STAR_L2] = 17.25;
    group[1].limit_mA = 16000;
    const sim_breach_t found = check(NO_TOLD_kW);
    sim_breach_text(&found, text, sizeof text);
    TEST_ASSERT_EQUAL_STRING("group 1: L2 by 1.250 A", text);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 1.25 * 0.23, found.by_kw);
}

static void test_setpoints_are_held_against_the_imbalance(void) {
    double setpoint_A[CONNECTORS] = {[STAR_L1] = 26.0, [STAR_L2] = 6.0, [DIRECT] = 200.0};
    const uint8_t used[CONNECTORS] = {1, 1, 3, 1, 1, 1};
    group[0].imbalance_mA = 26000;
    TEST_ASSERT_EQUAL(SIM_WITHIN, sim_loads_check_imbalance(&station, setpoint_A, used).kind);
    setpoint_A[STAR_L1] = 26.1;
    const sim_breach_t found = sim_loads_check_imbalance(&station, setpoint_A, used);
    TEST_ASSERT_EQUAL(SIM_IMBALANCE, found.kind);
    TEST_ASSERT_EQUAL_UINT(2, found.line); // L3 against L1
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0.1, found.by);
    setpoint_A[THREE] = 16.0; // on all three alike: changes nothing
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0.1, sim_loads_check_imbalance(&station, setpoint_A, used).by);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_one_phase_carries_its_own_current);
    RUN_TEST(test_a_one_phase_vehicle_on_three_conductors_draws_from_the_first);
    RUN_TEST(test_two_pairs_that_share_a_line_add_up_to_sqrt_three);
    RUN_TEST(test_a_pair_counts_alike_in_both_directions);
    RUN_TEST(test_a_pair_and_a_phase_meet_at_thirty_degrees);
    RUN_TEST(test_a_converter_s_losses_count_on_all_three_phases);
    RUN_TEST(test_a_line_above_its_limit_is_found_though_the_power_is_not);
    RUN_TEST(test_the_delta_side_carries_differences_of_lines);
    RUN_TEST(test_balanced_load_is_sqrt_three_on_the_delta_side);
    RUN_TEST(test_power_is_held_against_the_description_and_what_is_told);
    RUN_TEST(test_a_breach_says_where_and_by_how_much);
    RUN_TEST(test_setpoints_are_held_against_the_imbalance);
    return UNITY_END();
}
