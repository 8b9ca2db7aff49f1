/* Imbalance: what is cut, by how much, and in which order. */
#include <string.h>

#include "tree.h"
#include "unity.h"

static tree_t tree;
static uint8_t rank[TAPER_MAX_CONNECTORS];

void setUp(void) {
    tree_init(&tree);
    memset(&tree.setpoints, 0, sizeof tree.setpoints);
    for (uint8_t i = 0; i < TAPER_MAX_CONNECTORS; i++) {
        rank[i] = i;
    }
}
void tearDown(void) {}

static uint8_t add(uint8_t group, uint8_t lines, int32_t current_mA) {
    const bool pair = lines == (L1 | L2) || lines == (L2 | L3) || lines == (L3 | L1);
    const uint8_t i = pair ? tree_add_pair(&tree, group, lines) : tree_add(&tree, group, lines);
    tree.setpoints.current_mA[i] = current_mA;
    return i;
}

static void balance(void) {
    taper_balance(&tree.config, &tree.snapshot, tree_rows(&tree), rank, &tree.setpoints);
    TEST_ASSERT_TRUE(tree_guard(&tree));
}

static void assert_currents(int32_t first_mA, int32_t second_mA, int32_t third_mA) {
    TEST_ASSERT_EQUAL_INT32(first_mA, tree.setpoints.current_mA[0]);
    TEST_ASSERT_EQUAL_INT32(second_mA, tree.setpoints.current_mA[1]);
    TEST_ASSERT_EQUAL_INT32(third_mA, tree.setpoints.current_mA[2]);
}

static void test_without_a_limit_nothing_is_cut(void) {
    add(0, L1, 32000);
    balance();
    TEST_ASSERT_EQUAL_INT32(32000, tree.setpoints.current_mA[0]);
}

static void test_what_is_within_the_limit_is_left_alone(void) {
    add(0, L1, 20000);
    add(0, L2, 12000);
    add(0, L3, 10000);
    tree.group[0].imbalance_mA = 10000;
    balance();
    assert_currents(20000, 12000, 10000);
}

static void test_a_strong_phase_is_lowered_to_the_limit_and_no_further(void) {
    static const uint8_t lines[] = {L1, L2, L3};
    for (unsigned strong = 0; strong < 3; strong++) {
        for (unsigned weak = 1; weak < 3; weak++) {
            setUp();
            add(0, lines[strong], 32000);
            add(0, lines[(strong + weak) % 3], 8000);
            add(0, lines[(strong + 3 - weak) % 3], 10000);
            tree.group[0].imbalance_mA = 10000;
            balance();
            assert_currents(18000, 8000, 10000);
        }
    }
}

static void test_a_cut_is_a_whole_number_of_steps(void) {
    add(0, L1, 32000);
    tree.group[0].imbalance_mA = 9901;
    balance();
    TEST_ASSERT_EQUAL_INT32(9900, tree.setpoints.current_mA[0]);
    tree.setpoints.current_mA[0] = 32000;
    tree.group[0].imbalance_mA = 9999;
    balance();
    TEST_ASSERT_EQUAL_INT32(9900, tree.setpoints.current_mA[0]);
    tree.setpoints.current_mA[0] = 32000;
    tree.group[0].imbalance_mA = 10000;
    balance();
    TEST_ASSERT_EQUAL_INT32(10000, tree.setpoints.current_mA[0]);
}

static void test_two_strong_phases_are_both_lowered(void) {
    add(0, L1, 32000);
    add(0, L2, 25000);
    add(0, L3, 8000);
    tree.group[0].imbalance_mA = 10000;
    balance();
    assert_currents(18000, 18000, 8000);
}

static void test_the_last_in_rank_is_cut_first_and_all_down_to_their_minimum_before_any_is_off(void) {
    add(0, L1, 16000);
    add(0, L1, 16000);
    add(0, L1, 16000);
    const uint8_t order[] = {2, 0, 1};
    memcpy(rank, order, sizeof order);
    tree.group[0].imbalance_mA = 40000;
    balance();
    assert_currents(16000, 8000, 16000);
    tree.group[0].imbalance_mA = 30000;
    balance();
    assert_currents(8000, 6000, 16000);
    tree.group[0].imbalance_mA = 18000;
    balance();
    assert_currents(6000, 6000, 6000);
    tree.group[0].imbalance_mA = 17900;
    balance();
    assert_currents(6000, 0, 6000);
    tree.group[0].imbalance_mA = 11900;
    balance();
    assert_currents(0, 0, 6000);
    tree.group[0].imbalance_mA = 5900;
    balance();
    assert_currents(0, 0, 0);
}

static void test_a_minimum_that_is_no_whole_step_is_rounded_up(void) {
    add(0, L1, 16000);
    tree.snapshot.demand[0].min_mA = 6001;
    tree.group[0].imbalance_mA = 6100;
    balance();
    TEST_ASSERT_EQUAL_INT32(6100, tree.setpoints.current_mA[0]);
    tree.group[0].imbalance_mA = 6099;
    balance();
    TEST_ASSERT_EQUAL_INT32(0, tree.setpoints.current_mA[0]);
}

static void test_without_a_minimum_currents_go_down_to_nothing(void) {
    add(0, L1, 16000);
    add(0, L1, 16000);
    tree.snapshot.demand[1].min_mA = 0;
    tree.group[0].imbalance_mA = 16300;
    balance();
    TEST_ASSERT_EQUAL_INT32(16000, tree.setpoints.current_mA[0]);
    TEST_ASSERT_EQUAL_INT32(300, tree.setpoints.current_mA[1]);
    tree.group[0].imbalance_mA = 15000;
    balance();
    TEST_ASSERT_EQUAL_INT32(15000, tree.setpoints.current_mA[0]);
    TEST_ASSERT_EQUAL_INT32(0, tree.setpoints.current_mA[1]);
}

static void test_one_phase_is_cut_before_two(void) {
    add(0, L1, 16000);
    add(0, L1 | L2, 16000); /* 32, 16, 0 */
    tree.group[0].imbalance_mA = 25000;
    balance();
    assert_currents(9000, 16000, 0);
    tree.group[0].imbalance_mA = 21000;
    balance();
    assert_currents(6000, 15000, 0);
    tree.group[0].imbalance_mA = 11000;
    balance();
    assert_currents(0, 6000, 0);
}

static void test_a_pair_that_is_on_the_weak_phase_too_is_no_help(void) {
    add(0, L1, 32000);
    add(0, L1 | L3, 16000);
    add(0, L2, 20000); /* 48, 20, 16 */
    tree.group[0].imbalance_mA = 10000;
    balance();
    assert_currents(10000, 16000, 20000); /* 26, 20, 16 */
}

static void test_who_is_on_the_weak_phase_too_stays_where_others_go_off(void) {
    add(0, L1, 16000);
    add(0, L1 | L3, 16000);
    add(0, L2, 20000); /* 32, 20, 16 */
    tree.group[0].imbalance_mA = 4000;
    balance();
    assert_currents(0, 16000, 20000);
}

static void test_of_phases_alike_the_first_is_the_strongest(void) {
    add(0, L1 | L2, 16000);
    add(0, L1, 10000);
    add(0, L2, 10000); /* 26, 26, 0 */
    tree.snapshot.demand[2].min_mA = 0;
    tree.group[0].imbalance_mA = 20000;
    balance(); /* L1 first: what its pair loses, the other on L2 keeps */
    assert_currents(14000, 6000, 6000);
}

static void test_of_phases_alike_the_first_is_the_weakest(void) {
    add(0, L1 | L2, 16000);
    add(0, L1, 10000);
    add(0, L3, 16000); /* 26, 16, 16 */
    tree.snapshot.demand[1].min_mA = 10000;
    tree.group[0].imbalance_mA = 6000;
    balance();
    assert_currents(16000, 0, 16000);
}

static void test_a_group_within_a_group_is_lowered_and_not_switched_off(void) {
    const uint8_t leaf = tree_add_group(&tree, 0);
    add(leaf, L1, 32000);
    add(0, L2, 16000);
    tree.group[leaf].imbalance_mA = 20000;
    tree.group[0].imbalance_mA = 10000;
    balance();
    assert_currents(10000, 10000, 0);
}

/** A feeder whose phases are to be alike, and a site that cuts one by a step: three rounds for each step, and a last one. */
static void pass_to_and_fro(unsigned idle) {
    setUp();
    const uint8_t leaf = tree_add_group(&tree, 0);
    add(0, L2, 10000);
    add(leaf, L1, 6300);
    add(leaf, L2, 6300);
    add(leaf, L3, 6300);
    add(0, L3, 6000);
    for (unsigned k = 0; k < idle; k++) {
        add(0, L1, 0);
    }
    tree.group[leaf].imbalance_mA = 1;
    tree.group[0].imbalance_mA = 9900;
    balance();
}

static void test_small_cuts_passed_to_and_fro_end_in_switching_off(void) {
    pass_to_and_fro(1);
    assert_currents(9900, 6000, 6000);
    pass_to_and_fro(0);
    assert_currents(0, 0, 0);
    TEST_ASSERT_EQUAL_INT32(0, tree.setpoints.current_mA[3]);
}

static void test_three_phases_are_never_cut(void) {
    add(0, L1 | L2 | L3, 32000);
    add(0, L2, 32000);
    tree.group[0].imbalance_mA = 8000;
    balance();
    TEST_ASSERT_EQUAL_INT32(32000, tree.setpoints.current_mA[0]);
    TEST_ASSERT_EQUAL_INT32(8000, tree.setpoints.current_mA[1]);
    tree.group[0].imbalance_mA = 5000; /* not even where another has to go off for it */
    balance();
    TEST_ASSERT_EQUAL_INT32(32000, tree.setpoints.current_mA[0]);
    TEST_ASSERT_EQUAL_INT32(0, tree.setpoints.current_mA[1]);
}

static void test_each_group_is_balanced_by_its_own_connectors(void) {
    const uint8_t left = tree_add_group(&tree, 0);
    const uint8_t right = tree_add_group(&tree, 0);
    add(left, L1, 32000);
    add(right, L1, 32000);
    add(right, L2, 30000);
    tree.group[left].imbalance_mA = 12000;
    tree.group[right].imbalance_mA = 30000;
    balance();
    assert_currents(12000, 30000, 30000);
    tree.group[0].imbalance_mA = 20000; /* 42, 30, 0: the last on the strong phase first */
    balance();
    assert_currents(12000, 8000, 20000);
}

static void test_what_balances_the_site_may_tilt_a_feeder_and_both_hold_in_the_end(void) {
    const uint8_t leaf = tree_add_group(&tree, 0);
    add(leaf, L1, 20000);
    add(leaf, L2, 20000);
    add(0, L1, 20000);
    tree.group[leaf].imbalance_mA = 7000;
    tree.group[0].imbalance_mA = 7000;
    const uint8_t order[] = {2, 1, 0};
    memcpy(rank, order, sizeof order);
    balance(); /* L3 has nothing: no phase may have more than 7 A, which is one minimum */
    assert_currents(0, 7000, 6000);
}

static void test_a_rank_that_names_nobody_or_one_twice_still_cuts(void) {
    add(0, L1, 16000);
    add(0, L1, 16000);
    add(0, L1, 16000);
    const uint8_t order[] = {1, 1, 200};
    memcpy(rank, order, sizeof order);
    tree.group[0].imbalance_mA = 38000; /* the last one that is not named first, then the other */
    balance();
    assert_currents(16000, 16000, 6000);
    tree.group[0].imbalance_mA = 30000;
    balance();
    assert_currents(8000, 16000, 6000);
    rank[0] = 3; /* just no connector */
    tree.group[0].imbalance_mA = 20000;
    balance();
    assert_currents(6000, 8000, 6000);
}

/** Connector `i` is on these lines by older setpoints alone. */
static void only_older_setpoints_are_on(uint8_t i, uint8_t lines) {
    tree.snapshot.demand[i].booking.idle = lines;
    tree.snapshot.demand[i].booking.unsure = lines;
}

static void test_a_setpoint_does_not_balance_phases_that_only_older_ones_are_on(void) {
    add(0, L1, 15000);
    add(0, L2, 16000);
    add(0, L1 | L2 | L3, 18000); /* on L2 by now: 15, 34, 0 */
    only_older_setpoints_are_on(2, L1 | L3);
    tree.group[0].imbalance_mA = 20000;
    TEST_ASSERT_FALSE(tree_guard(&tree));
    balance();
    assert_currents(15000, 14000, 6000);
}

static void test_phases_that_only_older_setpoints_are_on_are_not_the_strong_ones(void) {
    add(0, L1, 15000);
    add(0, L2, 2000);
    add(0, L1 | L2 | L3, 18000); /* on L2 by now: 15, 20, 0 */
    only_older_setpoints_are_on(2, L1 | L3);
    tree.snapshot.demand[1].min_mA = 0;
    tree_assert_just_enough(&tree, &tree.group[0].imbalance_mA, 20000);
    balance();
    assert_currents(15000, 2000, 18000);
}

static void test_a_current_on_a_phase_that_nobody_knows_counts_on_each_and_balances_none(void) {
    static const uint8_t lines[] = {L1, L2, L3};
    for (unsigned known = 0; known < 3; known++) {
        setUp();
        add(0, lines[known], 8000);
        add(0, L1 | L2 | L3, 16000);
        tree.snapshot.demand[1].booking.unsure = L1 | L2 | L3;
        tree_assert_just_enough(&tree, &tree.group[0].imbalance_mA, 24000);
        tree.group[0].imbalance_mA = 15000;
        balance();
        assert_currents(8000, 7000, 0);
    }
}

static void test_a_current_on_one_of_two_phases_is_held_against_the_other(void) {
    add(0, L1, 20000);
    add(0, L2, 20000);
    add(0, L1 | L2, 16000);
    tree.snapshot.demand[2].booking.line_to_line = false;
    tree.snapshot.demand[2].booking.unsure = L1 | L2;
    add(0, L3, 20000); /* 36 or 20, 20 or 36, 20 */
    tree_assert_just_enough(&tree, &tree.group[0].imbalance_mA, 16000);
    tree.group[0].imbalance_mA = 10000;
    balance();
    TEST_ASSERT_EQUAL_INT32(10000, tree.setpoints.current_mA[2]);
}

static void test_what_carries_nothing_is_no_help(void) {
    add(0, L1, 16000);
    add(0, L1, 16000);
    tree.snapshot.demand[1].booking.permille = 0;
    tree.group[0].imbalance_mA = 10000;
    balance();
    TEST_ASSERT_EQUAL_INT32(10000, tree.setpoints.current_mA[0]);
    TEST_ASSERT_EQUAL_INT32(16000, tree.setpoints.current_mA[1]);
}

static void test_a_cut_counts_by_what_flows_for_an_ampere(void) {
    add(0, L1, 20000);
    tree.snapshot.demand[0].booking.permille = 500;
    tree.group[0].imbalance_mA = 8020;
    balance();
    TEST_ASSERT_EQUAL_INT32(16000, tree.setpoints.current_mA[0]);
}

static void test_of_a_rank_no_more_is_read_than_there_are_connectors(void) {
    add(0, L1, 16000);
    add(0, L1, 16000);
    add(0, L1, 16000);
    const uint8_t order[] = {1, 1, 1, 2};
    memcpy(rank, order, sizeof order);
    tree.group[0].imbalance_mA = 38000;
    balance();
    assert_currents(16000, 16000, 6000); /* 0 and 2 are not named: the last one first */
}

static void test_a_group_just_at_its_limit_does_not_hide_those_above(void) {
    const uint8_t leaf = tree_add_group(&tree, 0);
    add(leaf, L1, 10000);
    add(0, L1, 20000);
    tree.group[leaf].imbalance_mA = 10000;
    tree.group[0].imbalance_mA = 25000;
    balance();
    TEST_ASSERT_EQUAL_INT32(10000, tree.setpoints.current_mA[0]);
    TEST_ASSERT_EQUAL_INT32(15000, tree.setpoints.current_mA[1]);
}

static void test_the_least_current_and_the_least_excess_are_cut(void) {
    add(0, L1, 1);
    tree.snapshot.demand[0].min_mA = 0;
    tree.snapshot.demand[0].booking.permille = 1001;
    tree.group[0].imbalance_mA = 1; /* 1 uA less than it has */
    balance();
    TEST_ASSERT_EQUAL_INT32(0, tree.setpoints.current_mA[0]);
    tree.setpoints.current_mA[0] = 32000;
    tree.snapshot.demand[0].booking.permille = 1;
    tree.group[0].imbalance_mA = 10;
    balance();
    TEST_ASSERT_EQUAL_INT32(10000, tree.setpoints.current_mA[0]);
}

/** Small cuts that groups within groups pass to and fro come to an end. */
static void test_it_ends_in_a_deep_tree_whatever_is_asked(void) {
    static const uint8_t lines[] = {L1, L2, L3, L1 | L2, L2 | L3, L3 | L1, L1 | L2 | L3};
    uint32_t state = 0x5ee2;
    for (unsigned round = 0; round < 3000; round++) {
        setUp();
        const unsigned groups = tree_random(&state, TAPER_MAX_GROUPS);
        for (unsigned k = 0; k < groups; k++) {
            tree_add_group(&tree, (uint8_t)tree_random(&state, tree.config.group_count));
        }
        for (unsigned k = 0; k < tree.config.group_count; k++) {
            tree.group[k].imbalance_mA = (int32_t)tree_random(&state, 4) * (int32_t)tree_random(&state, 9000);
        }
        const unsigned connectors = 1 + tree_random(&state, TAPER_MAX_CONNECTORS);
        taper_setpoints_t before;
        for (unsigned i = 0; i < connectors; i++) {
            const uint8_t group = (uint8_t)tree_random(&state, tree.config.group_count);
            add(group, lines[tree_random(&state, 7)], 6000 + 100 * (int32_t)tree_random(&state, 261));
            rank[i] = (uint8_t)tree_random(&state, connectors + 1);
        }
        before = tree.setpoints;
        balance();
        for (unsigned i = 0; i < connectors; i++) {
            TEST_ASSERT_TRUE(tree.setpoints.current_mA[i] <= before.current_mA[i]);
        }
    }
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_without_a_limit_nothing_is_cut);
    RUN_TEST(test_what_is_within_the_limit_is_left_alone);
    RUN_TEST(test_a_strong_phase_is_lowered_to_the_limit_and_no_further);
    RUN_TEST(test_a_cut_is_a_whole_number_of_steps);
    RUN_TEST(test_two_strong_phases_are_both_lowered);
    RUN_TEST(test_the_last_in_rank_is_cut_first_and_all_down_to_their_minimum_before_any_is_off);
    RUN_TEST(test_a_minimum_that_is_no_whole_step_is_rounded_up);
    RUN_TEST(test_without_a_minimum_currents_go_down_to_nothing);
    RUN_TEST(test_one_phase_is_cut_before_two);
    RUN_TEST(test_a_pair_that_is_on_the_weak_phase_too_is_no_help);
    RUN_TEST(test_who_is_on_the_weak_phase_too_stays_where_others_go_off);
    RUN_TEST(test_of_phases_alike_the_first_is_the_strongest);
    RUN_TEST(test_of_phases_alike_the_first_is_the_weakest);
    RUN_TEST(test_a_group_within_a_group_is_lowered_and_not_switched_off);
    RUN_TEST(test_small_cuts_passed_to_and_fro_end_in_switching_off);
    RUN_TEST(test_three_phases_are_never_cut);
    RUN_TEST(test_each_group_is_balanced_by_its_own_connectors);
    RUN_TEST(test_what_balances_the_site_may_tilt_a_feeder_and_both_hold_in_the_end);
    RUN_TEST(test_a_rank_that_names_nobody_or_one_twice_still_cuts);
    RUN_TEST(test_a_setpoint_does_not_balance_phases_that_only_older_ones_are_on);
    RUN_TEST(test_phases_that_only_older_setpoints_are_on_are_not_the_strong_ones);
    RUN_TEST(test_a_current_on_a_phase_that_nobody_knows_counts_on_each_and_balances_none);
    RUN_TEST(test_a_current_on_one_of_two_phases_is_held_against_the_other);
    RUN_TEST(test_what_carries_nothing_is_no_help);
    RUN_TEST(test_a_cut_counts_by_what_flows_for_an_ampere);
    RUN_TEST(test_of_a_rank_no_more_is_read_than_there_are_connectors);
    RUN_TEST(test_a_group_just_at_its_limit_does_not_hide_those_above);
    RUN_TEST(test_the_least_current_and_the_least_excess_are_cut);
    RUN_TEST(test_it_ends_in_a_deep_tree_whatever_is_asked);
    return UNITY_END();
}
