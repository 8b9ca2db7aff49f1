/* EV_PARAM_E: a second line of the taper. */
#include "taper/session.h"

#include "support/session_bench.h"
#include "unity.h"

static session_bench_t bench;

void setUp(void) {
    bench_start(&bench, BENCH_AC3);
}

void tearDown(void) {}

static void assert_second_line(int32_t peak_W, int32_t taper_W) {
    const taper_demand_t *demand = bench_demand(&bench);
    TEST_ASSERT_TRUE(demand->active);
    TEST_ASSERT_EQUAL_INT32(peak_W, demand->second_peak_W);
    TEST_ASSERT_EQUAL_INT32(taper_W, demand->second_taper_W);
    TEST_ASSERT_EQUAL_INT32(11000, demand->peak_W);
    TEST_ASSERT_EQUAL_INT32(4400, demand->taper_W);
}

static void test_who_tells_no_second_line_has_none(void) {
    bench_plug_in(&bench);
    assert_second_line(0, 0);
}

static void test_a_second_line_may_come_later_and_makes_the_planner_think_again(void) {
    bench_plug_in(&bench);
    (void)bench_demand(&bench);
    const uint32_t revision = bench.table.revision;
    bench_report_e(&bench);
    assert_second_line(20000, 18000);
    TEST_ASSERT_EQUAL_UINT32(revision + 1, bench.table.revision);
    bench_report_e(&bench);
    TEST_ASSERT_EQUAL_UINT32(revision + 1, bench.table.revision);
}

static void test_a_second_line_of_another_revision_or_session_is_not_used(void) {
    bench.e.revision = 2;
    bench_plug_in(&bench);
    bench_report_e(&bench);
    assert_second_line(0, 0);
    bench.e.revision = 1;
    bench.e.session = 8;
    bench_report_e(&bench);
    assert_second_line(0, 0);
    bench.e.session = 7;
    bench_report_e(&bench);
    assert_second_line(20000, 18000);
}

static void test_new_parameters_end_the_second_line_of_the_old_ones(void) {
    bench_plug_in(&bench);
    bench_report_e(&bench);
    bench_next_revision(&bench);
    bench_report_parameters(&bench);
    assert_second_line(0, 0);
    bench_report_e(&bench);
    assert_second_line(20000, 18000);
}

static void test_what_cannot_be_is_repaired(void) {
    bench_plug_in(&bench);
    bench.e.taper_W = 30000;
    bench_report_e(&bench);
    assert_second_line(20000, 20000);
    bench.e.taper_W = TAPER_ABSENT;
    bench_report_e(&bench);
    assert_second_line(20000, 0);
    bench.e.peak_W = TAPER_ABSENT;
    bench.e.taper_W = 30000;
    bench_report_e(&bench);
    assert_second_line(0, 0);
}

static void test_lines_may_begin_above_what_the_currents_allow(void) {
    bench.b.peak_W = 60000;
    bench.d.taper_W = 58000;
    bench_plug_in(&bench);
    const taper_demand_t *demand = bench_demand(&bench);
    TEST_ASSERT_EQUAL_INT32(16000, demand->max_mA);
    TEST_ASSERT_EQUAL_INT32(60000, demand->peak_W);
    TEST_ASSERT_EQUAL_INT32(58000, demand->taper_W);
}

static void test_without_a_capacity_there_is_no_second_line(void) {
    bench.a.capacity_Wh = TAPER_ABSENT;
    bench_plug_in(&bench);
    bench_report_e(&bench);
    TEST_ASSERT_EQUAL_INT32(0, bench_demand(&bench)->second_peak_W);
}

static void test_the_next_vehicle_has_none_of_it(void) {
    bench_plug_in(&bench);
    bench_report_e(&bench);
    bench_unplug(&bench);
    bench_plug_in(&bench);
    assert_second_line(0, 0);
}

static void test_after_a_restart_it_counts_again_when_it_is_told_again(void) {
    taper_session_kept_t kept;
    bench_plug_in(&bench);
    bench_report_e(&bench);
    TEST_ASSERT_TRUE(taper_session_keep(&bench.table, bench.connector, bench.now_ms, &kept));
    const taper_station_config_t *config = bench.table.config;
    taper_session_init(&bench.table, config);
    TEST_ASSERT_TRUE(taper_session_restore(&bench.table, bench.connector, &kept));
    taper_session_start_clock(&bench.table, 0, bench.now_ms);
    bench_report_status(&bench);
    taper_session_confirm(&bench.table, bench.connector);
    assert_second_line(0, 0);
    bench_report_parameters(&bench);
    bench_report_e(&bench);
    assert_second_line(20000, 18000);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_who_tells_no_second_line_has_none);
    RUN_TEST(test_a_second_line_may_come_later_and_makes_the_planner_think_again);
    RUN_TEST(test_a_second_line_of_another_revision_or_session_is_not_used);
    RUN_TEST(test_new_parameters_end_the_second_line_of_the_old_ones);
    RUN_TEST(test_what_cannot_be_is_repaired);
    RUN_TEST(test_lines_may_begin_above_what_the_currents_allow);
    RUN_TEST(test_without_a_capacity_there_is_no_second_line);
    RUN_TEST(test_the_next_vehicle_has_none_of_it);
    RUN_TEST(test_after_a_restart_it_counts_again_when_it_is_told_again);
    return UNITY_END();
}
