/* From options to a station, and the grid of calls that daemon and replay share. */
#include "setup.h"

#include "taper/stations.h"
#include "unity.h"

static taper_setup_t setup;
static taper_made_t made;
static char reason[160];

void setUp(void) {
    setup = taper_setup_default(0);
    reason[0] = '\0';
}

void tearDown(void) {}

static bool make(void) {
    return taper_setup_make(&setup, &made, reason, sizeof reason);
}

static void test_by_default_the_station_is_as_its_file_says(void) {
    const taper_station_config_t *own = taper_stations[0];
    TEST_ASSERT_TRUE(make());
    TEST_ASSERT_EQUAL_INT32(own->groups[0].limit_W, made.config.groups[0].limit_W);
    TEST_ASSERT_EQUAL_INT32(own->failsafe_W, made.config.failsafe_W);
    TEST_ASSERT_EQUAL_UINT32(own->tick_ms, made.config.tick_ms);
    TEST_ASSERT_EQUAL_UINT32(own->tick_ms, made.tick_ms);
    TEST_ASSERT_EQUAL_UINT16(1, made.options.time_scale);
    TEST_ASSERT_EQUAL_PTR(&made.config, made.options.config);
}

static void test_limits_are_only_lowered(void) {
    setup.limit_kw = 5.0;
    TEST_ASSERT_TRUE(make());
    TEST_ASSERT_EQUAL_INT32(5000, made.config.groups[0].limit_W);
    TEST_ASSERT_EQUAL_INT32(5000, made.config.failsafe_W);
    setup.failsafe_kw = 4.2;
    TEST_ASSERT_TRUE(make());
    TEST_ASSERT_EQUAL_INT32(4200, made.config.failsafe_W);
    setup.failsafe_kw = taper_stations[0]->failsafe_W / 1000.0 + 0.1;
    TEST_ASSERT_FALSE(make());
    TEST_ASSERT_EQUAL_STRING_LEN("--failsafe-kw: ", reason, 15);
    setup.limit_kw = taper_stations[0]->groups[0].limit_W / 1000.0 + 0.1;
    TEST_ASSERT_FALSE(make());
    TEST_ASSERT_EQUAL_STRING_LEN("--limit-kw: ", reason, 12);
    TEST_ASSERT_NOT_EQUAL(5000, taper_stations[0]->groups[0].limit_W);
}

static void test_the_planner_counts_the_tick_in_its_own_time(void) {
    setup.tick_ms = 500;
    setup.time_scale = 60;
    TEST_ASSERT_TRUE(make());
    TEST_ASSERT_EQUAL_UINT32(500, made.tick_ms);
    TEST_ASSERT_EQUAL_UINT32(30000, made.config.tick_ms);
    TEST_ASSERT_EQUAL_UINT16(60, made.options.time_scale);
}

static void test_long_ticks_have_room_for_a_whole_solve(void) {
    TEST_ASSERT_EQUAL_UINT16(50, taper_setup_iterations(9999));
    TEST_ASSERT_EQUAL_UINT16(TAPER_MAX_ITERATIONS, taper_setup_iterations(10000));
    setup.iterations = 70;
    TEST_ASSERT_TRUE(make());
    TEST_ASSERT_EQUAL_UINT16(70, made.options.iterations_per_tick);
}

static void test_without_the_planner_there_is_no_solver(void) {
    setup.no_planner = true;
    TEST_ASSERT_TRUE(make());
    TEST_ASSERT_NULL(made.options.solver);
}

static void test_calls_are_on_the_ticks_and_on_polls_between(void) {
    TEST_ASSERT_EQUAL_UINT64(20, taper_setup_next_ms(0, 1000));
    TEST_ASSERT_EQUAL_UINT64(40, taper_setup_next_ms(20, 1000));
    TEST_ASSERT_EQUAL_UINT64(1000, taper_setup_next_ms(980, 1000));
    TEST_ASSERT_EQUAL_UINT64(1020, taper_setup_next_ms(1000, 1000));
}

static void test_polls_begin_anew_at_each_tick(void) {
    TEST_ASSERT_EQUAL_UINT64(50, taper_setup_next_ms(40, 50));
    TEST_ASSERT_EQUAL_UINT64(70, taper_setup_next_ms(50, 50));
    TEST_ASSERT_EQUAL_UINT64(20, taper_setup_next_ms(0, 20));
    TEST_ASSERT_EQUAL_UINT64(40, taper_setup_next_ms(20, 20));
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_by_default_the_station_is_as_its_file_says);
    RUN_TEST(test_limits_are_only_lowered);
    RUN_TEST(test_the_planner_counts_the_tick_in_its_own_time);
    RUN_TEST(test_long_ticks_have_room_for_a_whole_solve);
    RUN_TEST(test_without_the_planner_there_is_no_solver);
    RUN_TEST(test_calls_are_on_the_ticks_and_on_polls_between);
    RUN_TEST(test_polls_begin_anew_at_each_tick);
    return UNITY_END();
}
