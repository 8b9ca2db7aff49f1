/* Who is on where the minimum currents do not all fit. */
#include <string.h>

#include "tree.h"
#include "unity.h"

static tree_t tree;

void setUp(void) {
    tree_init(&tree);
}
void tearDown(void) {}

static void test_where_all_minima_fit_all_are_on_and_nobody_waits(void) {
    tree_start(&tree, 3, 3);
    tree_allocate(&tree);
    tree_assert_on(&tree, "012");
    TEST_ASSERT_EQUAL_INT32(6000, tree.setpoints.current_mA[2]);
    tree_assert_waiting(&tree, 0, 0, 0);
    tree_assert_waiting(&tree, 2, 0, 0);
}

static void test_what_is_left_beyond_the_minima_goes_by_rank(void) {
    tree_start(&tree, 3, 3);
    tree.group[0].limit_mA = 30000;
    const uint8_t rank[] = {1, 2, 0};
    memcpy(tree.proposal.rank, rank, sizeof rank);
    tree_wish(&tree, 1, 10000, 20000);
    tree_wish(&tree, 2, 9000, 9000);
    tree_wish(&tree, 0, 7000, 32000);
    tree_allocate(&tree);
    TEST_ASSERT_EQUAL_INT32(7000, tree.setpoints.current_mA[0]);
    TEST_ASSERT_EQUAL_INT32(14000, tree.setpoints.current_mA[1]); /* all wishes first, 4 A left over */
    TEST_ASSERT_EQUAL_INT32(9000, tree.setpoints.current_mA[2]);
}

static void test_who_has_the_least_laxity_is_on_first(void) {
    tree_start(&tree, 4, 2);
    tree_laxity(&tree, 3, -1000);
    tree_allocate(&tree);
    tree_assert_on(&tree, "03");
    tree_assert_waiting(&tree, 1, 1, 2);
    tree_assert_waiting(&tree, 2, 2, 2);
    tree_assert_waiting(&tree, 3, 0, 0);
}

static void test_equal_laxity_goes_by_index(void) {
    tree_start(&tree, 3, 2);
    for (uint8_t i = 0; i < 3; i++) {
        tree_laxity(&tree, i, 500);
    }
    tree_allocate(&tree);
    tree_assert_on(&tree, "01");
    tree_init(&tree);
    tree_start(&tree, 3, 2);
    tree_laxity(&tree, 0, 502);
    tree_laxity(&tree, 1, 501);
    tree_laxity(&tree, 2, 500);
    tree_allocate(&tree);
    tree_assert_on(&tree, "12");
}

/** Need and departure are equal: what the battery takes decides. */
static void test_laxity_counts_what_the_battery_still_takes(void) {
    tree_start(&tree, 2, 1);
    for (uint8_t i = 0; i < 2; i++) {
        tree.snapshot.demand[i].departs_in_s = 36000;
        tree.snapshot.demand[i].need_Wh = 10000;
        tree.snapshot.demand[i].peak_W = 7000;
        tree.snapshot.demand[i].taper_W = 7000;
        tree.snapshot.demand[i].capacity_Wh = 60000;
        tree.snapshot.demand[i].stored_Wh = 30000;
    }
    tree.snapshot.demand[1].stored_Wh = 31000; /* takes less, needs longer */
    tree_allocate(&tree);
    tree_assert_on(&tree, "1");
    tree_init(&tree);
    tree_start(&tree, 2, 1);
    for (uint8_t i = 0; i < 2; i++) {
        tree.snapshot.demand[i].departs_in_s = 36000;
        tree.snapshot.demand[i].peak_W = i == 0 ? 3000 : 2900; /* of unknown capacity */
        tree.snapshot.demand[i].taper_W = 2900;
        tree.snapshot.demand[i].stored_Wh = 1000;
    }
    tree_allocate(&tree);
    tree_assert_on(&tree, "1");
}

static void test_whose_battery_takes_nothing_comes_last(void) {
    tree_start(&tree, 2, 1);
    tree.snapshot.demand[0].departs_in_s = -100000;
    tree.snapshot.demand[0].peak_W = 7000;
    tree.snapshot.demand[0].taper_W = 7000;
    tree.snapshot.demand[0].capacity_Wh = 60000;
    tree.snapshot.demand[0].stored_Wh = 60000;
    tree_allocate(&tree);
    tree_assert_on(&tree, "1");
    tree_init(&tree);
    tree_start(&tree, 2, 1);
    tree.snapshot.demand[0].departs_in_s = -100000;
    tree.snapshot.demand[0].peak_W = 0;
    tree_allocate(&tree);
    tree_assert_on(&tree, "1");
}

static void test_laxity_is_worked_out_to_the_second(void) {
    tree_start(&tree, 2, 1);
    for (uint8_t i = 0; i < 2; i++) {
        tree.snapshot.demand[i].need_Wh = 7360; /* an hour at 32 A */
        tree.snapshot.demand[i].departs_in_s = 7200;
    }
    tree.snapshot.demand[1].departs_in_s = 7199;
    tree_allocate(&tree);
    tree_assert_on(&tree, "1");
    tree_init(&tree);
    tree_start(&tree, 2, 1);
    tree.snapshot.demand[0].need_Wh = 7360;
    tree.snapshot.demand[0].departs_in_s = 7200; /* 3600 s */
    tree.snapshot.demand[1].need_Wh = 14720;
    tree.snapshot.demand[1].departs_in_s = 10799; /* 3599 s */
    tree_allocate(&tree);
    tree_assert_on(&tree, "1");
}

static void test_a_long_need_is_worked_out_to_the_second(void) {
    tree_start(&tree, 2, 1);
    tree.snapshot.demand[0].need_Wh = 7360;
    tree.snapshot.demand[0].departs_in_s = 7200; /* 3600 s */
    tree.snapshot.demand[1].need_Wh = 736000;    /* 100 hours */
    tree.snapshot.demand[1].departs_in_s = 363601;
    tree_allocate(&tree);
    tree_assert_on(&tree, "0");
    tree_init(&tree);
    tree_start(&tree, 2, 1);
    tree.snapshot.demand[0].need_Wh = 736000;
    tree.snapshot.demand[0].departs_in_s = 363601;
    tree.snapshot.demand[1].need_Wh = 7360;
    tree.snapshot.demand[1].departs_in_s = 7200;
    tree_allocate(&tree);
    tree_assert_on(&tree, "1");
}

static void test_a_wish_of_just_the_minimum_comes_before_a_ceiling(void) {
    tree_start(&tree, 2, 1);
    tree_laxity(&tree, 0, 5000);
    tree_wish(&tree, 0, 6000, 6000);
    tree_wish(&tree, 1, 0, 32000);
    tree_laxity(&tree, 1, 0);
    tree_allocate(&tree);
    tree_assert_on(&tree, "0");
}

static void test_a_turn_lasts_until_it_is_over_while_others_wait(void) {
    tree_start(&tree, 2, 1);
    tree_laxity(&tree, 1, 100);
    tree_laxity(&tree, 0, 50);
    tree_allocate(&tree);
    tree_assert_on(&tree, "0");
    tree_laxity(&tree, 1, -5000); /* more urgent by now, but its turn has not come */
    tree_allocate_after(&tree, 900000 - 1);
    tree_assert_on(&tree, "0");
    tree_allocate_after(&tree, 1);
    tree_assert_on(&tree, "1");
    tree_assert_waiting(&tree, 0, 1, 1);
}

static void test_nobody_leaves_when_the_turn_is_over_and_nobody_waits(void) {
    tree_start(&tree, 2, 2);
    tree_allocate(&tree);
    tree_allocate_after(&tree, 2 * 900000);
    tree_assert_on(&tree, "01");
}

static void test_who_waited_for_a_turn_is_before_who_is_more_urgent(void) {
    tree_start(&tree, 3, 1);
    tree_allocate(&tree);
    tree_allocate_after(&tree, 899999);
    tree_assert_on(&tree, "0");
    tree_laxity(&tree, 0, -9000);
    tree_laxity(&tree, 1, 100);
    tree_laxity(&tree, 2, 50);
    tree_allocate_after(&tree, 1);
    tree_assert_on(&tree, "1"); /* both others are overdue for as long: by index */
    tree_assert_waiting(&tree, 2, 1, 2);
    tree_assert_waiting(&tree, 0, 2, 2);
}

static void test_of_those_overdue_the_one_that_waited_longest_is_first(void) {
    tree_start(&tree, 3, 1);
    tree.snapshot.demand[1].active = false;
    tree_allocate(&tree);
    tree.snapshot.demand[1].active = true; /* waits a second less, and is far more urgent */
    tree_laxity(&tree, 1, -9000);
    tree_allocate_after(&tree, 1000);
    tree_assert_waiting(&tree, 1, 1, 2);
    tree_assert_waiting(&tree, 2, 2, 2);
    tree_allocate_after(&tree, 900000);
    tree_assert_on(&tree, "2");
    tree_assert_waiting(&tree, 1, 1, 2);
}

static void test_before_it_is_overdue_a_waiting_one_is_served_by_laxity(void) {
    tree_start(&tree, 2, 1);
    tree.snapshot.demand[1].active = false;
    tree_allocate(&tree);
    tree.snapshot.demand[1].active = true;
    tree_allocate_after(&tree, 300000);
    tree_allocate_after(&tree, 899999); /* the turn is long over, but the other is not so urgent */
    tree_assert_on(&tree, "0");
    tree_allocate_after(&tree, 1);
    tree_assert_on(&tree, "1");
}

static void test_who_was_switched_on_lately_is_before_all_others(void) {
    tree.config.turn_ms = 100000; /* shorter than the least time on */
    tree_start(&tree, 2, 1);
    tree_allocate(&tree);
    tree_allocate_after(&tree, 299999);
    tree_assert_on(&tree, "0");
    tree_allocate_after(&tree, 1);
    tree_assert_on(&tree, "1");
}

static void test_of_those_on_the_ones_on_lately_stay_when_the_limit_falls(void) {
    tree_start(&tree, 2, 1);
    tree_allocate(&tree);
    tree.group[0].limit_mA = 12000;
    tree_allocate_after(&tree, 300000); /* 0 may leave from now on, 1 has just come */
    tree_assert_on(&tree, "01");
    tree.group[0].limit_mA = 6000;
    tree_allocate_after(&tree, 1000);
    tree_assert_on(&tree, "1");
}

static void test_a_limit_that_falls_sheds_the_largest_laxity_first(void) {
    tree_start(&tree, 5, 5);
    static const int32_t laxity_s[] = {500, 100, 400, 200, 300};
    for (uint8_t i = 0; i < 5; i++) {
        tree_laxity(&tree, i, laxity_s[i]);
    }
    tree_allocate(&tree);
    static const char *const left[] = {"1234", "134", "13", "1", ""};
    for (int32_t places = 4; places >= 0; places--) {
        tree.group[0].limit_mA = places * 6000 + (places < 4 ? 5999 : 0);
        tree_allocate_after(&tree, 1000);
        tree_assert_on(&tree, left[4 - places]);
    }
    tree_assert_waiting(&tree, 1, 1, 5);
    tree_assert_waiting(&tree, 0, 5, 5);
}

static void test_beyond_the_least_time_on_it_sheds_by_laxity_too(void) {
    tree_start(&tree, 3, 3);
    tree_laxity(&tree, 0, 50000);
    tree_allocate(&tree);
    tree.group[0].limit_mA = 12000;
    tree_allocate_after(&tree, 400000);
    tree_assert_on(&tree, "12");
}

static void test_who_was_shed_is_off_for_its_least_time(void) {
    tree_start(&tree, 2, 2);
    tree_allocate(&tree);
    tree.group[0].limit_mA = 6000;
    tree_allocate_after(&tree, 1000);
    tree_assert_on(&tree, "0");
    tree.group[0].limit_mA = 12000;
    tree_allocate_after(&tree, 299999);
    tree_assert_on(&tree, "0");
    tree_assert_waiting(&tree, 1, 1, 1);
    tree_allocate_after(&tree, 1);
    tree_assert_on(&tree, "01");
    tree_assert_waiting(&tree, 1, 0, 0);
}

static void test_who_is_kept_off_stands_behind_those_who_may_be_switched_on(void) {
    tree_start(&tree, 3, 2);
    tree_allocate(&tree);
    tree_laxity(&tree, 0, 9000);
    tree_laxity(&tree, 1, 8000);
    tree.group[0].limit_mA = 6000;
    tree_allocate_after(&tree, 1000); /* 0 is shed; 2 has never been on */
    tree_assert_on(&tree, "1");
    tree_laxity(&tree, 0, -5000);
    tree_allocate_after(&tree, 1000);
    tree_assert_waiting(&tree, 2, 1, 2);
    tree_assert_waiting(&tree, 0, 2, 2);
}

static void test_the_wait_counts_from_when_it_was_shed(void) {
    tree_start(&tree, 2, 2);
    tree_allocate(&tree);
    tree.group[0].limit_mA = 6000;
    tree_allocate_after(&tree, 100000);
    tree_allocate_after(&tree, 899999);
    tree_assert_on(&tree, "0");
    tree_allocate_after(&tree, 1);
    tree_assert_on(&tree, "1");
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_where_all_minima_fit_all_are_on_and_nobody_waits);
    RUN_TEST(test_what_is_left_beyond_the_minima_goes_by_rank);
    RUN_TEST(test_who_has_the_least_laxity_is_on_first);
    RUN_TEST(test_equal_laxity_goes_by_index);
    RUN_TEST(test_laxity_counts_what_the_battery_still_takes);
    RUN_TEST(test_whose_battery_takes_nothing_comes_last);
    RUN_TEST(test_laxity_is_worked_out_to_the_second);
    RUN_TEST(test_a_long_need_is_worked_out_to_the_second);
    RUN_TEST(test_a_wish_of_just_the_minimum_comes_before_a_ceiling);
    RUN_TEST(test_a_turn_lasts_until_it_is_over_while_others_wait);
    RUN_TEST(test_nobody_leaves_when_the_turn_is_over_and_nobody_waits);
    RUN_TEST(test_who_waited_for_a_turn_is_before_who_is_more_urgent);
    RUN_TEST(test_of_those_overdue_the_one_that_waited_longest_is_first);
    RUN_TEST(test_before_it_is_overdue_a_waiting_one_is_served_by_laxity);
    RUN_TEST(test_who_was_switched_on_lately_is_before_all_others);
    RUN_TEST(test_of_those_on_the_ones_on_lately_stay_when_the_limit_falls);
    RUN_TEST(test_a_limit_that_falls_sheds_the_largest_laxity_first);
    RUN_TEST(test_beyond_the_least_time_on_it_sheds_by_laxity_too);
    RUN_TEST(test_who_was_shed_is_off_for_its_least_time);
    RUN_TEST(test_who_is_kept_off_stands_behind_those_who_may_be_switched_on);
    RUN_TEST(test_the_wait_counts_from_when_it_was_shed);
    return UNITY_END();
}
