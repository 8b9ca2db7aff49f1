/*
 * The guard of the hand-over, row by row: power, the currents of the phases, of lines between which connectors are, and of
 * the delta side of a transformer; that it compares with what may be drawn already; and that it agrees with what is granted.
 */
#include <string.h>

#include "scene.h"
#include "taper/ledger.h"
#include "taper/rows.h"
#include "unity.h"

#define CONNECTORS 6

static taper_connector_config_t connectors[CONNECTORS];
static taper_group_config_t groups[3];
static taper_station_config_t config;
static taper_ledger_t ledger;
static taper_snapshot_t snapshot;
static taper_setpoints_t granted;
static taper_supply_t supply;

/** Connectors 0 to 2 are below group 1, the others below group 2; all of one phase, wired to L1. */
void setUp(void) {
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
    taper_ledger_update(&ledger, 3500); /* nothing of an earlier life is left */
}
void tearDown(void) {}

static bool passes(void) {
    return taper_guard_hand_over_passes(&ledger, &config, &snapshot, &supply, &granted);
}

static void grant(uint8_t i, int32_t current_mA) {
    granted.current_mA[i] = current_mA;
}

static void may_draw(uint8_t i, int32_t current_mA) {
    taper_ledger_sent(&ledger, i, 0, current_mA, 0, 3500);
}

/** Connector `i` is between two lines: 0 L1-L2, 1 L2-L3, 2 L3-L1. */
static void put_between(uint8_t i, int pair) {
    static const uint8_t rotation[3] = {TAPER_ROTATION_123, TAPER_ROTATION_231, TAPER_ROTATION_312};
    connectors[i].line_to_line = true;
    connectors[i].rotation = rotation[pair];
    config.line_to_line = true;
}

/** With `most` of connector `i` it passes, with one milliampere more it does not. */
static void assert_bound(uint8_t i, int32_t most_mA) {
    grant(i, most_mA);
    TEST_ASSERT_TRUE(passes());
    grant(i, most_mA + 1);
    TEST_ASSERT_FALSE(passes());
}

static void test_power_is_bounded_by_every_group_and_the_supply(void) {
    grant(0, 10000);
    groups[1].limit_W = 4600;
    assert_bound(1, 10000);
    groups[1].limit_W = 0; /* none */
    TEST_ASSERT_TRUE(passes());
    groups[0].limit_W = 6900;
    assert_bound(1, 20000);
    groups[0].limit_W = 1000000;
    supply.site_W = 4600;
    assert_bound(1, 10000);
    grant(1, 0);
    assert_bound(4, 10000);
    grant(4, 10001);
    supply.site_W = -1;
    TEST_ASSERT_FALSE(passes());
    memset(&granted, 0, sizeof granted);
    TEST_ASSERT_TRUE(passes());
}

static void test_the_power_of_one_ampere_is_as_it_is_booked(void) {
    groups[0].limit_W = 6900;
    connectors[0].phases = 3;
    assert_bound(0, 10000);
    connectors[0].voltage_mV = 229001; /* whole volts, rounded up */
    assert_bound(0, 10000);
    snapshot.demand[0].booking.W_per_A = 1000; /* more than by its description */
    assert_bound(0, 6900);
    snapshot.demand[0].active = true;
    snapshot.demand[0].W_per_A = 345;
    assert_bound(0, 6900);
    snapshot.demand[0].booking.W_per_A = 0;
    assert_bound(0, 20000);
    snapshot.demand[0].booking = (taper_booking_t){.phases = 1, .permille = 1000, .W_per_A = 230};
    assert_bound(0, 30000);
}

static void test_a_converter_counts_with_its_losses_on_all_phases(void) {
    connectors[0].is_dc = true;
    connectors[0].voltage_mV = 399001;
    connectors[0].efficiency_permille = 950; /* 421.05 W, rounded up; 422 / 690 of the current, rounded up */
    groups[0].limit_W = 4220;
    assert_bound(0, 10000);
    groups[0].limit_W = 1000000;
    groups[0].limit_mA = 6120;
    assert_bound(0, 10000);
    connectors[1].rotation = TAPER_ROTATION_231;
    grant(0, 5000);
    assert_bound(1, 3060);
}

static void test_each_phase_counts_who_is_wired_to_it(void) {
    static const uint8_t rotation[3] = {TAPER_ROTATION_UNKNOWN, TAPER_ROTATION_213, TAPER_ROTATION_312};
    groups[1].limit_mA = 16000;
    for (uint8_t i = 0; i < 3; i++) {
        connectors[i].rotation = rotation[i];
        assert_bound(i, 16000);
        grant(i, 16000);
    }
    connectors[0].rotation = TAPER_ROTATION_132;
    TEST_ASSERT_TRUE(passes());
    connectors[1].rotation = TAPER_ROTATION_321;
    TEST_ASSERT_FALSE(passes());
    connectors[2].rotation = TAPER_ROTATION_231;
    TEST_ASSERT_TRUE(passes());
}

static void test_three_phases_count_on_each_and_with_single_ones(void) {
    groups[1].limit_mA = 16000;
    connectors[0].phases = 3;
    connectors[0].rotation = TAPER_ROTATION_321;
    grant(0, 6000);
    for (uint8_t rotation = TAPER_ROTATION_123; rotation <= TAPER_ROTATION_312; rotation++) {
        connectors[1].rotation = rotation;
        assert_bound(1, 10000);
    }
}

static void test_phases_that_were_told_count_instead_of_the_described_ones(void) {
    groups[1].limit_mA = 16000;
    grant(0, 16000);
    snapshot.demand[0].booking = (taper_booking_t){.phases = 2, .permille = 1000, .W_per_A = 230};
    assert_bound(1, 16000);
    snapshot.demand[0].booking.phases = 7;
    assert_bound(1, 0);
    snapshot.demand[0].booking.permille = 500;
    assert_bound(1, 8000);
}

static void test_the_currents_of_a_group_count_in_its_parents(void) {
    groups[0].limit_mA = 16000;
    grant(0, 10000);
    assert_bound(4, 6000);
}

static void test_what_other_load_leaves_of_a_phase_bounds_the_site(void) {
    groups[0].limit_mA = 32000;
    supply.phase_mA[0] = 10000;
    assert_bound(0, 10000);
    supply.phase_mA[0] = 40000;
    assert_bound(0, 32000);
    supply.phase_mA[0] = -5;
    assert_bound(0, 0);
    grant(0, 20000);
    supply.phase_mA[0] = TAPER_NO_LIMIT;
    supply.phase_mA[1] = supply.phase_mA[2] = 0;
    TEST_ASSERT_TRUE(passes());
    groups[0].limit_mA = 0; /* the site has no such row */
    supply.phase_mA[0] = 0;
    TEST_ASSERT_TRUE(passes());
    groups[1].limit_mA = 20000; /* and other load is not below the groups */
    TEST_ASSERT_TRUE(passes());
}

static void test_between_two_lines_a_connector_loads_both(void) {
    groups[1].limit_mA = 16000;
    for (int pair = 0; pair < 3; pair++) {
        put_between(0, pair);
        assert_bound(0, 16000);
    }
    put_between(0, 0); /* L1-L2 */
    grant(0, 10000);
    connectors[1].rotation = TAPER_ROTATION_312; /* L3 */
    assert_bound(1, 16000);
    connectors[1].rotation = TAPER_ROTATION_231; /* L2 */
    assert_bound(1, 6000);
    connectors[1].rotation = TAPER_ROTATION_123;
    assert_bound(1, 6000);
}

static void test_two_pairs_that_meet_in_a_line_add_as_phasors(void) {
    groups[1].limit_mA = 17321;
    for (int pair = 0; pair < 3; pair++) {
        put_between(0, pair);
        put_between(1, (pair + 1) % 3);
        grant(0, 10000);
        assert_bound(1, 10000); /* sqrt(3) x 10 A = 17.3205 A */
        grant(0, 7000);
        groups[1].limit_mA = 13000; /* 7, 8 and 13: 49 + 56 + 64 = 169 */
        assert_bound(1, 8000);
        groups[1].limit_mA = 17321;
    }
}

static void test_three_balanced_pairs_load_each_line_with_the_root_of_three(void) {
    groups[1].limit_mA = 17321;
    for (uint8_t i = 0; i < 3; i++) {
        put_between(i, i);
        grant(i, 10000);
    }
    TEST_ASSERT_TRUE(passes());
    groups[1].limit_mA = 17320;
    TEST_ASSERT_FALSE(passes());
}

static void test_a_connector_between_lines_of_unknown_wiring_counts_on_all_of_them(void) {
    groups[1].limit_mA = 16000;
    snapshot.demand[0].booking =
        (taper_booking_t){.phases = 7, .permille = 1000, .W_per_A = 208, .line_to_line = true};
    grant(0, 10000);
    for (uint8_t rotation = TAPER_ROTATION_123; rotation <= TAPER_ROTATION_312; rotation++) {
        connectors[1].rotation = rotation;
        assert_bound(1, 6000);
    }
}

static void test_pairs_that_were_told_count_as_pairs(void) {
    static const uint8_t phases[3] = {3, 6, 5};
    groups[1].limit_mA = 13000;
    for (int pair = 0; pair < 3; pair++) {
        snapshot.demand[0].booking =
            (taper_booking_t){.phases = phases[pair], .permille = 1000, .W_per_A = 208, .line_to_line = true};
        put_between(1, (pair + 1) % 3);
        grant(0, 7000);
        assert_bound(1, 8000);
        snapshot.demand[0].booking.line_to_line = false; /* two phases to neutral */
        assert_bound(1, 6000);
    }
}

static void test_on_the_delta_side_one_pair_counts_twice_in_the_line_across(void) {
    groups[1].delta_mA = 16000;
    for (int pair = 0; pair < 3; pair++) {
        put_between(0, pair);
        assert_bound(0, 8000);
    }
}

static void test_on_the_delta_side_pairs_add_as_phasors(void) {
    groups[1].delta_mA = 30000;
    for (uint8_t i = 0; i < 3; i++) {
        put_between(i, i);
        grant(i, 10000); /* balanced: three times */
    }
    TEST_ASSERT_TRUE(passes());
    groups[1].delta_mA = 29999;
    TEST_ASSERT_FALSE(passes());
    /* Pairs of 3, 5 and 7 A. Line a: 9 + 25 + 196 - 15 + 42 + 70 = 327; b: 25 + 49 + 36 - 35 + 30 + 42 = 147;
       c: 49 + 9 + 100 - 21 + 70 + 30 = 237. The root of 327 is 18.0831. */
    for (uint8_t turn = 0; turn < 3; turn++) {
        for (uint8_t i = 0; i < 3; i++) {
            grant((uint8_t)((i + turn) % 3), 3000 + 2000 * i);
        }
        groups[1].delta_mA = 18084;
        TEST_ASSERT_TRUE(passes());
        groups[1].delta_mA = 18083;
        TEST_ASSERT_FALSE(passes());
    }
}

static void test_on_the_delta_side_a_phase_loads_the_two_lines_of_its_winding(void) {
    groups[1].delta_mA = 16000;
    grant(0, 10000);
    connectors[1].rotation = TAPER_ROTATION_231;
    assert_bound(1, 6000); /* meets it in one line */
    grant(1, 0);
    connectors[0].phases = 3;
    assert_bound(0, 8000);
}

static void test_what_may_be_drawn_already_may_stay_and_not_grow(void) {
    groups[1].limit_mA = 16000;
    may_draw(0, 20000);
    TEST_ASSERT_TRUE(passes());
    grant(0, 20000);
    TEST_ASSERT_TRUE(passes());
    grant(0, 20001);
    TEST_ASSERT_FALSE(passes());
    grant(0, 0);
    grant(1, 1);
    TEST_ASSERT_FALSE(passes());
    connectors[1].rotation = TAPER_ROTATION_231; /* another phase */
    TEST_ASSERT_TRUE(passes());
    grant(1, 0);
    grant(5, 50000); /* another group */
    TEST_ASSERT_TRUE(passes());
}

static void test_decreases_count_when_they_are_proven(void) {
    groups[1].limit_mA = 32000;
    may_draw(0, 20000);
    grant(0, 6000);
    assert_bound(1, 12000);
}

static void test_a_delta_line_that_is_above_its_limit_by_one_pair_gets_no_more_of_another(void) {
    const uint8_t rank[CONNECTORS] = {0, 1, 2, 3, 4, 5};
    const taper_setpoints_t target = {{6000, 0, 0, 6000}};
    for (uint8_t i = 0; i < 3; i++) {
        put_between(i, i);
    }
    groups[1].delta_mA = 30000;
    may_draw(1, 12000);
    may_draw(2, 6100); /* line c: CA + 2 BC are 0.1 A too much, AB + 2 BC are not; all three: 30.05 A */
    taper_ledger_grant(&ledger, &config, &snapshot, rank, &supply, &target, &granted);
    TEST_ASSERT_EQUAL_INT32(0, granted.current_mA[0]);
    TEST_ASSERT_EQUAL_INT32(6000, granted.current_mA[3]); /* another group */
    grant(0, 6000);
    TEST_ASSERT_FALSE(passes());
    groups[1].delta_mA = 30100;
    taper_ledger_grant(&ledger, &config, &snapshot, rank, &supply, &target, &granted);
    TEST_ASSERT_EQUAL_INT32(6000, granted.current_mA[0]);
    TEST_ASSERT_TRUE(passes());
}

static void test_what_is_granted_tilts_no_group_though_others_are_held_back(void) {
    const uint8_t rank[CONNECTORS] = {0, 1, 2, 3, 4, 5};
    const taper_setpoints_t target = {{16000, 16000}};
    connectors[1].rotation = connectors[2].rotation = TAPER_ROTATION_231;
    groups[1].limit_mA = 20000;
    groups[1].imbalance_mA = 10000;
    may_draw(2, 20000); /* leaves the other nothing on its phase */
    taper_ledger_grant(&ledger, &config, &snapshot, rank, &supply, &target, &granted);
    TEST_ASSERT_EQUAL_INT32(10000, granted.current_mA[0]);
    TEST_ASSERT_EQUAL_INT32(0, granted.current_mA[1]);
}

/** Random trees, wirings, ledgers and targets: the guard passes whatever is granted, and knows what is one step too much. */
static void test_the_guard_agrees_with_what_is_granted(void) {
    uint32_t state = 0x9a4d;
    unsigned refused = 0;
    for (int k = 0; k < 20000; k++) {
        const uint8_t rank[CONNECTORS] = {5, 3, 1, 0, 2, 4};
        taper_setpoints_t target;
        setUp();
        for (uint8_t g = 0; g < 3; g++) {
            groups[g].limit_W = (int32_t)(scene_random(&state) % 40000);
            groups[g].limit_mA = (int32_t)(scene_random(&state) % 3 * 30000);
            groups[g].delta_mA = (int32_t)(scene_random(&state) % 3 * 50000);
            supply.phase_mA[g] = (int32_t)(scene_random(&state) % 50000);
        }
        config.line_to_line = true;
        supply.site_W = (int32_t)(scene_random(&state) % 40000);
        for (uint8_t i = 0; i < CONNECTORS; i++) {
            taper_demand_t *demand = &snapshot.demand[i];
            const uint32_t kind = scene_random(&state) % 4;
            connectors[i].rotation = (uint8_t)(scene_random(&state) % 7);
            connectors[i].phases = kind == 0 ? 3 : 1;
            connectors[i].line_to_line = kind == 1;
            connectors[i].is_dc = kind == 2;
            connectors[i].efficiency_permille = (uint16_t)(900 + scene_random(&state) % 101);
            demand->active = scene_random(&state) % 4 != 0;
            demand->W_per_A = (int32_t)(200 + scene_random(&state) % 500);
            demand->min_mA = 6000;
            demand->booking.W_per_A = (int32_t)(scene_random(&state) % 700);
            if (scene_random(&state) % 2 == 0) {
                demand->booking.phases = (uint8_t)(1 + scene_random(&state) % 7);
                demand->booking.permille = 1000;
                demand->booking.line_to_line = kind == 1;
            }
            may_draw(i, (int32_t)(scene_random(&state) % 200) * 100);
            target.current_mA[i] = (int32_t)(60 + scene_random(&state) % 300) * 100;
        }
        taper_ledger_grant(&ledger, &config, &snapshot, rank, &supply, &target, &granted);
        TEST_ASSERT_TRUE(passes());
        granted = target;
        refused += passes() ? 0 : 1;
    }
    TEST_ASSERT_GREATER_THAN_UINT(15000, refused);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_power_is_bounded_by_every_group_and_the_supply);
    RUN_TEST(test_the_power_of_one_ampere_is_as_it_is_booked);
    RUN_TEST(test_a_converter_counts_with_its_losses_on_all_phases);
    RUN_TEST(test_each_phase_counts_who_is_wired_to_it);
    RUN_TEST(test_three_phases_count_on_each_and_with_single_ones);
    RUN_TEST(test_phases_that_were_told_count_instead_of_the_described_ones);
    RUN_TEST(test_the_currents_of_a_group_count_in_its_parents);
    RUN_TEST(test_what_other_load_leaves_of_a_phase_bounds_the_site);
    RUN_TEST(test_between_two_lines_a_connector_loads_both);
    RUN_TEST(test_two_pairs_that_meet_in_a_line_add_as_phasors);
    RUN_TEST(test_three_balanced_pairs_load_each_line_with_the_root_of_three);
    RUN_TEST(test_a_connector_between_lines_of_unknown_wiring_counts_on_all_of_them);
    RUN_TEST(test_pairs_that_were_told_count_as_pairs);
    RUN_TEST(test_on_the_delta_side_one_pair_counts_twice_in_the_line_across);
    RUN_TEST(test_on_the_delta_side_pairs_add_as_phasors);
    RUN_TEST(test_on_the_delta_side_a_phase_loads_the_two_lines_of_its_winding);
    RUN_TEST(test_what_may_be_drawn_already_may_stay_and_not_grow);
    RUN_TEST(test_decreases_count_when_they_are_proven);
    RUN_TEST(test_a_delta_line_that_is_above_its_limit_by_one_pair_gets_no_more_of_another);
    RUN_TEST(test_what_is_granted_tilts_no_group_though_others_are_held_back);
    RUN_TEST(test_the_guard_agrees_with_what_is_granted);
    return UNITY_END();
}
