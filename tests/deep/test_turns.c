/* Who is on where the minimum currents do not all fit, and for how long the others wait. */
#include <string.h>

#include "tree.h"
#include "unity.h"

#define MINUTE_ms 60000u

static tree_t tree;

void setUp(void) {
    tree_init(&tree);
}
void tearDown(void) {}

/** `vehicles` on one phase, `places` for their minima. Laxity rises with the index, an hour each. */
static void start(unsigned vehicles, int32_t places) {
    for (unsigned i = 0; i < vehicles; i++) {
        tree_laxity(&tree, tree_add(&tree, 0, L1), (int32_t)i * 3600);
    }
    tree.group[0].limit_mA = places * 6000;
}

static bool is_on(uint8_t i) {
    return tree.setpoints.current_mA[i] > 0;
}

/** Who is on, as a string of digits. */
static void assert_on(const char *expected) {
    char on[TAPER_MAX_CONNECTORS + 1];
    unsigned count = 0;
    for (uint8_t i = 0; i < tree.config.connector_count; i++) {
        if (is_on(i)) {
            on[count++] = (char)('0' + i);
        }
    }
    on[count] = '\0';
    TEST_ASSERT_EQUAL_STRING(expected, on);
}

static void assert_waiting(uint8_t i, uint8_t place, uint8_t of) {
    const taper_waiting_t waiting = taper_allocator_waiting(&tree.allocator, i);
    TEST_ASSERT_EQUAL_UINT8(place, waiting.place);
    TEST_ASSERT_EQUAL_UINT8(of, waiting.of);
}

static void test_where_all_minima_fit_all_are_on_and_nobody_waits(void) {
    start(3, 3);
    tree_allocate(&tree);
    assert_on("012");
    TEST_ASSERT_EQUAL_INT32(6000, tree.setpoints.current_mA[2]);
    assert_waiting(0, 0, 0);
    assert_waiting(2, 0, 0);
}

static void test_what_is_left_beyond_the_minima_goes_by_rank(void) {
    start(3, 3);
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
    start(4, 2);
    tree_laxity(&tree, 3, -1000);
    tree_allocate(&tree);
    assert_on("03");
    assert_waiting(1, 1, 2);
    assert_waiting(2, 2, 2);
    assert_waiting(3, 0, 0);
}

static void test_equal_laxity_goes_by_index(void) {
    start(3, 2);
    for (uint8_t i = 0; i < 3; i++) {
        tree_laxity(&tree, i, 500);
    }
    tree_allocate(&tree);
    assert_on("01");
    tree_init(&tree);
    start(3, 2);
    tree_laxity(&tree, 0, 502);
    tree_laxity(&tree, 1, 501);
    tree_laxity(&tree, 2, 500);
    tree_allocate(&tree);
    assert_on("12");
}

/** Need and departure are equal: what the battery takes decides. */
static void test_laxity_counts_what_the_battery_still_takes(void) {
    start(2, 1);
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
    assert_on("1");
    tree_init(&tree);
    start(2, 1);
    for (uint8_t i = 0; i < 2; i++) {
        tree.snapshot.demand[i].departs_in_s = 36000;
        tree.snapshot.demand[i].peak_W = i == 0 ? 3000 : 2900; /* of unknown capacity */
        tree.snapshot.demand[i].taper_W = 2900;
        tree.snapshot.demand[i].stored_Wh = 1000;
    }
    tree_allocate(&tree);
    assert_on("1");
}

static void test_whose_battery_takes_nothing_comes_last(void) {
    start(2, 1);
    tree.snapshot.demand[0].departs_in_s = -100000;
    tree.snapshot.demand[0].peak_W = 7000;
    tree.snapshot.demand[0].taper_W = 7000;
    tree.snapshot.demand[0].capacity_Wh = 60000;
    tree.snapshot.demand[0].stored_Wh = 60000;
    tree_allocate(&tree);
    assert_on("1");
    tree_init(&tree);
    start(2, 1);
    tree.snapshot.demand[0].departs_in_s = -100000;
    tree.snapshot.demand[0].peak_W = 0;
    tree_allocate(&tree);
    assert_on("1");
}

static void test_laxity_is_worked_out_to_the_second(void) {
    start(2, 1);
    for (uint8_t i = 0; i < 2; i++) {
        tree.snapshot.demand[i].need_Wh = 7360; /* an hour at 32 A */
        tree.snapshot.demand[i].departs_in_s = 7200;
    }
    tree.snapshot.demand[1].departs_in_s = 7199;
    tree_allocate(&tree);
    assert_on("1");
    tree_init(&tree);
    start(2, 1);
    tree.snapshot.demand[0].need_Wh = 7360;
    tree.snapshot.demand[0].departs_in_s = 7200; /* 3600 s */
    tree.snapshot.demand[1].need_Wh = 14720;
    tree.snapshot.demand[1].departs_in_s = 10799; /* 3599 s */
    tree_allocate(&tree);
    assert_on("1");
}

static void test_a_turn_lasts_until_it_is_over_while_others_wait(void) {
    start(2, 1);
    tree_laxity(&tree, 1, 100);
    tree_laxity(&tree, 0, 50);
    tree_allocate(&tree);
    assert_on("0");
    tree_laxity(&tree, 1, -5000); /* more urgent by now, but its turn has not come */
    tree_allocate_after(&tree, 900000 - 1);
    assert_on("0");
    tree_allocate_after(&tree, 1);
    assert_on("1");
    assert_waiting(0, 1, 1);
}

static void test_nobody_leaves_when_the_turn_is_over_and_nobody_waits(void) {
    start(2, 2);
    tree_allocate(&tree);
    tree_allocate_after(&tree, 2 * 900000);
    assert_on("01");
}

static void test_who_waited_for_a_turn_is_before_who_is_more_urgent(void) {
    start(3, 1);
    tree_allocate(&tree);
    tree_allocate_after(&tree, 899999);
    assert_on("0");
    tree_laxity(&tree, 0, -9000);
    tree_laxity(&tree, 1, 100);
    tree_laxity(&tree, 2, 50);
    tree_allocate_after(&tree, 1);
    assert_on("1"); /* both others are overdue for as long: by index */
    assert_waiting(2, 1, 2);
    assert_waiting(0, 2, 2);
}

static void test_of_those_overdue_the_one_that_waited_longest_is_first(void) {
    start(3, 1);
    tree.snapshot.demand[1].active = false;
    tree_allocate(&tree);
    tree.snapshot.demand[1].active = true; /* waits a second less, and is far more urgent */
    tree_laxity(&tree, 1, -9000);
    tree_allocate_after(&tree, 1000);
    assert_waiting(1, 1, 2);
    assert_waiting(2, 2, 2);
    tree_allocate_after(&tree, 900000);
    assert_on("2");
    assert_waiting(1, 1, 2);
}

static void test_before_it_is_overdue_a_waiting_one_is_served_by_laxity(void) {
    start(2, 1);
    tree.snapshot.demand[1].active = false;
    tree_allocate(&tree);
    tree.snapshot.demand[1].active = true;
    tree_allocate_after(&tree, 300000);
    tree_allocate_after(&tree, 899999); /* the turn is long over, but the other is not so urgent */
    assert_on("0");
    tree_allocate_after(&tree, 1);
    assert_on("1");
}

static void test_who_was_switched_on_lately_is_before_all_others(void) {
    tree.config.turn_ms = 100000; /* shorter than the least time on */
    start(2, 1);
    tree_allocate(&tree);
    tree_allocate_after(&tree, 299999);
    assert_on("0");
    tree_allocate_after(&tree, 1);
    assert_on("1");
}

static void test_of_those_on_the_ones_on_lately_stay_when_the_limit_falls(void) {
    start(2, 1);
    tree_allocate(&tree);
    tree.group[0].limit_mA = 12000;
    tree_allocate_after(&tree, 300000); /* 0 may leave from now on, 1 has just come */
    assert_on("01");
    tree.group[0].limit_mA = 6000;
    tree_allocate_after(&tree, 1000);
    assert_on("1");
}

static void test_a_limit_that_falls_sheds_the_largest_laxity_first(void) {
    start(5, 5);
    static const int32_t laxity_s[] = {500, 100, 400, 200, 300};
    for (uint8_t i = 0; i < 5; i++) {
        tree_laxity(&tree, i, laxity_s[i]);
    }
    tree_allocate(&tree);
    static const char *const left[] = {"1234", "134", "13", "1", ""};
    for (int32_t places = 4; places >= 0; places--) {
        tree.group[0].limit_mA = places * 6000 + (places < 4 ? 5999 : 0);
        tree_allocate_after(&tree, 1000);
        assert_on(left[4 - places]);
    }
    assert_waiting(1, 1, 5);
    assert_waiting(0, 5, 5);
}

static void test_beyond_the_least_time_on_it_sheds_by_laxity_too(void) {
    start(3, 3);
    tree_laxity(&tree, 0, 50000);
    tree_allocate(&tree);
    tree.group[0].limit_mA = 12000;
    tree_allocate_after(&tree, 400000);
    assert_on("12");
}

static void test_who_was_shed_is_off_for_its_least_time(void) {
    start(2, 2);
    tree_allocate(&tree);
    tree.group[0].limit_mA = 6000;
    tree_allocate_after(&tree, 1000);
    assert_on("0");
    tree.group[0].limit_mA = 12000;
    tree_allocate_after(&tree, 299999);
    assert_on("0");
    assert_waiting(1, 1, 1);
    tree_allocate_after(&tree, 1);
    assert_on("01");
    assert_waiting(1, 0, 0);
}

static void test_who_is_kept_off_stands_behind_those_who_may_be_switched_on(void) {
    start(3, 2);
    tree_allocate(&tree);
    tree_laxity(&tree, 0, 9000);
    tree_laxity(&tree, 1, 8000);
    tree.group[0].limit_mA = 6000;
    tree_allocate_after(&tree, 1000); /* 0 is shed; 2 has never been on */
    assert_on("1");
    tree_laxity(&tree, 0, -5000);
    tree_allocate_after(&tree, 1000);
    assert_waiting(2, 1, 2);
    assert_waiting(0, 2, 2);
}

static void test_the_wait_counts_from_when_it_was_shed(void) {
    start(2, 2);
    tree_allocate(&tree);
    tree.group[0].limit_mA = 6000;
    tree_allocate_after(&tree, 100000);
    tree_allocate_after(&tree, 899999);
    assert_on("0");
    tree_allocate_after(&tree, 1);
    assert_on("1");
}

static void test_who_wants_nothing_does_not_wait(void) {
    start(3, 1);
    tree_wish(&tree, 1, 0, 0);
    tree.snapshot.demand[2].active = false;
    tree_allocate(&tree);
    assert_waiting(1, 0, 0);
    assert_waiting(2, 0, 0);
    tree_wish(&tree, 1, 32000, 32000);
    tree_allocate_after(&tree, 900000); /* it waits only now */
    assert_on("0");
    assert_waiting(1, 1, 1);
    tree_wish(&tree, 1, 0, 0);
    tree_allocate_after(&tree, 1000);
    assert_waiting(1, 0, 0);
}

static void test_whose_minimum_is_above_its_maximum_can_have_nothing_and_does_not_wait(void) {
    start(1, 1);
    tree.snapshot.demand[0].max_mA = 6000;
    TEST_ASSERT_EQUAL_INT32(6000, tree_allocate(&tree));
    tree_init(&tree);
    start(1, 1);
    tree.snapshot.demand[0].max_mA = 5900;
    TEST_ASSERT_EQUAL_INT32(0, tree_allocate(&tree));
    assert_waiting(0, 0, 0);
}

static void test_a_minimum_between_two_steps_is_rounded_up(void) {
    start(1, 1);
    tree.snapshot.demand[0].min_mA = 6001;
    tree.group[0].limit_mA = 6099;
    TEST_ASSERT_EQUAL_INT32(0, tree_allocate(&tree));
    tree.group[0].limit_mA = 6100;
    TEST_ASSERT_EQUAL_INT32(6100, tree_allocate(&tree));
}

static void test_without_a_minimum_nobody_needs_a_turn(void) {
    start(3, 1);
    for (uint8_t i = 0; i < 3; i++) {
        tree.snapshot.demand[i].min_mA = 0;
    }
    tree_wish(&tree, 0, 2000, 2000);
    tree_wish(&tree, 1, 3500, 3500);
    tree_allocate(&tree);
    TEST_ASSERT_EQUAL_INT32(2000, tree.setpoints.current_mA[0]);
    TEST_ASSERT_EQUAL_INT32(3500, tree.setpoints.current_mA[1]);
    TEST_ASSERT_EQUAL_INT32(500, tree.setpoints.current_mA[2]);
    tree.group[0].limit_mA = 0;
    tree_allocate_after(&tree, 1000);
    assert_waiting(0, 0, 0);
    tree.group[0].limit_mA = 2000;
    tree_allocate_after(&tree, 1000);
    TEST_ASSERT_EQUAL_INT32(2000, tree.setpoints.current_mA[0]); /* nor is it kept off */
}

static void test_minima_come_before_those_that_need_none(void) {
    start(2, 1);
    tree.snapshot.demand[0].min_mA = 0;
    tree_allocate(&tree);
    TEST_ASSERT_EQUAL_INT32(0, tree.setpoints.current_mA[0]);
    TEST_ASSERT_EQUAL_INT32(6000, tree.setpoints.current_mA[1]);
}

static void test_a_ceiling_alone_comes_after_all_wishes(void) {
    start(3, 2);
    tree_wish(&tree, 0, 0, 32000);
    tree_wish(&tree, 1, 7000, 7000);
    tree_wish(&tree, 2, 5800, 5800); /* below its minimum, and not due */
    tree.group[0].limit_mA = 12999;
    tree_allocate(&tree);
    assert_on("1");
    assert_waiting(0, 1, 1);
    assert_waiting(2, 0, 0);
    tree.group[0].limit_mA = 13000;
    tree_allocate_after(&tree, 1000);
    assert_on("01");
    TEST_ASSERT_EQUAL_INT32(7000, tree.setpoints.current_mA[1]);
}

static void test_of_those_with_a_ceiling_alone_who_waited_too_long_is_first(void) {
    start(2, 1);
    tree_wish(&tree, 0, 0, 32000);
    tree_wish(&tree, 1, 0, 32000);
    tree_allocate(&tree);
    assert_on("0");
    assert_waiting(1, 1, 1);
    tree_allocate_after(&tree, 900000);
    assert_on("1");
}

static void test_if_one_minimum_fits_somebody_is_on(void) {
    tree_add(&tree, 0, L1 | L2 | L3);
    tree_add(&tree, 0, L2);
    tree_laxity(&tree, 0, -1000);
    tree.snapshot.demand[0].min_mA = 10000;
    tree.group[0].limit_mA = 6000;
    tree_allocate(&tree);
    assert_on("1");
    for (unsigned k = 0; k < 10; k++) { /* what never fits keeps nobody off, however long it waits */
        tree_allocate_after(&tree, 900000);
        assert_on("1");
    }
}

/** Three places for small ones, or one large. Their turns never end at the same time. */
static void test_small_minima_do_not_shut_out_a_large_one(void) {
    start(6, 3);
    tree.snapshot.demand[5].min_mA = 18000;
    tree_laxity(&tree, 5, 90000);
    for (uint8_t i = 1; i < 3; i++) {
        tree.snapshot.demand[i].active = false;
    }
    tree.snapshot.demand[3].active = tree.snapshot.demand[4].active = false;
    tree_allocate(&tree);
    assert_on("0");
    for (uint8_t i = 1; i < 5; i++) {
        tree.snapshot.demand[i].active = true;
        tree_allocate_after(&tree, 200000);
    }
    assert_on("012");
    unsigned minutes = 14; /* since it began to wait */
    while (!is_on(5) && minutes < 100) {
        tree_allocate_after(&tree, MINUTE_ms);
        minutes++;
    }
    assert_on("5");
    TEST_ASSERT_LESS_OR_EQUAL_UINT(15 + 15 + 1, minutes);
}

/** While room is kept for one, those who are on stay, and others come as far as there is room beside it. */
static void test_kept_room_is_closed_only_to_those_who_would_be_switched_on(void) {
    const uint8_t left = tree_add_group(&tree, 0);
    start(4, 0);
    tree.group[0].limit_mA = 0;
    tree.group[left].limit_mA = 18000;
    for (uint8_t i = 0; i < 3; i++) {
        tree.connector[i].group = left;
    }
    tree.snapshot.demand[1].min_mA = 18000; /* all of the group */
    tree.snapshot.demand[2].active = tree.snapshot.demand[3].active = false;
    tree_allocate(&tree);
    assert_on("0");
    tree_allocate_after(&tree, 600000);
    tree.snapshot.demand[0].session = 2; /* its turn begins anew */
    tree_laxity(&tree, 0, -1000);
    tree_allocate_after(&tree, 1000);
    tree.snapshot.demand[2].active = tree.snapshot.demand[3].active = true;
    tree_allocate_after(&tree, 299000); /* 1 is overdue: its room is closed to 2, but not to 3 elsewhere */
    assert_on("03");
    assert_waiting(1, 1, 2);
    assert_waiting(2, 2, 2);
    tree_allocate_after(&tree, 601000); /* the turn of 0 is over */
    assert_on("13");
}

static void test_another_session_begins_anew(void) {
    start(2, 1);
    tree_allocate(&tree);
    tree_allocate_after(&tree, 899000);
    tree.snapshot.demand[1].session = 2; /* has not waited yet */
    tree_allocate_after(&tree, 1000);
    assert_on("0");
    assert_waiting(1, 1, 1);
    tree.snapshot.demand[0].session = 2; /* its turn was of the one before */
    tree_laxity(&tree, 1, -1000);
    tree_allocate_after(&tree, 1000);
    assert_on("1");
}

static void test_who_comes_back_after_a_pause_begins_anew(void) {
    start(1, 1);
    tree_allocate(&tree);
    tree.snapshot.demand[0].active = false;
    TEST_ASSERT_EQUAL_INT32(0, tree_allocate_after(&tree, 1000));
    tree.snapshot.demand[0].active = true;
    TEST_ASSERT_EQUAL_INT32(6000, tree_allocate_after(&tree, 1000));
}

static void test_times_are_right_when_the_clock_wraps(void) {
    tree.snapshot.now_ms = UINT32_MAX - 500000;
    start(2, 1);
    tree_allocate(&tree);
    tree_allocate_after(&tree, 899999);
    assert_on("0");
    tree_allocate_after(&tree, 1);
    assert_on("1");
    tree_allocate_after(&tree, 299999);
    assert_on("1");
}

/** Who waits because phases would differ too much has its turn as well. */
static void test_balance_cuts_whose_turn_is_over(void) {
    start(2, 2);
    tree.group[0].limit_mA = 0;
    tree.group[0].imbalance_mA = 11900;
    tree_wish(&tree, 0, 6000, 6000);
    tree_wish(&tree, 1, 6000, 6000);
    tree_allocate(&tree);
    assert_on("0");
    assert_waiting(1, 1, 1);
    tree_allocate_after(&tree, 900000);
    assert_on("1");
    assert_waiting(0, 1, 1);
}

static void test_balance_cuts_those_without_a_minimum_from_the_last_rank_up(void) {
    start(3, 0);
    tree.group[0].limit_mA = 0;
    tree.group[0].imbalance_mA = 20000;
    for (uint8_t i = 0; i < 3; i++) {
        tree_wish(&tree, i, 9000, 9000);
    }
    tree.snapshot.demand[0].min_mA = tree.snapshot.demand[2].min_mA = 0;
    const uint8_t rank[] = {2, 3, 0}; /* 3 is none */
    memcpy(tree.proposal.rank, rank, sizeof rank);
    tree_allocate(&tree);
    TEST_ASSERT_EQUAL_INT32(5000, tree.setpoints.current_mA[0]);
    TEST_ASSERT_EQUAL_INT32(6000, tree.setpoints.current_mA[1]); /* ranked nowhere: its minimum */
    TEST_ASSERT_EQUAL_INT32(9000, tree.setpoints.current_mA[2]);
}

/** Hours of virtual time; laxities change at random. Nobody waits longer than the bound, whatever the places. */
static void run_waiting(unsigned vehicles, int32_t places, uint32_t tick_ms, uint32_t seed) {
    tree_init(&tree);
    start(vehicles, places);
    uint32_t state = seed;
    uint32_t waits_ms[TAPER_MAX_CONNECTORS] = {0};
    uint32_t longest_ms = 0;
    const uint32_t turns = (vehicles + (uint32_t)places - 1) / (uint32_t)places;
    for (uint32_t ms = 0; ms < 12u * 60u * MINUTE_ms; ms += tick_ms) {
        for (uint8_t i = 0; i < vehicles; i++) {
            tree_laxity(&tree, i, (int32_t)tree_random(&state, 100000) - 50000);
        }
        tree_allocate_after(&tree, tick_ms);
        unsigned on = 0;
        for (uint8_t i = 0; i < vehicles; i++) {
            waits_ms[i] = is_on(i) ? 0 : waits_ms[i] + tick_ms;
            longest_ms = waits_ms[i] > longest_ms ? waits_ms[i] : longest_ms;
            on += is_on(i) ? 1 : 0;
        }
        TEST_ASSERT_EQUAL_UINT(places, on);
    }
    TEST_ASSERT_LESS_OR_EQUAL_UINT32(turns * (900000 + tick_ms) + 300000, longest_ms);
    TEST_ASSERT_GREATER_OR_EQUAL_UINT32((turns - 1) * 900000, longest_ms); /* all had turns, and long ones */
}

static void test_nobody_waits_longer_than_the_turns_of_the_others(void) {
    static const struct {
        unsigned vehicles;
        int32_t places;
        uint32_t tick_ms;
    } cases[] = {{2, 1, 1000},   {5, 1, 5000},    {5, 2, 1000},   {7, 3, 10000},
                 {12, 5, 10000}, {20, 19, 10000}, {50, 9, 60000}, {6, 2, 900000}};
    for (uint32_t k = 0; k < sizeof cases / sizeof cases[0]; k++) {
        run_waiting(cases[k].vehicles, cases[k].places, cases[k].tick_ms, 77 + k);
    }
}

/** Vehicles come and go, and laxities change. While the limit stays, nobody is switched before its time. */
static void test_least_times_on_and_off_are_kept_unless_the_limit_falls(void) {
    start(8, 3);
    uint32_t state = 0x7a9e;
    uint32_t since_ms[8] = {0};
    bool was_on[8] = {false};
    bool known[8] = {false};
    unsigned switched = 0;
    for (unsigned tick = 0; tick < 40000; tick++) {
        const int32_t limit_mA = tree.group[0].limit_mA;
        for (uint8_t i = 0; i < 8; i++) {
            tree_laxity(&tree, i, (int32_t)tree_random(&state, 9000));
            if (tree_random(&state, 40) == 0) {
                tree_wish(&tree, i, (int32_t)tree_random(&state, 20000), (int32_t)tree_random(&state, 20000));
            }
        }
        if (tree_random(&state, 100) == 0) {
            tree.group[0].limit_mA = 6000 * (int32_t)tree_random(&state, 6) + 1000;
        }
        const bool fell = tree.group[0].limit_mA < limit_mA;
        tree_allocate_after(&tree, 10000);
        for (uint8_t i = 0; i < 8; i++) {
            if (is_on(i) == was_on[i]) {
                continue;
            }
            const uint32_t lasted_ms = tree.snapshot.now_ms - since_ms[i];
            TEST_ASSERT_TRUE(!known[i] || lasted_ms >= 300000 || (was_on[i] && fell));
            known[i] = true;
            was_on[i] = is_on(i);
            since_ms[i] = tree.snapshot.now_ms;
            switched++;
        }
    }
    TEST_ASSERT_GREATER_THAN_UINT(1000, switched);
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
    RUN_TEST(test_who_wants_nothing_does_not_wait);
    RUN_TEST(test_whose_minimum_is_above_its_maximum_can_have_nothing_and_does_not_wait);
    RUN_TEST(test_a_minimum_between_two_steps_is_rounded_up);
    RUN_TEST(test_without_a_minimum_nobody_needs_a_turn);
    RUN_TEST(test_minima_come_before_those_that_need_none);
    RUN_TEST(test_a_ceiling_alone_comes_after_all_wishes);
    RUN_TEST(test_of_those_with_a_ceiling_alone_who_waited_too_long_is_first);
    RUN_TEST(test_if_one_minimum_fits_somebody_is_on);
    RUN_TEST(test_small_minima_do_not_shut_out_a_large_one);
    RUN_TEST(test_kept_room_is_closed_only_to_those_who_would_be_switched_on);
    RUN_TEST(test_another_session_begins_anew);
    RUN_TEST(test_who_comes_back_after_a_pause_begins_anew);
    RUN_TEST(test_times_are_right_when_the_clock_wraps);
    RUN_TEST(test_balance_cuts_whose_turn_is_over);
    RUN_TEST(test_balance_cuts_those_without_a_minimum_from_the_last_rank_up);
    RUN_TEST(test_nobody_waits_longer_than_the_turns_of_the_others);
    RUN_TEST(test_least_times_on_and_off_are_kept_unless_the_limit_falls);
    return UNITY_END();
}
