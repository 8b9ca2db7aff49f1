/* Energy, currents, power and departure of a demand. */
#include "support/session_bench.h"
#include "unity.h"

#define NOON 1750000020u /* a full minute */

static session_bench_t bench;

void setUp(void) {
    bench_start(&bench, BENCH_AC3);
}

void tearDown(void) {}

static const taper_demand_t *plugged_in(void) {
    bench_plug_in(&bench);
    return bench_demand(&bench);
}

/* ---- Energy still wanted. */

static void test_need_is_the_target_less_what_was_charged(void) {
    bench.elec.energy_Wh = 4000;
    TEST_ASSERT_EQUAL_INT32(16000, plugged_in()->need_Wh);
}

static void test_need_holds_while_the_meter_is_silent(void) {
    bench.elec.energy_Wh = 4000;
    bench_plug_in(&bench);
    bench.now_ms += 2 * TAPER_EVSE_ELEC_TIMEOUT_ms;
    bench_tick(&bench);
    bench_report_status(&bench);
    TEST_ASSERT_EQUAL_INT32(16000, bench_demand(&bench)->need_Wh);
}

static void test_a_target_that_is_met_is_done(void) {
    bench.elec.energy_Wh = 20000;
    TEST_ASSERT_FALSE(plugged_in()->active);
    bench.elec.energy_Wh = 20010;
    TEST_ASSERT_FALSE(plugged_in()->active);
}

static void test_a_negative_target_is_done(void) {
    bench.c.target_Wh = -5000;
    TEST_ASSERT_FALSE(plugged_in()->active);
}

static void test_without_a_target_energy_the_target_soc_counts(void) {
    bench.c.target_Wh = TAPER_ABSENT;
    bench.a.soc_target_permille = 800;
    TEST_ASSERT_EQUAL_INT32(36000, plugged_in()->need_Wh);
    bench.elec.energy_Wh = 100;
    bench_report_elec(&bench);
    TEST_ASSERT_EQUAL_INT32(35900, bench_demand(&bench)->need_Wh);
}

static void test_a_target_soc_below_the_present_is_done(void) {
    bench.c.target_Wh = TAPER_ABSENT;
    bench.a.soc_target_permille = 200;
    TEST_ASSERT_FALSE(plugged_in()->active);
}

static void test_a_target_soc_below_the_minimum_is_raised(void) {
    bench.c.target_Wh = TAPER_ABSENT;
    bench.a.soc_target_permille = 100;
    bench.a.soc_minimum_permille = 300;
    TEST_ASSERT_EQUAL_INT32(6000, plugged_in()->need_Wh);
}

static void test_without_any_target_the_battery_is_filled(void) {
    bench.c.target_Wh = TAPER_ABSENT;
    TEST_ASSERT_EQUAL_INT32(48000, plugged_in()->need_Wh);
}

static void test_without_target_and_soc_the_rest_of_the_battery_is_wanted(void) {
    bench.c.target_Wh = TAPER_ABSENT;
    bench.a.soc_target_permille = 800;
    bench.ev.soc_permille = TAPER_ABSENT;
    bench.elec.energy_Wh = 5000;
    TEST_ASSERT_EQUAL_INT32(55000, plugged_in()->need_Wh);
}

static void test_without_target_and_capacity_a_large_battery_is_assumed(void) {
    bench.c.target_Wh = TAPER_ABSENT;
    bench.a.soc_target_permille = 800;
    bench.a.capacity_Wh = TAPER_ABSENT;
    bench.elec.energy_Wh = 50000;
    TEST_ASSERT_EQUAL_INT32(TAPER_OPEN_NEED_Wh, plugged_in()->need_Wh);
}

static void test_a_vehicle_without_target_takes_until_it_says_complete(void) {
    bench.c.target_Wh = TAPER_ABSENT;
    bench.ev.soc_permille = 1000;
    TEST_ASSERT_TRUE(plugged_in()->active);
    TEST_ASSERT_EQUAL_INT32(TAPER_OPEN_NEED_LEAST_Wh, bench_demand(&bench)->need_Wh);
    bench.ev.complete = true;
    bench_report_ev(&bench);
    TEST_ASSERT_FALSE(bench_demand(&bench)->active);
}

static void test_without_a_target_the_vehicles_maximum_counts(void) {
    bench.c.target_Wh = TAPER_ABSENT;
    bench.c.maximum_Wh = 9000;
    bench.elec.energy_Wh = 1000;
    TEST_ASSERT_EQUAL_INT32(8000, plugged_in()->need_Wh);
    bench.elec.energy_Wh = 9000;
    bench_report_elec(&bench);
    TEST_ASSERT_FALSE(bench_demand(&bench)->active);
}

static void test_inconsistent_energies_are_repaired(void) {
    bench.c.maximum_Wh = 15000;
    TEST_ASSERT_EQUAL_INT32(15000, plugged_in()->need_Wh);
    setUp();
    bench.c.minimum_Wh = 25000;
    TEST_ASSERT_EQUAL_INT32(25000, plugged_in()->need_Wh);
    setUp();
    bench.c.minimum_Wh = 25000;
    bench.c.maximum_Wh = 15000;
    TEST_ASSERT_EQUAL_INT32(15000, plugged_in()->need_Wh);
}

/* ---- Currents. */

static void test_the_lower_of_connector_and_vehicle_limit_counts(void) {
    TEST_ASSERT_EQUAL_INT32(16000, plugged_in()->max_mA);
    bench.ev.max_mA = 63000;
    bench_report_ev(&bench);
    TEST_ASSERT_EQUAL_INT32(32000, bench_demand(&bench)->max_mA);
    bench.ev.max_mA = TAPER_ABSENT;
    bench_report_ev(&bench);
    TEST_ASSERT_EQUAL_INT32(32000, bench_demand(&bench)->max_mA);
}

static void test_the_maximum_is_rounded_down_to_the_wires_step(void) {
    bench.ev.max_mA = 15999;
    TEST_ASSERT_EQUAL_INT32(15900, plugged_in()->max_mA);
}

static void test_a_vehicle_limit_expires_with_its_report(void) {
    bench_plug_in(&bench);
    bench.now_ms += TAPER_EV_STATUS_TIMEOUT_ms + 1;
    bench_report_status(&bench);
    TEST_ASSERT_EQUAL_INT32(32000, bench_demand(&bench)->max_mA);
}

static void test_a_vehicle_that_allows_no_current_is_not_active(void) {
    bench.ev.max_mA = 0;
    TEST_ASSERT_FALSE(plugged_in()->active);
    setUp();
    bench.connector = BENCH_DC;
    bench.ev.max_mA = 99;
    TEST_ASSERT_FALSE(plugged_in()->active);
}

static void test_a_vehicle_raises_the_minimum_but_does_not_lower_it(void) {
    bench.b.min_mA = 8000;
    TEST_ASSERT_EQUAL_INT32(8000, plugged_in()->min_mA);
    setUp();
    bench.b.min_mA = 2000;
    TEST_ASSERT_EQUAL_INT32(6000, plugged_in()->min_mA);
}

static void test_the_minimum_is_rounded_up_to_the_wires_step(void) {
    bench.b.min_mA = 7001;
    TEST_ASSERT_EQUAL_INT32(7100, plugged_in()->min_mA);
}

static void test_where_the_connector_has_no_minimum_that_of_the_vehicle_holds(void) {
    bench.connector = BENCH_DC;
    bench.b.min_mA = 8000;
    TEST_ASSERT_TRUE(plugged_in()->active);
    TEST_ASSERT_EQUAL_INT32(8000, bench_demand(&bench)->min_mA);
}

static void test_without_any_minimum_currents_are_continuous(void) {
    bench.connector = BENCH_DC;
    bench.b.min_mA = TAPER_ABSENT;
    TEST_ASSERT_TRUE(plugged_in()->active);
    TEST_ASSERT_EQUAL_INT32(0, bench_demand(&bench)->min_mA);
}

static void test_a_minimum_above_the_maximum_is_not_active(void) {
    bench.ev.max_mA = 5900;
    TEST_ASSERT_FALSE(plugged_in()->active);
    bench.ev.max_mA = 6000;
    bench_report_ev(&bench);
    TEST_ASSERT_TRUE(bench_demand(&bench)->active);
    TEST_ASSERT_EQUAL_INT32(6000, bench_demand(&bench)->min_mA);
}

/* ---- Power. */

static void test_power_is_booked_at_the_higher_voltage_in_whole_volts(void) {
    bench.elec.voltage_mV = 241300;
    TEST_ASSERT_EQUAL_INT32(3 * 242, plugged_in()->W_per_A);
    bench.elec.voltage_mV = 215000;
    bench_report_elec(&bench);
    TEST_ASSERT_EQUAL_INT32(3 * 230, bench_demand(&bench)->W_per_A);
    bench.elec.voltage_mV = TAPER_ABSENT;
    bench_report_elec(&bench);
    TEST_ASSERT_EQUAL_INT32(3 * 230, bench_demand(&bench)->W_per_A);
}

static void test_a_measured_voltage_expires(void) {
    bench.elec.voltage_mV = 241300;
    bench_plug_in(&bench);
    bench.now_ms += TAPER_EVSE_ELEC_TIMEOUT_ms;
    bench_report_status(&bench);
    TEST_ASSERT_EQUAL_INT32(3 * 242, bench_demand(&bench)->W_per_A);
    bench.now_ms += 1;
    TEST_ASSERT_EQUAL_INT32(3 * 230, bench_demand(&bench)->W_per_A);
}

static void test_only_the_phases_in_use_are_booked(void) {
    static const int32_t expected[] = {690, 230, 460, 690}; /* 0: unknown */
    for (uint8_t phases = 0; phases <= 3; phases++) {
        setUp();
        bench.status.phases = phases;
        TEST_ASSERT_EQUAL_INT32(expected[phases], plugged_in()->W_per_A);
    }
}

static void test_a_connector_has_no_more_phases_than_described(void) {
    bench.connector = BENCH_AC1;
    bench.status.phases = 3;
    TEST_ASSERT_EQUAL_INT32(230, plugged_in()->W_per_A);
}

static void test_an_unknown_peak_is_what_the_currents_allow(void) {
    bench.b.peak_W = TAPER_ABSENT;
    TEST_ASSERT_EQUAL_INT32(16 * 690, plugged_in()->peak_W);
}

static void test_the_taper_is_no_more_than_the_peak(void) {
    bench.d.taper_W = 20000;
    TEST_ASSERT_EQUAL_INT32(11000, plugged_in()->taper_W);
}

/* ---- Departure. */

static int32_t minute_of(uint32_t unix_s) {
    return (int32_t)(unix_s / 60u % 65535u);
}

static void test_a_departure_counts_from_the_clock(void) {
    bench_report_time(&bench, NOON + 30, 0, 1);
    bench.b.departure_min = minute_of(NOON) + 90;
    TEST_ASSERT_EQUAL_INT32(90 * 60 - 30, plugged_in()->departs_in_s);
    bench_live(&bench, 45000);
    TEST_ASSERT_EQUAL_INT32(90 * 60 - 75, bench_demand(&bench)->departs_in_s);
}

static void test_milliseconds_of_the_clock_count(void) {
    bench_report_time(&bench, NOON, 900, 1);
    bench.b.departure_min = minute_of(NOON) + 1;
    TEST_ASSERT_EQUAL_INT32(60, plugged_in()->departs_in_s);
    bench_live(&bench, 100);
    TEST_ASSERT_EQUAL_INT32(59, bench_demand(&bench)->departs_in_s);
}

static void test_a_departure_in_the_past_is_told_as_such(void) {
    bench_report_time(&bench, NOON, 0, 1);
    bench.b.departure_min = minute_of(NOON) - 10;
    TEST_ASSERT_TRUE(plugged_in()->active);
    TEST_ASSERT_EQUAL_INT32(-600, bench_demand(&bench)->departs_in_s);
}

static void test_a_departure_is_found_over_the_wrap_of_its_minutes(void) {
    const uint32_t last_minute = 65534u * 60u; /* of the first turn */
    bench_report_time(&bench, last_minute, 0, 1);
    bench.b.departure_min = 4;
    TEST_ASSERT_EQUAL_INT32(5 * 60, plugged_in()->departs_in_s);

    setUp();
    bench_report_time(&bench, last_minute + 120, 0, 1);
    bench.b.departure_min = 65530;
    TEST_ASSERT_EQUAL_INT32(-6 * 60, plugged_in()->departs_in_s);
}

static void test_without_a_clock_the_default_stay_counts_from_plug_in(void) {
    bench.b.departure_min = 4000;
    bench_plug_in(&bench);
    bench_live(&bench, 3600u * 1000u);
    TEST_ASSERT_EQUAL_INT32(TAPER_DEFAULT_STAY_s - 3600, bench_demand(&bench)->departs_in_s);
}

static void test_a_clock_of_quality_0_was_never_set(void) {
    bench_report_time(&bench, NOON, 0, 0);
    bench.b.departure_min = minute_of(NOON) + 90;
    TEST_ASSERT_EQUAL_INT32(TAPER_DEFAULT_STAY_s, plugged_in()->departs_in_s);
}

static void test_a_set_clock_is_held_over_when_its_source_is_lost(void) {
    bench_report_time(&bench, NOON, 0, 1);
    bench.b.departure_min = minute_of(NOON) + 600;
    bench_plug_in(&bench);
    bench_live(&bench, 60000);
    bench_report_time(&bench, 17, 0, 0);
    TEST_ASSERT_EQUAL_INT32(599 * 60, bench_demand(&bench)->departs_in_s);
}

static void test_the_clock_is_held_over_for_longer_than_the_tick_counter_lasts(void) {
    bench_report_time(&bench, NOON, 500, 1);
    const uint32_t days = 60;
    for (uint32_t hour = 0; hour < days * 24u; hour++) {
        bench.now_ms += 3600u * 1000u;
        bench_tick(&bench);
    }
    bench.b.departure_min = minute_of(NOON + days * 86400u) + 2;
    TEST_ASSERT_EQUAL_INT32(120, plugged_in()->departs_in_s);
}

static void test_a_clock_that_jumps_moves_the_departure(void) {
    bench_report_time(&bench, NOON, 0, 1);
    bench.b.departure_min = minute_of(NOON) + 90;
    bench_plug_in(&bench);
    bench_report_time(&bench, NOON + 3600, 0, 1);
    TEST_ASSERT_EQUAL_INT32(30 * 60, bench_demand(&bench)->departs_in_s);
}

static void test_two_clocks_of_one_second_that_arrive_unevenly_are_no_jump(void) {
    bench_report_time(&bench, NOON, 0, 1);
    bench.now_ms += 997;
    bench_report_time(&bench, NOON, 998, 1); /* it took 1 ms less on its way */
    TEST_ASSERT_EQUAL_UINT32(0, bench.table.clock_jumps);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_need_is_the_target_less_what_was_charged);
    RUN_TEST(test_need_holds_while_the_meter_is_silent);
    RUN_TEST(test_a_target_that_is_met_is_done);
    RUN_TEST(test_a_negative_target_is_done);
    RUN_TEST(test_without_a_target_energy_the_target_soc_counts);
    RUN_TEST(test_a_target_soc_below_the_present_is_done);
    RUN_TEST(test_a_target_soc_below_the_minimum_is_raised);
    RUN_TEST(test_without_any_target_the_battery_is_filled);
    RUN_TEST(test_without_target_and_soc_the_rest_of_the_battery_is_wanted);
    RUN_TEST(test_without_target_and_capacity_a_large_battery_is_assumed);
    RUN_TEST(test_a_vehicle_without_target_takes_until_it_says_complete);
    RUN_TEST(test_without_a_target_the_vehicles_maximum_counts);
    RUN_TEST(test_inconsistent_energies_are_repaired);
    RUN_TEST(test_the_lower_of_connector_and_vehicle_limit_counts);
    RUN_TEST(test_the_maximum_is_rounded_down_to_the_wires_step);
    RUN_TEST(test_a_vehicle_limit_expires_with_its_report);
    RUN_TEST(test_a_vehicle_that_allows_no_current_is_not_active);
    RUN_TEST(test_a_vehicle_raises_the_minimum_but_does_not_lower_it);
    RUN_TEST(test_the_minimum_is_rounded_up_to_the_wires_step);
    RUN_TEST(test_where_the_connector_has_no_minimum_that_of_the_vehicle_holds);
    RUN_TEST(test_without_any_minimum_currents_are_continuous);
    RUN_TEST(test_a_minimum_above_the_maximum_is_not_active);
    RUN_TEST(test_power_is_booked_at_the_higher_voltage_in_whole_volts);
    RUN_TEST(test_a_measured_voltage_expires);
    RUN_TEST(test_only_the_phases_in_use_are_booked);
    RUN_TEST(test_a_connector_has_no_more_phases_than_described);
    RUN_TEST(test_an_unknown_peak_is_what_the_currents_allow);
    RUN_TEST(test_the_taper_is_no_more_than_the_peak);
    RUN_TEST(test_a_departure_counts_from_the_clock);
    RUN_TEST(test_milliseconds_of_the_clock_count);
    RUN_TEST(test_a_departure_in_the_past_is_told_as_such);
    RUN_TEST(test_a_departure_is_found_over_the_wrap_of_its_minutes);
    RUN_TEST(test_without_a_clock_the_default_stay_counts_from_plug_in);
    RUN_TEST(test_a_clock_of_quality_0_was_never_set);
    RUN_TEST(test_a_set_clock_is_held_over_when_its_source_is_lost);
    RUN_TEST(test_the_clock_is_held_over_for_longer_than_the_tick_counter_lasts);
    RUN_TEST(test_a_clock_that_jumps_moves_the_departure);
    RUN_TEST(test_two_clocks_of_one_second_that_arrive_unevenly_are_no_jump);
    return UNITY_END();
}
