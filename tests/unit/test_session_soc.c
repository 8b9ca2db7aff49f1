/* State of charge: what is reported, what is estimated, what is not believed. */
#include "support/session_bench.h"
#include "unity.h"

static session_bench_t bench;

/* 1 % of the bench's battery is 600 Wh; the wire's half step is 150 Wh. */
void setUp(void) {
    bench_start(&bench, BENCH_AC3);
}

void tearDown(void) {}

static void plug_in(void) {
    bench_plug_in(&bench);
    bench_tick(&bench);
}

/* Each report in a tick of its own. */
static void report_energy(int32_t energy_Wh) {
    bench.elec.energy_Wh = energy_Wh;
    bench_report_elec(&bench);
    bench_tick(&bench);
}

static void report_soc(int32_t soc_permille) {
    bench.ev.soc_permille = soc_permille;
    bench_report_ev(&bench);
    bench_tick(&bench);
}

static void assert_stored(int32_t expected_Wh, bool estimated) {
    const taper_demand_t *demand = bench_demand(&bench);
    TEST_ASSERT_TRUE(demand->active);
    TEST_ASSERT_EQUAL_INT32(expected_Wh, demand->stored_Wh);
    TEST_ASSERT_EQUAL(estimated, demand->soc_estimated);
}

/* ---- The first SOC. */

static void test_the_first_soc_is_the_reported_one(void) {
    bench.a.soc_plug_in_permille = 100;
    plug_in();
    assert_stored(12000, false);
}

static void test_without_a_report_the_soc_at_plug_in_is_taken(void) {
    bench.ev.soc_permille = TAPER_ABSENT;
    bench.a.soc_plug_in_permille = 100;
    plug_in();
    assert_stored(6000, true);
}

static void test_a_soc_at_plug_in_is_followed_by_all_the_energy_since(void) {
    bench.ev.soc_permille = TAPER_ABSENT;
    bench.a.soc_plug_in_permille = 100;
    bench.elec.energy_Wh = 3000; /* the station restarted in mid session */
    plug_in();
    assert_stored(9000, true);
    report_energy(3500);
    assert_stored(9500, true);
}

static void test_a_reported_soc_already_holds_the_energy_before_it(void) {
    bench.elec.energy_Wh = 3000;
    plug_in();
    assert_stored(12000, false);
    report_energy(3100);
    assert_stored(12100, false);
}

static void test_a_soc_before_the_first_meter_reading_starts_there(void) {
    bench_report_status(&bench);
    bench_report_ev(&bench);
    bench_report_parameters(&bench);
    bench_tick(&bench);
    report_energy(3000);
    assert_stored(12000, false);
    report_energy(3050);
    assert_stored(12050, false);
}

static void test_a_vehicle_that_never_tells_its_soc_has_none(void) {
    bench.ev.soc_permille = TAPER_ABSENT;
    plug_in();
    report_energy(5000);
    assert_stored(0, true);
    TEST_ASSERT_EQUAL_INT32(15000, bench_demand(&bench)->need_Wh); /* planned by energy */
}

static void test_a_soc_that_comes_late_is_taken(void) {
    bench.ev.soc_permille = TAPER_ABSENT;
    plug_in();
    report_energy(2000);
    report_soc(500);
    assert_stored(30000, false);
    report_energy(2100);
    assert_stored(30100, false);
}

/* ---- Between reports. */

static void test_measured_energy_resolves_finer_than_the_wire(void) {
    plug_in();
    for (int32_t energy_Wh = 10; energy_Wh <= 150; energy_Wh += 10) {
        report_energy(energy_Wh);
        report_soc(200);
        assert_stored(12000 + energy_Wh, false);
    }
}

static void test_soc_and_energy_of_one_tick_count_once_in_either_order(void) {
    for (int energy_first = 0; energy_first <= 1; energy_first++) {
        setUp();
        plug_in();
        bench.elec.energy_Wh = 600;
        bench.ev.soc_permille = 210;
        if (energy_first != 0) {
            bench_report_elec(&bench);
        }
        bench_report_ev(&bench);
        if (energy_first == 0) {
            bench_report_elec(&bench);
        }
        assert_stored(12600, false);
    }
}

static void test_the_estimate_keeps_within_half_a_step_of_a_fresh_report(void) {
    plug_in();
    report_energy(400);
    assert_stored(12400, false);
    report_soc(200);
    assert_stored(12150, false); /* 20 % + 0.25 % */
    report_soc(210);
    assert_stored(12450, false); /* 21 % - 0.25 % */
}

static void test_a_report_that_is_a_little_old_may_lag_by_what_flowed_since(void) {
    bench.ev.soc_age_s = 36;
    bench.elec.power_W = 10000; /* 100 Wh in 36 s */
    plug_in();
    report_energy(400);
    report_soc(200);
    assert_stored(12250, false);
}

static void test_the_estimate_never_exceeds_the_battery(void) {
    bench.ev.soc_permille = 995;
    plug_in();
    bench.ev.soc_permille = TAPER_ABSENT;
    bench_report_ev(&bench);
    report_energy(5000);
    assert_stored(60000, true);
}

static void test_a_full_report_keeps_the_estimate_within_the_battery(void) {
    bench.ev.soc_permille = 1000;
    plug_in();
    report_energy(10);
    report_soc(1000);
    assert_stored(60000, false);
}

static void test_a_meter_that_goes_back_moves_nothing(void) {
    plug_in();
    report_energy(100);
    report_energy(20);
    assert_stored(12100, false);
    report_energy(50);
    assert_stored(12130, false);
}

static void test_an_absent_meter_reading_moves_nothing(void) {
    plug_in();
    report_energy(100);
    report_energy(TAPER_ABSENT);
    assert_stored(12100, false);
    TEST_ASSERT_EQUAL_INT32(19900, bench_demand(&bench)->need_Wh);
    report_energy(130);
    assert_stored(12130, false);
}

/* ---- Stale. */

static void test_stale_soc_is_estimated_from_energy(void) {
    plug_in();
    bench.ev.soc_age_s = 61;
    report_energy(3000);
    report_soc(200);
    assert_stored(15000, true);
}

static void test_a_soc_of_60_s_still_counts(void) {
    plug_in();
    bench.ev.soc_age_s = 60;
    report_energy(400);
    report_soc(200);
    assert_stored(12150, false);
    bench.now_ms += 1; /* and by now it is older */
    assert_stored(12150, true);
}

static void test_a_soc_of_unknown_age_is_stale(void) {
    bench.ev.soc_age_s = TAPER_ABSENT;
    bench.a.soc_plug_in_permille = 300;
    plug_in();
    assert_stored(18000, true);
}

static void test_a_silent_vehicle_is_estimated_after_its_timeout(void) {
    plug_in();
    bench.now_ms += TAPER_EV_STATUS_TIMEOUT_ms;
    bench_report_status(&bench);
    assert_stored(12000, false);
    bench.now_ms += 1;
    bench_report_status(&bench);
    assert_stored(12000, true);
    report_energy(700);
    assert_stored(12700, true);
}

/* ---- Jumps. */

static void test_a_jump_is_not_believed_until_three_reports_agree(void) {
    plug_in();
    report_soc(500);
    assert_stored(12000, true);
    report_soc(505);
    assert_stored(12000, true);
    report_soc(505);
    assert_stored(30300, false);
}

static void test_the_estimate_goes_on_by_energy_during_a_jump(void) {
    plug_in();
    report_soc(500);
    report_energy(800);
    assert_stored(12800, true);
}

static void test_a_jump_down_is_a_jump_too(void) {
    plug_in();
    report_soc(100);
    report_soc(100);
    assert_stored(12000, true);
    report_soc(100);
    assert_stored(6000, false);
}

static void test_a_jump_that_goes_away_is_forgotten(void) {
    plug_in();
    report_soc(500);
    report_soc(500);
    report_soc(200);
    assert_stored(12000, false);
    report_soc(500);
    report_soc(500);
    assert_stored(12000, true);
}

static void test_jumps_that_disagree_are_not_believed(void) {
    plug_in();
    for (int i = 0; i < 6; i++) {
        report_soc(i % 2 == 0 ? 500 : 800);
        assert_stored(12000, true);
    }
}

static void test_two_percent_beside_the_estimate_is_not_a_jump(void) {
    plug_in();
    report_soc(220);
    assert_stored(13050, false); /* 22 % - 0.25 % */
    setUp();
    plug_in();
    report_soc(225);
    assert_stored(12000, true);
}

static void test_a_new_session_has_no_jump_pending(void) {
    plug_in();
    report_soc(500);
    report_soc(500);
    bench_unplug(&bench);
    bench.ev.soc_permille = 100;
    plug_in();
    assert_stored(6000, false);
    report_soc(500);
    assert_stored(6000, true);
}

/* ---- Capacity. */

static void test_without_a_sound_capacity_there_is_neither_soc_nor_taper(void) {
    static const int32_t unsound[] = {TAPER_ABSENT, 100, TAPER_CAPACITY_MIN_Wh - 1, TAPER_CAPACITY_MAX_Wh + 1,
                                      6553400};
    for (size_t i = 0; i < sizeof unsound / sizeof unsound[0]; i++) {
        setUp();
        bench.a.capacity_Wh = unsound[i];
        bench.a.soc_plug_in_permille = 300;
        plug_in();
        report_energy(1000);
        report_soc(250);
        const taper_demand_t *demand = bench_demand(&bench);
        TEST_ASSERT_TRUE(demand->active);
        TEST_ASSERT_EQUAL_INT32(0, demand->capacity_Wh);
        TEST_ASSERT_EQUAL_INT32(0, demand->stored_Wh);
        TEST_ASSERT_EQUAL_INT32(0, demand->taper_W);
        TEST_ASSERT_EQUAL_INT32(19000, demand->need_Wh);
    }
}

static void test_the_ends_of_the_sound_capacities_are_sound(void) {
    static const int32_t sound[] = {TAPER_CAPACITY_MIN_Wh, TAPER_CAPACITY_MAX_Wh};
    for (size_t i = 0; i < 2; i++) {
        setUp();
        bench.a.capacity_Wh = sound[i];
        bench.ev.soc_permille = 1000;
        plug_in();
        TEST_ASSERT_EQUAL_INT32(sound[i], bench_demand(&bench)->capacity_Wh);
        TEST_ASSERT_EQUAL_INT32(sound[i], bench_demand(&bench)->stored_Wh);
    }
}

static void test_a_corrected_capacity_keeps_the_soc(void) {
    plug_in();
    bench_next_revision(&bench);
    bench.a.capacity_Wh = 80000;
    bench_report_parameters(&bench);
    assert_stored(16000, false);
}

static void test_a_capacity_that_is_withdrawn_and_told_again_starts_anew(void) {
    plug_in();
    report_energy(100);
    bench_next_revision(&bench);
    bench.a.capacity_Wh = TAPER_ABSENT;
    bench_report_parameters(&bench);
    assert_stored(0, false);
    bench_next_revision(&bench);
    bench.a.capacity_Wh = 60000;
    bench_report_parameters(&bench);
    assert_stored(12000, false);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_the_first_soc_is_the_reported_one);
    RUN_TEST(test_without_a_report_the_soc_at_plug_in_is_taken);
    RUN_TEST(test_a_soc_at_plug_in_is_followed_by_all_the_energy_since);
    RUN_TEST(test_a_reported_soc_already_holds_the_energy_before_it);
    RUN_TEST(test_a_soc_before_the_first_meter_reading_starts_there);
    RUN_TEST(test_a_vehicle_that_never_tells_its_soc_has_none);
    RUN_TEST(test_a_soc_that_comes_late_is_taken);
    RUN_TEST(test_measured_energy_resolves_finer_than_the_wire);
    RUN_TEST(test_soc_and_energy_of_one_tick_count_once_in_either_order);
    RUN_TEST(test_the_estimate_keeps_within_half_a_step_of_a_fresh_report);
    RUN_TEST(test_a_report_that_is_a_little_old_may_lag_by_what_flowed_since);
    RUN_TEST(test_the_estimate_never_exceeds_the_battery);
    RUN_TEST(test_a_full_report_keeps_the_estimate_within_the_battery);
    RUN_TEST(test_a_meter_that_goes_back_moves_nothing);
    RUN_TEST(test_an_absent_meter_reading_moves_nothing);
    RUN_TEST(test_stale_soc_is_estimated_from_energy);
    RUN_TEST(test_a_soc_of_60_s_still_counts);
    RUN_TEST(test_a_soc_of_unknown_age_is_stale);
    RUN_TEST(test_a_silent_vehicle_is_estimated_after_its_timeout);
    RUN_TEST(test_a_jump_is_not_believed_until_three_reports_agree);
    RUN_TEST(test_the_estimate_goes_on_by_energy_during_a_jump);
    RUN_TEST(test_a_jump_down_is_a_jump_too);
    RUN_TEST(test_a_jump_that_goes_away_is_forgotten);
    RUN_TEST(test_jumps_that_disagree_are_not_believed);
    RUN_TEST(test_two_percent_beside_the_estimate_is_not_a_jump);
    RUN_TEST(test_a_new_session_has_no_jump_pending);
    RUN_TEST(test_without_a_sound_capacity_there_is_neither_soc_nor_taper);
    RUN_TEST(test_the_ends_of_the_sound_capacities_are_sound);
    RUN_TEST(test_a_corrected_capacity_keeps_the_soc);
    RUN_TEST(test_a_capacity_that_is_withdrawn_and_told_again_starts_anew);
    return UNITY_END();
}
