/* A session over a restart of the controller: what is kept, what confirms it, and what shows that it was another's. */
#include <stddef.h>
#include <string.h>

#include "session_bench.h"
#include "unity.h"

#define KEPT_UNIX_s 1500000000u
#define OUTAGE_s    100u
#define SESSION     7

static session_bench_t bench;
static taper_event_log_t events;
static taper_session_kept_t kept;

/** An hour of charging: 11 kWh in, SOC told at the beginning only. */
void setUp(void) {
    memset(&events, 0, sizeof events);
    bench_start(&bench, BENCH_AC3);
    bench.table.log = &events;
    bench_report_time(&bench, KEPT_UNIX_s - 3600u, 0, 1);
    bench_plug_in(&bench);
    bench_tick(&bench);
    bench.ev.soc_permille = TAPER_ABSENT;
    bench.elec.energy_Wh = 11000;
    bench_live(&bench, 3600000);
    bench_tick(&bench);
}

void tearDown(void) {}

static unsigned count_of(taper_event_code_t code) {
    unsigned found = 0;
    for (uint32_t k = 0; k < events.count; k++) {
        found += events.event[k].code == code ? 1u : 0u;
    }
    return found;
}

static void keep(void) {
    TEST_ASSERT_TRUE(taper_session_keep(&bench.table, bench.connector, bench.now_ms, &kept));
}

/** The controller forgets all but `kept`, and its clock starts anew. Kept at `unix_s`. */
static void begin_anew(uint32_t unix_s) {
    const taper_station_config_t *config = bench.table.config;
    const uint32_t scale = bench.table.time_scale;
    taper_session_init(&bench.table, config);
    memset(&events, 0, sizeof events);
    bench.table.log = &events;
    bench.table.time_scale = scale;
    TEST_ASSERT_TRUE(taper_session_restore(&bench.table, bench.connector, &kept));
    bench.now_ms = UINT32_MAX - 500u; /* it wraps soon */
    taper_session_start_clock(&bench.table, unix_s, bench.now_ms);
    bench_tick(&bench); /* nothing was heard yet */
}

static void restart(void) {
    keep();
    begin_anew(KEPT_UNIX_s);
}

static uint32_t stay_s(void) {
    return taper_elapsed_ms(bench.now_ms, bench.table.session[bench.connector].plugged_in_ms) / 1000u *
           bench.table.time_scale;
}

static void assert_resumed(void) {
    TEST_ASSERT_EQUAL_UINT(1, count_of(TAPER_EVENT_SESSION_RESUMED));
    TEST_ASSERT_EQUAL_UINT(0, count_of(TAPER_EVENT_SESSION_BEGUN));
    TEST_ASSERT_EQUAL_UINT(0, count_of(TAPER_EVENT_SESSION_ENDED));
    TEST_ASSERT_TRUE(taper_session_is_kept(&bench.table, bench.connector));
    TEST_ASSERT_TRUE(bench_demand(&bench)->active);
}

/** The session that was kept is over; the vehicle that is there has been so for no time. */
static void assert_another_began(void) {
    TEST_ASSERT_EQUAL_UINT(0, count_of(TAPER_EVENT_SESSION_RESUMED));
    TEST_ASSERT_EQUAL_UINT(1, count_of(TAPER_EVENT_SESSION_ENDED));
    TEST_ASSERT_EQUAL_UINT(1, count_of(TAPER_EVENT_SESSION_BEGUN));
    TEST_ASSERT_FALSE(taper_session_is_kept(&bench.table, bench.connector));
    TEST_ASSERT_TRUE(bench_demand(&bench)->active);
    TEST_ASSERT_EQUAL_INT32(TAPER_DEFAULT_STAY_s, bench_demand(&bench)->departs_in_s);
}

static void test_an_awaited_session_has_a_number_and_no_demand(void) {
    restart();
    TEST_ASSERT_EQUAL_UINT8(SESSION, taper_session_number(&bench.table, bench.connector));
    TEST_ASSERT_FALSE(bench_demand(&bench)->active);
    bench_report_status(&bench);
    TEST_ASSERT_FALSE(bench_demand(&bench)->active);
    TEST_ASSERT_EQUAL(TAPER_REASON_NO_PARAMETERS,
                      taper_session_idle_reason(&bench.table, bench.connector, bench.now_ms));
    TEST_ASSERT_EQUAL_UINT32(0, events.count);
}

static void test_parameters_with_its_number_resume_it_with_stay_and_energy(void) {
    restart();
    bench_live(&bench, 1000);
    assert_resumed();
    const taper_demand_t *demand = bench_demand(&bench);
    TEST_ASSERT_EQUAL_INT32(23000, demand->stored_Wh); /* 20 % of 60 kWh, and 11 kWh */
    TEST_ASSERT_TRUE(demand->soc_estimated);
    TEST_ASSERT_EQUAL_INT32(9000, demand->need_Wh);
    TEST_ASSERT_EQUAL_INT32(TAPER_DEFAULT_STAY_s - 3601, demand->departs_in_s);
}

static void test_an_accepted_setpoint_resumes_it_with_the_parameters_that_were_kept(void) {
    restart();
    taper_session_confirm(&bench.table, bench.connector);
    TEST_ASSERT_EQUAL_UINT32(0, events.count); /* nobody says that a vehicle is there */
    bench_report_status(&bench);
    taper_session_confirm(&bench.table, bench.connector);
    assert_resumed();
    const taper_demand_t *demand = bench_demand(&bench);
    TEST_ASSERT_EQUAL_UINT8(SESSION, demand->session);
    TEST_ASSERT_EQUAL_INT32(23000, demand->stored_Wh);
    TEST_ASSERT_EQUAL_INT32(60000, demand->capacity_Wh);
    TEST_ASSERT_EQUAL_INT32(11000, demand->peak_W);
    TEST_ASSERT_EQUAL_INT32(4400, demand->taper_W);
    TEST_ASSERT_EQUAL_INT32(9000, demand->need_Wh);
}

static void test_a_vehicle_that_cannot_charge_is_not_resumed_by_an_echo(void) {
    restart();
    bench.status.pilot = TAPER_PILOT_F;
    bench_report_status(&bench);
    taper_session_confirm(&bench.table, bench.connector);
    TEST_ASSERT_FALSE(bench_demand(&bench)->active);
    TEST_ASSERT_EQUAL_UINT(0, count_of(TAPER_EVENT_SESSION_RESUMED));
}

static void test_energy_that_flowed_during_the_restart_counts(void) {
    restart();
    bench.elec.energy_Wh = 12500;
    bench_live(&bench, 1000);
    assert_resumed();
    TEST_ASSERT_EQUAL_INT32(24500, bench_demand(&bench)->stored_Wh);
    TEST_ASSERT_EQUAL_INT32(7500, bench_demand(&bench)->need_Wh);
}

static void test_other_wishes_with_the_same_number_are_the_same_session(void) {
    restart();
    bench_next_revision(&bench);
    bench.c.target_Wh = 30000;
    bench_live(&bench, 1000);
    assert_resumed();
    TEST_ASSERT_EQUAL_INT32(19000, bench_demand(&bench)->need_Wh);
}

static void test_another_number_is_another_session_as_soon_as_it_is_told(void) {
    restart();
    bench.a.session = SESSION + 1;
    bench.b.session = SESSION + 1;
    bench.d.session = SESSION + 1;
    bench.elec.energy_Wh = 0;
    bench_report_status(&bench);
    bench_report_b(&bench);
    TEST_ASSERT_EQUAL_UINT8(0, taper_session_number(&bench.table, bench.connector));
    taper_session_confirm(&bench.table, bench.connector);
    TEST_ASSERT_FALSE(bench_demand(&bench)->active);
    bench_live(&bench, 0);
    assert_another_began();
}

static void test_another_battery_or_soc_at_plug_in_is_another_session(void) {
    bench.a.soc_plug_in_permille = 200;
    bench_next_revision(&bench);
    bench_report_parameters(&bench);
    bench.elec.energy_Wh = 11000;
    for (unsigned k = 0; k < 2; k++) {
        taper_ev_param_a_t *a = &bench.a;
        restart();
        const taper_ev_param_a_t before = *a;
        a->capacity_Wh = k == 0 ? 40000 : a->capacity_Wh;
        a->soc_plug_in_permille = k == 1 ? 300 : a->soc_plug_in_permille;
        bench_live(&bench, 0);
        assert_another_began();
        TEST_ASSERT_EQUAL_INT32(k == 0 ? 40000 : 60000, bench_demand(&bench)->capacity_Wh);
        *a = before;
    }
}

static void test_what_was_not_told_before_contradicts_nothing(void) {
    restart();
    bench_next_revision(&bench);
    bench.a.soc_plug_in_permille = 200;
    bench_live(&bench, 1000);
    assert_resumed();
}

static void test_a_meter_that_shows_less_is_another_session(void) {
    restart();
    bench_report_status(&bench);
    taper_session_confirm(&bench.table, bench.connector);
    bench.elec.energy_Wh = 10990;
    bench_report_elec(&bench);
    TEST_ASSERT_EQUAL_UINT(1, count_of(TAPER_EVENT_SESSION_ENDED));
    TEST_ASSERT_FALSE(bench_demand(&bench)->active); /* its parameters were the other one's */
    bench_live(&bench, 0);
    TEST_ASSERT_EQUAL_UINT(1, count_of(TAPER_EVENT_SESSION_BEGUN));
    TEST_ASSERT_EQUAL_INT32(9010, bench_demand(&bench)->need_Wh);
}

static void test_the_taper_of_another_vehicle_is_not_used(void) {
    restart();
    bench.a.capacity_Wh = 40000;
    bench_report_status(&bench);
    bench_report_ev(&bench);
    bench_report_a(&bench);
    bench_report_b(&bench);
    bench_report_c(&bench);
    TEST_ASSERT_EQUAL_INT32(0, bench_demand(&bench)->taper_W);
    bench_report_d(&bench);
    TEST_ASSERT_EQUAL_INT32(4400, bench_demand(&bench)->taper_W);
}

static void test_the_taper_that_tells_of_another_session_is_that_sessions(void) {
    restart();
    bench.a.session = SESSION + 1;
    bench.b.session = SESSION + 1;
    bench.d.session = SESSION + 1;
    bench.elec.energy_Wh = 0;
    bench_report_status(&bench);
    bench_report_ev(&bench);
    bench_report_d(&bench);
    bench_report_a(&bench);
    bench_report_b(&bench);
    bench_report_c(&bench);
    TEST_ASSERT_EQUAL_INT32(4400, bench_demand(&bench)->taper_W);
}

static void test_a_vehicle_that_left_meanwhile_is_forgotten(void) {
    restart();
    bench_unplug(&bench);
    TEST_ASSERT_EQUAL_UINT(1, count_of(TAPER_EVENT_SESSION_ENDED));
    TEST_ASSERT_EQUAL_UINT8(0, taper_session_number(&bench.table, bench.connector));
    TEST_ASSERT_FALSE(taper_session_may_be_there(&bench.table, bench.connector));
    TEST_ASSERT_FALSE(taper_session_keep(&bench.table, bench.connector, bench.now_ms, &kept));
}

static void test_who_was_done_and_fell_asleep_stays_done(void) {
    bool *const asks[] = {&bench.ev.complete, &bench.ev.pause_requested, &bench.ev.stop_requested};
    for (unsigned k = 0; k < sizeof asks / sizeof asks[0]; k++) {
        *asks[k] = true;
        bench_report_ev(&bench);
        restart();
        bench_report_status(&bench);
        bench_report_parameters(&bench);
        TEST_ASSERT_FALSE(bench_demand(&bench)->active);
        *asks[k] = false;
        bench_report_ev(&bench);
        TEST_ASSERT_TRUE(bench_demand(&bench)->active);
    }
    bench.ev.error = 3;
    bench_report_ev(&bench);
    restart();
    bench_report_status(&bench);
    bench_report_parameters(&bench);
    TEST_ASSERT_EQUAL(TAPER_REASON_FAULT,
                      taper_session_idle_reason(&bench.table, bench.connector, bench.now_ms));
}

static void test_the_restart_itself_counts_once_the_clock_is_set(void) {
    restart();
    bench_live(&bench, 2000);
    TEST_ASSERT_EQUAL_UINT32(3602, stay_s());
    bench_report_time(&bench, KEPT_UNIX_s + 2u + OUTAGE_s, 0, 1);
    TEST_ASSERT_EQUAL_UINT32(3602 + OUTAGE_s, stay_s());
    bench_report_time(&bench, KEPT_UNIX_s + 5000u, 0, 1); /* a jump of the clock is none */
    TEST_ASSERT_EQUAL_UINT32(3602 + OUTAGE_s, stay_s());
}

static void test_without_a_clock_before_or_one_that_went_back_it_counts_as_no_time(void) {
    keep();
    begin_anew(0);
    bench_live(&bench, 2000);
    bench_report_time(&bench, KEPT_UNIX_s + OUTAGE_s, 0, 1);
    TEST_ASSERT_EQUAL_UINT32(3602, stay_s());
    begin_anew(KEPT_UNIX_s);
    bench_live(&bench, 2000);
    bench_report_time(&bench, KEPT_UNIX_s - 50u, 0, 1);
    TEST_ASSERT_EQUAL_UINT32(3602, stay_s());
}

static void test_a_restart_of_years_does_not_confuse_the_clock(void) {
    restart();
    bench_live(&bench, 2000);
    bench_report_time(&bench, KEPT_UNIX_s + 400000000u, 0, 1);
    TEST_ASSERT_UINT32_WITHIN(1, 20u * 86400u, stay_s());
    TEST_ASSERT_LESS_THAN_INT32(0, bench_demand(&bench)->departs_in_s); /* it has passed */
}

static void test_a_second_restart_before_anything_was_heard_adds_up(void) {
    restart();
    bench.now_ms += 7000;
    keep();
    begin_anew(taper_session_kept_unix_s(&bench.table, bench.now_ms));
    TEST_ASSERT_EQUAL_UINT32(KEPT_UNIX_s + 7u, bench.table.kept_unix_s);
    bench_live(&bench, 1000);
    bench_report_time(&bench, KEPT_UNIX_s + 8u + OUTAGE_s, 0, 1);
    assert_resumed();
    TEST_ASSERT_EQUAL_UINT32(3608 + OUTAGE_s, stay_s());
    TEST_ASSERT_EQUAL_INT32(23000, bench_demand(&bench)->stored_Wh);
}

static void test_a_session_of_this_life_is_not_made_longer_by_the_clock(void) {
    restart();
    bench_unplug(&bench);
    bench.elec.energy_Wh = 0;
    bench_live(&bench, 1000);
    bench_report_time(&bench, KEPT_UNIX_s + OUTAGE_s, 0, 1);
    TEST_ASSERT_EQUAL_UINT32(0, stay_s());
}

static void test_in_a_simulation_the_worlds_time_is_kept(void) {
    bench.table.time_scale = 60;
    keep();
    TEST_ASSERT_EQUAL_UINT32(60 * 3600, kept.stay_s);
    begin_anew(KEPT_UNIX_s);
    bench_live(&bench, 1000);
    bench_report_time(&bench, KEPT_UNIX_s + 60u + 600u, 0, 1);
    TEST_ASSERT_EQUAL_UINT32(60 * 3600 + 60 + 600, stay_s());
}

static void test_quantities_that_cannot_be_are_not_believed(void) {
    static const struct {
        size_t offset;
        int32_t value;
    } wrong[] = {
        {offsetof(taper_session_kept_t, used.a.capacity_Wh), 6553401},
        {offsetof(taper_session_kept_t, used.a.soc_target_permille), 1001},
        {offsetof(taper_session_kept_t, used.a.soc_minimum_permille), -1},
        {offsetof(taper_session_kept_t, used.a.soc_plug_in_permille), INT32_MAX},
        {offsetof(taper_session_kept_t, used.b.departure_min), 65535},
        {offsetof(taper_session_kept_t, used.b.peak_W), 655341},
        {offsetof(taper_session_kept_t, used.b.min_mA), -1},
        {offsetof(taper_session_kept_t, used.c.target_Wh), 655341},
        {offsetof(taper_session_kept_t, used.c.maximum_Wh), -655341},
        {offsetof(taper_session_kept_t, used.c.minimum_Wh), TAPER_ABSENT + 1},
        {offsetof(taper_session_kept_t, used.d.taper_W), -1},
        {offsetof(taper_session_kept_t, session_Wh), -1},
        {offsetof(taper_session_kept_t, stored_Wh), TAPER_CAPACITY_MAX_Wh + 1},
        {offsetof(taper_session_kept_t, anchor_Wh), INT32_MAX},
        {offsetof(taper_session_kept_t, stay_s), 20 * 86400 + 1},
    };
    keep();
    taper_session_init(&bench.table, bench.table.config);
    for (unsigned k = 0; k < sizeof wrong / sizeof wrong[0]; k++) {
        taper_session_kept_t bad = kept;
        memcpy((uint8_t *)&bad + wrong[k].offset, &wrong[k].value, sizeof wrong[k].value);
        TEST_ASSERT_FALSE(taper_session_restore(&bench.table, bench.connector, &bad));
        TEST_ASSERT_EQUAL_UINT8(0, taper_session_number(&bench.table, bench.connector));
    }
    TEST_ASSERT_FALSE(taper_session_restore(&bench.table, 3, &kept)); /* there is no such connector */
    TEST_ASSERT_TRUE(taper_session_restore(&bench.table, bench.connector, &kept));
}

static void test_a_battery_holds_no_more_than_its_capacity(void) {
    keep();
    kept.stored_Wh = 70000;
    begin_anew(KEPT_UNIX_s);
    bench_report_status(&bench);
    taper_session_confirm(&bench.table, bench.connector);
    TEST_ASSERT_EQUAL_INT32(60000, bench_demand(&bench)->stored_Wh);
}

static void test_what_should_be_kept_soon_is_counted(void) {
    const uint32_t before = bench.table.changes;
    bench_live(&bench, 1000);
    bench.elec.energy_Wh += 100;
    bench_live(&bench, 1000);
    bench_tick(&bench);
    TEST_ASSERT_EQUAL_UINT32(before, bench.table.changes); /* energy and time go on all the while */
    bench.ev.complete = true;
    bench_report_ev(&bench);
    TEST_ASSERT_EQUAL_UINT32(before + 1, bench.table.changes);
    bench_next_revision(&bench);
    bench_report_parameters(&bench);
    TEST_ASSERT_GREATER_THAN_UINT32(before + 1, bench.table.changes);
    const uint32_t there = bench.table.changes;
    bench_unplug(&bench);
    TEST_ASSERT_GREATER_THAN_UINT32(there, bench.table.changes);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_an_awaited_session_has_a_number_and_no_demand);
    RUN_TEST(test_parameters_with_its_number_resume_it_with_stay_and_energy);
    RUN_TEST(test_an_accepted_setpoint_resumes_it_with_the_parameters_that_were_kept);
    RUN_TEST(test_a_vehicle_that_cannot_charge_is_not_resumed_by_an_echo);
    RUN_TEST(test_energy_that_flowed_during_the_restart_counts);
    RUN_TEST(test_other_wishes_with_the_same_number_are_the_same_session);
    RUN_TEST(test_another_number_is_another_session_as_soon_as_it_is_told);
    RUN_TEST(test_another_battery_or_soc_at_plug_in_is_another_session);
    RUN_TEST(test_what_was_not_told_before_contradicts_nothing);
    RUN_TEST(test_a_meter_that_shows_less_is_another_session);
    RUN_TEST(test_the_taper_of_another_vehicle_is_not_used);
    RUN_TEST(test_the_taper_that_tells_of_another_session_is_that_sessions);
    RUN_TEST(test_a_vehicle_that_left_meanwhile_is_forgotten);
    RUN_TEST(test_who_was_done_and_fell_asleep_stays_done);
    RUN_TEST(test_the_restart_itself_counts_once_the_clock_is_set);
    RUN_TEST(test_without_a_clock_before_or_one_that_went_back_it_counts_as_no_time);
    RUN_TEST(test_a_restart_of_years_does_not_confuse_the_clock);
    RUN_TEST(test_a_second_restart_before_anything_was_heard_adds_up);
    RUN_TEST(test_a_session_of_this_life_is_not_made_longer_by_the_clock);
    RUN_TEST(test_in_a_simulation_the_worlds_time_is_kept);
    RUN_TEST(test_quantities_that_cannot_be_are_not_believed);
    RUN_TEST(test_a_battery_holds_no_more_than_its_capacity);
    RUN_TEST(test_what_should_be_kept_soon_is_counted);
    return UNITY_END();
}
