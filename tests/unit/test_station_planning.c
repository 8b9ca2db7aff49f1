/* The station with its planner: the whole pipeline, plans in slices, and what happens when a solve goes wrong. */
#include <math.h>

#include "solver.h"
#include "station_bench.h"
#include "taper/solvers.h"
#include "unity.h"

static taper_station_options_t with_solver(void) {
    taper_station_options_t options = bench_options();
    options.solver = taper_solvers[bench_hub_index()];
    return options;
}

void setUp(void) {
    const taper_station_options_t options = with_solver();
    bench_start(&options);
}
void tearDown(void) {}

static void test_a_soc_frame_in_gives_a_setpoint_frame_out_through_every_hop(void) {
    bench_send_all(1, 50000);
    bench_step();
    bench_assert_one_vehicle_in_the_snapshot();
    TEST_ASSERT_EQUAL(TAPER_VERDICT_SOLVED, bench.station.planner.verdict);
    TEST_ASSERT_EQUAL(TAPER_MODE_PLAN, taper_station_mode(&bench.station));
    TEST_ASSERT_INT32_WITHIN(80, 8000,
                             bench.station.plan_W[0][0]); /* 11 kW - half of 6 kW, within tolerance */
    TEST_ASSERT_EQUAL_INT32(8000, bench.station.proposal.ceiling_W[0]);
    /* 8000 W / 690 V = 11.594 A, up to the step */
    TEST_ASSERT_EQUAL_INT32(11600, bench.station.setpoints.current_mA[0]);

    const taper_setpoint_t setpoint = bench_setpoint_for(1);
    TEST_ASSERT_EQUAL(TAPER_COMMAND_CHARGE, setpoint.command);
    TEST_ASSERT_EQUAL_INT32(11600, setpoint.current_mA);
    TEST_ASSERT_EQUAL_UINT8(7, setpoint.session);
    TEST_ASSERT_EQUAL_UINT8(7, setpoint.phase_mask);
    TEST_ASSERT_EQUAL_UINT32(0, taper_station_counter(&bench.station, TAPER_COUNTER_GUARD_VIOLATIONS));
}

static void test_sliced_planning_charges_by_fallback_until_the_plan_is_there(void) {
    taper_station_options_t with = with_solver();
    with.iterations_per_tick = 10;
    bench_start(&with);
    bench_send_all(8, 30000);
    bench_step();
    TEST_ASSERT_EQUAL(TAPER_MODE_FALLBACK, taper_station_mode(&bench.station));
    TEST_ASSERT_GREATER_THAN_INT32(0, bench.station.setpoints.current_mA[0]);
    for (int tick = 0; tick < 50 && taper_station_mode(&bench.station) != TAPER_MODE_PLAN; tick++) {
        bench_send_all(8, 30000);
        bench_step();
    }
    TEST_ASSERT_EQUAL(TAPER_MODE_PLAN, taper_station_mode(&bench.station));
    TEST_ASSERT_EQUAL_UINT32(1, taper_station_counter(&bench.station, TAPER_COUNTER_PLANS));
}

static void test_short_slices_come_to_a_plan_as_well_with_less_than_ten_iterations_in_every_tick(void) {
    taper_station_options_t with = with_solver();
    with.iterations_per_tick = 7;
    bench_start(&with);
    uint16_t before = 0;
    for (int tick = 0; tick < 100 && taper_station_mode(&bench.station) != TAPER_MODE_PLAN; tick++) {
        bench_send_all(8, 30000);
        bench_step();
        const uint16_t iterations = taper_planner_iterations(&bench.station.planner);
        TEST_ASSERT_LESS_OR_EQUAL_UINT16(7, iterations - before);
        before = iterations;
    }
    TEST_ASSERT_EQUAL(TAPER_MODE_PLAN, taper_station_mode(&bench.station));
    TEST_ASSERT_EQUAL_UINT32(1, taper_station_counter(&bench.station, TAPER_COUNTER_PLANS));
}

/** A NaN in the solver's memory, as a bit flip would leave it. */
static void poison_solver(void) {
    static OSQPFloat poisoned[TAPER_MAX_VARIABLES];
    for (unsigned v = 0; v < TAPER_MAX_VARIABLES; v++) {
        poisoned[v] = (OSQPFloat)NAN;
    }
    TEST_ASSERT_EQUAL(0, osqp_update_data_vec(bench.station.options.solver->osqp, poisoned, NULL, NULL));
}

/** Bring the station to PLAN, then into a solve that is not finished. */
static void leave_a_solve_unfinished(void) {
    bench_send_all(8, 30000);
    bench_step();
    TEST_ASSERT_EQUAL(TAPER_MODE_PLAN, taper_station_mode(&bench.station));
    bench.station.options.iterations_per_tick = TAPER_MIN_SLICE;
    bench_send_all(8, 9000); /* an event, far enough from the last problem for many slices */
    bench_step();
    TEST_ASSERT_EQUAL(TAPER_VERDICT_SOLVING, bench.station.planner.verdict);
}

static void test_while_a_renewal_is_in_work_the_plan_is_followed(void) {
    leave_a_solve_unfinished();
    TEST_ASSERT_EQUAL(TAPER_MODE_PLAN, taper_station_mode(&bench.station));
    TEST_ASSERT_EQUAL_UINT32(1, taper_station_counter(&bench.station, TAPER_COUNTER_PLANS));
}

static void test_a_poisoned_solver_means_fallback_in_the_same_tick_and_a_new_try_after_a_minute(void) {
    leave_a_solve_unfinished();
    poison_solver();
    bench_send_all(8, 9000);
    bench_step();
    TEST_ASSERT_EQUAL(TAPER_VERDICT_NOT_FINITE, bench.station.planner.verdict);
    TEST_ASSERT_EQUAL(TAPER_MODE_FALLBACK, taper_station_mode(&bench.station));
    TEST_ASSERT_EQUAL_UINT32(1, taper_station_counter(&bench.station, TAPER_COUNTER_PLANS_REJECTED));
    TEST_ASSERT_GREATER_THAN_INT32(0, bench.station.setpoints.current_mA[0]);

    bench.station.options.iterations_per_tick = TAPER_MAX_ITERATIONS;
    bench_send_all(8, 9000);
    bench_step(); /* nothing has changed: no new try yet */
    TEST_ASSERT_EQUAL(TAPER_MODE_FALLBACK, taper_station_mode(&bench.station));
    bench.now_ms += 60000;
    for (int tick = 0; tick < 2; tick++) { /* the first comes late, and is left to EDF */
        bench_send_all(8, 9000);
        bench_step();
    }
    TEST_ASSERT_EQUAL(TAPER_MODE_PLAN, taper_station_mode(&bench.station));
    TEST_ASSERT_EQUAL_UINT32(1, taper_station_counter(&bench.station, TAPER_COUNTER_PLANS_REJECTED));
    TEST_ASSERT_EQUAL_UINT32(0, taper_station_counter(&bench.station, TAPER_COUNTER_GUARD_VIOLATIONS));
}

static void test_a_plan_ends_after_two_steps_without_a_renewal(void) {
    leave_a_solve_unfinished();
    bench.now_ms += 2 * 900000; /* the solve was never given a tick to go on */
    bench_send_all(8, 9000);
    bench_step();
    TEST_ASSERT_EQUAL(TAPER_MODE_FALLBACK, taper_station_mode(&bench.station));
}

/** Vehicle 1 says the greatest that the wire carries of everything; the next set is used whole. */
static void send_extreme_parameters(void) {
    taper_message_t message = {.kind = TAPER_MESSAGE_EV_PARAM_A, .node = 1};
    message.as.ev_param_a = (taper_ev_param_a_t){.revision = 9,
                                                 .session = 7,
                                                 .capacity_Wh = 2000000,
                                                 .soc_target_permille = 1000,
                                                 .soc_minimum_permille = TAPER_ABSENT,
                                                 .soc_plug_in_permille = TAPER_ABSENT};
    bench_send(&message);
    message = (taper_message_t){.kind = TAPER_MESSAGE_EV_PARAM_B, .node = 1};
    message.as.ev_param_b = (taper_ev_param_b_t){
        .revision = 9, .session = 7, .departure_min = 65534, .peak_W = 655340, .min_mA = TAPER_ABSENT};
    bench_send(&message);
    message = (taper_message_t){.kind = TAPER_MESSAGE_EV_PARAM_C, .node = 1};
    message.as.ev_param_c = (taper_ev_param_c_t){
        .revision = 9, .target_Wh = 655340, .maximum_Wh = TAPER_ABSENT, .minimum_Wh = TAPER_ABSENT};
    bench_send(&message);
    message = (taper_message_t){.kind = TAPER_MESSAGE_EV_PARAM_D, .node = 1};
    message.as.ev_param_d = (taper_ev_param_d_t){.revision = 9, .session = 7, .taper_W = 655340};
    bench_send(&message);
}

static void test_row_5_the_greatest_values_of_the_wire_do_not_spoil_the_plan(void) {
    bench_send_all(3, 50000);
    bench_step();
    bench_send_all(3, 50000);
    send_extreme_parameters();
    bench_step();
    TEST_ASSERT_EQUAL_INT32(2000000, bench.station.snapshot.demand[0].capacity_Wh);
    for (uint8_t i = 0; i < 3; i++) {
        TEST_ASSERT_TRUE(bench.station.plan_W[0][i] >= 0 && bench.station.plan_W[0][i] <= 22080);
    }
    TEST_ASSERT_INT32_WITHIN(80, 8000, bench.station.plan_W[0][1]); /* the others, as planned without it */
    TEST_ASSERT_EQUAL_UINT32(0, taper_station_counter(&bench.station, TAPER_COUNTER_PLANS_REJECTED));
    TEST_ASSERT_EQUAL_UINT32(0, taper_station_counter(&bench.station, TAPER_COUNTER_GUARD_VIOLATIONS));
}

static void test_row_26_a_clock_that_was_set_makes_the_planner_think_again(void) {
    taper_message_t message = {.kind = TAPER_MESSAGE_TIME_SYNC, .node = TAPER_NODE_GATEWAY};
    bench_send_all(1, 50000);
    bench_step();
    bench_send_all(1, 50000);
    bench_step();
    TEST_ASSERT_EQUAL_UINT32(1, taper_station_counter(&bench.station, TAPER_COUNTER_PLANS));
    bench_send_all(1, 50000);
    message.as.time_sync = (taper_time_sync_t){.unix_s = 600000 + bench.now_ms / 1000 + 3600, .quality = 1};
    bench_send(&message);
    bench_step();
    TEST_ASSERT_EQUAL_UINT32(2, taper_station_counter(&bench.station, TAPER_COUNTER_PLANS));
    TEST_ASSERT_EQUAL(TAPER_MODE_PLAN, taper_station_mode(&bench.station));
}

/** A station to which price counts, with one vehicle for 8 hours, and a price that halves in an hour. */
static void start_with_a_falling_price(int32_t weight_permille, taper_station_config_t *config) {
    taper_station_options_t options = with_solver();
    *config = *options.config;
    config->price_weight_permille = weight_permille;
    options.config = config;
    bench_start(&options);
    taper_price_curve_t price = {.count = 6};
    for (uint16_t hour = 0; hour < price.count; hour++) {
        price.point[hour] = (taper_price_point_t){.time_ms = bench.now_ms + hour * UINT32_C(3600000),
                                                  .milli_per_kWh = hour == 0 ? 300 : 150};
    }
    TEST_ASSERT_EQUAL(TAPER_OK, taper_limits_set_price(&bench.station.limits, &price));
    bench_send_all(1, 50000);
    taper_message_t stay = {.kind = TAPER_MESSAGE_EV_PARAM_B, .node = 1};
    stay.as.ev_param_b = (taper_ev_param_b_t){
        .revision = 7, .session = 7, .departure_min = 10000 + 480, .peak_W = 11000, .min_mA = TAPER_ABSENT};
    bench_send(&stay);
    bench_step();
    TEST_ASSERT_EQUAL(TAPER_MODE_PLAN, taper_station_mode(&bench.station));
}

static void test_who_has_time_waits_for_a_lower_price_and_gets_no_power_that_is_left_over(void) {
    taper_station_config_t config;
    start_with_a_falling_price(0, &config);
    TEST_ASSERT_GREATER_THAN_INT32(0, bench.station.setpoints.current_mA[0]);
    start_with_a_falling_price(1000, &config);
    TEST_ASSERT_TRUE(bench.station.plan_waits[0]);
    TEST_ASSERT_EQUAL_INT32(bench.station.proposal.wish_W[0], bench.station.proposal.ceiling_W[0]);
    TEST_ASSERT_EQUAL_INT32(0, bench.station.setpoints.current_mA[0]);
}

static void start_planning(const taper_planning_t *planning, taper_station_config_t *config) {
    taper_station_options_t options = with_solver();
    *config = *options.config;
    config->planning = *planning;
    options.config = config;
    bench_start(&options);
}

/** So many ticks of a second, with reports of the first `vehicles`. */
static void pass_seconds(unsigned seconds, uint8_t vehicles) {
    for (unsigned k = 0; k < seconds; k++) {
        bench_send_all(vehicles, 30000);
        bench_step();
    }
    TEST_ASSERT_EQUAL(TAPER_MODE_PLAN, taper_station_mode(&bench.station));
}

static uint32_t plans(void) {
    return taper_station_counter(&bench.station, TAPER_COUNTER_PLANS);
}

static void test_by_the_papers_rule_a_plan_is_followed_step_by_step_until_a_vehicle_comes(void) {
    taper_station_config_t config;
    start_planning(&(taper_planning_t){.on_events = true, .horizon_steps = 3}, &config);
    pass_seconds(100, 1); /* its vehicle takes nothing, which is no event */
    const uint32_t made = plans();
    TEST_ASSERT_EQUAL_UINT32(1, made);
    bench.station.plan_W[1][0] = 3000; /* to tell the steps apart */
    pass_seconds(790, 1);
    TEST_ASSERT_GREATER_THAN_INT32(3000, bench.station.proposal.wish_W[0]);
    pass_seconds(20, 1);
    TEST_ASSERT_EQUAL_INT32(3000, bench.station.proposal.wish_W[0]);
    TEST_ASSERT_EQUAL_UINT32(made, plans());
    pass_seconds(1, 2);
    TEST_ASSERT_EQUAL_UINT32(made + 1, plans());
    pass_seconds(100, 2);
    const uint32_t both = plans();
    pass_seconds(2 * 900, 2); /* the horizon has three steps */
    TEST_ASSERT_EQUAL_UINT32(both + 1, plans());
}

static void test_otherwise_a_plan_is_made_anew_in_every_step(void) {
    taper_station_config_t config;
    start_planning(&(taper_planning_t){.horizon_steps = 3}, &config);
    pass_seconds(100, 1);
    const uint32_t made = plans();
    pass_seconds(3 * 900, 1);
    TEST_ASSERT_EQUAL_UINT32(made + 3, plans());
}

static void test_by_the_log_utility_nobody_gets_more_than_is_planned(void) {
    taper_station_config_t config;
    const taper_planning_t planning = {.objective = TAPER_OBJECTIVE_LOG_UTILITY,
                                       .lambda_milli_per_kWh2 = 100000};
    start_planning(&planning, &config);
    pass_seconds(1, 1);
    bench.station.plan_W[0][0] = 5000;
    pass_seconds(1, 1);
    TEST_ASSERT_EQUAL_INT32(5000, bench.station.proposal.wish_W[0]);
    TEST_ASSERT_EQUAL_INT32(5000, bench.station.proposal.ceiling_W[0]);
    TEST_ASSERT_EQUAL_INT32(
        7300, bench.station.target.current_mA[0]); /* up to the step, where it could take 11.6 A */
}

static void test_a_tick_with_room_for_a_whole_solve_ends_with_a_plan_by_log_utility_too(void) {
    taper_station_config_t config;
    const taper_planning_t planning = {.objective = TAPER_OBJECTIVE_LOG_UTILITY,
                                       .lambda_milli_per_kWh2 = 1000000};
    start_planning(&planning, &config);
    bench_send_all(8, 45000);
    for (uint8_t node = 1; node <= 8;
         node++) { /* uneven and steep: many programmes, of many iterations each */
        taper_message_t steep = {.kind = TAPER_MESSAGE_EV_PARAM_D, .node = node};
        steep.as.ev_param_d = (taper_ev_param_d_t){.revision = 7, .session = 7, .taper_W = 10900};
        bench_send_vehicle(node, 7, 90 * node);
        bench_send(&steep);
    }
    bench_step();
    const uint16_t expected = TAPER_REAL_IS_DOUBLE ? TAPER_MAX_ITERATIONS : 0; /* float asks for less */
    TEST_ASSERT_GREATER_THAN_UINT16(expected, taper_planner_iterations(&bench.station.planner));
    TEST_ASSERT_EQUAL(TAPER_MODE_PLAN, taper_station_mode(&bench.station));
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_a_soc_frame_in_gives_a_setpoint_frame_out_through_every_hop);
    RUN_TEST(test_sliced_planning_charges_by_fallback_until_the_plan_is_there);
    RUN_TEST(test_short_slices_come_to_a_plan_as_well_with_less_than_ten_iterations_in_every_tick);
    RUN_TEST(test_while_a_renewal_is_in_work_the_plan_is_followed);
    RUN_TEST(test_a_poisoned_solver_means_fallback_in_the_same_tick_and_a_new_try_after_a_minute);
    RUN_TEST(test_a_plan_ends_after_two_steps_without_a_renewal);
    RUN_TEST(test_row_5_the_greatest_values_of_the_wire_do_not_spoil_the_plan);
    RUN_TEST(test_row_26_a_clock_that_was_set_makes_the_planner_think_again);
    RUN_TEST(test_who_has_time_waits_for_a_lower_price_and_gets_no_power_that_is_left_over);
    RUN_TEST(test_by_the_papers_rule_a_plan_is_followed_step_by_step_until_a_vehicle_comes);
    RUN_TEST(test_otherwise_a_plan_is_made_anew_in_every_step);
    RUN_TEST(test_by_the_log_utility_nobody_gets_more_than_is_planned);
    RUN_TEST(test_a_tick_with_room_for_a_whole_solve_ends_with_a_plan_by_log_utility_too);
    return UNITY_END();
}
