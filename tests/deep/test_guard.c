/* The guard: each limit passes when it is met exactly, and refuses the least that is more. */
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

static void test_a_current_is_within_its_connectors_and_its_vehicles_limits(void) {
    static const struct {
        const char *what;
        int32_t current_mA;
        bool passes;
    } cases[] = {
        {"nothing", 0, true},
        {"the minimum", 6000, true},
        {"below the minimum", 5900, false},
        {"the most", 32000, true},
        {"more than the most", 32100, false},
        {"no step of the wire", 6050, false},
        {"just no step", 6001, false},
        {"negative", -100, false},
    };
    tree_add(&tree, 0, L1);
    for (size_t k = 0; k < sizeof cases / sizeof cases[0]; k++) {
        give(0, cases[k].current_mA);
        TEST_ASSERT_EQUAL_MESSAGE(cases[k].passes, tree_guard(&tree), cases[k].what);
    }
    give(0, 16000);
    tree_assert_just_enough(&tree, &tree.connector[0].max_mA, 16000);
    tree_assert_just_enough(&tree, &tree.snapshot.demand[0].max_mA, 16000);
    tree.snapshot.demand[0].active = false;
    TEST_ASSERT_FALSE(tree_guard(&tree));
    give(0, 0);
    TEST_ASSERT_TRUE(tree_guard(&tree));
}

static void test_the_last_connector_is_looked_at_too(void) {
    tree_add(&tree, 0, L1);
    tree_add(&tree, 0, L1);
    give(1, 32100);
    TEST_ASSERT_FALSE(tree_guard(&tree));
    give(1, 0);
    give(2, 32100); /* there is none */
    TEST_ASSERT_TRUE(tree_guard(&tree));
}

static void test_where_there_is_no_room_not_even_the_least_may_flow(void) {
    tree_add(&tree, 0, L1);
    tree.snapshot.demand[0].min_mA = 0;
    tree.snapshot.demand[0].W_per_A = 1;
    tree.snapshot.demand[0].booking.W_per_A = 1;
    tree.snapshot.demand[0].booking.permille = 1;
    tree.group[0].limit_mA = 10;
    give(0, 100); /* 0.1 W, 0.1 mA */
    tree_assert_just_enough(&tree, &tree.supply.site_W, 1);
    tree_assert_just_enough(&tree, &tree.supply.phase_mA[0], 1);
}

static void test_the_power_of_a_group_is_that_of_all_below_it(void) {
    const uint8_t left = tree_add_group(&tree, 0);
    const uint8_t right = tree_add_group(&tree, 0);
    const uint8_t leaf = tree_add_group(&tree, left);
    tree_add(&tree, left, L1);
    tree_add(&tree, leaf, L1 | L2 | L3);
    tree_add(&tree, right, L2);
    give(0, 10000); /* 2300 W */
    give(1, 20000); /* 13800 W */
    give(2, 30000); /* 6900 W */
    tree_assert_just_enough(&tree, &tree.group[left].limit_W, 16100);
    tree_assert_just_enough(&tree, &tree.group[leaf].limit_W, 13800);
    tree_assert_just_enough(&tree, &tree.group[right].limit_W, 6900);
    tree_assert_just_enough(&tree, &tree.group[0].limit_W, 23000);
    tree_assert_just_enough(&tree, &tree.supply.site_W, 23000);
    tree.supply.site_W = -1;
    TEST_ASSERT_FALSE(tree_guard(&tree));
    memset(&tree.setpoints, 0, sizeof tree.setpoints);
    TEST_ASSERT_TRUE(tree_guard(&tree));
}

static void test_a_group_without_a_limit_bounds_nothing(void) {
    const uint8_t leaf = tree_add_group(&tree, 0);
    tree_add(&tree, leaf, L1);
    give(0, 32000);
    TEST_ASSERT_TRUE(tree_guard(&tree));
    tree.group[0].limit_W = 0; /* what the site may have now binds nevertheless */
    TEST_ASSERT_TRUE(tree_guard(&tree));
    tree_assert_just_enough(&tree, &tree.supply.site_W, 7360);
}

static void test_each_phase_of_a_group_has_its_own_sum(void) {
    static const uint8_t lines[] = {L1, L2, L3};
    for (uint8_t k = 0; k < 3; k++) {
        setUp();
        memset(&tree.setpoints, 0, sizeof tree.setpoints);
        const uint8_t leaf = tree_add_group(&tree, 0);
        tree_add(&tree, leaf, lines[k]);
        tree_add(&tree, leaf, lines[(k + 1) % 3]);
        tree_add(&tree, leaf, L1 | L2 | L3);
        give(0, 16000);
        give(1, 15900);
        give(2, 10000);
        tree_assert_just_enough(&tree, &tree.group[leaf].limit_mA, 26000);
        tree.group[leaf].limit_mA = 0;
        tree_assert_just_enough(&tree, &tree.group[0].limit_mA, 26000);
    }
}

static void test_what_other_load_leaves_binds_the_phases_of_the_site_alone(void) {
    static const uint8_t lines[] = {L1, L2, L3};
    for (uint8_t k = 0; k < 3; k++) {
        setUp();
        memset(&tree.setpoints, 0, sizeof tree.setpoints);
        const uint8_t leaf = tree_add_group(&tree, 0);
        tree_add(&tree, leaf, lines[k]);
        give(0, 16000);
        tree.group[leaf].limit_mA = 20000;
        tree.supply.phase_mA[k] = 0;
        TEST_ASSERT_TRUE(tree_guard(&tree)); /* the site has no limit of its phases */
        tree.group[0].limit_mA = 20000;
        tree_assert_just_enough(&tree, &tree.supply.phase_mA[k], 16000);
        tree.supply.phase_mA[k] = -5;
        TEST_ASSERT_FALSE(tree_guard(&tree));
        give(0, 0);
        TEST_ASSERT_TRUE(tree_guard(&tree)); /* less than nothing is nothing */
    }
}

static void test_a_connector_of_unknown_wiring_counts_on_all_phases(void) {
    tree_add(&tree, 0, L1);
    tree_add(&tree, 0, L3);
    tree.snapshot.demand[0].booking.phases = 7;
    give(0, 10000);
    give(1, 16000);
    tree_assert_just_enough(&tree, &tree.group[0].limit_mA, 26000);
}

/** A booking that says nothing: by the description, and by the vehicle's power. */
static void test_without_a_booking_the_description_says_the_lines(void) {
    static const struct {
        uint8_t rotation, one, two;
    } cases[] = {{0, L1, L1 | L2}, {1, L1, L1 | L2}, {2, L2, L2 | L3}, {3, L3, L3 | L1},
                 {4, L1, L1 | L3}, {5, L2, L2 | L1}, {6, L3, L3 | L2}, {7, L1, L1 | L2}};
    static const int32_t free_mA = 1000000;
    for (size_t k = 0; k < sizeof cases / sizeof cases[0]; k++) {
        for (unsigned pair = 0; pair < 2; pair++) {
            setUp();
            memset(&tree.setpoints, 0, sizeof tree.setpoints);
            tree_add(&tree, 0, L1);
            tree.connector[0].rotation = cases[k].rotation;
            tree.connector[0].line_to_line = pair == 1;
            tree.snapshot.demand[0].booking = (taper_booking_t){.W_per_A = 0};
            tree.group[0].limit_mA = free_mA;
            give(0, 16000);
            for (unsigned line = 0; line < 3; line++) {
                const unsigned lines = pair == 1 ? cases[k].two : cases[k].one;
                const bool counts = (lines >> line & 1u) != 0u;
                tree.supply.phase_mA[line] = 15999;
                TEST_ASSERT_EQUAL(!counts, tree_guard(&tree));
                tree.supply.phase_mA[line] = 16000;
                TEST_ASSERT_TRUE(tree_guard(&tree));
            }
            tree_assert_just_enough(&tree, &tree.supply.site_W, 3680);
        }
    }
}

static void test_without_a_booking_three_phases_and_converters_count_on_all_lines(void) {
    for (unsigned line = 0; line < 3; line++) {
        setUp();
        tree_add(&tree, 0, L1 | L2 | L3);
        tree.snapshot.demand[0].booking = (taper_booking_t){.W_per_A = 700}; /* more than it draws */
        tree.group[0].limit_mA = 100000;
        give(0, 16000);
        tree_assert_just_enough(&tree, &tree.supply.phase_mA[line], 16000);
        tree_assert_just_enough(&tree, &tree.supply.site_W, 11200);
        tree.snapshot.demand[0].booking.W_per_A = 0;
        tree_assert_just_enough(&tree, &tree.supply.site_W, 11040);
        /* 399.001 V counts as 400 V; 95 %: 422 W per A (421.05); 422 W / 690 V: 612 permille (611.6) */
        tree.connector[0].is_dc = true;
        tree.connector[0].line_to_line = line == 1; /* of no account */
        tree.connector[0].phases = 1;
        tree.connector[0].voltage_mV = 399001;
        tree.connector[0].efficiency_permille = 950;
        tree_assert_just_enough(&tree, &tree.supply.site_W, 11632); /* 690 W / 95 %: 727 W (726.3) */
        tree_assert_just_enough(&tree, &tree.supply.phase_mA[line], 9792);
        /* 380 V, 95 %: 400 W per A, 580 permille (579.7) */
        tree.connector[0].voltage_mV = 380000;
        tree_assert_just_enough(&tree, &tree.supply.phase_mA[line], 9280);
        /* 345 V, no losses: half of 690 V */
        tree.connector[0].voltage_mV = 345000;
        tree.connector[0].efficiency_permille = 1000;
        tree_assert_just_enough(&tree, &tree.supply.phase_mA[line], 8000);
    }
}

static void test_a_booking_says_how_much_flows_for_an_ampere(void) {
    tree_add(&tree, 0, L1 | L2 | L3);
    tree.snapshot.demand[0].booking.permille = 612;
    tree.snapshot.demand[0].booking.W_per_A = 422;
    tree.snapshot.demand[0].W_per_A = 400;
    give(0, 10000);
    tree_assert_just_enough(&tree, &tree.group[0].limit_mA, 6120);
    tree_assert_just_enough(&tree, &tree.supply.site_W, 4220);
}

static void test_no_less_power_counts_than_the_demand_draws_with_the_losses_of_a_converter(void) {
    tree_add(&tree, 0, L1 | L2 | L3);
    tree.snapshot.demand[0].booking.W_per_A = 422;
    tree.connector[0].efficiency_permille = 950; /* of no account without a converter */
    give(0, 10000);
    tree.snapshot.demand[0].W_per_A = 423;
    tree_assert_just_enough(&tree, &tree.supply.site_W, 4230);
    tree.snapshot.demand[0].W_per_A = 2002;
    tree_assert_just_enough(&tree, &tree.supply.site_W, 20020);
    tree.connector[0].is_dc = true;
    tree.snapshot.demand[0].W_per_A = 400; /* 421.05 W */
    tree_assert_just_enough(&tree, &tree.supply.site_W, 4220);
    tree.snapshot.demand[0].W_per_A = 401; /* 422.1 W */
    tree_assert_just_enough(&tree, &tree.supply.site_W, 4230);
    tree.snapshot.demand[0].W_per_A = 418; /* 440 W */
    tree_assert_just_enough(&tree, &tree.supply.site_W, 4400);
}

static void test_phases_differ_by_no_more_than_the_imbalance(void) {
    static const uint8_t lines[] = {L1, L2, L3};
    for (unsigned strong = 0; strong < 3; strong++) {
        for (unsigned weak = 1; weak < 3; weak++) {
            tree_init(&tree);
            memset(&tree.setpoints, 0, sizeof tree.setpoints);
            const uint8_t leaf = tree_add_group(&tree, 0);
            tree_add(&tree, leaf, lines[strong]);
            tree_add(&tree, leaf, lines[(strong + weak) % 3]);
            tree_add(&tree, leaf, lines[(strong + 3 - weak) % 3]);
            tree_add(&tree, leaf, L1 | L2 | L3);
            give(0, 20000);
            give(1, 8000);
            give(2, 15000);
            give(3, 32000);
            tree_assert_just_enough(&tree, &tree.group[leaf].imbalance_mA, 12000);
            tree.group[leaf].imbalance_mA = 0;
            tree_assert_just_enough(&tree, &tree.group[0].imbalance_mA, 12000);
        }
    }
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_a_current_is_within_its_connectors_and_its_vehicles_limits);
    RUN_TEST(test_the_last_connector_is_looked_at_too);
    RUN_TEST(test_where_there_is_no_room_not_even_the_least_may_flow);
    RUN_TEST(test_the_power_of_a_group_is_that_of_all_below_it);
    RUN_TEST(test_a_group_without_a_limit_bounds_nothing);
    RUN_TEST(test_each_phase_of_a_group_has_its_own_sum);
    RUN_TEST(test_what_other_load_leaves_binds_the_phases_of_the_site_alone);
    RUN_TEST(test_a_connector_of_unknown_wiring_counts_on_all_phases);
    RUN_TEST(test_without_a_booking_the_description_says_the_lines);
    RUN_TEST(test_without_a_booking_three_phases_and_converters_count_on_all_lines);
    RUN_TEST(test_a_booking_says_how_much_flows_for_an_ampere);
    RUN_TEST(test_no_less_power_counts_than_the_demand_draws_with_the_losses_of_a_converter);
    RUN_TEST(test_phases_differ_by_no_more_than_the_imbalance);
    return UNITY_END();
}
