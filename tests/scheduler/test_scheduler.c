/* What the library of host_sim/scheduler gives: within every limit, and what vehicles take. */
#include <complex.h>
#include <math.h>

#include "bench.h"
#include "unity.h"

/** What a sum of currents may be above a limit [A]: the arithmetic of this test. */
#define ROUNDING_A 1e-6

/* ---- Limits */

/** Currents of the pairs L1-L2, L2-L3, L3-L1 of caltech, as phasors; `only`: of this group, -1: of all. */
static void add_pairs(double complex *pair, int32_t only) {
    for (int32_t i = 0; i < taper_scheduler_connectors(scheduler); i++) {
        taper_scheduler_connector_t connector;
        taper_scheduler_connector(scheduler, i, &connector);
        const int at = connector.lines == 3 ? 0 : connector.lines == 6 ? 1 : 2;
        if (only < 0 || connector.group == only) {
            pair[at] +=
                currents[i].current_A * cexp((double complex)I * ((30.0 - 120.0 * at) * acos(-1) / 180));
        }
    }
}

static void assert_caltech_holds(void) {
    taper_scheduler_group_t site, pod;
    double complex all[3] = {0};
    taper_scheduler_group(scheduler, 0, &site);
    add_pairs(all, -1);
    for (int line = 0; line < 3; line++) {
        const double complex here = all[line] - all[(line + 2) % 3];
        const double complex before = all[(line + 2) % 3] - all[(line + 1) % 3];
        TEST_ASSERT_TRUE(cabs(here) <= site.line_A + ROUNDING_A);
        TEST_ASSERT_TRUE(cabs(here - before) <= site.delta_A + ROUNDING_A);
    }
    for (int32_t k = 1; k < taper_scheduler_groups(scheduler); k++) {
        double complex of_pod[3] = {0};
        taper_scheduler_group(scheduler, k, &pod);
        add_pairs(of_pod, k);
        TEST_ASSERT_TRUE(cabs(of_pod[0]) <= pod.line_A + ROUNDING_A);
    }
}

static void hold_limits_at_random(int32_t policy) {
    uint32_t state = 20260801;
    double most_A = 0;
    open_with("caltech", policy);
    for (int round = 0; round < 12; round++) {
        const double now_s = 300.0 * round;
        plug_in_at_random(&state, now_s);
        taper_scheduler_set_limit(scheduler, 150 * random_share(&state));
        plan_at(now_s);
        assert_caltech_holds();
        most_A = fmax(most_A, sum_A());
    }
    taper_scheduler_account_t account;
    taper_scheduler_account(scheduler, &account);
    TEST_ASSERT_EQUAL_INT32(0, account.lowered);
    TEST_ASSERT_TRUE(most_A > 500); /* it did charge: the lines carry 720 A in sum */
}

static void test_limits_hold_for_random_vehicles_by_the_plan(void) {
    hold_limits_at_random(best_policy());
}

static void test_limits_hold_for_random_vehicles_by_edf(void) {
    hold_limits_at_random(TAPER_SCHEDULER_EDF_SOC);
}

static void test_a_lower_limit_of_the_site_counts_from_the_next_plan_on(void) {
    open_with("hub", best_policy());
    plug_in_everywhere();
    plan_at(0);
    TEST_ASSERT_TRUE(sum_A() > 3 * 32.0);
    taper_scheduler_set_limit(scheduler, 20);
    plan_at(300);
    TEST_ASSERT_TRUE(sum_A() * 690 <= 20000);
    TEST_ASSERT_TRUE(sum_A() > 0);
    taper_scheduler_set_limit(scheduler, 0);
    plan_at(600);
    TEST_ASSERT_EQUAL_DOUBLE(0, sum_A());
}

static void test_a_known_course_lowers_the_limit_when_its_time_comes(void) {
    const taper_scheduler_point_t course[] = {{0, 110}, {HOUR_s, 10}};
    open_with("hub", best_policy());
    TEST_ASSERT_EQUAL_INT32(TAPER_SCHEDULER_OK, taper_scheduler_set_course(scheduler, course, 2));
    plug_in_everywhere();
    plan_at(0);
    TEST_ASSERT_TRUE(sum_A() * 690 > 60000);
    plan_at(HOUR_s);
    TEST_ASSERT_TRUE(sum_A() * 690 <= 10000);
    TEST_ASSERT_EQUAL_INT32(TAPER_SCHEDULER_OK, taper_scheduler_set_course(scheduler, NULL, 0));
    plan_at(2 * HOUR_s);
    TEST_ASSERT_TRUE(sum_A() * 690 > 60000);
}

static void test_limits_of_a_group_can_be_set_where_it_has_some(void) {
    const taper_scheduler_group_t lower = {.line_A = 12};
    const taper_scheduler_group_t not_described = {.delta_A = 100};
    taper_scheduler_group_t now;
    open_with("hub", best_policy());
    TEST_ASSERT_EQUAL_INT32(TAPER_SCHEDULER_OK, taper_scheduler_set_group(scheduler, 1, &lower));
    TEST_ASSERT_EQUAL_INT32(TAPER_SCHEDULER_ERR_ARGUMENT,
                            taper_scheduler_set_group(scheduler, 1, &not_described));
    taper_scheduler_group(scheduler, 1, &now);
    TEST_ASSERT_EQUAL_DOUBLE(12, now.line_A);
    TEST_ASSERT_EQUAL_DOUBLE(66, now.limit_kW); /* left as it was */
    plug_in_everywhere();
    plan_at(0);
    double sum = 0;
    for (int i = 0; i < 4; i++) {
        sum += currents[i].current_A;
    }
    TEST_ASSERT_TRUE(sum <= 12 && sum >= 6);
}

static void test_currents_can_be_asked_about(void) {
    double asked_A[MOST_CONNECTORS] = {0};
    open_with("hub", best_policy());
    asked_A[0] = asked_A[1] = asked_A[2] = 31;
    asked_A[3] = 2.652; /* 65.999 kW of the 66 of feeder A */
    TEST_ASSERT_EQUAL_INT32(1, taper_scheduler_holds(scheduler, asked_A));
    asked_A[3] = 2.655; /* 2 W too much */
    TEST_ASSERT_EQUAL_INT32(0, taper_scheduler_holds(scheduler, asked_A));
    asked_A[3] = -1;
    TEST_ASSERT_EQUAL_INT32(TAPER_SCHEDULER_ERR_ARGUMENT, taper_scheduler_holds(scheduler, asked_A));
    TEST_ASSERT_EQUAL_INT32(TAPER_SCHEDULER_ERR_ARGUMENT, taper_scheduler_holds(scheduler, NULL));
}

/* ---- What vehicles take */

static void test_a_vehicle_alone_gets_all_it_takes(void) {
    const taper_scheduler_vehicle_t vehicle = vehicle_that_wants(20, 2 * HOUR_s);
    open_with("hub", best_policy());
    plug_in(3, &vehicle);
    plan_at(0);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 31.9, currents[3].current_A); /* 22 kW / 690 V = 31.88 A, rounded up */
    TEST_ASSERT_EQUAL_INT32(TAPER_SCHEDULER_VEHICLE_LIMIT, currents[3].why);
    TEST_ASSERT_EQUAL_INT32(TAPER_SCHEDULER_NO_VEHICLE, currents[2].why);
}

static void test_a_nearly_full_battery_is_given_what_its_line_says(void) {
    taper_scheduler_vehicle_t vehicle = vehicle_that_wants(5, 2 * HOUR_s);
    vehicle.stored_kWh = 54; /* SOC 0.9: 11 kW */
    open_with("hub", best_policy());
    plug_in(3, &vehicle);
    plan_at(0);
    TEST_ASSERT_DOUBLE_WITHIN(0.1, 11000 / 690.0, currents[3].current_A);
}

static void test_nobody_is_given_more_than_he_wants(void) {
    const taper_scheduler_vehicle_t half_a_kWh = vehicle_that_wants(0.5, 2 * HOUR_s); /* 6 kW for 300 s */
    const taper_scheduler_vehicle_t too_little = vehicle_that_wants(0.1, 2 * HOUR_s); /* 6 A are 0.345 kWh */
    open_with("hub", best_policy());
    plug_in(0, &half_a_kWh);
    plug_in(1, &too_little);
    plan_at(0);
    TEST_ASSERT_DOUBLE_WITHIN(0.1, 6000 / 690.0, currents[0].current_A);
    TEST_ASSERT_EQUAL_DOUBLE(0, currents[1].current_A);
    TEST_ASSERT_EQUAL_INT32(TAPER_SCHEDULER_NO_VEHICLE, currents[1].why);
}

static void test_an_evse_gets_only_currents_that_it_can_give(void) {
    const double rates_A[] = {0, 8, 16, 24, 32};
    open_with("hub", best_policy());
    for (int32_t i = 0; i < 8; i++) {
        TEST_ASSERT_EQUAL_INT32(TAPER_SCHEDULER_OK, taper_scheduler_set_rates(scheduler, i, rates_A, 5, 0));
    }
    plug_in_everywhere();
    plan_at(0);
    for (int i = 0; i < 8; i++) {
        TEST_ASSERT_EQUAL_DOUBLE(0, fmod(currents[i].current_A, 8));
    }
    TEST_ASSERT_TRUE(sum_A() >= 152); /* of 160 A, and of steps of 8 A */
}

static void test_a_vehicle_between_two_rates_is_offered_the_higher(void) {
    const double rates_A[] = {0, 8, 16, 24, 32};
    taper_scheduler_vehicle_t vehicle = vehicle_that_wants(20, 2 * HOUR_s);
    open_with("hub", best_policy());
    taper_scheduler_set_rates(scheduler, 0, rates_A, 5, 0);
    plug_in(0, &vehicle);
    vehicle.max_kW = 2; /* 2.9 A: less than any connector can give */
    plug_in(1, &vehicle);
    vehicle.max_A = 10;
    plug_in(2, &vehicle);
    plan_at(0);
    TEST_ASSERT_EQUAL_DOUBLE(32, currents[0].current_A); /* it takes 31.9 A of that */
    TEST_ASSERT_EQUAL_DOUBLE(6, currents[1].current_A);
    TEST_ASSERT_EQUAL_DOUBLE(6, currents[2].current_A);
}

/** Current of a vehicle alone that wants 20 A for a period, where a line has room for `line_A`. */
static double current_within_A(double line_A) {
    const taper_scheduler_vehicle_t vehicle = vehicle_that_wants(20 * 690 / 12000.0, 2 * HOUR_s);
    const taper_scheduler_group_t few = {.line_A = line_A};
    open_with("hub", TAPER_SCHEDULER_EDF_SOC);
    taper_scheduler_set_group(scheduler, 1, &few);
    plug_in(0, &vehicle);
    plan_at(0);
    tearDown();
    return currents[0].current_A;
}

static void test_no_rest_is_left_that_is_less_than_the_least_current(void) {
    TEST_ASSERT_EQUAL_DOUBLE(20, current_within_A(96));
    TEST_ASSERT_EQUAL_DOUBLE(14, current_within_A(16)); /* the rest of 4 A could not be charged */
    TEST_ASSERT_EQUAL_DOUBLE(12, current_within_A(12));
}

static void test_a_rate_is_the_nearest_to_the_wish_where_there_is_room(void) {
    const double rates_A[] = {0, 8, 16, 24, 32};
    const taper_scheduler_group_t few = {.line_A = 24};
    taper_scheduler_vehicle_t slow = vehicle_that_wants(20, 2 * HOUR_s), fast = slow;
    open_with("hub", TAPER_SCHEDULER_EDF_SOC);
    taper_scheduler_set_group(scheduler, 1, &few);
    slow.peak_kW = 21.8; /* 10.9 kW at half charge: 15.8 A */
    slow.taper_kW = 21.8;
    for (int32_t i = 0; i < 2; i++) {
        taper_scheduler_set_rates(scheduler, i, rates_A, 5, 0);
    }
    fast.departs_s = 3 * HOUR_s;
    plug_in(0, &slow);
    plug_in(1, &fast);
    plan_at(0);
    TEST_ASSERT_EQUAL_DOUBLE(16, currents[0].current_A);
    TEST_ASSERT_EQUAL_DOUBLE(8, currents[1].current_A);
}

static void test_what_rounding_leaves_over_goes_to_the_most_urgent(void) {
    const double rates_A[] = {0, 10, 20, 30};
    const taper_scheduler_group_t few = {.line_A = 50};
    open_with("hub", TAPER_SCHEDULER_EDF_SOC);
    for (int32_t i = 0; i < 4; i++) {
        taper_scheduler_set_rates(scheduler, i, rates_A, 4, 0);
    }
    taper_scheduler_set_group(scheduler, 1, &few);
    plug_in_everywhere();
    plan_at(0);
    TEST_ASSERT_EQUAL_DOUBLE(20, currents[0].current_A); /* four minima of 10 A, and 10 A more */
    TEST_ASSERT_EQUAL_DOUBLE(10, currents[1].current_A);
    TEST_ASSERT_EQUAL_INT32(TAPER_SCHEDULER_LIMIT, currents[1].why);
}

static void test_who_finds_no_place_waits(void) {
    const taper_scheduler_group_t one = {.line_A = 6};
    open_with("hub", best_policy());
    taper_scheduler_set_group(scheduler, 1, &one);
    plug_in_everywhere();
    plan_at(0);
    int on = 0, waiting = 0;
    for (int i = 0; i < 4; i++) {
        on += currents[i].current_A > 0;
        waiting += currents[i].why == TAPER_SCHEDULER_WAITING;
    }
    TEST_ASSERT_EQUAL_INT(1, on);
    TEST_ASSERT_EQUAL_INT(3, waiting);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_limits_hold_for_random_vehicles_by_the_plan);
    RUN_TEST(test_limits_hold_for_random_vehicles_by_edf);
    RUN_TEST(test_a_lower_limit_of_the_site_counts_from_the_next_plan_on);
    RUN_TEST(test_a_known_course_lowers_the_limit_when_its_time_comes);
    RUN_TEST(test_limits_of_a_group_can_be_set_where_it_has_some);
    RUN_TEST(test_currents_can_be_asked_about);
    RUN_TEST(test_a_vehicle_alone_gets_all_it_takes);
    RUN_TEST(test_a_nearly_full_battery_is_given_what_its_line_says);
    RUN_TEST(test_nobody_is_given_more_than_he_wants);
    RUN_TEST(test_an_evse_gets_only_currents_that_it_can_give);
    RUN_TEST(test_a_vehicle_between_two_rates_is_offered_the_higher);
    RUN_TEST(test_no_rest_is_left_that_is_less_than_the_least_current);
    RUN_TEST(test_a_rate_is_the_nearest_to_the_wish_where_there_is_room);
    RUN_TEST(test_what_rounding_leaves_over_goes_to_the_most_urgent);
    RUN_TEST(test_who_finds_no_place_waits);
    return UNITY_END();
}
