/* A planner that fails, a guard that objects, a tick that is late, a bit that flips: faults 22 to 25, 47 and 48. And what
   vehicles ask of the planner that cannot be: 32 and 34. */
#include <math.h>

#include "solver.h"
#include "station_bench.h"
#include "taper/codec.h"
#include "taper/solvers.h"
#include "unity.h"

#define VEHICLES 8
#define LIMIT_W  30000
#define LOW_W    20000
#define OFF_ms   600000u

static OSQPSolver *osqp(void) {
    return bench.station.options.solver->osqp;
}

static int32_t limit_W;

static void tick(void) {
    bench_send_all(VEHICLES, limit_W);
    bench_step();
}

void setUp(void) {
    taper_station_options_t options = bench_options();
    options.solver = taper_solvers[bench_hub_index()];
    bench_start(&options);
    limit_W = LIMIT_W;
    tick();
    TEST_ASSERT_EQUAL(TAPER_MODE_PLAN, taper_station_mode(&bench.station));
}

void tearDown(void) {
    TEST_ASSERT_LESS_OR_EQUAL_INT64((int64_t)LIMIT_W * 1000, bench.station.row_sum[0][TAPER_ROW_POWER]);
}

static uint32_t count(taper_counter_t counter) {
    return taper_station_counter(&bench.station, counter);
}

static int32_t sum_mA(void) {
    int32_t sum = 0;
    for (unsigned i = 0; i < VEHICLES; i++) {
        sum += bench.station.setpoints.current_mA[i];
    }
    return sum;
}

/** A problem under way, that whatever the test does to the solver meets. */
static void begin_a_problem(void) {
    bench.station.options.iterations_per_tick = TAPER_MIN_SLICE;
    limit_W = limit_W == LIMIT_W ? LOW_W : LIMIT_W; /* an event, far enough from the last problem */
    tick();
    TEST_ASSERT_EQUAL(TAPER_VERDICT_SOLVING, bench.station.planner.verdict);
}

/** EDF in the same tick, and everybody still charges. */
static void assert_fallback(taper_verdict_t verdict) {
    TEST_ASSERT_EQUAL(verdict, bench.station.planner.verdict);
    TEST_ASSERT_EQUAL(TAPER_MODE_FALLBACK, taper_station_mode(&bench.station));
    TEST_ASSERT_GREATER_THAN_INT32(20000, sum_mA()); /* of 29 A that the lower limit carries */
    TEST_ASSERT_EQUAL_UINT32(0, count(TAPER_COUNTER_GUARD_VIOLATIONS));
}

static void poison_with_nan(void) {
    static OSQPFloat poisoned[TAPER_MAX_VARIABLES];
    for (unsigned v = 0; v < TAPER_MAX_VARIABLES; v++) {
        poisoned[v] = (OSQPFloat)NAN;
    }
    TEST_ASSERT_EQUAL(0, osqp_update_data_vec(osqp(), poisoned, NULL, NULL));
}

/** What the solver answers to data that cannot be met: bounds that cross. */
static void test_row_22_a_problem_called_infeasible_means_edf_in_the_same_tick_and_the_shortfall_is_told(
    void) {
    begin_a_problem();
    osqp()->info->status_val = OSQP_PRIMAL_INFEASIBLE;
    osqp()->settings->eps_prim_inf = (OSQPFloat)1e6; /* any step now looks like a proof */
    osqp()->settings->eps_dual_inf = (OSQPFloat)1e6;
    bench.station.options.iterations_per_tick = TAPER_MAX_ITERATIONS;
    tick();
    osqp()->settings->eps_prim_inf = (OSQPFloat)1e-20;
    osqp()->settings->eps_dual_inf = (OSQPFloat)1e-20;
    assert_fallback(TAPER_VERDICT_REFUSED);
    bench_send_all(VEHICLES, 5000); /* not enough for all of them */
    bench_step();
    const taper_outlook_t outlook = taper_station_outlook(&bench.station, VEHICLES - 1);
    TEST_ASSERT_GREATER_THAN_INT32(0, outlook.short_Wh);
    TEST_ASSERT_EQUAL(TAPER_REASON_DEPARTURE, outlook.because); /* 20 kWh in two hours, and it takes 8 kW */
}

static void test_row_23_a_solve_that_runs_out_of_iterations_means_edf_in_the_same_tick(void) {
    begin_a_problem();
    const OSQPFloat absolute = osqp()->settings->eps_abs, relative = osqp()->settings->eps_rel;
    osqp()->settings->eps_abs = (OSQPFloat)1e-30; /* never good enough */
    osqp()->settings->eps_rel = 0;
    bench.station.options.iterations_per_tick = TAPER_MAX_ITERATIONS;
    tick();
    osqp()->settings->eps_abs = absolute;
    osqp()->settings->eps_rel = relative;
    assert_fallback(TAPER_VERDICT_LATE);
    TEST_ASSERT_EQUAL_UINT16(TAPER_MAX_ITERATIONS, taper_planner_iterations(&bench.station.planner));
    TEST_ASSERT_EQUAL_UINT32(1, count(TAPER_COUNTER_PLANS_REJECTED));
}

static void test_row_23_while_slices_remain_the_last_plan_is_followed(void) {
    begin_a_problem();
    TEST_ASSERT_EQUAL(TAPER_MODE_PLAN, taper_station_mode(&bench.station));
    TEST_ASSERT_EQUAL_UINT32(0, count(TAPER_COUNTER_PLANS_REJECTED));
}

static void test_row_24_nan_in_the_solver_means_edf_in_the_same_tick(void) {
    begin_a_problem();
    poison_with_nan();
    tick();
    assert_fallback(TAPER_VERDICT_NOT_FINITE);
}

/** One more bad plan. A minute passes: sooner it is not tried again. */
static void fail_once(void) {
    bench.now_ms += 60000;
    bench.station.stepped_ms = bench.now_ms - 1000; /* that is no late tick here */
    begin_a_problem();
    poison_with_nan();
    tick();
    TEST_ASSERT_EQUAL(TAPER_VERDICT_NOT_FINITE, bench.station.planner.verdict);
}

static void test_row_24_after_three_bad_plans_in_a_row_the_planner_is_off_for_ten_minutes(void) {
    fail_once();
    fail_once();
    TEST_ASSERT_EQUAL_UINT32(0, count(TAPER_COUNTER_PLANNER_OFFS));
    fail_once();
    TEST_ASSERT_EQUAL_UINT32(1, count(TAPER_COUNTER_PLANNER_OFFS));
    TEST_ASSERT_EQUAL_UINT(1, bench_events(TAPER_EVENT_PLANNER_OFF));
    bench.station.options.iterations_per_tick = TAPER_MAX_ITERATIONS;
    const uint32_t off_ms = bench.now_ms;
    const uint32_t plans = count(TAPER_COUNTER_PLANS);
    while (bench.now_ms - off_ms < OFF_ms - 2000) {
        bench.station.planned_limit_W = -1; /* events do not help */
        tick();
        TEST_ASSERT_EQUAL(TAPER_MODE_FALLBACK, taper_station_mode(&bench.station));
    }
    TEST_ASSERT_EQUAL_UINT32(plans, count(TAPER_COUNTER_PLANS));
    for (int k = 0; k < 3; k++) {
        tick();
    }
    TEST_ASSERT_EQUAL(TAPER_MODE_PLAN, taper_station_mode(&bench.station));
    TEST_ASSERT_EQUAL_UINT(1, bench_events(TAPER_EVENT_PLANNER_ON));
}

static void test_row_24_a_good_plan_between_two_bad_ones_keeps_the_planner_on(void) {
    for (int k = 0; k < 4; k++) {
        fail_once();
        bench.now_ms += 60000;
        bench.station.stepped_ms = bench.now_ms - 1000;
        bench.station.options.iterations_per_tick = TAPER_MAX_ITERATIONS;
        tick();
        TEST_ASSERT_EQUAL(TAPER_MODE_PLAN, taper_station_mode(&bench.station));
    }
    TEST_ASSERT_EQUAL_UINT32(0, count(TAPER_COUNTER_PLANNER_OFFS));
}

static void test_row_25_what_the_guard_refuses_is_scaled_down_and_counted(void) {
    const int32_t before_mA = sum_mA();
    bench.station.limit_now.supply.site_W = LIMIT_W / 2; /* as if the sums had been wrong */
    bench.station.target.current_mA[0] += TAPER_CURRENT_STEP_mA;
    bench_poll(20);
    TEST_ASSERT_EQUAL_UINT32(1, count(TAPER_COUNTER_GUARD_VIOLATIONS));
    TEST_ASSERT_EQUAL_UINT(1, bench_events(TAPER_EVENT_GUARD));
    TEST_ASSERT_LESS_OR_EQUAL_INT32(before_mA / 2, sum_mA());
    for (unsigned i = 0; i < VEHICLES; i++) {
        const int32_t current_mA = bench.station.setpoints.current_mA[i];
        TEST_ASSERT_TRUE(current_mA == 0 || current_mA >= 6000);
    }
}

static void test_row_25_where_scaling_does_not_help_everybody_gets_nothing(void) {
    bench.station.limit_now.supply.site_W = 0;
    bench.station.target.current_mA[0] += TAPER_CURRENT_STEP_mA;
    bench_poll(20);
    TEST_ASSERT_EQUAL_UINT32(1, count(TAPER_COUNTER_GUARD_VIOLATIONS));
    TEST_ASSERT_EQUAL_INT32(0, sum_mA());
}

/** Vehicle 1 tells something else of itself, with a revision of its own. */
static void send_other_params(int32_t capacity_Wh, int32_t departure_min) {
    taper_message_t message = {.kind = TAPER_MESSAGE_EV_PARAM_A, .node = 1};
    message.as.ev_param_a = (taper_ev_param_a_t){.revision = 9,
                                                 .session = 7,
                                                 .capacity_Wh = capacity_Wh,
                                                 .soc_target_permille = 800,
                                                 .soc_minimum_permille = TAPER_ABSENT,
                                                 .soc_plug_in_permille = 500};
    bench_send(&message);
    message = (taper_message_t){.kind = TAPER_MESSAGE_EV_PARAM_B, .node = 1};
    message.as.ev_param_b = (taper_ev_param_b_t){
        .revision = 9, .session = 7, .departure_min = departure_min, .peak_W = 11000, .min_mA = TAPER_ABSENT};
    bench_send(&message);
    message = (taper_message_t){.kind = TAPER_MESSAGE_EV_PARAM_C, .node = 1};
    message.as.ev_param_c = (taper_ev_param_c_t){
        .revision = 9, .target_Wh = 20000, .maximum_Wh = TAPER_ABSENT, .minimum_Wh = TAPER_ABSENT};
    bench_send(&message);
}

/** A tick with the first `vehicles`, of which only vehicle 1 says anything. */
static void tick_with_other_params(uint8_t vehicles, int32_t capacity_Wh, int32_t departure_min) {
    bench_send_clock();
    bench_send_limit(limit_W);
    for (uint8_t node = 1; node <= VEHICLES; node++) {
        bench_send_status(node, node <= vehicles);
    }
    send_other_params(capacity_Wh, departure_min);
    bench_step();
}

static void assert_planned(void) {
    TEST_ASSERT_EQUAL(TAPER_VERDICT_SOLVED, bench.station.planner.verdict);
    TEST_ASSERT_EQUAL(TAPER_MODE_PLAN, taper_station_mode(&bench.station));
    TEST_ASSERT_EQUAL_UINT32(0, count(TAPER_COUNTER_PLANS_REJECTED));
}

static void test_row_32_a_departure_in_the_past_makes_no_problem_infeasible_and_comes_first(void) {
    const uint32_t plans = count(TAPER_COUNTER_PLANS);
    for (int k = 0; k < 3; k++) {
        limit_W = LOW_W;                              /* three could take 27 kW */
        tick_with_other_params(3, 60000, 10000 - 60); /* an hour ago */
    }
    assert_planned();
    TEST_ASSERT_GREATER_THAN_UINT32(plans, count(TAPER_COUNTER_PLANS));
    TEST_ASSERT_LESS_THAN_INT32(0, bench.station.snapshot.demand[0].departs_in_s);
    TEST_ASSERT_TRUE(taper_station_outlook(&bench.station, 0).departure_passed);
    TEST_ASSERT_EQUAL_INT32(15900, bench.station.target.current_mA[0]); /* 11 kW, all that it takes */
    TEST_ASSERT_LESS_THAN_INT32(11000, bench.station.target.current_mA[1]);
    TEST_ASSERT_LESS_THAN_INT32(11000, bench.station.target.current_mA[2]);
}

static void test_row_34_a_vehicle_without_a_capacity_is_planned_by_its_energy(void) {
    static const int32_t capacities_Wh[] = {TAPER_ABSENT, 100, 900, 2000100, 6553400};
    for (unsigned k = 0; k < sizeof capacities_Wh / sizeof capacities_Wh[0]; k++) {
        tick();
        for (int s = 0; s < 3; s++) {
            tick_with_other_params(VEHICLES, capacities_Wh[k], 10120);
        }
        assert_planned();
        TEST_ASSERT_EQUAL_INT32(0, bench.station.snapshot.demand[0].capacity_Wh);
        TEST_ASSERT_EQUAL_INT32(20000, bench.station.snapshot.demand[0].need_Wh);
        TEST_ASSERT_TRUE(taper_station_outlook(&bench.station, 0).by_energy);
        TEST_ASSERT_GREATER_OR_EQUAL_INT32(6000, bench.station.target.current_mA[0]);
        TEST_ASSERT_GREATER_THAN_INT32(20000, sum_mA());
    }
}

static void test_row_47_after_a_late_tick_edf_charges_for_one_tick(void) {
    tick();
    bench.now_ms += 600;
    tick();
    TEST_ASSERT_EQUAL(TAPER_MODE_FALLBACK, taper_station_mode(&bench.station));
    TEST_ASSERT_EQUAL_UINT32(1, count(TAPER_COUNTER_TICK_OVERRUNS));
    TEST_ASSERT_EQUAL_UINT(1, bench_events(TAPER_EVENT_TICK_OVERRUN));
    tick();
    TEST_ASSERT_EQUAL(TAPER_MODE_PLAN, taper_station_mode(&bench.station));
}

static unsigned kicks;

static void kick(void *context) {
    (void)context;
    kicks++;
}

static void test_row_47_after_two_late_ticks_in_a_row_the_watchdog_is_left_to_bite(void) {
    bench.port.kick_watchdog = kick;
    kicks = 0;
    tick();
    TEST_ASSERT_EQUAL_UINT(1, kicks);
    bench.now_ms += 600;
    tick();
    TEST_ASSERT_EQUAL_UINT(2, kicks);
    bench.now_ms += 600;
    tick();
    tick();
    TEST_ASSERT_EQUAL_UINT(2, kicks);
}

static void test_row_48_a_flipped_setpoint_is_worked_out_again_before_it_is_sent(void) {
    const taper_setpoint_t right = bench_setpoint_for(1);
    bench.station.setpoints.current_mA[0] ^= 0x4000;
    bench_poll(20);
    TEST_ASSERT_EQUAL_INT32(right.current_mA, bench.station.setpoints.current_mA[0]);
    TEST_ASSERT_EQUAL_INT32(right.current_mA, bench.setpoint[1].current_mA);
    TEST_ASSERT_EQUAL_UINT32(1, count(TAPER_COUNTER_SETPOINT_FLIPS));
    TEST_ASSERT_EQUAL_UINT(1, bench_events(TAPER_EVENT_SETPOINT_FLIP));
}

static void test_row_48_every_bit_of_setpoints_fallback_currents_and_inverses_is_watched(void) {
    taper_setpoints_t *const kept[] = {&bench.station.setpoints, &bench.station.fallback,
                                       &bench.station.inverse, &bench.station.fallback_inverse};
    for (unsigned k = 0; k < 4; k++) {
        for (unsigned bit = 0; bit < 32; bit++) {
            const uint32_t flipped = (uint32_t)kept[k]->current_mA[bit % VEHICLES] ^ (UINT32_C(1) << bit);
            kept[k]->current_mA[bit % VEHICLES] = (int32_t)flipped;
            bench_poll(20);
            TEST_ASSERT_EQUAL_UINT32(k * 32 + bit + 1, count(TAPER_COUNTER_SETPOINT_FLIPS));
        }
    }
}

static void test_row_48_after_two_flips_the_watchdog_is_left_to_bite(void) {
    bench.port.kick_watchdog = kick;
    bench.station.setpoints.current_mA[0] ^= 1;
    bench_poll(20);
    kicks = 0;
    tick();
    TEST_ASSERT_EQUAL_UINT(1, kicks);
    bench.station.inverse.current_mA[3] ^= 1;
    bench_poll(20);
    tick();
    TEST_ASSERT_EQUAL_UINT(1, kicks);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_row_22_a_problem_called_infeasible_means_edf_in_the_same_tick_and_the_shortfall_is_told);
    RUN_TEST(test_row_23_a_solve_that_runs_out_of_iterations_means_edf_in_the_same_tick);
    RUN_TEST(test_row_23_while_slices_remain_the_last_plan_is_followed);
    RUN_TEST(test_row_24_nan_in_the_solver_means_edf_in_the_same_tick);
    RUN_TEST(test_row_24_after_three_bad_plans_in_a_row_the_planner_is_off_for_ten_minutes);
    RUN_TEST(test_row_24_a_good_plan_between_two_bad_ones_keeps_the_planner_on);
    RUN_TEST(test_row_25_what_the_guard_refuses_is_scaled_down_and_counted);
    RUN_TEST(test_row_25_where_scaling_does_not_help_everybody_gets_nothing);
    RUN_TEST(test_row_32_a_departure_in_the_past_makes_no_problem_infeasible_and_comes_first);
    RUN_TEST(test_row_34_a_vehicle_without_a_capacity_is_planned_by_its_energy);
    RUN_TEST(test_row_47_after_a_late_tick_edf_charges_for_one_tick);
    RUN_TEST(test_row_47_after_two_late_ticks_in_a_row_the_watchdog_is_left_to_bite);
    RUN_TEST(test_row_48_a_flipped_setpoint_is_worked_out_again_before_it_is_sent);
    RUN_TEST(test_row_48_every_bit_of_setpoints_fallback_currents_and_inverses_is_watched);
    RUN_TEST(test_row_48_after_two_flips_the_watchdog_is_left_to_bite);
    return UNITY_END();
}
