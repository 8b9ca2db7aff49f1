/* The calls of host_sim/scheduler: what they refuse, and that they repeat. */
#include <math.h>
#include <stdbool.h>
#include <stddef.h>
#include <string.h>

#include "bench.h"
#include "unity.h"

static void test_a_station_is_opened_once(void) {
    taper_scheduler_options_t options;
    taper_scheduler_t *second = NULL, *other = NULL;
    taper_scheduler_defaults(&options);
    open_with("hub", best_policy());
    TEST_ASSERT_EQUAL_INT32(TAPER_SCHEDULER_ERR_OPEN, taper_scheduler_open(&second, "hub", &options));
    TEST_ASSERT_NULL(second);
    TEST_ASSERT_EQUAL_INT32(TAPER_SCHEDULER_OK, taper_scheduler_open(&other, "caltech", &options));
    taper_scheduler_close(scheduler);
    TEST_ASSERT_EQUAL_INT32(TAPER_SCHEDULER_OK, taper_scheduler_open(&scheduler, "hub", &options));
    taper_scheduler_close(other);
}

static void test_a_library_without_planner_says_so(void) {
    taper_scheduler_options_t options;
    taper_scheduler_account_t account;
    taper_scheduler_defaults(&options);
    const bool plans = options.policy == TAPER_SCHEDULER_SOC_MPC;
    options.policy = TAPER_SCHEDULER_SOC_MPC;
    TEST_ASSERT_EQUAL_INT32(plans ? TAPER_SCHEDULER_OK : TAPER_SCHEDULER_ERR_NO_PLANNER,
                            taper_scheduler_open(&scheduler, "hub", &options));
    if (scheduler == NULL) {
        open_with("hub", TAPER_SCHEDULER_EDF_SOC);
    }
    plug_in_everywhere();
    plan_at(0);
    taper_scheduler_account(scheduler, &account);
    TEST_ASSERT_EQUAL_INT32(plans, account.planned);
    TEST_ASSERT_EQUAL_INT32(plans, account.iterations > 0);
}

/** Greatest less least current of the four connectors of feeder A, with room for 40 A. */
static double spread_A(int32_t objective) {
    const taper_scheduler_group_t few = {.line_A = 40};
    taper_scheduler_options_t options;
    taper_scheduler_defaults(&options);
    options.objective = objective;
    options.lambda_per_kWh2 = 0.01;
    TEST_ASSERT_EQUAL_INT32(TAPER_SCHEDULER_OK, taper_scheduler_open(&scheduler, "hub", &options));
    taper_scheduler_set_group(scheduler, 1, &few);
    for (int32_t i = 0; i < 4; i++) {
        const taper_scheduler_vehicle_t vehicle = vehicle_that_wants(25, HOUR_s * (1 + i));
        plug_in(i, &vehicle);
    }
    plan_at(0);
    double least_A = currents[0].current_A, most_A = least_A;
    for (int i = 1; i < 4; i++) {
        least_A = fmin(least_A, currents[i].current_A);
        most_A = fmax(most_A, currents[i].current_A);
    }
    taper_scheduler_close(scheduler);
    scheduler = NULL;
    return most_A - least_A;
}

static void test_the_log_utility_shares_more_evenly(void) {
    if (best_policy() == TAPER_SCHEDULER_SOC_MPC) {
        TEST_ASSERT_TRUE(spread_A(1) + 5 < spread_A(0));
    } else { /* EDF has no objective */
        TEST_ASSERT_EQUAL_DOUBLE(spread_A(0), spread_A(1));
    }
}

static void test_the_same_calls_give_the_same_currents(void) {
    taper_scheduler_current_t first[MOST_CONNECTORS];
    for (int run = 0; run < 2; run++) {
        uint32_t state = 4711;
        open_with("caltech", best_policy());
        for (int round = 0; round < 3; round++) {
            plug_in_at_random(&state, 300.0 * round);
            plan_at(300.0 * round);
        }
        taper_scheduler_close(scheduler);
        scheduler = NULL;
        if (run == 0) {
            memcpy(first, currents, sizeof first);
        }
    }
    TEST_ASSERT_EQUAL_MEMORY(first, currents, sizeof first);
}

static void test_options_out_of_range_are_refused(void) {
    taper_scheduler_options_t sound, options;
    taper_scheduler_defaults(&sound);
    const size_t fields[] = {
        offsetof(taper_scheduler_options_t, policy), offsetof(taper_scheduler_options_t, period_s),
        offsetof(taper_scheduler_options_t, objective), offsetof(taper_scheduler_options_t, outer_iterations),
        offsetof(taper_scheduler_options_t, horizon_steps)};
    for (size_t k = 0; k < sizeof fields / sizeof fields[0]; k++) {
        const int32_t wrong[] = {-1, 100000};
        for (int w = 0; w < 2; w++) {
            options = sound;
            memcpy((char *)&options + fields[k], &wrong[w], sizeof wrong[w]);
            TEST_ASSERT_EQUAL_INT32(TAPER_SCHEDULER_ERR_ARGUMENT,
                                    taper_scheduler_open(&scheduler, "hub", &options));
        }
    }
    options = sound;
    options.lambda_per_kWh2 = nan("");
    TEST_ASSERT_EQUAL_INT32(TAPER_SCHEDULER_ERR_ARGUMENT, taper_scheduler_open(&scheduler, "hub", &options));
    options = sound;
    options.horizon_steps = 1;
    TEST_ASSERT_EQUAL_INT32(TAPER_SCHEDULER_ERR_ARGUMENT, taper_scheduler_open(&scheduler, "hub", &options));
    TEST_ASSERT_EQUAL_INT32(TAPER_SCHEDULER_ERR_STATION, taper_scheduler_open(&scheduler, "hut", &sound));
    TEST_ASSERT_NULL(scheduler);
}

static void refuses(taper_scheduler_vehicle_t vehicle) {
    TEST_ASSERT_EQUAL_INT32(TAPER_SCHEDULER_ERR_ARGUMENT,
                            taper_scheduler_set_vehicle(scheduler, 0, &vehicle));
}

static void test_a_vehicle_out_of_range_is_refused_and_the_last_one_kept(void) {
    taper_scheduler_vehicle_t vehicle = vehicle_that_wants(20, 2 * HOUR_s);
    open_with("hub", best_policy());
    plug_in(0, &vehicle);
    double *const fields[] = {&vehicle.need_kWh,   &vehicle.max_kW,  &vehicle.max_A,   &vehicle.capacity_kWh,
                              &vehicle.stored_kWh, &vehicle.peak_kW, &vehicle.taper_kW};
    for (size_t k = 0; k < sizeof fields / sizeof fields[0]; k++) {
        const double wrong[] = {-0.1, nan(""), 1e9};
        const double sound = *fields[k];
        for (int w = 0; w < 3; w++) {
            *fields[k] = wrong[w];
            refuses(vehicle);
        }
        *fields[k] = sound;
    }
    TEST_ASSERT_EQUAL_INT32(TAPER_SCHEDULER_ERR_ARGUMENT,
                            taper_scheduler_set_vehicle(scheduler, 8, &vehicle));
    TEST_ASSERT_EQUAL_INT32(TAPER_SCHEDULER_ERR_ARGUMENT,
                            taper_scheduler_set_vehicle(scheduler, -1, &vehicle));
    plan_at(0);
    TEST_ASSERT_TRUE(currents[0].current_A > 31);
}

static void test_rates_that_no_evse_here_can_have_are_refused(void) {
    static const double bad[][2] = {{6, 6}, {16, 8}, {6, 33}, {6.05, 8}, {-6, 8}, {3, 8}};
    open_with("hub", best_policy());
    for (size_t k = 0; k < sizeof bad / sizeof bad[0]; k++) {
        TEST_ASSERT_EQUAL_INT32(TAPER_SCHEDULER_ERR_ARGUMENT,
                                taper_scheduler_set_rates(scheduler, 0, bad[k], 2, 0));
    }
    TEST_ASSERT_EQUAL_INT32(TAPER_SCHEDULER_ERR_ARGUMENT,
                            taper_scheduler_set_rates(scheduler, 0, bad[0], 0, 0));
    taper_scheduler_connector_t connector;
    taper_scheduler_connector(scheduler, 0, &connector);
    TEST_ASSERT_EQUAL_DOUBLE(6, connector.min_A);
    TEST_ASSERT_EQUAL_DOUBLE(32, connector.max_A);
}

static void test_limits_and_courses_out_of_range_are_refused(void) {
    const taper_scheduler_point_t back[] = {{HOUR_s, 10}, {0, 20}};
    const taper_scheduler_point_t far[] = {{0, 10}, {25 * 24 * HOUR_s, 20}};
    const taper_scheduler_point_t negative = {0, -1};
    open_with("hub", best_policy());
    TEST_ASSERT_EQUAL_INT32(TAPER_SCHEDULER_ERR_ARGUMENT, taper_scheduler_set_limit(scheduler, -1));
    TEST_ASSERT_EQUAL_INT32(TAPER_SCHEDULER_ERR_ARGUMENT, taper_scheduler_set_limit(scheduler, nan("")));
    TEST_ASSERT_EQUAL_INT32(TAPER_SCHEDULER_ERR_ARGUMENT, taper_scheduler_set_course(scheduler, back, 2));
    TEST_ASSERT_EQUAL_INT32(TAPER_SCHEDULER_ERR_ARGUMENT, taper_scheduler_set_course(scheduler, far, 2));
    TEST_ASSERT_EQUAL_INT32(TAPER_SCHEDULER_ERR_ARGUMENT,
                            taper_scheduler_set_course(scheduler, &negative, 1));
    TEST_ASSERT_EQUAL_INT32(TAPER_SCHEDULER_ERR_ARGUMENT, taper_scheduler_set_course(scheduler, NULL, 1));
}

static void test_time_does_not_go_back(void) {
    open_with("hub", best_policy());
    plan_at(1000);
    plan_at(1000);
    TEST_ASSERT_EQUAL_INT32(TAPER_SCHEDULER_ERR_ARGUMENT, taper_scheduler_plan(scheduler, 999, currents));
    TEST_ASSERT_EQUAL_INT32(TAPER_SCHEDULER_ERR_ARGUMENT, taper_scheduler_plan(scheduler, nan(""), currents));
}

static void test_the_wrap_of_the_firmwares_clock_is_not_seen(void) {
    const double wrap_s = 4294967.296;
    open_with("hub", best_policy());
    for (int round = -3; round < 3; round++) {
        plug_in_everywhere();
        plan_at(wrap_s + 300 * round);
        TEST_ASSERT_TRUE(sum_A() > 100);
    }
}

static void test_every_status_has_words(void) {
    for (int32_t status = TAPER_SCHEDULER_ERR_MEMORY; status <= TAPER_SCHEDULER_OK; status++) {
        TEST_ASSERT_TRUE(strlen(taper_scheduler_status_text(status)) > 3);
    }
    TEST_ASSERT_EQUAL_INT32(TAPER_SCHEDULER_VERSION, taper_scheduler_version());
    TEST_ASSERT_NULL(taper_scheduler_station_name(-1));
    TEST_ASSERT_NOT_NULL(taper_scheduler_station_name(0));
    TEST_ASSERT_NULL(taper_scheduler_station_name(1000));
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_a_station_is_opened_once);
    RUN_TEST(test_a_library_without_planner_says_so);
    RUN_TEST(test_the_log_utility_shares_more_evenly);
    RUN_TEST(test_the_same_calls_give_the_same_currents);
    RUN_TEST(test_options_out_of_range_are_refused);
    RUN_TEST(test_a_vehicle_out_of_range_is_refused_and_the_last_one_kept);
    RUN_TEST(test_rates_that_no_evse_here_can_have_are_refused);
    RUN_TEST(test_limits_and_courses_out_of_range_are_refused);
    RUN_TEST(test_time_does_not_go_back);
    RUN_TEST(test_the_wrap_of_the_firmwares_clock_is_not_seen);
    RUN_TEST(test_every_status_has_words);
    return UNITY_END();
}
