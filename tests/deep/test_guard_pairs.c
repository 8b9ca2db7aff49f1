/* The guard, where currents flow between lines: sums of phasors, a transformer's delta side, and great numbers. */
#include <string.h>

#include "tree.h"
#include "unity.h"

static tree_t tree;

void setUp(void) {
    tree_init(&tree);
}
void tearDown(void) {}

static void give(uint8_t i, int32_t current_mA) {
    tree.setpoints.current_mA[i] = current_mA;
}

/** The three pairs, each after the other: currents of the one from `line` on, of the next, and of the one before. */
static void give_pairs(unsigned line, int32_t x_mA, int32_t next_mA, int32_t before_mA) {
    static const uint8_t pairs[] = {L1 | L2, L2 | L3, L3 | L1};
    tree_init(&tree);
    memset(&tree.setpoints, 0, sizeof tree.setpoints);
    for (unsigned k = 0; k < 3; k++) {
        tree_add_pair(&tree, 0, pairs[(line + k) % 3]);
    }
    give(0, x_mA);
    give(1, next_mA);
    give(2, before_mA);
}

static void test_currents_of_two_pairs_add_as_phasors(void) {
    for (unsigned line = 0; line < 3; line++) {
        tree_init(&tree);
        give_pairs(line, 10000, 0, 0);
        tree_assert_just_enough(&tree, &tree.group[0].limit_mA, 10000);
        give_pairs(line, 10000, 0, 10000);
        tree_assert_just_enough(&tree, &tree.group[0].limit_mA, 17321); /* 10 A x sqrt(3) = 17.3205 A */
        give_pairs(line, 20000, 0, 10000);
        tree_assert_just_enough(&tree, &tree.group[0].limit_mA,
                                26458); /* sqrt(400 + 200 + 100) = 26.4575 A */
        give_pairs(line, 10000, 0, 20000);
        tree_assert_just_enough(&tree, &tree.group[0].limit_mA, 26458);
    }
}

static void test_pairs_of_a_group_count_in_those_above_it(void) {
    give_pairs(0, 20000, 0, 10000);
    const uint8_t leaf = tree_add_group(&tree, 0);
    for (uint8_t i = 0; i < 3; i++) {
        tree.connector[i].group = leaf;
    }
    tree_assert_just_enough(&tree, &tree.group[leaf].limit_mA, 26458);
    tree_add_pair(&tree, 0, L1 | L2);
    give(3, 10000);
    tree_assert_just_enough(&tree, &tree.group[0].limit_mA,
                            36056); /* 30 A and 10 A: sqrt(1300) = 36.0555 A */
    give(3, 0);
    tree_assert_just_enough(&tree, &tree.group[0].limit_mA, 26458);
}

static void test_other_currents_on_a_line_add_to_the_pairs_in_full(void) {
    give_pairs(0, 20000, 0, 10000);
    tree_add(&tree, 0, L1);
    give(3, 6000);
    tree_assert_just_enough(&tree, &tree.group[0].limit_mA, 32458);
    give(0, 0);
    give(2, 0);
    tree_assert_just_enough(&tree, &tree.group[0].limit_mA, 6000);
}

static void test_a_line_that_is_full_of_other_currents_has_no_room_for_a_pair(void) {
    give_pairs(0, 6000, 0, 0);
    tree_add(&tree, 0, L1);
    tree_add(&tree, 0, L2);
    give(3, 32000);
    tree.group[0].limit_mA = 25000; /* 7 A less than nothing: its square is no room */
    TEST_ASSERT_FALSE(tree_guard(&tree));
    give(3, 25000);
    TEST_ASSERT_FALSE(tree_guard(&tree));
    give(0, 0);
    TEST_ASSERT_TRUE(tree_guard(&tree));
}

static void test_a_pair_on_lines_that_are_not_known_counts_on_all_in_full(void) {
    give_pairs(0, 10000, 0, 10000);
    tree.snapshot.demand[0].booking.phases = 7;
    tree_assert_just_enough(&tree, &tree.group[0].limit_mA, 20000);
}

static void test_a_delta_side_carries_differences_of_pairs(void) {
    for (unsigned line = 0; line < 3; line++) {
        give_pairs(line, 10000, 0, 0);
        tree_assert_just_enough(&tree, &tree.group[0].delta_mA, 20000); /* 1 : 2 : 1 */
        tree.group[0].delta_mA = 9999;
        TEST_ASSERT_FALSE(tree_guard(&tree));
        give_pairs(line, 10000, 10000, 10000);
        tree_assert_just_enough(&tree, &tree.group[0].delta_mA, 30000);
        give_pairs(line, 20000, 10000, 0);
        tree_assert_just_enough(&tree, &tree.group[0].delta_mA,
                                45826); /* sqrt(10^2 + 2 x 20 x 10 + 4 x 20^2) = 45.8258 A */
        give_pairs(line, 10000, 20000, 0);
        tree_assert_just_enough(&tree, &tree.group[0].delta_mA,
                                45826); /* sqrt(10^2 + 2 x 20 x 10 + 4 x 20^2), another line */
        give_pairs(line, 24000, 20000, 10000);
        tree_assert_just_enough(&tree, &tree.group[0].delta_mA,
                                63593); /* CA 24, AB 10, BC 20: sqrt(300 + 1440 + 2304) */
    }
}

static void test_what_flows_to_neutral_is_in_two_lines_of_a_delta_side(void) {
    static const uint8_t lines[] = {L1, L2, L3};
    for (unsigned k = 0; k < 3; k++) {
        tree_init(&tree);
        memset(&tree.setpoints, 0, sizeof tree.setpoints);
        tree_add(&tree, 0, lines[k]);
        give(0, 10000);
        tree_assert_just_enough(&tree, &tree.group[0].delta_mA, 10000);
        tree_add(&tree, 0, lines[(k + 1) % 3]); /* they share a winding's line */
        give(1, 8000);
        tree_assert_just_enough(&tree, &tree.group[0].delta_mA, 15864); /* 10 A and 0.733 times 8 A */
    }
    tree_init(&tree);
    memset(&tree.setpoints, 0, sizeof tree.setpoints);
    tree_add(&tree, 0, L1 | L2 | L3);
    give(0, 10000);
    tree_assert_just_enough(&tree, &tree.group[0].delta_mA, 17330); /* sqrt(3) of a phase */
}

static void test_a_pair_counts_for_imbalance_on_both_of_its_lines(void) {
    for (unsigned line = 0; line < 3; line++) {
        give_pairs(line, 10000, 0, 0);
        tree_assert_just_enough(&tree, &tree.group[0].imbalance_mA, 10000);
        give_pairs(line, 10000, 8000, 0);
        tree_assert_just_enough(&tree, &tree.group[0].imbalance_mA, 10000); /* 10, 18, 8 */
        give_pairs(line, 10000, 8000, 7000);
        tree_assert_just_enough(&tree, &tree.group[0].imbalance_mA, 3000); /* 17, 18, 15 */
    }
}

static void test_no_limit_lets_100_kA_pass(void) {
    give_pairs(0, 32000, 0, 0);
    tree.group[0].limit_mA = INT32_MAX;
    tree.snapshot.demand[0].booking.permille = 3124000; /* 99.968 kA */
    TEST_ASSERT_TRUE(tree_guard(&tree));
    tree.snapshot.demand[0].booking.permille = 3125000;
    TEST_ASSERT_FALSE(tree_guard(&tree));
    tree.snapshot.demand[0].booking.permille = INT32_MAX;
    TEST_ASSERT_FALSE(tree_guard(&tree));
    tree.group[0].limit_mA = 100500000;
    TEST_ASSERT_FALSE(tree_guard(&tree));
    tree.group[0].limit_mA = 100000000;
    TEST_ASSERT_FALSE(tree_guard(&tree));
    tree.snapshot.demand[0].booking.permille = 3124000;
    TEST_ASSERT_TRUE(tree_guard(&tree));
    tree.group[0].limit_mA = 0;
    tree.group[0].delta_mA = INT32_MAX;
    TEST_ASSERT_FALSE(tree_guard(&tree)); /* twice that */
}

static void test_limits_beyond_all_currents_pass(void) {
    give_pairs(0, 32000, 32000, 32000);
    tree.group[0].limit_mA = INT32_MAX;
    tree.group[0].delta_mA = INT32_MAX;
    tree.group[0].imbalance_mA = INT32_MAX;
    TEST_ASSERT_TRUE(tree_guard(&tree));
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_currents_of_two_pairs_add_as_phasors);
    RUN_TEST(test_pairs_of_a_group_count_in_those_above_it);
    RUN_TEST(test_other_currents_on_a_line_add_to_the_pairs_in_full);
    RUN_TEST(test_a_line_that_is_full_of_other_currents_has_no_room_for_a_pair);
    RUN_TEST(test_a_pair_on_lines_that_are_not_known_counts_on_all_in_full);
    RUN_TEST(test_a_delta_side_carries_differences_of_pairs);
    RUN_TEST(test_what_flows_to_neutral_is_in_two_lines_of_a_delta_side);
    RUN_TEST(test_a_pair_counts_for_imbalance_on_both_of_its_lines);
    RUN_TEST(test_no_limit_lets_100_kA_pass);
    RUN_TEST(test_limits_beyond_all_currents_pass);
    return UNITY_END();
}
