/* When the planner should think again. */
#include "support/session_bench.h"
#include "unity.h"

static session_bench_t bench;

void setUp(void) {
    bench_start(&bench, BENCH_AC3);
}

void tearDown(void) {}

static bool revised(uint32_t *last) {
    bench_tick(&bench);
    const bool changed = bench.table.revision != *last;
    *last = bench.table.revision;
    return changed;
}

static void test_a_session_that_begins_or_ends_is_an_event(void) {
    bench_tick(&bench);
    uint32_t last = bench.table.revision;
    bench_plug_in(&bench);
    TEST_ASSERT_TRUE(revised(&last));
    bench_unplug(&bench);
    TEST_ASSERT_TRUE(revised(&last));
}

static void test_a_session_that_ends_without_having_charged_is_an_event(void) {
    bench.ev.complete = true;
    bench_plug_in(&bench);
    bench_tick(&bench);
    uint32_t last = bench.table.revision;
    bench_unplug(&bench);
    TEST_ASSERT_TRUE(revised(&last));
}

static void test_repeated_reports_are_no_event(void) {
    bench_plug_in(&bench);
    bench_tick(&bench);
    uint32_t last = bench.table.revision;
    for (int i = 0; i < 20; i++) {
        bench_live(&bench, 200);
        bench_tick(&bench);
        TEST_ASSERT_FALSE(revised(&last));
    }
}

static void test_new_parameters_are_an_event_once_they_are_whole(void) {
    bench_plug_in(&bench);
    bench_tick(&bench);
    uint32_t last = bench.table.revision;
    bench_next_revision(&bench);
    bench_report_a(&bench);
    bench_report_b(&bench);
    TEST_ASSERT_FALSE(revised(&last));
    bench_report_c(&bench);
    TEST_ASSERT_TRUE(revised(&last));
    bench_report_d(&bench); /* the taper is known again */
    TEST_ASSERT_TRUE(revised(&last));
}

static void test_new_parameters_of_a_vehicle_without_a_taper_are_an_event(void) {
    bench_report_status(&bench);
    bench_report_a(&bench);
    bench_report_b(&bench);
    bench_report_c(&bench);
    bench_tick(&bench);
    uint32_t last = bench.table.revision;
    bench_next_revision(&bench);
    bench_report_a(&bench);
    bench_report_b(&bench);
    bench_report_c(&bench);
    TEST_ASSERT_TRUE(revised(&last));
}

static void test_a_met_target_is_an_event(void) {
    bench_plug_in(&bench);
    bench_tick(&bench);
    uint32_t last = bench.table.revision;
    bench.elec.energy_Wh = 19990;
    bench_report_elec(&bench);
    TEST_ASSERT_FALSE(revised(&last));
    bench.elec.energy_Wh = 20000;
    bench_report_elec(&bench);
    TEST_ASSERT_TRUE(revised(&last));
}

static void test_a_connector_that_falls_silent_is_an_event_when_expired(void) {
    bench_plug_in(&bench);
    bench_tick(&bench);
    uint32_t last = bench.table.revision;
    bench.now_ms += TAPER_EVSE_STATUS_TIMEOUT_ms;
    bench_tick(&bench);
    TEST_ASSERT_FALSE(revised(&last));
    bench.now_ms += 1;
    bench_tick(&bench);
    TEST_ASSERT_TRUE(revised(&last));
    bench_report_status(&bench);
    TEST_ASSERT_TRUE(revised(&last));
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_a_session_that_begins_or_ends_is_an_event);
    RUN_TEST(test_a_session_that_ends_without_having_charged_is_an_event);
    RUN_TEST(test_repeated_reports_are_no_event);
    RUN_TEST(test_new_parameters_are_an_event_once_they_are_whole);
    RUN_TEST(test_new_parameters_of_a_vehicle_without_a_taper_are_an_event);
    RUN_TEST(test_a_met_target_is_an_event);
    RUN_TEST(test_a_connector_that_falls_silent_is_an_event_when_expired);
    return UNITY_END();
}
