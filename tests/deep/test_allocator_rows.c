/* Every kind of row binds the allocator at its exact bound, and no kind binds what has no weight in it. */
#include <string.h>

#include "rooms.h"
#include "tree.h"
#include "unity.h"

static tree_t tree;
static uint8_t leaf;

void setUp(void) {
    tree_init(&tree);
    leaf = tree_add_group(&tree, tree_add_group(&tree, 0));
}
void tearDown(void) {}

static int32_t given(uint8_t i) {
    return tree.setpoints.current_mA[i];
}

static void test_power_binds_in_every_group_above(void) {
    tree_add(&tree, leaf, L1 | L2 | L3);
    int32_t *const limits[] = {&tree.group[leaf].limit_W, &tree.group[1].limit_W, &tree.group[0].limit_W,
                               &tree.supply.site_W};
    for (size_t k = 0; k < sizeof limits / sizeof limits[0]; k++) {
        const int32_t before_W = *limits[k];
        *limits[k] = 6900;
        TEST_ASSERT_EQUAL_INT32(10000, tree_allocate(&tree));
        *limits[k] = 6899;
        TEST_ASSERT_EQUAL_INT32(9900, tree_allocate(&tree));
        *limits[k] = 4140;
        TEST_ASSERT_EQUAL_INT32(6000, tree_allocate(&tree));
        *limits[k] = 4139;
        TEST_ASSERT_EQUAL_INT32(0, tree_allocate(&tree));
        *limits[k] = before_W;
        tree_allocate_after(&tree, 300000);
    }
}

static void test_each_phase_binds_those_on_it(void) {
    static const uint8_t lines[] = {L1, L2, L3};
    for (unsigned k = 0; k < 3; k++) {
        setUp();
        tree_add(&tree, leaf, lines[k]);
        tree_add(&tree, leaf, lines[(k + 1) % 3]);
        tree_add(&tree, leaf, lines[k]);
        tree_add(&tree, 0, lines[k]);
        tree.group[1].limit_mA = 30099;
        tree_allocate(&tree);
        TEST_ASSERT_EQUAL_INT32(24000, given(0));
        TEST_ASSERT_EQUAL_INT32(30000, given(1));
        TEST_ASSERT_EQUAL_INT32(6000, given(2));
        TEST_ASSERT_EQUAL_INT32(32000, given(3)); /* not below that group */
    }
}

static void test_three_phases_take_from_all_three(void) {
    tree_add(&tree, leaf, L1 | L2 | L3);
    tree_add(&tree, leaf, L1);
    tree_add(&tree, leaf, L2);
    tree.group[0].limit_mA = 30000;
    tree_wish(&tree, 0, 10000, 10000);
    tree_wish(&tree, 1, 15000, 15000);
    tree_allocate(&tree);
    TEST_ASSERT_EQUAL_INT32(10000, given(0));
    TEST_ASSERT_EQUAL_INT32(15000, given(1));
    TEST_ASSERT_EQUAL_INT32(20000, given(2));
}

static void test_other_load_binds_its_phase(void) {
    static const uint8_t lines[] = {L1, L2, L3};
    for (unsigned k = 0; k < 3; k++) {
        setUp();
        for (unsigned line = 0; line < 3; line++) {
            tree_add(&tree, leaf, lines[line]);
        }
        tree.group[0].limit_mA = 25000;
        tree.supply.phase_mA[k] = 9000;
        tree_allocate(&tree);
        for (uint8_t i = 0; i < 3; i++) {
            TEST_ASSERT_EQUAL_INT32(i == k ? 9000 : 25000, given(i));
        }
        tree.supply.phase_mA[k] = -9000;
        tree_allocate_after(&tree, 1000);
        TEST_ASSERT_EQUAL_INT32(0, given((uint8_t)k));
    }
}

static void test_wiring_that_is_not_known_takes_from_all_phases(void) {
    tree_add(&tree, leaf, L1);
    tree_add(&tree, leaf, L2);
    tree_add(&tree, leaf, L3);
    tree.snapshot.demand[0].booking.phases = 7;
    tree_wish(&tree, 0, 10000, 10000);
    tree.group[leaf].limit_mA = 32000;
    tree_allocate(&tree);
    TEST_ASSERT_EQUAL_INT32(10000, given(0));
    TEST_ASSERT_EQUAL_INT32(22000, given(1));
    TEST_ASSERT_EQUAL_INT32(22000, given(2));
}

static void test_a_converter_takes_what_its_booking_says(void) {
    tree_add(&tree, leaf, L1 | L2 | L3);
    tree.snapshot.demand[0].booking.permille = 612;
    tree.snapshot.demand[0].booking.W_per_A = 422;
    tree.snapshot.demand[0].W_per_A = 400;
    tree_wish(&tree, 0, 32000, 32000);
    tree.group[leaf].limit_mA = 6120;
    TEST_ASSERT_EQUAL_INT32(10000, tree_allocate(&tree));
    tree.group[leaf].limit_mA = 6119;
    TEST_ASSERT_EQUAL_INT32(9900, tree_allocate(&tree));
    tree.group[leaf].limit_mA = 0;
    tree.group[leaf].limit_W = 4220;
    TEST_ASSERT_EQUAL_INT32(10000, tree_allocate(&tree));
    tree.group[leaf].limit_W = 4219;
    TEST_ASSERT_EQUAL_INT32(9900, tree_allocate(&tree));
}

/** x on the pair that begins at `line`, y on the one that ends there: as much of x as line's two rows leave. */
static void test_two_pairs_on_a_line_add_by_both_rows(void) {
    static const uint8_t pairs[] = {L1 | L2, L2 | L3, L3 | L1};
    for (unsigned line = 0; line < 3; line++) {
        setUp();
        tree_add_pair(&tree, leaf, pairs[(line + 2) % 3]);
        tree_add_pair(&tree, leaf, pairs[line]);
        tree_wish(&tree, 0, 10000, 10000);
        tree.group[leaf].limit_mA = 30000;
        tree_allocate(&tree);
        TEST_ASSERT_EQUAL_INT32(10000, given(0));
        TEST_ASSERT_EQUAL_INT32(22600, given(1)); /* 22.6 + 0.733 x 10 = 29.93 */
        tree_wish(&tree, 0, 20000, 20000);
        tree_allocate(&tree);
        TEST_ASSERT_EQUAL_INT32(20000, given(0));
        TEST_ASSERT_EQUAL_INT32(13600, given(1)); /* 20 + 0.733 x 13.6 = 29.97 */
    }
}

static void test_a_delta_side_binds_by_both_rows(void) {
    static const uint8_t pairs[] = {L1 | L2, L2 | L3, L3 | L1};
    for (unsigned line = 0; line < 3; line++) {
        setUp();
        tree_add_pair(&tree, leaf, pairs[line]);
        tree_add_pair(&tree, leaf, pairs[(line + 1) % 3]);
        tree_wish(&tree, 0, 10000, 10000);
        tree.group[leaf].delta_mA = 50000;
        tree_allocate(&tree);
        TEST_ASSERT_EQUAL_INT32(10000, given(0));
        TEST_ASSERT_EQUAL_INT32(20000, given(1)); /* 10 + 2 x 20 */
        tree_wish(&tree, 0, 21000, 21000);
        tree_allocate(&tree);
        TEST_ASSERT_EQUAL_INT32(21000, given(0));
        TEST_ASSERT_EQUAL_INT32(8000, given(1)); /* 2 x 21 + 8 */
    }
}

static void test_what_is_reserved_is_taken_from_every_row(void) {
    tree_add(&tree, leaf, L1);
    tree_add(&tree, leaf, L1 | L2 | L3);
    tree_add(&tree, leaf, L2);
    tree.snapshot.demand[1].active = false;
    tree.group[leaf].limit_mA = 30000;
    tree.group[0].limit_W = 12000;
    int32_t reserved_mA[TAPER_MAX_CONNECTORS] = {0, 10000, 0};
    taper_allocate(&tree.allocator, &tree.config, &tree.snapshot, &tree.proposal, tree_rows(&tree),
                   reserved_mA, &tree.setpoints);
    TEST_ASSERT_EQUAL_INT32(16100, given(0)); /* 5100 W left: 6 A for the other, the rest here */
    TEST_ASSERT_EQUAL_INT32(0, given(1));
    TEST_ASSERT_EQUAL_INT32(6000, given(2));
    tree.group[0].limit_W = 100000;
    taper_allocate(&tree.allocator, &tree.config, &tree.snapshot, &tree.proposal, tree_rows(&tree),
                   reserved_mA, &tree.setpoints);
    TEST_ASSERT_EQUAL_INT32(20000, given(0));
    TEST_ASSERT_EQUAL_INT32(20000, given(2));
}

static void test_an_overdrawn_row_gives_nothing_to_those_with_a_weight_in_it(void) {
    tree_add(&tree, leaf, L1);
    tree_add(&tree, leaf, L1);
    tree_add(&tree, leaf, L2);
    tree.snapshot.demand[0].min_mA = tree.snapshot.demand[2].min_mA = 0;
    tree.snapshot.demand[1].active = false;
    tree.group[leaf].limit_mA = 10000;
    const int32_t reserved_mA[TAPER_MAX_CONNECTORS] = {0, 10001, 0};
    taper_allocate(&tree.allocator, &tree.config, &tree.snapshot, &tree.proposal, tree_rows(&tree),
                   reserved_mA, &tree.setpoints);
    TEST_ASSERT_EQUAL_INT32(0, given(0));
    TEST_ASSERT_EQUAL_INT32(10000, given(2));
}

static void test_the_last_step_rounds_a_ceiling_up_where_there_is_room(void) {
    tree_add(&tree, leaf, L1);
    tree_add(&tree, leaf, L1);
    tree.proposal.wish_W[0] = tree.proposal.ceiling_W[0] = 2301; /* 10.004 A */
    tree.proposal.wish_W[1] = tree.proposal.ceiling_W[1] = 2300; /* 10 A */
    tree_allocate(&tree);
    TEST_ASSERT_EQUAL_INT32(10100, given(0));
    TEST_ASSERT_EQUAL_INT32(10000, given(1));
    tree.group[0].limit_mA = 20099;
    tree_allocate(&tree);
    TEST_ASSERT_EQUAL_INT32(10000, given(0));
    tree.group[0].limit_mA = 0;
    tree.snapshot.demand[0].max_mA = 10000;
    tree_allocate(&tree);
    TEST_ASSERT_EQUAL_INT32(10000, given(0));
    tree.snapshot.demand[0].max_mA = 10099;
    tree_allocate(&tree);
    TEST_ASSERT_EQUAL_INT32(10000, given(0));
    tree.proposal.ceiling_W[0] = 0; /* counts as the wish */
    tree.snapshot.demand[0].max_mA = 32000;
    tree_allocate(&tree);
    TEST_ASSERT_EQUAL_INT32(10100, given(0));
}

static void test_a_rank_that_names_nobody_raises_nobody(void) {
    tree_add(&tree, leaf, L1);
    tree_add(&tree, leaf, L1);
    const uint8_t rank[] = {0, 2};
    memcpy(tree.proposal.rank, rank, sizeof rank);
    tree_allocate(&tree);
    TEST_ASSERT_EQUAL_INT32(32000, given(0));
    TEST_ASSERT_EQUAL_INT32(6000, given(1)); /* its minimum needs no rank */
}

static void test_rooms_say_what_is_left_and_what_is_overdrawn(void) {
    taper_rooms_t rooms;
    tree_add(&tree, leaf, L1);
    tree.group[1].limit_mA = 20000;
    const taper_rows_t *rows = tree_rows(&tree);
    taper_rooms_open(&rooms, &tree.config, rows);
    TEST_ASSERT_EQUAL_UINT8(4, rows->sums); /* power, and three phases */
    TEST_ASSERT_EQUAL_INT32(20000, taper_rooms_fit_mA(&rooms, &tree.config, rows, 0, INT32_MAX));
    TEST_ASSERT_EQUAL_INT32(19999, taper_rooms_fit_mA(&rooms, &tree.config, rows, 0, 19999));
    taper_rooms_draw(&rooms, &tree.config, rows, 0, 20000);
    TEST_ASSERT_EQUAL_INT32(0, taper_rooms_fit_mA(&rooms, &tree.config, rows, 0, INT32_MAX));
    TEST_ASSERT_EQUAL_INT32(0, taper_rooms_fit_mA(&rooms, &tree.config, rows, 0, 0));
    taper_rooms_draw(&rooms, &tree.config, rows, 0, 1);
    TEST_ASSERT_EQUAL_INT32(-1, taper_rooms_fit_mA(&rooms, &tree.config, rows, 0, INT32_MAX));
    TEST_ASSERT_EQUAL_INT32(-1, taper_rooms_fit_mA(&rooms, &tree.config, rows, 0, 0));
}

static void test_the_least_weight_counts(void) {
    taper_rooms_t rooms;
    tree_add(&tree, leaf, L1);
    tree.snapshot.demand[0].booking.permille = 1;
    tree.group[leaf].limit_mA = 9;
    const taper_rows_t *rows = tree_rows(&tree);
    taper_rooms_open(&rooms, &tree.config, rows);
    TEST_ASSERT_EQUAL_INT32(9000, taper_rooms_fit_mA(&rooms, &tree.config, rows, 0, INT32_MAX));
}

static void test_rooms_without_any_limit_have_all_that_an_integer_holds(void) {
    taper_rooms_t rooms;
    tree_add(&tree, leaf, L1);
    tree.group[0].limit_W = 0;
    const taper_rows_t *rows = tree_rows(&tree);
    taper_rooms_open(&rooms, &tree.config, rows);
    TEST_ASSERT_EQUAL_INT32(INT32_MAX, taper_rooms_fit_mA(&rooms, &tree.config, rows, 0, INT32_MAX));
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_power_binds_in_every_group_above);
    RUN_TEST(test_each_phase_binds_those_on_it);
    RUN_TEST(test_three_phases_take_from_all_three);
    RUN_TEST(test_other_load_binds_its_phase);
    RUN_TEST(test_wiring_that_is_not_known_takes_from_all_phases);
    RUN_TEST(test_a_converter_takes_what_its_booking_says);
    RUN_TEST(test_two_pairs_on_a_line_add_by_both_rows);
    RUN_TEST(test_a_delta_side_binds_by_both_rows);
    RUN_TEST(test_what_is_reserved_is_taken_from_every_row);
    RUN_TEST(test_an_overdrawn_row_gives_nothing_to_those_with_a_weight_in_it);
    RUN_TEST(test_the_last_step_rounds_a_ceiling_up_where_there_is_room);
    RUN_TEST(test_a_rank_that_names_nobody_raises_nobody);
    RUN_TEST(test_rooms_say_what_is_left_and_what_is_overdrawn);
    RUN_TEST(test_the_least_weight_counts);
    RUN_TEST(test_rooms_without_any_limit_have_all_that_an_integer_holds);
    return UNITY_END();
}
