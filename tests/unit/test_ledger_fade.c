/*
 * Vehicles take their time: what is over stays booked until they have followed. And what nobody told: an earlier life, the
 * fallback current, over-draw. scene_four() with a reaction of 5 s.
 */
#include <string.h>

#include "scene.h"
#include "taper/ledger.h"
#include "unity.h"

#define VALIDITY_ms 3000u
#define EXPIRED_ms  (VALIDITY_ms + TAPER_LEDGER_LATE_ms)
#define REACTION_ms 5000u
#define START_ms    (UINT32_MAX - 4000u) /* the clock wraps in every test that waits */

static taper_connector_config_t connectors[4];
static taper_station_config_t config;
static taper_ledger_t ledger;
static uint32_t now_ms;

static int32_t may_mA(void) {
    return taper_ledger_may_mA(&ledger, 0);
}

static int32_t told_mA(void) {
    return taper_ledger_told_mA(&ledger, 0);
}

static int32_t fallback_mA(void) {
    return taper_ledger_fallback_mA(&ledger, 0);
}

static void wait_ms(uint32_t ms) {
    now_ms += ms;
    taper_ledger_update(&ledger, now_ms);
}

static void start(uint32_t time_scale) {
    now_ms = START_ms;
    taper_ledger_init(&ledger, &config, VALIDITY_ms, time_scale, now_ms);
}

static taper_evse_status_t status_of(uint8_t echo) {
    return (taper_evse_status_t){.pilot = TAPER_PILOT_C,
                                 .ev_present = true,
                                 .setpoint_echo = echo,
                                 .current_mA = {TAPER_ABSENT, TAPER_ABSENT, TAPER_ABSENT}};
}

static void hear(const taper_evse_status_t *status) {
    taper_ledger_hear(&ledger, 0, status, now_ms);
}

static void hear_echo(uint8_t counter) {
    const taper_evse_status_t status = status_of(counter);
    hear(&status);
}

static void hear_fallback(void) {
    taper_evse_status_t status = status_of(0);
    status.fallback_active = true;
    hear(&status);
}

static void hear_no_vehicle(void) {
    const taper_evse_status_t status = {.pilot = TAPER_PILOT_A};
    hear(&status);
}

static void hear_draw(uint8_t echo, int32_t L1_mA, int32_t L2_mA, int32_t L3_mA) {
    taper_evse_status_t status = status_of(echo);
    status.current_mA[0] = L1_mA;
    status.current_mA[1] = L2_mA;
    status.current_mA[2] = L3_mA;
    hear(&status);
}

static void send(uint8_t counter, int32_t current_mA, int32_t told_fallback_mA) {
    taper_ledger_sent(&ledger, 0, counter, current_mA, told_fallback_mA, now_ms);
}

/** All that `then_mA` is, exactly from `ms` on, and `before_mA` until then. */
static void assert_changes_after(uint32_t ms, int32_t before_mA, int32_t then_mA) {
    wait_ms(ms - 1);
    TEST_ASSERT_EQUAL_INT32(before_mA, may_mA());
    wait_ms(1);
    TEST_ASSERT_EQUAL_INT32(then_mA, may_mA());
}

void setUp(void) {
    memcpy(connectors, scene_four()->connectors, sizeof connectors);
    for (unsigned i = 0; i < 4; i++) {
        connectors[i].reaction_ms = REACTION_ms;
    }
    config = *scene_four();
    config.connectors = connectors;
    start(1);
    hear_no_vehicle(); /* nothing of an earlier life is left */
}
void tearDown(void) {}

static void test_a_vehicle_has_its_time_to_follow_a_decrease_from_when_the_echo_came(void) {
    send(0, 16000, 0);
    hear_echo(0);
    send(1, 6000, 0);
    wait_ms(300);
    hear_echo(1);
    TEST_ASSERT_EQUAL_INT32(16000, may_mA());
    TEST_ASSERT_EQUAL_INT32(16000, told_mA());
    send(2, 6000, 0); /* what keeps 6 A in force */
    wait_ms(3000);
    send(3, 6000, 0);
    assert_changes_after(REACTION_ms - 3000, 16000, 6000);
}

static void test_a_setpoint_that_another_as_high_replaces_does_not_fade(void) {
    send(0, 16000, 0);
    wait_ms(1);
    send(1, 16000, 0);
    hear_echo(1);
    wait_ms(1);
    hear_no_vehicle();
    TEST_ASSERT_EQUAL_INT32(0, may_mA());
    send(2, 6000, 0);
    hear_echo(2);
    send(3, 16000, 0);
    hear_echo(3);
    TEST_ASSERT_EQUAL_INT32(0, ledger.entry[0].fade[0].mA);
    TEST_ASSERT_EQUAL_INT32(16000, may_mA());
}

static void test_what_expires_fades_as_well(void) {
    send(0, 16000, 0);
    assert_changes_after(EXPIRED_ms + REACTION_ms - 1, 16000, 16000);
    /* seen at the update 1 ms before; the update before that was 1 ms earlier still */
    wait_ms(REACTION_ms);
    TEST_ASSERT_EQUAL_INT32(0, may_mA());
}

static void test_what_expires_fades_from_the_update_that_saw_it(void) {
    send(0, 16000, 0);
    wait_ms(EXPIRED_ms);
    assert_changes_after(REACTION_ms, 16000, 0);
}

static void test_what_fell_back_fades_to_the_fallback_current(void) {
    send(0, 16000, 6000);
    wait_ms(2 * TAPER_LEDGER_LATE_ms);
    hear_fallback();
    TEST_ASSERT_EQUAL_INT32(16000, may_mA());
    assert_changes_after(REACTION_ms, 16000, 6000);
    wait_ms(3600000);
    TEST_ASSERT_EQUAL_INT32(6000, may_mA());
}

static void test_a_report_of_fallback_says_nothing_of_what_it_may_have_crossed(void) {
    send(0, 16000, 6000);
    wait_ms(2 * TAPER_LEDGER_LATE_ms - 1);
    hear_fallback();
    TEST_ASSERT_EQUAL_INT32(0, ledger.entry[0].fade[0].mA);
    TEST_ASSERT_FALSE(taper_ledger_can_send(&ledger, 0, 0));
    wait_ms(1);
    hear_fallback();
    TEST_ASSERT_EQUAL_INT32(16000, ledger.entry[0].fade[0].mA);
    TEST_ASSERT_TRUE(taper_ledger_can_send(&ledger, 0, 0));
}

static void test_an_empty_connector_draws_nothing_at_once(void) {
    send(0, 16000, 6000);
    wait_ms(1);
    send(1, 6000, 6000);
    hear_echo(1);
    hear_no_vehicle();
    TEST_ASSERT_EQUAL_INT32(0, may_mA());
    TEST_ASSERT_EQUAL_INT32(0, fallback_mA());
    wait_ms(EXPIRED_ms);
    TEST_ASSERT_EQUAL_INT32(0, may_mA());
}

static void test_a_vehicle_reacts_in_the_worlds_time(void) {
    connectors[0].reaction_ms = 5001;
    start(100); /* 50.01 ms */
    hear_no_vehicle();
    send(0, 16000, 0);
    hear_echo(0);
    send(1, 0, 0);
    wait_ms(1);
    hear_echo(1);
    assert_changes_after(51, 16000, 0);
    connectors[0].reaction_ms = 5000;
    send(2, 16000, 0);
    hear_echo(2);
    wait_ms(1);
    send(3, 0, 0);
    hear_echo(3);
    assert_changes_after(50, 16000, 0);
}

static void test_falling_step_by_step_every_level_has_its_own_time(void) {
    const int32_t level_mA[] = {20000, 16000, 12000, 8000};
    for (uint8_t c = 0; c < 4; c++) {
        send(c, level_mA[c], 0);
        wait_ms(100);
        hear_echo(c);
    } /* at 100, 200, 300, 400 ms */
    send(4, 0, 0);
    wait_ms(100);
    hear_echo(4);
    TEST_ASSERT_EQUAL_INT32(20000, may_mA());
    assert_changes_after(REACTION_ms - 300, 20000, 16000);
    assert_changes_after(100, 16000, 12000);
    assert_changes_after(100, 12000, 8000);
    assert_changes_after(100, 8000, 0);
}

static void test_more_levels_than_there_is_room_for_count_as_the_higher_of_two(void) {
    const int32_t level_mA[] = {20000, 16000, 12000, 8000, 7000, 6000};
    for (uint8_t c = 0; c < 6; c++) {
        send(c, level_mA[c], 0);
        wait_ms(100);
        hear_echo(c);
    }
    send(6, 0, 0);
    wait_ms(100);
    hear_echo(6); /* 20, 16 A began to fade at 200, 300 ms; 12 A at 400; 8, 7 and 6 A at 500, 600, 700 */
    assert_changes_after(REACTION_ms - 500, 20000, 16000);
    assert_changes_after(100, 16000, 12000);
    assert_changes_after(100, 12000, 8000);
    assert_changes_after(300, 8000, 0);
}

static void test_a_higher_level_that_fades_later_covers_all_lower_ones(void) {
    send(0, 8000, 0);
    wait_ms(1);
    send(1, 6000, 0);
    hear_echo(1); /* 8 A fades */
    wait_ms(100);
    send(2, 20000, 0);
    wait_ms(1);
    send(3, 0, 0);
    hear_echo(3); /* 20 A fades */
    TEST_ASSERT_EQUAL_INT32(20000, ledger.entry[0].fade[0].mA);
    TEST_ASSERT_EQUAL_INT32(0, ledger.entry[0].fade[1].mA);
    assert_changes_after(REACTION_ms, 20000, 0);
}

static void test_the_same_level_again_fades_from_the_last_time(void) {
    send(0, 8000, 0);
    wait_ms(1);
    send(1, 0, 0);
    hear_echo(1);
    wait_ms(1000);
    send(2, 8000, 0);
    wait_ms(1);
    send(3, 0, 0);
    hear_echo(3);
    TEST_ASSERT_EQUAL_INT32(0, ledger.entry[0].fade[1].mA);
    assert_changes_after(REACTION_ms, 8000, 0);
}

static void test_a_report_from_before_the_last_update_shortens_nothing(void) {
    const taper_evse_status_t echo_2 = status_of(2);
    send(0, 20000, 0);
    wait_ms(1);
    send(1, 16000, 0);
    hear_echo(1);
    wait_ms(1);
    send(2, 0, 0);
    taper_ledger_hear(&ledger, 0, &echo_2, now_ms - 100);
    TEST_ASSERT_EQUAL_INT32(16000, ledger.entry[0].fade[1].mA);
    TEST_ASSERT_EQUAL_UINT32(ledger.entry[0].fade[0].until_ms, ledger.entry[0].fade[1].until_ms);
    assert_changes_after(REACTION_ms - 1, 20000, 0);
}

static void test_nobody_is_told_more_than_last_while_a_level_fades_above_the_limit(void) {
    const taper_snapshot_t snapshot = scene_snapshot(now_ms, 4);
    const taper_supply_t supply = taper_supply_of_W(2300);
    const uint8_t rank[4] = {0, 1, 2, 3};
    taper_setpoints_t target = {{16000}}, granted;
    send(0, 16000, 0);
    wait_ms(1);
    send(1, 6000, 0);
    hear_echo(1);
    taper_ledger_grant(&ledger, &config, &snapshot, rank, &supply, &target, &granted);
    TEST_ASSERT_EQUAL_INT32(6000, granted.current_mA[0]);
    TEST_ASSERT_TRUE(taper_guard_hand_over_passes(&ledger, &config, &snapshot, &supply, &granted));
}

static void test_while_one_fades_no_other_gets_its_room(void) {
    const taper_snapshot_t snapshot = scene_snapshot(now_ms, 4);
    const taper_supply_t supply = taper_supply_of_W(9200); /* 40 A */
    const uint8_t rank[4] = {0, 1, 2, 3};
    taper_setpoints_t target = {{6000, 0, 30000}}, granted;
    for (uint8_t i = 1; i < 4; i++) {
        const taper_evse_status_t empty = {.pilot = TAPER_PILOT_A};
        taper_ledger_hear(&ledger, i, &empty, now_ms);
    }
    send(0, 16000, 0);
    wait_ms(1);
    send(1, 6000, 0);
    hear_echo(1);
    taper_ledger_grant(&ledger, &config, &snapshot, rank, &supply, &target, &granted);
    TEST_ASSERT_EQUAL_INT32(24000, granted.current_mA[2]);
    wait_ms(2000);
    send(2, 6000, 0);
    wait_ms(REACTION_ms - 2000);
    taper_ledger_grant(&ledger, &config, &snapshot, rank, &supply, &target, &granted);
    TEST_ASSERT_EQUAL_INT32(30000, granted.current_mA[2]);
}

/* Fallback currents. */

static void test_a_connector_out_of_reach_draws_its_fallback_current_for_ever(void) {
    send(0, 16000, 6000);
    hear_echo(0);
    TEST_ASSERT_EQUAL_INT32(6000, fallback_mA());
    wait_ms(EXPIRED_ms);
    assert_changes_after(REACTION_ms, 16000, 6000);
    wait_ms(UINT32_C(0x7fffffff));
    wait_ms(UINT32_C(0x7fffffff));
    TEST_ASSERT_EQUAL_INT32(6000, may_mA());
    TEST_ASSERT_EQUAL_INT32(6000, fallback_mA());
}

static void test_a_connector_that_was_told_to_fall_back_to_nothing_counts_nothing(void) {
    send(0, 16000, 0);
    wait_ms(EXPIRED_ms);
    wait_ms(REACTION_ms);
    TEST_ASSERT_EQUAL_INT32(0, may_mA());
    TEST_ASSERT_EQUAL_INT32(0, fallback_mA());
}

static void test_an_old_fallback_current_counts_until_a_later_setpoint_is_echoed(void) {
    send(0, 16000, 10000);
    wait_ms(EXPIRED_ms);
    send(1, 6000, 6000);
    TEST_ASSERT_EQUAL_INT32(10000, fallback_mA());
    wait_ms(EXPIRED_ms); /* lost */
    TEST_ASSERT_EQUAL_INT32(10000, fallback_mA());
    send(2, 6000, 6000);
    wait_ms(REACTION_ms);
    TEST_ASSERT_EQUAL_INT32(10000, may_mA());
    send(3, 6000, 0);
    hear_echo(3);
    TEST_ASSERT_EQUAL_INT32(0, fallback_mA());
    TEST_ASSERT_EQUAL_INT32(10000, may_mA()); /* and the vehicle has its time to leave it */
    wait_ms(2000);
    send(4, 6000, 0);
    assert_changes_after(REACTION_ms - 2000, 10000, 6000);
}

static void test_an_echo_that_is_lower_ends_the_fallback_currents_before_it_and_none_after(void) {
    send(0, 16000, 10000);
    wait_ms(1);
    send(1, 16000, 8000);
    wait_ms(1);
    send(2, 16000, 9000);
    TEST_ASSERT_EQUAL_INT32(10000, fallback_mA());
    hear_echo(1);
    TEST_ASSERT_EQUAL_INT32(9000, fallback_mA());
    wait_ms(EXPIRED_ms);
    TEST_ASSERT_EQUAL_INT32(9000, fallback_mA());
}

static void test_an_echo_of_what_expired_ends_no_fallback_current(void) {
    send(0, 16000, 10000);
    wait_ms(1);
    send(1, 16000, 6000);
    wait_ms(EXPIRED_ms);
    hear_echo(1);
    TEST_ASSERT_EQUAL_INT32(10000, fallback_mA());
}

static void test_a_fallback_current_ends_with_the_vehicle(void) {
    send(0, 16000, 10000);
    wait_ms(EXPIRED_ms);
    hear_no_vehicle();
    TEST_ASSERT_EQUAL_INT32(0, fallback_mA());
    TEST_ASSERT_EQUAL_INT32(0, may_mA());
}

static void test_a_report_of_fallback_keeps_the_highest_that_may_be_meant(void) {
    send(0, 16000, 10000);
    wait_ms(1);
    send(1, 6000, 6000);
    wait_ms(2 * TAPER_LEDGER_LATE_ms);
    hear_fallback();
    TEST_ASSERT_EQUAL_INT32(10000, fallback_mA());
}

static void test_who_ran_out_of_setpoints_is_out_of_reach_until_it_is_heard_to_accept_one(void) {
    send(0, 16000, 6000);
    wait_ms(EXPIRED_ms - 1);
    TEST_ASSERT_EQUAL_INT32(0, taper_ledger_unreached_mA(&ledger, 0));
    wait_ms(1);
    TEST_ASSERT_EQUAL_INT32(6000, taper_ledger_unreached_mA(&ledger, 0));
    TEST_ASSERT_EQUAL_INT32(0, taper_ledger_unreached_mA(&ledger, 1));
    send(1, 8000, 8000);
    TEST_ASSERT_EQUAL_INT32(6000, taper_ledger_unreached_mA(&ledger, 0));
    hear_echo(1);
    TEST_ASSERT_EQUAL_INT32(0, taper_ledger_unreached_mA(&ledger, 0));
}

static void test_after_a_start_nobody_is_known_to_be_within_reach(void) {
    connectors[0].fallback_mA = 7000;
    start(1);
    TEST_ASSERT_EQUAL_INT32(7000, taper_ledger_unreached_mA(&ledger, 0));
}

/* An earlier life. */

static void test_after_a_start_its_maximum_counts_until_it_is_left_and_then_its_fallback_current(void) {
    connectors[0].fallback_mA = 7000;
    start(1);
    TEST_ASSERT_EQUAL_INT32(7000, fallback_mA());
    TEST_ASSERT_EQUAL_INT32(32000, told_mA());
    assert_changes_after(EXPIRED_ms + REACTION_ms, 32000, 7000);
    wait_ms(3600000);
    TEST_ASSERT_EQUAL_INT32(7000, may_mA());
}

static void test_after_a_start_fallback_ends_it_sooner_and_only_once(void) {
    connectors[0].fallback_mA = 7000;
    start(1);
    wait_ms(100);
    hear_fallback();
    TEST_ASSERT_EQUAL_INT32(32000, may_mA());
    wait_ms(200);
    hear_fallback();
    assert_changes_after(REACTION_ms - 200, 32000, 7000);
}

static void test_after_a_start_a_late_proof_makes_it_last_no_longer(void) {
    start(1);
    wait_ms(EXPIRED_ms - 1);
    hear_fallback();
    assert_changes_after(REACTION_ms, 32000, 0);
    start(1);
    wait_ms(EXPIRED_ms + 1);
    hear_fallback();
    assert_changes_after(REACTION_ms - 1, 32000, 0);
}

static void test_after_a_start_two_different_echoes_prove_ours(void) {
    connectors[0].fallback_mA = 7000;
    start(1);
    send(0, 6000, 0);
    send(1, 6000, 0);
    hear_echo(0);
    hear_echo(0);
    TEST_ASSERT_EQUAL_INT32(7000, fallback_mA());
    hear_echo(1);
    TEST_ASSERT_EQUAL_INT32(0, fallback_mA());
    TEST_ASSERT_EQUAL_INT32(32000, may_mA());
    wait_ms(3000);
    send(2, 6000, 0);
    assert_changes_after(REACTION_ms - 3000, 32000, 6000);
}

static void test_after_a_start_the_first_echo_is_ours_when_no_other_can_be_heard(void) {
    connectors[0].fallback_mA = 7000;
    start(1);
    wait_ms(EXPIRED_ms - 1);
    send(0, 6000, 0);
    hear_echo(0);
    TEST_ASSERT_EQUAL_INT32(7000, fallback_mA());
    wait_ms(1);
    hear_echo(0);
    TEST_ASSERT_EQUAL_INT32(0, fallback_mA());
}

static void test_after_a_start_an_echo_after_fallback_is_ours(void) {
    connectors[0].fallback_mA = 7000;
    start(1);
    hear_fallback();
    send(0, 6000, 0);
    hear_echo(0);
    TEST_ASSERT_EQUAL_INT32(0, fallback_mA());
}

static void test_after_a_start_an_empty_connector_counts_nothing_and_its_first_echo_is_ours(void) {
    connectors[0].fallback_mA = 7000;
    start(1);
    hear_no_vehicle();
    TEST_ASSERT_EQUAL_INT32(0, may_mA());
    TEST_ASSERT_EQUAL_INT32(0, fallback_mA());
    send(0, 16000, 8000);
    wait_ms(1);
    send(1, 6000, 0);
    hear_echo(1);
    TEST_ASSERT_EQUAL_INT32(0, fallback_mA());
}

static void test_after_a_start_a_lower_setpoint_of_ours_hides_nothing(void) {
    start(1);
    send(0, 6000, 0);
    wait_ms(EXPIRED_ms);
    TEST_ASSERT_EQUAL_INT32(32000, may_mA());
    assert_changes_after(REACTION_ms, 32000, 0);
}

/* Over-draw. */

static void test_what_is_drawn_beyond_the_tolerance_is_booked_at_once(void) {
    send(0, 16000, 0);
    hear_draw(0, 0, 18150, TAPER_ABSENT);
    TEST_ASSERT_EQUAL_INT32(16000, may_mA());
    hear_draw(0, 0, 18151, TAPER_ABSENT);
    TEST_ASSERT_EQUAL_INT32(18151, may_mA());
    TEST_ASSERT_EQUAL_INT32(16000, told_mA());
}

static void test_the_greatest_of_the_phases_counts(void) {
    send(0, 6000, 0);
    hear_draw(0, 20000, 0, 0);
    TEST_ASSERT_EQUAL_INT32(20000, may_mA());
    hear_draw(0, 0, 21000, 0);
    TEST_ASSERT_EQUAL_INT32(21000, may_mA());
    hear_draw(0, 0, 0, 22000);
    TEST_ASSERT_EQUAL_INT32(22000, may_mA());
}

static void test_a_vehicle_on_its_way_down_does_not_over_draw(void) {
    send(0, 16000, 0);
    wait_ms(1);
    send(1, 0, 0);
    hear_draw(1, 17000, 0, 0);
    TEST_ASSERT_EQUAL_INT32(16000, may_mA());
    wait_ms(REACTION_ms);
    hear_draw(1, 17000, 0, 0);
    TEST_ASSERT_EQUAL_INT32(17000, may_mA());
}

static void test_over_draw_ends_with_the_report_that_says_less(void) {
    send(0, 16000, 0);
    hear_draw(0, 30000, 0, 0);
    hear_draw(0, 25000, 0, 0);
    TEST_ASSERT_EQUAL_INT32(25000, may_mA());
    hear_draw(0, 16000, 0, 0);
    TEST_ASSERT_EQUAL_INT32(16000, may_mA());
}

static void test_a_report_without_a_current_does_not_end_over_draw(void) {
    send(0, 16000, 0);
    hear_draw(0, 30000, 0, 0);
    hear_echo(0);
    TEST_ASSERT_EQUAL_INT32(30000, may_mA());
}

static void test_over_draw_of_a_silent_connector_counts_until_its_setpoint_is_over_and_followed(void) {
    send(0, 16000, 0);
    hear_draw(0, 30000, 0, 0);
    wait_ms(VALIDITY_ms);
    assert_changes_after(REACTION_ms, 30000, 16000);
}

static void test_over_draw_ends_with_the_vehicle(void) {
    send(0, 16000, 0);
    hear_draw(0, 30000, 0, 0);
    hear_no_vehicle();
    TEST_ASSERT_EQUAL_INT32(0, may_mA());
}

static void test_nobody_gets_the_room_of_who_over_draws_and_he_no_more_than_last(void) {
    const taper_snapshot_t snapshot = scene_snapshot(now_ms, 4);
    const taper_supply_t supply = taper_supply_of_W(6900); /* 30 A */
    const uint8_t rank[4] = {0, 1, 2, 3};
    taper_setpoints_t target = {{15000, 0, 15000}}, granted;
    for (uint8_t i = 1; i < 4; i++) {
        const taper_evse_status_t empty = {.pilot = TAPER_PILOT_A};
        taper_ledger_hear(&ledger, i, &empty, now_ms);
    }
    send(0, 10000, 0);
    hear_draw(0, 20000, 0, 0);
    taper_ledger_grant(&ledger, &config, &snapshot, rank, &supply, &target, &granted);
    TEST_ASSERT_EQUAL_INT32(15000, granted.current_mA[0]); /* paid for already */
    TEST_ASSERT_EQUAL_INT32(10000, granted.current_mA[2]);
    hear_draw(0, 31000, 0, 0);
    taper_ledger_grant(&ledger, &config, &snapshot, rank, &supply, &target, &granted);
    TEST_ASSERT_EQUAL_INT32(10000, granted.current_mA[0]);
    TEST_ASSERT_EQUAL_INT32(0, granted.current_mA[2]);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_a_vehicle_has_its_time_to_follow_a_decrease_from_when_the_echo_came);
    RUN_TEST(test_a_setpoint_that_another_as_high_replaces_does_not_fade);
    RUN_TEST(test_what_expires_fades_as_well);
    RUN_TEST(test_what_expires_fades_from_the_update_that_saw_it);
    RUN_TEST(test_what_fell_back_fades_to_the_fallback_current);
    RUN_TEST(test_a_report_of_fallback_says_nothing_of_what_it_may_have_crossed);
    RUN_TEST(test_an_empty_connector_draws_nothing_at_once);
    RUN_TEST(test_a_vehicle_reacts_in_the_worlds_time);
    RUN_TEST(test_falling_step_by_step_every_level_has_its_own_time);
    RUN_TEST(test_more_levels_than_there_is_room_for_count_as_the_higher_of_two);
    RUN_TEST(test_a_higher_level_that_fades_later_covers_all_lower_ones);
    RUN_TEST(test_the_same_level_again_fades_from_the_last_time);
    RUN_TEST(test_a_report_from_before_the_last_update_shortens_nothing);
    RUN_TEST(test_nobody_is_told_more_than_last_while_a_level_fades_above_the_limit);
    RUN_TEST(test_while_one_fades_no_other_gets_its_room);
    RUN_TEST(test_a_connector_out_of_reach_draws_its_fallback_current_for_ever);
    RUN_TEST(test_a_connector_that_was_told_to_fall_back_to_nothing_counts_nothing);
    RUN_TEST(test_an_old_fallback_current_counts_until_a_later_setpoint_is_echoed);
    RUN_TEST(test_an_echo_that_is_lower_ends_the_fallback_currents_before_it_and_none_after);
    RUN_TEST(test_an_echo_of_what_expired_ends_no_fallback_current);
    RUN_TEST(test_a_fallback_current_ends_with_the_vehicle);
    RUN_TEST(test_a_report_of_fallback_keeps_the_highest_that_may_be_meant);
    RUN_TEST(test_who_ran_out_of_setpoints_is_out_of_reach_until_it_is_heard_to_accept_one);
    RUN_TEST(test_after_a_start_nobody_is_known_to_be_within_reach);
    RUN_TEST(test_after_a_start_its_maximum_counts_until_it_is_left_and_then_its_fallback_current);
    RUN_TEST(test_after_a_start_fallback_ends_it_sooner_and_only_once);
    RUN_TEST(test_after_a_start_a_late_proof_makes_it_last_no_longer);
    RUN_TEST(test_after_a_start_two_different_echoes_prove_ours);
    RUN_TEST(test_after_a_start_the_first_echo_is_ours_when_no_other_can_be_heard);
    RUN_TEST(test_after_a_start_an_echo_after_fallback_is_ours);
    RUN_TEST(test_after_a_start_an_empty_connector_counts_nothing_and_its_first_echo_is_ours);
    RUN_TEST(test_after_a_start_a_lower_setpoint_of_ours_hides_nothing);
    RUN_TEST(test_what_is_drawn_beyond_the_tolerance_is_booked_at_once);
    RUN_TEST(test_the_greatest_of_the_phases_counts);
    RUN_TEST(test_a_vehicle_on_its_way_down_does_not_over_draw);
    RUN_TEST(test_over_draw_ends_with_the_report_that_says_less);
    RUN_TEST(test_a_report_without_a_current_does_not_end_over_draw);
    RUN_TEST(test_over_draw_of_a_silent_connector_counts_until_its_setpoint_is_over_and_followed);
    RUN_TEST(test_over_draw_ends_with_the_vehicle);
    RUN_TEST(test_nobody_gets_the_room_of_who_over_draws_and_he_no_more_than_last);
    return UNITY_END();
}
