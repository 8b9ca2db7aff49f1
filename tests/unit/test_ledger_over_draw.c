/* What connectors are seen to draw beyond all that they were told. scene_four() with a reaction of 5 s. */
#include "ledger_bench.h"
#include "scene.h"
#include "unity.h"

void setUp(void) {
    bench_begin();
}
void tearDown(void) {}

static void test_what_is_drawn_beyond_the_tolerance_is_booked_at_once(void) {
    bench_send(0, 16000, 0);
    bench_hear_draw(0, 0, 18150, TAPER_ABSENT);
    TEST_ASSERT_EQUAL_INT32(16000, bench_may_mA());
    bench_hear_draw(0, 0, 18151, TAPER_ABSENT);
    TEST_ASSERT_EQUAL_INT32(18151, bench_may_mA());
    TEST_ASSERT_EQUAL_INT32(16000, bench_told_mA());
}

static void test_the_greatest_of_the_phases_counts(void) {
    bench_send(0, 6000, 0);
    bench_hear_draw(0, 20000, 0, 0);
    TEST_ASSERT_EQUAL_INT32(20000, bench_may_mA());
    bench_hear_draw(0, 0, 21000, 0);
    TEST_ASSERT_EQUAL_INT32(21000, bench_may_mA());
    bench_hear_draw(0, 0, 0, 22000);
    TEST_ASSERT_EQUAL_INT32(22000, bench_may_mA());
}

static void test_a_vehicle_on_its_way_down_does_not_over_draw(void) {
    bench_send(0, 16000, 0);
    bench_wait_ms(1);
    bench_send(1, 0, 0);
    bench_hear_draw(1, 17000, 0, 0);
    TEST_ASSERT_EQUAL_INT32(16000, bench_may_mA());
    bench_wait_ms(REACTION_ms);
    bench_hear_draw(1, 17000, 0, 0);
    TEST_ASSERT_EQUAL_INT32(17000, bench_may_mA());
}

static void test_over_draw_ends_with_the_report_that_says_less(void) {
    bench_send(0, 16000, 0);
    bench_hear_draw(0, 30000, 0, 0);
    bench_hear_draw(0, 25000, 0, 0);
    TEST_ASSERT_EQUAL_INT32(25000, bench_may_mA());
    bench_hear_draw(0, 16000, 0, 0);
    TEST_ASSERT_EQUAL_INT32(16000, bench_may_mA());
}

static void test_a_report_without_a_current_does_not_end_over_draw(void) {
    bench_send(0, 16000, 0);
    bench_hear_draw(0, 30000, 0, 0);
    bench_hear_echo(0);
    TEST_ASSERT_EQUAL_INT32(30000, bench_may_mA());
}

static void test_over_draw_of_a_silent_connector_counts_until_its_setpoint_is_over_and_followed(void) {
    bench_hear_draw(0, 30000, 0, 0); /* told nothing */
    bench_wait_ms(VALIDITY_ms);
    bench_assert_changes_after(REACTION_ms, 30000, 0);
}

static void test_over_draw_ends_with_the_vehicle(void) {
    bench_send(0, 16000, 0);
    bench_hear_draw(0, 30000, 0, 0);
    bench_hear_no_vehicle();
    TEST_ASSERT_EQUAL_INT32(0, bench_may_mA());
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
    bench_send(0, 10000, 0);
    bench_hear_draw(0, 20000, 0, 0);
    taper_ledger_grant(&ledger, &config, &snapshot, rank, scene_rows(&config, &snapshot, &supply), &target,
                       &granted);
    TEST_ASSERT_EQUAL_INT32(15000, granted.current_mA[0]); /* paid for already */
    TEST_ASSERT_EQUAL_INT32(10000, granted.current_mA[2]);
    bench_hear_draw(0, 31000, 0, 0);
    taper_ledger_grant(&ledger, &config, &snapshot, rank, scene_rows(&config, &snapshot, &supply), &target,
                       &granted);
    TEST_ASSERT_EQUAL_INT32(10000, granted.current_mA[0]);
    TEST_ASSERT_EQUAL_INT32(0, granted.current_mA[2]);
}

int main(void) {
    UNITY_BEGIN();
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
