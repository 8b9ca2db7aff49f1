/* Who is there, with which parameters, and what keeps a vehicle from charging. */
#include "taper/session.h"

#include <string.h>

#include "support/session_bench.h"
#include "unity.h"

static session_bench_t bench;

void setUp(void) {
    bench_start(&bench, BENCH_AC3);
}

void tearDown(void) {}

/* ---- Beginning and end. */

static void test_an_empty_table_wants_nothing(void) {
    taper_session_snapshot(&bench.table, bench.now_ms, &bench.snapshot);
    TEST_ASSERT_EQUAL_UINT8(3, bench.snapshot.count);
    TEST_ASSERT_EQUAL_UINT32(bench.now_ms, bench.snapshot.now_ms);
    for (uint8_t i = 0; i < 3; i++) {
        TEST_ASSERT_FALSE(bench.snapshot.demand[i].active);
        TEST_ASSERT_EQUAL_UINT8(0, taper_session_number(&bench.table, i));
    }
}

static void test_a_sound_vehicle_becomes_a_demand(void) {
    bench_plug_in(&bench);
    const taper_demand_t *demand = bench_demand(&bench);
    TEST_ASSERT_TRUE(demand->active);
    TEST_ASSERT_FALSE(demand->soc_estimated);
    TEST_ASSERT_EQUAL_UINT8(7, demand->session);
    TEST_ASSERT_EQUAL_INT32(12000, demand->stored_Wh);
    TEST_ASSERT_EQUAL_INT32(60000, demand->capacity_Wh);
    TEST_ASSERT_EQUAL_INT32(20000, demand->need_Wh);
    TEST_ASSERT_EQUAL_INT32(11000, demand->peak_W);
    TEST_ASSERT_EQUAL_INT32(4400, demand->taper_W);
    TEST_ASSERT_EQUAL_INT32(16000, demand->max_mA);
    TEST_ASSERT_EQUAL_INT32(6000, demand->min_mA);
    TEST_ASSERT_EQUAL_INT32(690, demand->W_per_A);
    TEST_ASSERT_EQUAL_INT32(TAPER_DEFAULT_STAY_s, demand->departs_in_s);
    TEST_ASSERT_EQUAL_UINT8(7, taper_session_number(&bench.table, BENCH_AC3));
    TEST_ASSERT_FALSE(bench.snapshot.demand[BENCH_AC1].active);
}

static void test_a_session_needs_status_and_parameters_a_b_and_c(void) {
    void (*const report[])(session_bench_t *) = {bench_report_status, bench_report_a, bench_report_b,
                                                 bench_report_c};
    for (size_t left_out = 0; left_out < 4; left_out++) {
        setUp();
        bench.a.revision = bench.b.revision = bench.c.revision =
            0; /* what a frame that never came looks like */
        bench.a.session = bench.b.session = left_out == 3 ? 7 : 0;
        for (size_t i = 0; i < 4; i++) {
            if (i != left_out) {
                report[i](&bench);
            }
        }
        TEST_ASSERT_FALSE(bench_demand(&bench)->active);
        TEST_ASSERT_EQUAL_UINT8(0, taper_session_number(&bench.table, BENCH_AC3));
        report[left_out](&bench); /* in any order */
        TEST_ASSERT_TRUE(bench_demand(&bench)->active);
    }
}

static void test_a_session_does_not_begin_on_disagreeing_parameters(void) {
    bench.c.revision = 2;
    bench_plug_in(&bench);
    TEST_ASSERT_FALSE(bench_demand(&bench)->active);
    setUp();
    bench.b.revision = 2;
    bench_plug_in(&bench);
    TEST_ASSERT_FALSE(bench_demand(&bench)->active);
    setUp();
    bench.b.session = 8;
    bench_plug_in(&bench);
    TEST_ASSERT_FALSE(bench_demand(&bench)->active);
}

static void test_a_session_begins_only_in_pilot_states_b_c_and_d(void) {
    for (int pilot = TAPER_PILOT_A; pilot <= TAPER_PILOT_F; pilot++) {
        setUp();
        bench.status.pilot = (taper_pilot_t)pilot;
        bench_plug_in(&bench);
        const bool expected = pilot >= TAPER_PILOT_B && pilot <= TAPER_PILOT_D;
        TEST_ASSERT_EQUAL(expected, bench_demand(&bench)->active);
        TEST_ASSERT_EQUAL(expected, taper_session_number(&bench.table, BENCH_AC3) == 7);
    }
}

static void test_pilot_state_a_ends_the_session_at_once(void) {
    bench_plug_in(&bench);
    bench.status.pilot = TAPER_PILOT_A;
    bench_report_status(&bench);
    TEST_ASSERT_FALSE(bench_demand(&bench)->active);
    TEST_ASSERT_EQUAL_UINT8(0, taper_session_number(&bench.table, BENCH_AC3));
}

static void test_no_vehicle_ends_the_session_at_once(void) {
    bench_plug_in(&bench);
    bench.status.ev_present = false;
    bench_report_status(&bench);
    TEST_ASSERT_FALSE(bench_demand(&bench)->active);
    TEST_ASSERT_EQUAL_UINT8(0, taper_session_number(&bench.table, BENCH_AC3));
    bench_report_parameters(&bench); /* whatever the pilot still says */
    TEST_ASSERT_EQUAL_UINT8(0, taper_session_number(&bench.table, BENCH_AC3));
}

static void test_parameters_of_a_vehicle_that_left_do_not_serve_the_next(void) {
    bench_plug_in(&bench);
    bench_unplug(&bench);
    bench_report_status(&bench);
    TEST_ASSERT_FALSE(bench_demand(&bench)->active);
    bench_report_a(&bench);
    bench_report_b(&bench);
    TEST_ASSERT_FALSE(bench_demand(&bench)->active);
    bench_report_c(&bench);
    TEST_ASSERT_TRUE(bench_demand(&bench)->active);
    TEST_ASSERT_EQUAL_INT32(0, bench_demand(&bench)->taper_W); /* D has not come again */
}

static void test_nothing_of_the_last_vehicle_reaches_the_next(void) {
    bench.elec.energy_Wh = 5000;
    bench.ev.complete = true;
    bench_plug_in(&bench);
    bench_unplug(&bench);
    bench_report_elec(&bench); /* the meter still shows the last session */
    bench_report_ev(&bench);
    bench.a.session = 8;
    bench.b.session = 8;
    bench.a.soc_plug_in_permille = 500;
    bench_report_status(&bench);
    bench_report_parameters(&bench);
    const taper_demand_t *demand = bench_demand(&bench);
    TEST_ASSERT_TRUE(demand->active);
    TEST_ASSERT_EQUAL_INT32(20000, demand->need_Wh);
    TEST_ASSERT_EQUAL_INT32(30000, demand->stored_Wh);
}

static void test_another_session_number_is_a_new_session(void) {
    bench.elec.energy_Wh = 5000;
    bench_plug_in(&bench);
    TEST_ASSERT_EQUAL_INT32(15000, bench_demand(&bench)->need_Wh);
    bench_next_revision(&bench);
    bench.a.session = 9;
    bench.b.session = 9;
    bench.a.soc_plug_in_permille = 400;
    bench.now_ms += 900;
    bench_report_parameters(&bench);
    const taper_demand_t *demand = bench_demand(&bench);
    TEST_ASSERT_TRUE(demand->active);
    TEST_ASSERT_EQUAL_UINT8(9, demand->session);
    TEST_ASSERT_EQUAL_INT32(20000, demand->need_Wh);
    TEST_ASSERT_EQUAL_INT32(24000, demand->stored_Wh);
    TEST_ASSERT_EQUAL_INT32(TAPER_DEFAULT_STAY_s, demand->departs_in_s);
}

static void test_the_same_session_number_elsewhere_is_another_session(void) {
    bench_plug_in(&bench);
    bench.connector = BENCH_AC1;
    bench_plug_in(&bench);
    bench_unplug(&bench);
    bench.connector = BENCH_AC3;
    TEST_ASSERT_TRUE(bench_demand(&bench)->active);
    TEST_ASSERT_FALSE(bench.snapshot.demand[BENCH_AC1].active);
}

/* ---- Parameters. */

static void test_the_old_parameters_hold_until_the_new_are_whole(void) {
    bench_plug_in(&bench);
    bench_next_revision(&bench);
    bench.a.capacity_Wh = 80000;
    bench.b.peak_W = 7000;
    bench.c.target_Wh = 30000;
    bench_report_a(&bench);
    TEST_ASSERT_EQUAL_INT32(60000, bench_demand(&bench)->capacity_Wh);
    bench_report_b(&bench);
    TEST_ASSERT_EQUAL_INT32(11000, bench_demand(&bench)->peak_W);
    TEST_ASSERT_EQUAL_INT32(4400, bench_demand(&bench)->taper_W);
    bench_report_c(&bench);
    const taper_demand_t *demand = bench_demand(&bench);
    TEST_ASSERT_EQUAL_INT32(80000, demand->capacity_Wh);
    TEST_ASSERT_EQUAL_INT32(7000, demand->peak_W);
    TEST_ASSERT_EQUAL_INT32(30000, demand->need_Wh);
}

static void test_a_taper_of_another_revision_or_session_is_not_used(void) {
    bench.d.revision = 2;
    bench_plug_in(&bench);
    TEST_ASSERT_EQUAL_INT32(0, bench_demand(&bench)->taper_W);
    bench.d.revision = 1;
    bench.d.session = 8;
    bench_report_d(&bench);
    TEST_ASSERT_EQUAL_INT32(0, bench_demand(&bench)->taper_W);
    bench.d.session = 7;
    bench_report_d(&bench);
    TEST_ASSERT_EQUAL_INT32(4400, bench_demand(&bench)->taper_W);
}

static void test_a_vehicle_without_a_taper_is_planned_without(void) {
    bench_report_status(&bench);
    bench_report_a(&bench);
    bench_report_b(&bench);
    bench_report_c(&bench);
    TEST_ASSERT_TRUE(bench_demand(&bench)->active);
    TEST_ASSERT_EQUAL_INT32(0, bench_demand(&bench)->taper_W);
}

/* ---- What keeps a vehicle from charging. */

static void test_a_silent_connector_is_not_active_after_its_timeout(void) {
    bench_plug_in(&bench);
    bench.now_ms += TAPER_EVSE_STATUS_TIMEOUT_ms;
    TEST_ASSERT_TRUE(bench_demand(&bench)->active);
    bench.now_ms += 1;
    TEST_ASSERT_FALSE(bench_demand(&bench)->active);
    TEST_ASSERT_EQUAL_UINT8(7, taper_session_number(&bench.table, BENCH_AC3));
    bench_report_status(&bench);
    TEST_ASSERT_TRUE(bench_demand(&bench)->active);
}

static void test_a_silent_connector_stays_silent_over_the_clocks_wrap(void) {
    bench_plug_in(&bench);
    bench.now_ms += 5000;
    bench_tick(&bench);
    bench.now_ms -= 4500; /* 2^32 - 4500 ms later */
    TEST_ASSERT_FALSE(bench_demand(&bench)->active);
}

static void test_reports_are_fresh_over_the_clocks_wrap(void) {
    bench.now_ms = UINT32_MAX - 100;
    bench_plug_in(&bench);
    bench.now_ms += 600;
    TEST_ASSERT_TRUE(bench_demand(&bench)->active);
    bench_tick(&bench);
    TEST_ASSERT_TRUE(bench_demand(&bench)->active);
}

static void assert_ev_flag_pauses(bool *flag) {
    bench_plug_in(&bench);
    TEST_ASSERT_TRUE(bench_demand(&bench)->active);
    *flag = true;
    bench_report_ev(&bench);
    TEST_ASSERT_FALSE(bench_demand(&bench)->active);
    *flag = false;
    bench_report_ev(&bench);
    TEST_ASSERT_TRUE(bench_demand(&bench)->active);
}

static void test_a_complete_vehicle_is_not_active(void) {
    assert_ev_flag_pauses(&bench.ev.complete);
}

static void test_a_pause_request_is_obeyed(void) {
    assert_ev_flag_pauses(&bench.ev.pause_requested);
}

static void test_a_stop_request_is_obeyed(void) {
    assert_ev_flag_pauses(&bench.ev.stop_requested);
}

static void test_a_complete_vehicle_that_falls_asleep_stays_complete(void) {
    bench_plug_in(&bench);
    bench.ev.complete = true;
    bench_report_ev(&bench);
    bench.now_ms += 10 * TAPER_EV_STATUS_TIMEOUT_ms;
    bench_tick(&bench);
    bench_report_status(&bench);
    TEST_ASSERT_FALSE(bench_demand(&bench)->active);
}

static void test_a_fault_of_connector_or_vehicle_pauses(void) {
    bench.status.fault = true;
    bench_plug_in(&bench);
    TEST_ASSERT_FALSE(bench_demand(&bench)->active);
    bench.status.fault = false;
    bench_report_status(&bench);
    TEST_ASSERT_TRUE(bench_demand(&bench)->active);
    bench.ev.error = 3;
    bench_report_ev(&bench);
    TEST_ASSERT_FALSE(bench_demand(&bench)->active);
}

static void test_pilot_e_pauses_but_keeps_the_session(void) {
    bench_plug_in(&bench);
    bench.status.pilot = TAPER_PILOT_E;
    bench_report_status(&bench);
    TEST_ASSERT_FALSE(bench_demand(&bench)->active);
    TEST_ASSERT_EQUAL_UINT8(7, taper_session_number(&bench.table, BENCH_AC3));
    bench.status.pilot = TAPER_PILOT_B;
    bench_report_status(&bench);
    TEST_ASSERT_TRUE(bench_demand(&bench)->active);
}

static void test_an_inactive_demand_is_all_zero(void) {
    static const taper_demand_t nothing;
    bench_plug_in(&bench);
    bench.status.fault = true;
    bench_report_status(&bench);
    memset(&bench.snapshot, 0xAA, sizeof bench.snapshot);
    const taper_demand_t *demand = bench_demand(&bench);
    TEST_ASSERT_FALSE(demand->active);
    TEST_ASSERT_FALSE(demand->soc_estimated);
    TEST_ASSERT_EQUAL_INT32(nothing.need_Wh, demand->need_Wh);
    TEST_ASSERT_EQUAL_INT32(nothing.max_mA, demand->max_mA);
    TEST_ASSERT_EQUAL_INT32(nothing.stored_Wh, demand->stored_Wh);
    TEST_ASSERT_EQUAL_INT32(nothing.peak_W, demand->peak_W);
}

/* ---- Addresses. */

static void test_messages_that_are_not_for_the_table_are_ignored(void) {
    taper_message_t message;
    memset(&message, 0, sizeof message);
    message.kind = TAPER_MESSAGE_SITE_LIMIT;
    message.node = TAPER_NODE_GATEWAY;
    TEST_ASSERT_FALSE(taper_session_apply(&bench.table, &message, bench.now_ms));
    message.kind = TAPER_MESSAGE_SETPOINT;
    message.node = 1;
    TEST_ASSERT_FALSE(taper_session_apply(&bench.table, &message, bench.now_ms));
    message.kind = TAPER_MESSAGE_EVSE_STATUS;
    message.node = 4; /* the station has three */
    TEST_ASSERT_FALSE(taper_session_apply(&bench.table, &message, bench.now_ms));
    message.node = 1;
    message.bus = 1;
    TEST_ASSERT_FALSE(taper_session_apply(&bench.table, &message, bench.now_ms));
    message.bus = 0;
    TEST_ASSERT_TRUE(taper_session_apply(&bench.table, &message, bench.now_ms));
}

static void test_connectors_are_found_in_any_order_of_the_description(void) {
    static const taper_connector_config_t connectors[] = {
        {.bus = 1, .node = 5}, {.bus = 0, .node = 2}, {.bus = 0, .node = 1}, {.bus = 1, .node = 60}};
    const taper_station_config_t config = {.connectors = connectors, .connector_count = 4};
    for (int i = 0; i < 4; i++) {
        TEST_ASSERT_EQUAL_INT(i, taper_session_connector(&config, connectors[i].bus, connectors[i].node));
    }
    TEST_ASSERT_EQUAL_INT(-1, taper_session_connector(&config, 0, 3));
    TEST_ASSERT_EQUAL_INT(-1, taper_session_connector(&config, 0, 0));
    TEST_ASSERT_EQUAL_INT(-1, taper_session_connector(&config, 255, 255));
}

static void test_a_connector_beyond_the_station_has_no_session_number(void) {
    TEST_ASSERT_EQUAL_UINT8(0, taper_session_number(&bench.table, 3));
    TEST_ASSERT_EQUAL_UINT8(0, taper_session_number(&bench.table, 255));
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_an_empty_table_wants_nothing);
    RUN_TEST(test_a_sound_vehicle_becomes_a_demand);
    RUN_TEST(test_a_session_needs_status_and_parameters_a_b_and_c);
    RUN_TEST(test_a_session_does_not_begin_on_disagreeing_parameters);
    RUN_TEST(test_a_session_begins_only_in_pilot_states_b_c_and_d);
    RUN_TEST(test_pilot_state_a_ends_the_session_at_once);
    RUN_TEST(test_no_vehicle_ends_the_session_at_once);
    RUN_TEST(test_parameters_of_a_vehicle_that_left_do_not_serve_the_next);
    RUN_TEST(test_nothing_of_the_last_vehicle_reaches_the_next);
    RUN_TEST(test_another_session_number_is_a_new_session);
    RUN_TEST(test_the_same_session_number_elsewhere_is_another_session);
    RUN_TEST(test_the_old_parameters_hold_until_the_new_are_whole);
    RUN_TEST(test_a_taper_of_another_revision_or_session_is_not_used);
    RUN_TEST(test_a_vehicle_without_a_taper_is_planned_without);
    RUN_TEST(test_a_silent_connector_is_not_active_after_its_timeout);
    RUN_TEST(test_a_silent_connector_stays_silent_over_the_clocks_wrap);
    RUN_TEST(test_reports_are_fresh_over_the_clocks_wrap);
    RUN_TEST(test_a_complete_vehicle_is_not_active);
    RUN_TEST(test_a_pause_request_is_obeyed);
    RUN_TEST(test_a_stop_request_is_obeyed);
    RUN_TEST(test_a_complete_vehicle_that_falls_asleep_stays_complete);
    RUN_TEST(test_a_fault_of_connector_or_vehicle_pauses);
    RUN_TEST(test_pilot_e_pauses_but_keeps_the_session);
    RUN_TEST(test_an_inactive_demand_is_all_zero);
    RUN_TEST(test_messages_that_are_not_for_the_table_are_ignored);
    RUN_TEST(test_connectors_are_found_in_any_order_of_the_description);
    RUN_TEST(test_a_connector_beyond_the_station_has_no_session_number);
    return UNITY_END();
}
