/* The allocator at its edges: who is kept room for, what a rank may say, and what belongs to nobody. */
#include <string.h>

#include "rooms.h"
#include "tree.h"
#include "unity.h"

static tree_t tree;

void setUp(void) {
    tree_init(&tree);
}
void tearDown(void) {}

static int32_t given(uint8_t i) {
    return tree.setpoints.current_mA[i];
}

/** Vehicles of 6 A at least on one phase; only those that `active` names. */
static void start(unsigned vehicles, int32_t limit_mA, const char *active) {
    tree_start(&tree, vehicles, 0);
    tree.group[0].limit_mA = limit_mA;
    for (uint8_t i = 0; i < vehicles; i++) {
        tree.snapshot.demand[i].active = strchr(active, '0' + i) != NULL;
    }
}

static void test_an_allocator_begins_with_nothing(void) {
    static const taper_allocator_t nothing;
    memset(&tree.allocator, 0xFF, sizeof tree.allocator);
    taper_allocator_init(&tree.allocator);
    TEST_ASSERT_EQUAL_MEMORY(&nothing, &tree.allocator, sizeof nothing);
}

static void test_what_is_reserved_beyond_the_last_connector_is_nothing(void) {
    const int32_t reserved_mA[TAPER_MAX_CONNECTORS] = {0, 10000};
    start(2, 20000, "01");
    tree.config.connector_count = tree.snapshot.count = 1;
    taper_allocate(&tree.allocator, &tree.config, &tree.snapshot, &tree.proposal, tree_rows(&tree),
                   reserved_mA, &tree.setpoints);
    TEST_ASSERT_EQUAL_INT32(20000, given(0));
}

static void test_a_negative_wish_gives_nothing_and_a_great_one_is_exact(void) {
    start(1, 0, "0");
    taper_demand_t *demand = &tree.snapshot.demand[0];
    demand->min_mA = 0;
    demand->W_per_A = demand->booking.W_per_A = 1;
    tree.proposal.wish_W[0] = tree.proposal.ceiling_W[0] = -5;
    TEST_ASSERT_EQUAL_INT32(0, tree_allocate(&tree));
    tree.connector[0].max_mA = demand->max_mA = 250000;
    tree.proposal.wish_W[0] = tree.proposal.ceiling_W[0] = 200;
    TEST_ASSERT_EQUAL_INT32(200000, tree_allocate(&tree));
}

static void test_a_group_beyond_the_last_one_has_no_rows(void) {
    start(1, 20000, "0");
    tree.group[1].delta_mA = 1000;
    TEST_ASSERT_EQUAL_UINT8(4, tree_rows(&tree)->count);
}

static void test_what_is_taken_is_taken_once_from_each_row(void) {
    taper_rooms_t rooms;
    start(1, 32000, "0");
    tree.group[0].limit_W = 7000;
    const taper_rows_t *rows = tree_rows(&tree);
    taper_rooms_open(&rooms, &tree.config, rows);
    taper_rooms_draw(&rooms, &tree.config, rows, 0, 10000);
    TEST_ASSERT_EQUAL_UINT8(TAPER_ROW_L1, rows->kind[1]);
    TEST_ASSERT_EQUAL_INT64(4700000, rooms.left[0][0]);  /* power */
    TEST_ASSERT_EQUAL_INT64(22000000, rooms.left[0][1]); /* L1 */
    TEST_ASSERT_EQUAL_INT64(32000000, rooms.left[0][2]); /* L2 */
}

static void test_ceilings_are_filled_before_any_is_rounded_up(void) {
    start(2, 20000, "01");
    tree_wish(&tree, 0, 6000, 6000);
    tree_wish(&tree, 1, 6000, 6000);
    tree.proposal.ceiling_W[0] = 2301; /* 10.004 A */
    tree.proposal.ceiling_W[1] = 2300;
    tree_allocate(&tree);
    TEST_ASSERT_EQUAL_INT32(10000, given(0));
    TEST_ASSERT_EQUAL_INT32(10000, given(1));
}

/* ---- Ranks */

static void test_a_rank_of_who_is_not_there_raises_nobody(void) {
    start(3, 0, "012");
    tree.config.connector_count = tree.snapshot.count = 2;
    tree.snapshot.demand[2].min_mA = 0;
    const uint8_t rank[] = {0, 2, 1}; /* two places: the third is not read */
    memcpy(tree.proposal.rank, rank, sizeof rank);
    tree_allocate(&tree);
    TEST_ASSERT_EQUAL_INT32(32000, given(0));
    TEST_ASSERT_EQUAL_INT32(6000, given(1));
    TEST_ASSERT_EQUAL_INT32(0, given(2));
}

static void test_balance_cuts_by_rank_those_without_a_minimum(void) {
    start(4, 0, "0123");
    for (uint8_t i = 0; i < 4; i++) {
        tree_wish(&tree, i, i < 2 ? 9000 : 6000, i < 2 ? 9000 : 6000);
        tree.snapshot.demand[i].min_mA = i < 2 ? 0 : 6000;
    }
    const uint8_t rank[] = {2, 3, 1, 0};
    memcpy(tree.proposal.rank, rank, sizeof rank);
    tree.group[0].imbalance_mA = 25000;
    tree_allocate(&tree);
    TEST_ASSERT_EQUAL_INT32(4000, given(0));
    TEST_ASSERT_EQUAL_INT32(9000, given(1));
    TEST_ASSERT_EQUAL_INT32(6000, given(2));
    TEST_ASSERT_EQUAL_INT32(6000, given(3));
}

/* ---- Kept room */

static void test_no_room_is_kept_for_what_never_fits(void) {
    start(2, 10000, "0");
    tree.snapshot.demand[0].min_mA = 12000;
    tree_allocate(&tree);
    tree.snapshot.demand[1].active = true;
    tree_allocate_after(&tree, 900000); /* 0 is overdue */
    tree_assert_on(&tree, "1");
}

static void test_room_is_kept_from_what_those_before_left(void) {
    start(4, 30000, "013");
    tree.snapshot.demand[1].min_mA = 19000;
    tree_laxity(&tree, 3, -1000);
    tree_allocate(&tree);
    tree_assert_on(&tree, "03");
    tree.snapshot.demand[0].session = tree.snapshot.demand[3].session = 2; /* their turns begin anew */
    tree_allocate_after(&tree, 899000);
    tree_assert_on(&tree, "03");
    tree.snapshot.demand[2].active = true;
    tree_allocate_after(&tree, 1000); /* 18 A are left, 1 waits for 19 A */
    tree_assert_on(&tree, "03");
    tree_assert_waiting(&tree, 1, 1, 2);
    tree_assert_waiting(&tree, 2, 2, 2);
}

static void test_those_who_come_beside_kept_room_take_of_what_is_beside_it(void) {
    const uint8_t left = tree_add_group(&tree, 0);
    start(5, 36000, "01");
    tree.group[left].limit_mA = 18000;
    tree.connector[0].group = tree.connector[1].group = left;
    tree.snapshot.demand[1].min_mA = 18000;
    tree_allocate(&tree);
    tree_assert_on(&tree, "0");
    tree.snapshot.demand[0].session = 2;
    tree_allocate_after(&tree, 899000);
    for (uint8_t i = 2; i < 5; i++) {
        tree.snapshot.demand[i].active = true;
    }
    tree_allocate_after(&tree, 1000); /* of 36 A: 6 for 0, 18 kept for 1, so there is room for two */
    tree_assert_on(&tree, "023");
}

static void test_who_is_on_stays_on_although_room_is_kept(void) {
    start(4, 23000, "01");
    tree.snapshot.demand[1].min_mA = 18000;
    tree_allocate(&tree);
    tree.snapshot.demand[3].active = true;
    tree_allocate_after(&tree, 600000);
    tree_assert_on(&tree, "03");
    tree_allocate_after(&tree, 300000); /* 1 is overdue, the turn of 0 over, that of 3 is not: 17 A */
    tree_assert_on(&tree, "03");
}

/** Two connectors, 0 draws `reserved_mA` whatever it is told; the site has room for `site_W`. */
static void allocate_beside(int32_t reserved_mA, int32_t site_W) {
    const int32_t reserved[TAPER_MAX_CONNECTORS] = {reserved_mA};
    tree_init(&tree);
    memset(&tree.setpoints, 0, sizeof tree.setpoints);
    tree_add(&tree, 0, L1);
    tree_add(&tree, 0, L1);
    tree.supply.site_W = site_W;
    taper_allocate(&tree.allocator, &tree.config, &tree.snapshot, &tree.proposal, tree_rows(&tree), reserved,
                   &tree.setpoints);
}

static void test_what_a_connector_draws_anyway_pays_for_its_setpoint_to_the_last_step(void) {
    allocate_beside(10000, 52 * 230); /* as if nothing were reserved */
    TEST_ASSERT_EQUAL_INT32(32000, tree.setpoints.current_mA[0]);
    TEST_ASSERT_EQUAL_INT32(20000, tree.setpoints.current_mA[1]);
    allocate_beside(20000,
                    26 * 230); /* what it draws beyond its minimum is paid for, the other has the rest */
    TEST_ASSERT_EQUAL_INT32(20000, tree.setpoints.current_mA[0]);
    TEST_ASSERT_EQUAL_INT32(6000, tree.setpoints.current_mA[1]);
    allocate_beside(20000, 20 * 230);
    TEST_ASSERT_EQUAL_INT32(20000, tree.setpoints.current_mA[0]);
    TEST_ASSERT_EQUAL_INT32(0, tree.setpoints.current_mA[1]);
    allocate_beside(20000, 20 * 230 - 1); /* more than there is: that makes nothing legal */
    TEST_ASSERT_EQUAL_INT32(0, tree.setpoints.current_mA[0]);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_what_a_connector_draws_anyway_pays_for_its_setpoint_to_the_last_step);
    RUN_TEST(test_an_allocator_begins_with_nothing);
    RUN_TEST(test_what_is_reserved_beyond_the_last_connector_is_nothing);
    RUN_TEST(test_a_negative_wish_gives_nothing_and_a_great_one_is_exact);
    RUN_TEST(test_a_group_beyond_the_last_one_has_no_rows);
    RUN_TEST(test_what_is_taken_is_taken_once_from_each_row);
    RUN_TEST(test_ceilings_are_filled_before_any_is_rounded_up);
    RUN_TEST(test_a_rank_of_who_is_not_there_raises_nobody);
    RUN_TEST(test_balance_cuts_by_rank_those_without_a_minimum);
    RUN_TEST(test_no_room_is_kept_for_what_never_fits);
    RUN_TEST(test_room_is_kept_from_what_those_before_left);
    RUN_TEST(test_those_who_come_beside_kept_room_take_of_what_is_beside_it);
    RUN_TEST(test_who_is_on_stays_on_although_room_is_kept);
    return UNITY_END();
}
