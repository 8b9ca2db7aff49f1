/* The whole station and the field in milliseconds: who gets what, and what happens when a node fails. */
#include "live_bench.h"
#include "unity.h"

#define KW_PER_A 0.69 /* of the hub: 3 x 230 V */

void setUp(void) {}

void tearDown(void) {
    live_bench_end();
}

/** Vehicles that are there from the start, on the hub under `limit_kw`. */
static void start(const live_options_t *options, unsigned vehicles) {
    sim_session_t sessions[8];
    for (unsigned i = 0; i < vehicles; i++) {
        sessions[i] = live_vehicle(0.0);
    }
    live_bench_start(options, sessions, vehicles);
}

static void assert_nobody_exceeded(void) {
    TEST_ASSERT_EQUAL_UINT32(0, live.field.tracker.drawn.times);
    TEST_ASSERT_EQUAL_UINT32(0, live.field.tracker.may.times);
    TEST_ASSERT_EQUAL_UINT32(0, taper_station_counter(&live.station, TAPER_COUNTER_GUARD_VIOLATIONS));
}

static void test_a_vehicle_charges_and_its_energy_is_the_integral_of_its_power(void) {
    const live_options_t options = live_options(50.0);
    start(&options, 1);
    live_bench_run_ms(10000);
    TEST_ASSERT_DOUBLE_WITHIN(0.1, 11.0, live.field.tracker.drawn_kw);
    live_bench_run_ms(50000);
    TEST_ASSERT_GREATER_THAN_INT32(140, (int32_t)(live.drawn_kwh * 1000.0));
    /* the last step of power is not charged yet */
    TEST_ASSERT_DOUBLE_WITHIN(11.1 * LIVE_POLL_ms / 3.6e6, live.drawn_kwh, live.field.evse[0].energy_kwh);
    assert_nobody_exceeded();
}

static void test_eight_vehicles_share_a_limit_and_never_exceed_it(void) {
    const live_options_t options = live_options(30.0);
    start(&options, 8);
    live_bench_run_ms(120000);
    TEST_ASSERT_DOUBLE_WITHIN(1.0, 30.0, live.field.tracker.drawn_kw);
    assert_nobody_exceeded();
}

static void test_a_fall_of_the_limit_is_followed_in_time(void) {
    double time_s[] = {0.0, LIVE_START_S + 30.3, LIVE_START_S + 60.0};
    double limit_kw[] = {60.0, 9.0, 60.0};
    const sim_course_t limits = {.time_s = time_s, .value = limit_kw, .count = 3};
    live_options_t options = live_options(-1.0);
    options.limits = &limits;
    start(&options, 8);
    live_bench_run_ms(30000);
    TEST_ASSERT_DOUBLE_WITHIN(1.0, 60.0, live.field.tracker.drawn_kw);
    live_bench_run_ms(4000);
    TEST_ASSERT_DOUBLE_WITHIN(5.0, 7.0, live.field.tracker.drawn_kw);
    live_bench_run_ms(60000);
    assert_nobody_exceeded();
}

static void test_vehicles_that_do_not_follow_are_seen_to_exceed(void) {
    double time_s[] = {0.0, LIVE_START_S + 30.0};
    double limit_kw[] = {60.0, 9.0};
    const sim_course_t limits = {.time_s = time_s, .value = limit_kw, .count = 2};
    live_options_t options = live_options(-1.0);
    options.limits = &limits;
    options.vehicle_delay_ms = 5000;
    start(&options, 8);
    live_bench_run_ms(40000);
    TEST_ASSERT_EQUAL_UINT32(1, live.field.tracker.drawn.times);
    TEST_ASSERT_GREATER_THAN_UINT32(1000, (uint32_t)live.field.tracker.drawn.ms);
    TEST_ASSERT_GREATER_THAN_INT32(20, (int32_t)live.field.tracker.drawn.worst_kw);
    TEST_ASSERT_EQUAL_UINT32(0, live.field.tracker.may.times);
}

static void test_without_a_station_connectors_fall_back_and_with_one_they_go_on(void) {
    const live_options_t options = live_options(30.0);
    start(&options, 2);
    live_bench_run_ms(20000);
    TEST_ASSERT_DOUBLE_WITHIN(0.2, 22.0, live.field.tracker.drawn_kw);
    live_bench_kill_station();
    live_bench_run_ms(3600); /* the last setpoint may be half a second old */
    TEST_ASSERT_EQUAL_DOUBLE(0.0, live.field.tracker.drawn_kw);
    TEST_ASSERT_FALSE(live.field.evse[0].in_force);
    live_bench_revive_station();
    live_bench_run_ms(10000);
    TEST_ASSERT_DOUBLE_WITHIN(0.2, 22.0, live.field.tracker.drawn_kw);
    assert_nobody_exceeded();
}

static void test_without_a_gateway_the_failsafe_limit_holds_and_with_one_it_ends(void) {
    const live_options_t options = live_options(30.0);
    start(&options, 4);
    live_bench_run_ms(20000);
    sim_field_kill(&live.field, SIM_GATEWAY);
    live_bench_run_ms(10000);
    TEST_ASSERT_EQUAL(TAPER_MODE_FAILSAFE, taper_station_mode(&live.station));
    TEST_ASSERT_DOUBLE_WITHIN(3.0, 9.0, live.field.tracker.drawn_kw); /* of 11 kW */
    sim_field_revive(&live.field, SIM_GATEWAY);
    live_bench_run_ms(10000);
    TEST_ASSERT_EQUAL(TAPER_MODE_FALLBACK, taper_station_mode(&live.station));
    assert_nobody_exceeded();
}

static void test_a_day_of_the_world_goes_by_in_minutes_of_the_bus(void) {
    live_options_t options = live_options(50.0);
    options.time_scale = 600;
    sim_session_t session = live_vehicle(120.0);
    session.departure_s = session.told_s = session.arrival_s + 6.0 * 3600.0;
    live_bench_start(&options, &session, 1);
    live_bench_run_ms(40000);
    TEST_ASSERT_TRUE(sim_field_is_over(&live.field));
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, 56.0, live.outcome[0].energy_kwh);
    assert_nobody_exceeded();
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_a_vehicle_charges_and_its_energy_is_the_integral_of_its_power);
    RUN_TEST(test_eight_vehicles_share_a_limit_and_never_exceed_it);
    RUN_TEST(test_a_fall_of_the_limit_is_followed_in_time);
    RUN_TEST(test_vehicles_that_do_not_follow_are_seen_to_exceed);
    RUN_TEST(test_without_a_station_connectors_fall_back_and_with_one_they_go_on);
    RUN_TEST(test_without_a_gateway_the_failsafe_limit_holds_and_with_one_it_ends);
    RUN_TEST(test_a_day_of_the_world_goes_by_in_minutes_of_the_bus);
    return UNITY_END();
}
