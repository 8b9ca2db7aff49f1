/* The guard of the hand-over where connectors are between two lines, and on the delta side of a transformer. */
#include "hand_over_bench.h"
#include "scene.h"
#include "unity.h"

void setUp(void) {
    bench_start();
}
void tearDown(void) {}

static void test_a_connector_between_lines_is_on_the_two_that_its_rotation_names_first(void) {
    static const uint8_t third[7] = {TAPER_ROTATION_312, TAPER_ROTATION_312, TAPER_ROTATION_123,
                                     TAPER_ROTATION_231, TAPER_ROTATION_231, TAPER_ROTATION_312,
                                     TAPER_ROTATION_123}; /* a wiring that begins with the other line */
    groups[1].limit_mA = 16000;
    connectors[0].line_to_line = true;
    config.line_to_line = true;
    bench_grant(0, 10000);
    for (uint8_t rotation = 0; rotation < 7; rotation++) {
        connectors[0].rotation = rotation;
        for (uint8_t line = TAPER_ROTATION_123; line <= TAPER_ROTATION_312; line++) {
            connectors[1].rotation = line;
            bench_assert_bound(1, line == third[rotation] ? 16000 : 6000);
        }
    }
}

static void test_between_two_lines_a_connector_loads_both(void) {
    groups[1].limit_mA = 16000;
    for (int pair = 0; pair < 3; pair++) {
        bench_put_between(0, pair);
        bench_assert_bound(0, 16000);
    }
    bench_put_between(0, 0); /* L1-L2 */
    bench_grant(0, 10000);
    connectors[1].rotation = TAPER_ROTATION_312; /* L3 */
    bench_assert_bound(1, 16000);
    connectors[1].rotation = TAPER_ROTATION_231; /* L2 */
    bench_assert_bound(1, 6000);
    connectors[1].rotation = TAPER_ROTATION_123;
    bench_assert_bound(1, 6000);
}

static void test_a_pair_counts_in_the_parents_of_its_group(void) {
    groups[0].limit_mA = 16000;
    for (int pair = 0; pair < 3; pair++) {
        bench_put_between(0, pair);
        bench_assert_bound(0, 16000);
    }
}

static void test_two_pairs_that_meet_in_a_line_add_as_phasors(void) {
    groups[1].limit_mA = 17321;
    for (int pair = 0; pair < 3; pair++) {
        bench_put_between(0, pair);
        bench_put_between(1, (pair + 1) % 3);
        bench_grant(0, 10000);
        bench_assert_bound(1, 10000); /* sqrt(3) x 10 A = 17.3205 A */
        bench_grant(0, 7000);
        groups[1].limit_mA = 13000; /* 7, 8 and 13: 49 + 56 + 64 = 169 */
        bench_assert_bound(1, 8000);
        groups[1].limit_mA = 17321;
    }
}

static void test_three_balanced_pairs_load_each_line_with_the_root_of_three(void) {
    groups[1].limit_mA = 17321;
    for (uint8_t i = 0; i < 3; i++) {
        bench_put_between(i, i);
        bench_grant(i, 10000);
    }
    TEST_ASSERT_TRUE(bench_passes());
    groups[1].limit_mA = 17320;
    TEST_ASSERT_FALSE(bench_passes());
}

static void test_a_connector_between_lines_of_unknown_wiring_counts_on_all_of_them(void) {
    groups[1].limit_mA = 16000;
    snapshot.demand[0].booking =
        (taper_booking_t){.phases = 7, .permille = 1000, .W_per_A = 208, .line_to_line = true};
    bench_grant(0, 10000);
    for (uint8_t rotation = TAPER_ROTATION_123; rotation <= TAPER_ROTATION_312; rotation++) {
        connectors[1].rotation = rotation;
        bench_assert_bound(1, 6000);
    }
}

static void test_pairs_that_were_told_count_as_pairs(void) {
    static const uint8_t phases[3] = {3, 6, 5};
    groups[1].limit_mA = 13000;
    for (int pair = 0; pair < 3; pair++) {
        snapshot.demand[0].booking =
            (taper_booking_t){.phases = phases[pair], .permille = 1000, .W_per_A = 208, .line_to_line = true};
        bench_put_between(1, (pair + 1) % 3);
        bench_grant(0, 7000);
        bench_assert_bound(1, 8000);
        snapshot.demand[0].booking.line_to_line = false; /* two phases to neutral */
        bench_assert_bound(1, 6000);
    }
}

static void test_on_the_delta_side_one_pair_counts_twice_in_the_line_across(void) {
    groups[1].delta_mA = 16000;
    for (int pair = 0; pair < 3; pair++) {
        bench_put_between(0, pair);
        bench_assert_bound(0, 8000);
    }
}

static void test_on_the_delta_side_pairs_add_as_phasors(void) {
    groups[1].delta_mA = 30000;
    for (uint8_t i = 0; i < 3; i++) {
        bench_put_between(i, i);
        bench_grant(i, 10000); /* balanced: three times */
    }
    TEST_ASSERT_TRUE(bench_passes());
    groups[1].delta_mA = 29999;
    TEST_ASSERT_FALSE(bench_passes());
    /* Pairs of 3, 5 and 7 A. Line a: 9 + 25 + 196 - 15 + 42 + 70 = 327; b: 25 + 49 + 36 - 35 + 30 + 42 = 147;
       c: 49 + 9 + 100 - 21 + 70 + 30 = 237. The root of 327 is 18.0831. */
    for (uint8_t turn = 0; turn < 3; turn++) {
        for (uint8_t i = 0; i < 3; i++) {
            bench_grant((uint8_t)((i + turn) % 3), 3000 + 2000 * i);
        }
        groups[1].delta_mA = 18084;
        TEST_ASSERT_TRUE(bench_passes());
        groups[1].delta_mA = 18083;
        TEST_ASSERT_FALSE(bench_passes());
    }
}

static void test_on_the_delta_side_three_phases_alike_count_as_in_the_rows(void) {
    connectors[0].phases = 3;
    groups[1].delta_mA = 17330; /* sqrt(3) x 10 A, rounded up */
    bench_assert_bound(0, 10000);
}

static void test_on_the_delta_side_a_phase_loads_the_two_lines_of_its_winding(void) {
    groups[1].delta_mA = 16000;
    bench_grant(0, 10000);
    connectors[1].rotation = TAPER_ROTATION_231;
    bench_assert_bound(1, 8185); /* meets it in one line, 60 degrees apart */
    groups[1].delta_mA = 10291;
    bench_assert_bound(1, 396); /* of 397 mA it is 1 uA too much */
    groups[1].delta_mA = 16000;
    bench_grant(1, 0);
    connectors[0].phases = 3;
    bench_assert_bound(0, 9232);
}

static void test_a_delta_line_that_is_above_its_limit_by_one_pair_gets_no_more_of_another(void) {
    const uint8_t rank[CONNECTORS] = {0, 1, 2, 3, 4, 5};
    const taper_setpoints_t target = {{6000, 0, 0, 6000, 6000}};
    for (uint8_t i = 0; i < 3; i++) {
        bench_put_between(i, i);
    }
    connectors[3].group = 1; /* from line 1 to neutral: that is not on line c */
    groups[1].delta_mA = 30000;
    bench_may_draw(1, 12000);
    bench_may_draw(2, 6100); /* line c: CA + 2 BC are 0.1 A too much, AB + 2 BC are not; all three: 30.05 A */
    taper_ledger_grant(&ledger, &config, &snapshot, rank, scene_rows(&config, &snapshot, &supply), &target,
                       &granted);
    TEST_ASSERT_EQUAL_INT32(0, granted.current_mA[0]);
    TEST_ASSERT_EQUAL_INT32(5800, granted.current_mA[3]); /* line a: BC + 2 CA are 24.2 A */
    TEST_ASSERT_EQUAL_INT32(6000, granted.current_mA[4]); /* another group */
    bench_grant(0, 6000);
    bench_grant(3, 0);
    TEST_ASSERT_FALSE(bench_passes());
    groups[1].delta_mA = 30100;
    taper_ledger_grant(&ledger, &config, &snapshot, rank, scene_rows(&config, &snapshot, &supply), &target,
                       &granted);
    TEST_ASSERT_EQUAL_INT32(6000, granted.current_mA[0]);
    TEST_ASSERT_TRUE(bench_passes());
}

static void test_that_holds_for_each_line_of_each_group(void) {
    const uint8_t rank[CONNECTORS] = {0, 1, 2, 3, 4, 5};
    const taper_setpoints_t target = {{6000, 0, 0, 0, 6000}};
    for (uint8_t group = 0; group < 2; group++) {
        for (int turn = 0; turn < 3; turn++) {
            bench_start();
            for (uint8_t i = 0; i < 3; i++) {
                bench_put_between(i, (i + turn) % 3);
            }
            connectors[4].is_dc = group == 0; /* on all lines: below this one, too */
            groups[group].delta_mA = 30000;
            bench_may_draw(1, 12000);
            bench_may_draw(2, 6100);
            taper_ledger_grant(&ledger, &config, &snapshot, rank, scene_rows(&config, &snapshot, &supply),
                               &target, &granted);
            TEST_ASSERT_EQUAL_INT32(0, granted.current_mA[0]);
            TEST_ASSERT_EQUAL_INT32(group == 0 ? 0 : 6000, granted.current_mA[4]);
        }
    }
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_a_connector_between_lines_is_on_the_two_that_its_rotation_names_first);
    RUN_TEST(test_between_two_lines_a_connector_loads_both);
    RUN_TEST(test_a_pair_counts_in_the_parents_of_its_group);
    RUN_TEST(test_two_pairs_that_meet_in_a_line_add_as_phasors);
    RUN_TEST(test_three_balanced_pairs_load_each_line_with_the_root_of_three);
    RUN_TEST(test_a_connector_between_lines_of_unknown_wiring_counts_on_all_of_them);
    RUN_TEST(test_pairs_that_were_told_count_as_pairs);
    RUN_TEST(test_on_the_delta_side_one_pair_counts_twice_in_the_line_across);
    RUN_TEST(test_on_the_delta_side_pairs_add_as_phasors);
    RUN_TEST(test_on_the_delta_side_three_phases_alike_count_as_in_the_rows);
    RUN_TEST(test_on_the_delta_side_a_phase_loads_the_two_lines_of_its_winding);
    RUN_TEST(test_a_delta_line_that_is_above_its_limit_by_one_pair_gets_no_more_of_another);
    RUN_TEST(test_that_holds_for_each_line_of_each_group);
    return UNITY_END();
}
