/* Vehicles take their time: what is over stays booked until they have followed. scene_four() with a reaction of 5 s. */
#include "ledger_bench.h"
#include "scene.h"
#include "unity.h"

void setUp(void) {
    bench_begin();
}
void tearDown(void) {}

static void test_a_vehicle_has_its_time_to_follow_a_decrease_from_when_the_echo_came(void) {
    bench_send(0, 16000, 0);
    bench_hear_echo(0);
    bench_send(1, 6000, 0);
    bench_wait_ms(300);
    bench_hear_echo(1);
    TEST_ASSERT_EQUAL_INT32(16000, bench_may_mA());
    TEST_ASSERT_EQUAL_INT32(16000, bench_told_mA());
    bench_send(2, 6000, 0); /* what keeps 6 A in force */
    bench_wait_ms(3000);
    bench_send(3, 6000, 0);
    bench_assert_changes_after(REACTION_ms - 3000, 16000, 6000);
}

static void test_a_setpoint_that_another_as_high_replaces_does_not_fade(void) {
    bench_send(0, 16000, 0);
    bench_wait_ms(1);
    bench_send(1, 16000, 0);
    bench_hear_echo(1);
    bench_wait_ms(1);
    bench_hear_no_vehicle();
    TEST_ASSERT_EQUAL_INT32(0, bench_may_mA());
    bench_send(2, 6000, 0);
    bench_hear_echo(2);
    bench_send(3, 16000, 0);
    bench_hear_echo(3);
    TEST_ASSERT_EQUAL_INT32(0, ledger.entry[0].fade[0].mA);
    TEST_ASSERT_EQUAL_INT32(16000, bench_may_mA());
}

static void test_what_expires_fades_as_well(void) {
    bench_send(0, 16000, 0);
    bench_assert_changes_after(EXPIRED_ms + REACTION_ms - 1, 16000, 16000);
    /* seen at the update 1 ms before; the update before that was 1 ms earlier still */
    bench_wait_ms(REACTION_ms);
    TEST_ASSERT_EQUAL_INT32(0, bench_may_mA());
}

static void test_what_expires_fades_from_the_update_that_saw_it(void) {
    bench_send(0, 16000, 0);
    bench_wait_ms(EXPIRED_ms);
    bench_assert_changes_after(REACTION_ms, 16000, 0);
}

static void test_what_fell_back_fades_to_the_fallback_current(void) {
    bench_send(0, 16000, 6000);
    bench_wait_ms(2 * TAPER_LEDGER_LATE_ms);
    bench_hear_fallback();
    TEST_ASSERT_EQUAL_INT32(16000, bench_may_mA());
    bench_assert_changes_after(REACTION_ms, 16000, 6000);
    bench_wait_ms(3600000);
    TEST_ASSERT_EQUAL_INT32(6000, bench_may_mA());
}

static void test_a_report_of_fallback_says_nothing_of_what_it_may_have_crossed(void) {
    bench_send(0, 16000, 6000);
    bench_wait_ms(2 * TAPER_LEDGER_LATE_ms - 1);
    bench_hear_fallback();
    TEST_ASSERT_EQUAL_INT32(0, ledger.entry[0].fade[0].mA);
    TEST_ASSERT_FALSE(taper_ledger_can_send(&ledger, 0, 0));
    bench_wait_ms(1);
    bench_hear_fallback();
    TEST_ASSERT_EQUAL_INT32(16000, ledger.entry[0].fade[0].mA);
    TEST_ASSERT_TRUE(taper_ledger_can_send(&ledger, 0, 0));
}

static void test_an_empty_connector_draws_nothing_at_once(void) {
    bench_send(0, 16000, 6000);
    bench_wait_ms(1);
    bench_send(1, 6000, 6000);
    bench_hear_echo(1);
    bench_hear_no_vehicle();
    TEST_ASSERT_EQUAL_INT32(0, bench_may_mA());
    TEST_ASSERT_EQUAL_INT32(0, bench_fallback_mA());
    bench_wait_ms(EXPIRED_ms);
    TEST_ASSERT_EQUAL_INT32(0, bench_may_mA());
}

static void test_a_vehicle_reacts_in_the_worlds_time(void) {
    connectors[0].reaction_ms = 5001;
    bench_start(100); /* 50.01 ms */
    bench_hear_no_vehicle();
    bench_send(0, 16000, 0);
    bench_hear_echo(0);
    bench_send(1, 0, 0);
    bench_wait_ms(1);
    bench_hear_echo(1);
    bench_assert_changes_after(51, 16000, 0);
    connectors[0].reaction_ms = 5000;
    bench_send(2, 16000, 0);
    bench_hear_echo(2);
    bench_wait_ms(1);
    bench_send(3, 0, 0);
    bench_hear_echo(3);
    bench_assert_changes_after(50, 16000, 0);
}

static void test_falling_step_by_step_every_level_has_its_own_time(void) {
    const int32_t level_mA[] = {20000, 16000, 12000, 8000};
    for (uint8_t c = 0; c < 4; c++) {
        bench_send(c, level_mA[c], 0);
        bench_wait_ms(100);
        bench_hear_echo(c);
    } /* at 100, 200, 300, 400 ms */
    bench_send(4, 0, 0);
    bench_wait_ms(100);
    bench_hear_echo(4);
    TEST_ASSERT_EQUAL_INT32(20000, bench_may_mA());
    bench_assert_changes_after(REACTION_ms - 300, 20000, 16000);
    bench_assert_changes_after(100, 16000, 12000);
    bench_assert_changes_after(100, 12000, 8000);
    bench_assert_changes_after(100, 8000, 0);
}

static void test_more_levels_than_there_is_room_for_count_as_the_higher_of_two(void) {
    const int32_t level_mA[] = {20000, 16000, 12000, 8000, 7000, 6000};
    for (uint8_t c = 0; c < 6; c++) {
        bench_send(c, level_mA[c], 0);
        bench_wait_ms(100);
        bench_hear_echo(c);
    }
    bench_send(6, 0, 0);
    bench_wait_ms(100);
    bench_hear_echo(
        6); /* 20, 16 A began to fade at 200, 300 ms; 12 A at 400; 8, 7 and 6 A at 500, 600, 700 */
    bench_assert_changes_after(REACTION_ms - 500, 20000, 16000);
    bench_assert_changes_after(100, 16000, 12000);
    bench_assert_changes_after(100, 12000, 8000);
    bench_assert_changes_after(300, 8000, 0);
}

static void test_a_higher_level_that_fades_later_covers_all_lower_ones(void) {
    bench_send(0, 8000, 0);
    bench_send(1, 7000, 0);
    bench_hear_echo(1); /* 8 A fades */
    bench_wait_ms(1);
    bench_send(2, 6000, 0);
    bench_hear_echo(2); /* 7 A fades */
    bench_wait_ms(100);
    bench_send(3, 20000, 0);
    bench_wait_ms(1);
    bench_send(4, 0, 0);
    bench_hear_echo(4); /* 20 A fades */
    TEST_ASSERT_EQUAL_INT32(20000, ledger.entry[0].fade[0].mA);
    TEST_ASSERT_EQUAL_INT32(0, ledger.entry[0].fade[1].mA);
    bench_assert_changes_after(REACTION_ms, 20000, 0);
}

static void test_the_same_level_again_fades_from_the_last_time(void) {
    bench_send(0, 8000, 0);
    bench_wait_ms(1);
    bench_send(1, 0, 0);
    bench_hear_echo(1);
    bench_wait_ms(1000);
    bench_send(2, 8000, 0);
    bench_wait_ms(1);
    bench_send(3, 0, 0);
    bench_hear_echo(3);
    TEST_ASSERT_EQUAL_INT32(0, ledger.entry[0].fade[1].mA);
    bench_assert_changes_after(REACTION_ms, 8000, 0);
}

static void test_a_report_from_before_the_last_update_shortens_nothing(void) {
    const taper_evse_status_t echo_2 = bench_status(2);
    bench_send(0, 20000, 0);
    bench_wait_ms(1);
    bench_send(1, 16000, 0);
    bench_hear_echo(1);
    bench_wait_ms(1);
    bench_send(2, 0, 0);
    taper_ledger_hear(&ledger, 0, &echo_2, now_ms - 100);
    TEST_ASSERT_EQUAL_INT32(16000, ledger.entry[0].fade[1].mA);
    TEST_ASSERT_EQUAL_UINT32(ledger.entry[0].fade[0].until_ms, ledger.entry[0].fade[1].until_ms);
    bench_assert_changes_after(REACTION_ms - 1, 20000, 0);
}

static void test_nobody_is_told_more_than_last_while_a_level_fades_above_the_limit(void) {
    const taper_snapshot_t snapshot = scene_snapshot(now_ms, 4);
    const taper_supply_t supply = taper_supply_of_W(2300);
    const uint8_t rank[4] = {0, 1, 2, 3};
    taper_setpoints_t target = {{16000}}, granted;
    bench_send(0, 16000, 0);
    bench_wait_ms(1);
    bench_send(1, 6000, 0);
    bench_hear_echo(1);
    taper_ledger_grant(&ledger, &config, &snapshot, rank, scene_rows(&config, &snapshot, &supply), &target,
                       &granted);
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
    bench_send(0, 16000, 0);
    bench_wait_ms(1);
    bench_send(1, 6000, 0);
    bench_hear_echo(1);
    taper_ledger_grant(&ledger, &config, &snapshot, rank, scene_rows(&config, &snapshot, &supply), &target,
                       &granted);
    TEST_ASSERT_EQUAL_INT32(24000, granted.current_mA[2]);
    bench_wait_ms(2000);
    bench_send(2, 6000, 0);
    bench_wait_ms(REACTION_ms - 2000);
    taper_ledger_grant(&ledger, &config, &snapshot, rank, scene_rows(&config, &snapshot, &supply), &target,
                       &granted);
    TEST_ASSERT_EQUAL_INT32(30000, granted.current_mA[2]);
}

static void test_who_is_not_there_takes_no_room_and_is_granted_nothing(void) {
    const taper_snapshot_t snapshot = scene_snapshot(now_ms, 4);
    const taper_supply_t supply = taper_supply_of_W(9200); /* 40 A */
    const uint8_t rank[4] = {4, 0, 1, 2};
    const taper_setpoints_t target = {{0, 0, 32000, 0, 16000}};
    taper_setpoints_t granted = {{0, 0, 0, 0, 777}};
    for (uint8_t i = 0; i < 4; i++) {
        const taper_evse_status_t empty = {.pilot = TAPER_PILOT_A};
        taper_ledger_hear(&ledger, i, &empty, now_ms);
    }
    ledger.entry[4].drawn_mA = 32000;
    taper_ledger_grant(&ledger, &config, &snapshot, rank, scene_rows(&config, &snapshot, &supply), &target,
                       &granted);
    TEST_ASSERT_EQUAL_INT32(32000, granted.current_mA[2]);
    TEST_ASSERT_EQUAL_INT32(777, granted.current_mA[4]);
    ledger.entry[4].drawn_mA = 0;
    taper_ledger_grant(&ledger, &config, &snapshot, rank, scene_rows(&config, &snapshot, &supply), &target,
                       &granted);
    TEST_ASSERT_EQUAL_INT32(777, granted.current_mA[4]);
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
    RUN_TEST(test_who_is_not_there_takes_no_room_and_is_granted_nothing);
    return UNITY_END();
}
