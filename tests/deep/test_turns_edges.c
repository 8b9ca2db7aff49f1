/* Turns at their edges: the least battery, power, minimum and debt, and what belongs to nobody. */
#include <string.h>

#include "tree.h"
#include "turns.h"
#include "unity.h"

static tree_t tree;

void setUp(void) {
    tree_init(&tree);
}
void tearDown(void) {}

static void test_who_stands_beyond_the_last_connector_has_no_turn(void) {
    static const taper_turn_t none;
    tree_start(&tree, 3, 3);
    tree.config.connector_count = tree.snapshot.count = 2;
    tree_allocate(&tree);
    tree_allocate_after(&tree, 1000);
    TEST_ASSERT_EQUAL_INT32(0, tree.setpoints.current_mA[2]);
    TEST_ASSERT_EQUAL_MEMORY(&none, &tree.allocator.turn[2], sizeof none);
}

static void test_the_least_battery_that_is_full_takes_nothing(void) {
    tree_start(&tree, 2, 1);
    taper_demand_t *full = &tree.snapshot.demand[0];
    full->departs_in_s = -100000;
    full->peak_W = full->taper_W = 7000;
    full->capacity_Wh = full->stored_Wh = 1;
    tree_allocate(&tree);
    tree_assert_on(&tree, "1");
}

static void test_who_takes_a_watt_can_charge(void) {
    tree_start(&tree, 2, 1);
    tree.snapshot.demand[0].peak_W = 1;
    tree.snapshot.demand[0].need_Wh = 1; /* an hour */
    tree.snapshot.demand[0].departs_in_s = 0;
    tree_laxity(&tree, 1, -3599);
    tree_allocate(&tree);
    tree_assert_on(&tree, "0");
}

/** The longest reaction counts, and the pause between two changes, both for who gives up and for who gets the current. */
static void test_a_turn_lasts_longer_than_the_hand_over_to_it(void) {
    for (int slow = 0; slow < 2; slow++) {
        tree_init(&tree);
        tree_start(&tree, 2, 1);
        tree.config.min_on_ms = tree.config.min_off_ms = 0;
        tree.config.turn_ms = 1000;
        tree.config.change_ms = 2000;
        tree.connector[slow].reaction_ms = 5000;
        tree.connector[1 - slow].reaction_ms = 4000;
        tree_allocate(&tree);
        tree_allocate_after(&tree, 13999);
        tree_assert_on(&tree, "0");
        tree_allocate_after(&tree, 1);
        tree_assert_on(&tree, "1");
    }
}

static void test_without_a_reaction_a_turn_is_as_long_as_described(void) {
    tree_start(&tree, 2, 1);
    tree.config.min_on_ms = tree.config.min_off_ms = 0;
    tree.config.turn_ms = 1000;
    tree.config.change_ms = 2000;
    tree_allocate(&tree);
    tree_allocate_after(&tree, 999);
    tree_assert_on(&tree, "0");
    tree_allocate_after(&tree, 1);
    tree_assert_on(&tree, "1");
}

static void test_the_least_minimum_needs_a_turn(void) {
    tree_start(&tree, 1, 1);
    tree.snapshot.demand[0].min_mA = 1;
    TEST_ASSERT_EQUAL_INT32(6000, tree_allocate(&tree));
}

static void test_who_is_on_stays_for_the_last_of_what_it_is_owed(void) {
    for (int64_t owed_mWs = 0; owed_mWs < 2; owed_mWs++) {
        tree_init(&tree);
        tree_start(&tree, 1, 1);
        TEST_ASSERT_EQUAL_INT32(6000, tree_allocate(&tree));
        tree_wish(&tree, 0, 3000, 3000);
        tree.allocator.turn[0].owed_mWs = owed_mWs;
        tree.allocator.turn[0].lacks_mW = 0;
        TEST_ASSERT_EQUAL_INT32(owed_mWs == 0 ? 0 : 6000, tree_allocate_after(&tree, 300000));
    }
}

static void test_a_queue_begins_empty(void) {
    taper_queue_t queue = {.wishing = 1, .count = 1};
    tree_start(&tree, 1, 1);
    taper_turns_line_up(&tree.allocator, &tree.config, &tree.snapshot, &tree.proposal, &queue);
    TEST_ASSERT_EQUAL_UINT8(1, queue.count);
    TEST_ASSERT_EQUAL_UINT8(1, queue.wishing);
}

static void test_whoever_has_any_current_is_on_and_does_not_wait(void) {
    for (int32_t current_mA = 0; current_mA < 2; current_mA++) {
        taper_queue_t queue;
        tree_init(&tree);
        tree_start(&tree, 1, 1);
        tree.setpoints.current_mA[0] = current_mA;
        taper_turns_begin(&tree.allocator, &tree.config, &tree.snapshot);
        taper_turns_line_up(&tree.allocator, &tree.config, &tree.snapshot, &tree.proposal, &queue);
        taper_turns_end(&tree.allocator, &tree.config, &tree.snapshot, &tree.proposal, &queue,
                        &tree.setpoints);
        TEST_ASSERT_EQUAL(current_mA > 0, tree.allocator.turn[0].on);
        TEST_ASSERT_EQUAL_UINT8(current_mA > 0 ? 0 : 1, taper_allocator_waiting(&tree.allocator, 0).place);
    }
}

static void test_a_turn_that_is_kept_goes_on_as_much_later(void) {
    const taper_turn_t before = {.on = true,
                                 .switched = true,
                                 .place = 1,
                                 .session = 1,
                                 .since_ms = 2000,
                                 .waiting_ms = 3000,
                                 .owed_mWs = -1234567,
                                 .lacks_mW = 5};
    tree.allocator.turn[1] = before;
    const taper_turn_kept_t kept = taper_allocator_keep(&tree.allocator, 1, 5002999);
    TEST_ASSERT_TRUE(kept.on && kept.switched && kept.waits);
    TEST_ASSERT_EQUAL_UINT32(5000, kept.since_s);
    TEST_ASSERT_EQUAL_UINT32(4999, kept.waiting_s);
    TEST_ASSERT_EQUAL_INT32(-1234, kept.owed_Ws);
    taper_allocator_restore(&tree.allocator, 0, 7, &kept, 100, 50000); /* a clock that began anew */
    const taper_turn_t *after = &tree.allocator.turn[0];
    TEST_ASSERT_TRUE(after->on && after->switched);
    TEST_ASSERT_EQUAL_UINT8(7, after->session);
    TEST_ASSERT_EQUAL_UINT8(1, after->place);
    TEST_ASSERT_EQUAL_UINT32(5100000, taper_elapsed_ms(50000, after->since_ms));
    TEST_ASSERT_EQUAL_UINT32(5099000, taper_elapsed_ms(50000, after->waiting_ms));
    TEST_ASSERT_EQUAL_INT64(-1234000, after->owed_mWs);
    TEST_ASSERT_EQUAL_INT64(0, after->lacks_mW);
}

static void test_a_turn_of_nobody_is_kept_as_such(void) {
    tree.allocator.turn[1].place = 0;
    const taper_turn_kept_t kept = taper_allocator_keep(&tree.allocator, 1, 0);
    TEST_ASSERT_FALSE(kept.on || kept.switched || kept.waits);
    taper_allocator_restore(&tree.allocator, 1, 3, &kept, 0, 0);
    TEST_ASSERT_EQUAL_UINT8(0, tree.allocator.turn[1].place);
    TEST_ASSERT_FALSE(tree.allocator.turn[1].on || tree.allocator.turn[1].switched);
}

static void test_a_debt_beyond_all_is_kept_as_the_greatest_that_can_be(void) {
    tree.allocator.turn[1].owed_mWs = INT64_MAX;
    TEST_ASSERT_EQUAL_INT32(INT32_MAX, taper_allocator_keep(&tree.allocator, 1, 0).owed_Ws);
}

static void test_no_turn_is_older_than_the_clock_can_tell(void) {
    taper_turn_kept_t kept = {.since_s = 999999, .waiting_s = UINT32_MAX};
    taper_allocator_restore(&tree.allocator, 1, 1, &kept, 0, 5);
    TEST_ASSERT_EQUAL_UINT32(999999000u, taper_elapsed_ms(5, tree.allocator.turn[1].since_ms));
    TEST_ASSERT_EQUAL_UINT32(1000000000u, taper_elapsed_ms(5, tree.allocator.turn[1].waiting_ms));
    taper_allocator_restore(&tree.allocator, 1, 1, &kept, UINT32_MAX, 5);
    TEST_ASSERT_EQUAL_UINT32(1000000000u, taper_elapsed_ms(5, tree.allocator.turn[1].since_ms));
}

static void test_every_switch_is_counted_once(void) {
    tree_start(&tree, 2, 2);
    tree_allocate(&tree);
    TEST_ASSERT_EQUAL_UINT32(2, tree.allocator.switches);
    tree_allocate_after(&tree, 1000);
    TEST_ASSERT_EQUAL_UINT32(2, tree.allocator.switches);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_who_stands_beyond_the_last_connector_has_no_turn);
    RUN_TEST(test_the_least_battery_that_is_full_takes_nothing);
    RUN_TEST(test_who_takes_a_watt_can_charge);
    RUN_TEST(test_a_turn_lasts_longer_than_the_hand_over_to_it);
    RUN_TEST(test_without_a_reaction_a_turn_is_as_long_as_described);
    RUN_TEST(test_the_least_minimum_needs_a_turn);
    RUN_TEST(test_who_is_on_stays_for_the_last_of_what_it_is_owed);
    RUN_TEST(test_a_queue_begins_empty);
    RUN_TEST(test_whoever_has_any_current_is_on_and_does_not_wait);
    RUN_TEST(test_a_turn_that_is_kept_goes_on_as_much_later);
    RUN_TEST(test_a_turn_of_nobody_is_kept_as_such);
    RUN_TEST(test_a_debt_beyond_all_is_kept_as_the_greatest_that_can_be);
    RUN_TEST(test_no_turn_is_older_than_the_clock_can_tell);
    RUN_TEST(test_every_switch_is_counted_once);
    return UNITY_END();
}
