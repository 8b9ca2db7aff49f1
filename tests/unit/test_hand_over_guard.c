/*
 * The guard of the hand-over, row by row: power and the currents of the phases; that it compares with what may be drawn
 * already; and that it agrees with what is granted.
 */
#include <string.h>

#include "hand_over_bench.h"
#include "scene.h"
#include "unity.h"

void setUp(void) {
    bench_start();
}
void tearDown(void) {}

static void test_power_is_bounded_by_every_group_and_the_supply(void) {
    bench_grant(0, 10000);
    groups[1].limit_W = 4600;
    bench_assert_bound(1, 10000);
    groups[1].limit_W = 0; /* none */
    TEST_ASSERT_TRUE(bench_passes());
    groups[0].limit_W = 6900;
    bench_assert_bound(1, 20000);
    groups[0].limit_W = 1000000;
    supply.site_W = 4600;
    bench_assert_bound(1, 10000);
    bench_grant(1, 0);
    bench_assert_bound(4, 10000);
    bench_grant(4, 10001);
    supply.site_W = -1;
    TEST_ASSERT_FALSE(bench_passes());
    memset(&granted, 0, sizeof granted);
    TEST_ASSERT_TRUE(bench_passes());
}

static void test_the_power_of_one_ampere_is_as_it_is_booked(void) {
    groups[0].limit_W = 6900;
    connectors[0].phases = 3;
    bench_assert_bound(0, 10000);
    connectors[0].voltage_mV = 229001; /* whole volts, rounded up */
    bench_assert_bound(0, 10000);
    snapshot.demand[0].booking.W_per_A = 1000; /* more than by its description */
    bench_assert_bound(0, 6900);
    snapshot.demand[0].active = true;
    snapshot.demand[0].W_per_A = 345;
    bench_assert_bound(0, 6900);
    snapshot.demand[0].booking.W_per_A = 0;
    bench_assert_bound(0, 20000);
    snapshot.demand[0].booking = (taper_booking_t){.phases = 1, .permille = 1000, .W_per_A = 230};
    bench_assert_bound(0, 20000); /* no less than it draws */
}

static void test_a_converter_counts_with_its_losses_on_all_phases(void) {
    connectors[0].is_dc = true;
    connectors[0].voltage_mV = 399001;
    connectors[0].efficiency_permille = 950; /* 421.05 W, rounded up; 422 / 690 of the current, rounded up */
    groups[0].limit_W = 4220;
    bench_assert_bound(0, 10000);
    groups[0].limit_W = 1000000;
    groups[0].limit_mA = 6120;
    bench_assert_bound(0, 10000);
    connectors[1].rotation = TAPER_ROTATION_231;
    bench_grant(0, 5000);
    bench_assert_bound(1, 3060);
}

static void test_a_converter_whose_numbers_are_whole_is_not_rounded(void) {
    connectors[0].is_dc = true;
    connectors[0].voltage_mV = 345000; /* half of 690 V */
    groups[0].limit_W = 3450;
    bench_assert_bound(0, 10000);
    groups[0].limit_W = 1000000;
    groups[0].limit_mA = 5000;
    bench_assert_bound(0, 10000);
}

static void test_each_phase_counts_who_is_wired_to_it(void) {
    static const uint8_t rotation[3] = {TAPER_ROTATION_UNKNOWN, TAPER_ROTATION_213, TAPER_ROTATION_312};
    groups[1].limit_mA = 16000;
    for (uint8_t i = 0; i < 3; i++) {
        connectors[i].rotation = rotation[i];
        bench_assert_bound(i, 16000);
        bench_grant(i, 16000);
    }
    connectors[0].rotation = TAPER_ROTATION_132;
    TEST_ASSERT_TRUE(bench_passes());
    connectors[1].rotation = TAPER_ROTATION_321;
    TEST_ASSERT_FALSE(bench_passes());
    connectors[2].rotation = TAPER_ROTATION_231;
    TEST_ASSERT_TRUE(bench_passes());
}

static void test_a_connector_of_one_phase_is_on_the_one_that_its_rotation_names_first(void) {
    static const uint8_t first[7] = {TAPER_ROTATION_123, TAPER_ROTATION_123, TAPER_ROTATION_231,
                                     TAPER_ROTATION_312, TAPER_ROTATION_123, TAPER_ROTATION_231,
                                     TAPER_ROTATION_312}; /* a wiring that begins with the same line */
    groups[1].limit_mA = 16000;
    bench_grant(0, 10000);
    for (uint8_t rotation = 0; rotation < 7; rotation++) {
        connectors[0].rotation = rotation;
        for (uint8_t line = TAPER_ROTATION_123; line <= TAPER_ROTATION_312; line++) {
            connectors[1].rotation = line;
            bench_assert_bound(1, line == first[rotation] ? 6000 : 16000);
        }
    }
}

static void test_three_phases_count_on_each_and_with_single_ones(void) {
    groups[1].limit_mA = 16000;
    connectors[0].phases = 3;
    connectors[0].rotation = TAPER_ROTATION_321;
    bench_grant(0, 6000);
    for (uint8_t rotation = TAPER_ROTATION_123; rotation <= TAPER_ROTATION_312; rotation++) {
        connectors[1].rotation = rotation;
        bench_assert_bound(1, 10000);
    }
}

static void test_phases_that_were_told_count_instead_of_the_described_ones(void) {
    groups[1].limit_mA = 16000;
    bench_grant(0, 16000);
    snapshot.demand[0].booking = (taper_booking_t){.phases = 2, .permille = 1000, .W_per_A = 230};
    bench_assert_bound(1, 16000);
    snapshot.demand[0].booking.phases = 7;
    bench_assert_bound(1, 0);
    snapshot.demand[0].booking.permille = 500;
    bench_assert_bound(1, 8000);
}

static void test_the_currents_of_a_group_count_in_its_parents(void) {
    groups[0].limit_mA = 16000;
    bench_grant(0, 10000);
    bench_assert_bound(4, 6000);
}

static void test_what_other_load_leaves_of_a_phase_bounds_the_site(void) {
    groups[0].limit_mA = 32000;
    supply.phase_mA[0] = 10000;
    bench_assert_bound(0, 10000);
    supply.phase_mA[0] = 40000;
    bench_assert_bound(0, 32000);
    supply.phase_mA[0] = -5;
    bench_assert_bound(0, 0);
    bench_grant(0, 20000);
    supply.phase_mA[0] = TAPER_NO_LIMIT;
    supply.phase_mA[1] = supply.phase_mA[2] = 0;
    TEST_ASSERT_TRUE(bench_passes());
    groups[0].limit_mA = 0; /* the site has no such row */
    supply.phase_mA[0] = 0;
    TEST_ASSERT_TRUE(bench_passes());
    groups[1].limit_mA = 20000; /* and other load is not below the groups */
    TEST_ASSERT_TRUE(bench_passes());
}

static void test_what_may_be_drawn_already_may_stay_and_not_grow(void) {
    groups[1].limit_mA = 16000;
    bench_may_draw(0, 20000);
    TEST_ASSERT_TRUE(bench_passes());
    bench_grant(0, 20000);
    TEST_ASSERT_TRUE(bench_passes());
    bench_grant(0, 20001);
    TEST_ASSERT_FALSE(bench_passes());
    bench_grant(0, 0);
    bench_grant(1, 1);
    TEST_ASSERT_FALSE(bench_passes());
    connectors[1].rotation = TAPER_ROTATION_231; /* another phase */
    TEST_ASSERT_TRUE(bench_passes());
    bench_grant(1, 0);
    bench_grant(5, 50000); /* another group */
    TEST_ASSERT_TRUE(bench_passes());
}

static void test_decreases_count_when_they_are_proven(void) {
    groups[1].limit_mA = 32000;
    bench_may_draw(0, 20000);
    bench_grant(0, 6000);
    bench_assert_bound(1, 12000);
}

static void test_what_is_granted_tilts_no_group_though_others_are_held_back(void) {
    const uint8_t rank[CONNECTORS] = {0, 1, 2, 3, 4, 5};
    const taper_setpoints_t target = {{16000, 16000}};
    connectors[1].rotation = connectors[2].rotation = TAPER_ROTATION_231;
    groups[1].limit_mA = 20000;
    groups[1].imbalance_mA = 10000;
    bench_may_draw(2, 20000); /* leaves the other nothing on its phase */
    taper_ledger_grant(&ledger, &config, &snapshot, rank, scene_rows(&config, &snapshot, &supply), &target,
                       &granted);
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
        bench_start();
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
            bench_may_draw(i, (int32_t)(scene_random(&state) % 200) * 100);
            target.current_mA[i] = (int32_t)(60 + scene_random(&state) % 300) * 100;
        }
        taper_ledger_grant(&ledger, &config, &snapshot, rank, scene_rows(&config, &snapshot, &supply),
                           &target, &granted);
        TEST_ASSERT_TRUE(bench_passes());
        granted = target;
        refused += bench_passes() ? 0 : 1;
    }
    TEST_ASSERT_GREATER_THAN_UINT(15000, refused);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_power_is_bounded_by_every_group_and_the_supply);
    RUN_TEST(test_the_power_of_one_ampere_is_as_it_is_booked);
    RUN_TEST(test_a_converter_counts_with_its_losses_on_all_phases);
    RUN_TEST(test_a_converter_whose_numbers_are_whole_is_not_rounded);
    RUN_TEST(test_each_phase_counts_who_is_wired_to_it);
    RUN_TEST(test_a_connector_of_one_phase_is_on_the_one_that_its_rotation_names_first);
    RUN_TEST(test_three_phases_count_on_each_and_with_single_ones);
    RUN_TEST(test_phases_that_were_told_count_instead_of_the_described_ones);
    RUN_TEST(test_the_currents_of_a_group_count_in_its_parents);
    RUN_TEST(test_what_other_load_leaves_of_a_phase_bounds_the_site);
    RUN_TEST(test_what_may_be_drawn_already_may_stay_and_not_grow);
    RUN_TEST(test_decreases_count_when_they_are_proven);
    RUN_TEST(test_what_is_granted_tilts_no_group_though_others_are_held_back);
    RUN_TEST(test_the_guard_agrees_with_what_is_granted);
    return UNITY_END();
}
