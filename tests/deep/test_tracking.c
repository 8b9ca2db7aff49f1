/* Wishes below the minimum current, followed over time by switching on and off. */
#include "tree.h"
#include "unity.h"

static tree_t tree;

/** Vehicles of 6 A at least on one phase, with places for some; all would take 32 A. */
static void start(unsigned vehicles, int32_t limit_mA) {
    tree_init(&tree);
    for (unsigned i = 0; i < vehicles; i++) {
        tree_add(&tree, 0, L1);
    }
    tree.group[0].limit_mA = limit_mA;
}

void setUp(void) {
    start(1, 6000);
}
void tearDown(void) {}

/** Wish of connector 0 [mA]; its ceiling is as much, so that it gets nothing that is left over. */
static void wish(int32_t wish_mA) {
    tree_wish(&tree, 0, wish_mA, wish_mA);
}

static void test_it_is_switched_on_when_half_the_energy_of_the_least_time_on_is_owed(void) {
    wish(3000);
    TEST_ASSERT_EQUAL_INT32(0, tree_allocate(&tree));
    TEST_ASSERT_EQUAL_INT32(0, tree_allocate_after(&tree, 299999)); /* 3 A for 300 s: 6 A for 150 s */
    TEST_ASSERT_EQUAL_INT32(6000, tree_allocate_after(&tree, 1));
}

static void test_it_is_switched_off_when_it_was_given_what_it_was_owed(void) {
    wish(3000);
    tree_allocate(&tree);
    TEST_ASSERT_EQUAL_INT32(6000, tree_allocate_after(&tree, 300000)); /* owed 900 As, falls by 3 A */
    TEST_ASSERT_EQUAL_INT32(6000, tree_allocate_after(&tree, 299999));
    TEST_ASSERT_EQUAL_INT32(0, tree_allocate_after(&tree, 1));
    TEST_ASSERT_EQUAL_INT32(0, tree_allocate_after(&tree, 299999));
    TEST_ASSERT_EQUAL_INT32(6000, tree_allocate_after(&tree, 1));
}

static void test_a_small_wish_stays_on_for_its_least_time_and_pays_for_it_later(void) {
    wish(1000);
    tree_allocate(&tree);
    TEST_ASSERT_EQUAL_INT32(0, tree_allocate_after(&tree, 899999));
    TEST_ASSERT_EQUAL_INT32(6000, tree_allocate_after(&tree, 1)); /* owed 900 As */
    TEST_ASSERT_EQUAL_INT32(6000, tree_allocate_after(&tree, 299999));
    TEST_ASSERT_EQUAL_INT32(0, tree_allocate_after(&tree, 1)); /* given 1500 As too much: owed -600 As */
    TEST_ASSERT_EQUAL_INT32(0, tree_allocate_after(&tree, 1499999));
    TEST_ASSERT_EQUAL_INT32(6000, tree_allocate_after(&tree, 1));
}

static void test_a_great_wish_is_on_for_as_long_as_it_is_owed(void) {
    wish(5000);
    tree_allocate(&tree);
    TEST_ASSERT_EQUAL_INT32(6000, tree_allocate_after(&tree, 180000)); /* owed 900 As, falls by 1 A */
    TEST_ASSERT_EQUAL_INT32(6000, tree_allocate_after(&tree, 899999));
    TEST_ASSERT_EQUAL_INT32(0, tree_allocate_after(&tree, 1));
}

static void test_a_wish_of_the_minimum_needs_no_tracking(void) {
    tree.proposal.wish_W[0] = tree.proposal.ceiling_W[0] = 1380; /* 6 A */
    TEST_ASSERT_EQUAL_INT32(6000, tree_allocate(&tree));
    start(1, 6000);
    tree.proposal.wish_W[0] = tree.proposal.ceiling_W[0] =
        1356; /* more than a step below: a ceiling does not allow it */
    TEST_ASSERT_EQUAL_INT32(0, tree_allocate(&tree));
    start(1, 6000);
    tree.proposal.wish_W[0] = 0;
    tree.proposal.ceiling_W[0] = 1357; /* a step */
    TEST_ASSERT_EQUAL_INT32(6000, tree_allocate(&tree));
}

static void test_a_vehicle_that_takes_no_more_than_its_ceiling_has_its_minimum_all_the_time(void) {
    wish(3000);
    tree.snapshot.demand[0].peak_W = 713; /* 3.1 A: a step above */
    TEST_ASSERT_EQUAL_INT32(6000, tree_allocate(&tree));
    start(1, 6000);
    wish(3000);
    tree.snapshot.demand[0].peak_W = 714;
    TEST_ASSERT_EQUAL_INT32(0, tree_allocate(&tree));
    start(1, 6000);
    wish(3000);
    tree.snapshot.demand[0].need_Wh = 1; /* 3600 W for a second, 600 W for six */
    tree.config.tick_ms = 6000;
    TEST_ASSERT_EQUAL_INT32(6000, tree_allocate(&tree));
    start(1, 6000);
    wish(3000);
    tree.snapshot.demand[0].need_Wh = 1;
    tree.config.tick_ms = 5000; /* 720 W */
    TEST_ASSERT_EQUAL_INT32(0, tree_allocate(&tree));
    start(1, 6000);
    wish(3000);
    tree.snapshot.demand[0].need_Wh = 1;
    tree.config.tick_ms = 5049; /* 713.01 W: rounded up, beyond the step */
    TEST_ASSERT_EQUAL_INT32(0, tree_allocate(&tree));
    tree.config.tick_ms = 5050; /* 712.9 W */
    TEST_ASSERT_EQUAL_INT32(6000, tree_allocate_after(&tree, 1));
}

/** One that draws less than it is told is not given more than it draws. */
static void test_what_it_does_not_draw_is_not_booked_as_given(void) {
    wish(3000);
    tree.snapshot.demand[0].peak_W = 920; /* 4 A */
    tree_allocate(&tree);
    TEST_ASSERT_EQUAL_INT32(6000, tree_allocate_after(&tree, 300000)); /* owed 900 As, falls by 1 A */
    TEST_ASSERT_EQUAL_INT32(6000, tree_allocate_after(&tree, 899999));
    TEST_ASSERT_EQUAL_INT32(0, tree_allocate_after(&tree, 1));
}

static void test_what_is_left_over_counts_as_given_but_not_without_bound(void) {
    start(2, 12000);
    tree_wish(&tree, 0, 1000, 32000);
    tree_wish(&tree, 1, 0, 0);
    TEST_ASSERT_EQUAL_INT32(12000, tree_allocate(&tree));
    for (unsigned minute = 0; minute < 600; minute++) {
        tree_allocate_after(&tree, 60000);
    }
    /* No further than 6 A for 300 s and the last tick of 60 s. */
    TEST_ASSERT_EQUAL_INT64(-INT64_C(1380) * 360000, tree.allocator.turn[0].owed_mWs);
    tree_wish(&tree, 1, 32000, 32000);
    tree.group[0].limit_mA = 6000;
    tree_laxity(&tree, 0, 90000);
    tree_allocate_after(&tree, 1000);
    TEST_ASSERT_EQUAL_INT32(6000, tree.setpoints.current_mA[1]);
}

static void test_what_waits_is_owed_but_not_without_bound(void) {
    start(1, 5000);
    tree_allocate(&tree);
    tree_allocate_after(&tree, 100000);
    TEST_ASSERT_EQUAL_INT64(INT64_C(1380) * 400000, tree.allocator.turn[0].owed_mWs);
    tree_allocate_after(&tree, 1000);
    TEST_ASSERT_EQUAL_INT64(INT64_C(1380) * 301000, tree.allocator.turn[0].owed_mWs);
}

static void test_no_more_is_owed_than_the_vehicle_could_have_had(void) {
    start(1, 5000);
    tree.snapshot.demand[0].max_mA = 7000;
    tree.proposal.wish_W[0] = INT32_MAX;
    tree_allocate(&tree);
    tree_allocate_after(&tree, 10000);
    TEST_ASSERT_EQUAL_INT64(INT64_C(1610) * 10000, tree.allocator.turn[0].owed_mWs);
}

static void test_a_negative_wish_is_none(void) {
    start(1, 5000);
    tree.proposal.wish_W[0] = -5000;
    tree.proposal.ceiling_W[0] = 5000;
    tree_allocate(&tree);
    tree_allocate_after(&tree, 10000);
    TEST_ASSERT_EQUAL_INT64(0, tree.allocator.turn[0].owed_mWs);
}

static void test_nothing_is_owed_from_before_the_first_tick_nor_to_another_session(void) {
    tree.snapshot.now_ms = 4000000000u;
    wish(3000);
    TEST_ASSERT_EQUAL_INT32(0, tree_allocate(&tree));
    TEST_ASSERT_EQUAL_INT64(0, tree.allocator.turn[0].owed_mWs);
    tree_allocate_after(&tree, 100000);
    TEST_ASSERT_EQUAL_INT64(INT64_C(690) * 100000, tree.allocator.turn[0].owed_mWs);
    tree.snapshot.demand[0].session = 2;
    tree_allocate_after(&tree, 1000);
    TEST_ASSERT_EQUAL_INT64(0, tree.allocator.turn[0].owed_mWs);
    tree_allocate_after(&tree, 1000);
    TEST_ASSERT_EQUAL_INT64(690000, tree.allocator.turn[0].owed_mWs);
    tree.snapshot.demand[0].active = false;
    tree_allocate_after(&tree, 1000);
    TEST_ASSERT_EQUAL_INT64(0, tree.allocator.turn[0].owed_mWs);
    TEST_ASSERT_EQUAL_INT64(0, tree.allocator.turn[0].lacks_mW);
}

static void test_of_a_long_silence_one_hour_is_booked(void) {
    tree.config.min_on_ms = 100000000; /* so that the bound is out of the way */
    wish(1000);
    tree_allocate(&tree);
    tree_allocate_after(&tree, 3600001);
    TEST_ASSERT_EQUAL_INT64(INT64_C(230) * 3600000, tree.allocator.turn[0].owed_mWs);
    tree_allocate_after(&tree, 3599999);
    TEST_ASSERT_EQUAL_INT64(INT64_C(230) * 7199999, tree.allocator.turn[0].owed_mWs);
}

static void test_without_a_minimum_nothing_is_owed(void) {
    tree.snapshot.demand[0].min_mA = 0;
    tree.group[0].limit_mA = 1000;
    tree_allocate(&tree);
    tree_allocate_after(&tree, 10000);
    TEST_ASSERT_EQUAL_INT64(0, tree.allocator.turn[0].owed_mWs);
}

static void test_without_a_least_time_on_it_follows_from_tick_to_tick(void) {
    tree.config.min_on_ms = tree.config.min_off_ms = 0;
    wish(3000);
    TEST_ASSERT_EQUAL_INT32(0, tree_allocate(&tree));
    TEST_ASSERT_EQUAL_INT32(6000, tree_allocate_after(&tree, 1000));
    TEST_ASSERT_EQUAL_INT32(0, tree_allocate_after(&tree, 1000));
    TEST_ASSERT_EQUAL_INT32(6000, tree_allocate_after(&tree, 1000));
}

/** A plan like water, `wish_mA` each, in places that are just enough; 6 h, in ticks of `tick_ms`. */
static void run_plan(unsigned vehicles, int32_t wish_mA, int32_t limit_mA, uint32_t tick_ms) {
    start(vehicles, limit_mA);
    for (uint8_t i = 0; i < vehicles; i++) {
        tree_wish(&tree, i, wish_mA, wish_mA);
    }
    tree.config.tick_ms = tick_ms;
    int64_t given_mAs[TAPER_MAX_CONNECTORS] = {0};
    int64_t wished_mAs = 0;
    const int64_t bound_mAs = INT64_C(6000) * (300000 + tick_ms) / 1000;
    tree_allocate(&tree);
    for (uint32_t ms = 0; ms < 6u * 3600000u; ms += tick_ms) {
        wished_mAs += (int64_t)wish_mA * tick_ms / 1000;
        for (uint8_t i = 0; i < vehicles; i++) {
            given_mAs[i] += (int64_t)tree.setpoints.current_mA[i] * tick_ms / 1000;
            TEST_ASSERT_INT64_WITHIN((uint64_t)bound_mAs, wished_mAs, given_mAs[i]);
        }
        tree_allocate_after(&tree, tick_ms);
    }
    TEST_ASSERT_GREATER_THAN_INT64(5 * bound_mAs, wished_mAs);
}

static void test_a_plan_below_the_minimum_is_followed_over_six_hours(void) {
    static const uint32_t ticks_ms[] = {500, 1000, 10000, 60000, 300000};
    for (unsigned k = 0; k < sizeof ticks_ms / sizeof ticks_ms[0]; k++) {
        run_plan(1, 3000, 6000, ticks_ms[k]);
        run_plan(4, 3000, 24000, ticks_ms[k]);
        run_plan(8, 4500, 48000, ticks_ms[k]);
        run_plan(5, 5700, 30000, ticks_ms[k]);
    }
    run_plan(3, 3000, 18000, 900000);
}

static void test_a_plan_is_followed_where_the_minima_do_not_all_fit(void) {
    run_plan(4, 2000, 12000, 1000); /* 8 A of 12 A: two places for four */
    run_plan(6, 1000, 12000, 10000);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_it_is_switched_on_when_half_the_energy_of_the_least_time_on_is_owed);
    RUN_TEST(test_it_is_switched_off_when_it_was_given_what_it_was_owed);
    RUN_TEST(test_a_small_wish_stays_on_for_its_least_time_and_pays_for_it_later);
    RUN_TEST(test_a_great_wish_is_on_for_as_long_as_it_is_owed);
    RUN_TEST(test_a_wish_of_the_minimum_needs_no_tracking);
    RUN_TEST(test_a_vehicle_that_takes_no_more_than_its_ceiling_has_its_minimum_all_the_time);
    RUN_TEST(test_what_it_does_not_draw_is_not_booked_as_given);
    RUN_TEST(test_what_is_left_over_counts_as_given_but_not_without_bound);
    RUN_TEST(test_what_waits_is_owed_but_not_without_bound);
    RUN_TEST(test_no_more_is_owed_than_the_vehicle_could_have_had);
    RUN_TEST(test_a_negative_wish_is_none);
    RUN_TEST(test_nothing_is_owed_from_before_the_first_tick_nor_to_another_session);
    RUN_TEST(test_of_a_long_silence_one_hour_is_booked);
    RUN_TEST(test_without_a_minimum_nothing_is_owed);
    RUN_TEST(test_without_a_least_time_on_it_follows_from_tick_to_tick);
    RUN_TEST(test_a_plan_below_the_minimum_is_followed_over_six_hours);
    RUN_TEST(test_a_plan_is_followed_where_the_minima_do_not_all_fit);
    return UNITY_END();
}
