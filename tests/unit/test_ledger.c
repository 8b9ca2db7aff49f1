/* The ledger, setpoint by setpoint, and what is granted by it. scene_four(): 230 V, 6..32 A, two feeders of 52 A. */
#include "taper/ledger.h"

#include <string.h>

#include "scene.h"
#include "unity.h"

#define VALIDITY_ms 3000u
#define EXPIRED_ms  (VALIDITY_ms + TAPER_LEDGER_LATE_ms)
#define START_ms    (UINT32_MAX - 1000u) /* the clock wraps in every test that waits */

static taper_ledger_t ledger;
static taper_snapshot_t snapshot;
static taper_setpoints_t target, granted;
static uint8_t rank[TAPER_MAX_CONNECTORS];
static uint32_t now_ms;

static void wait_ms(uint32_t ms) {
    now_ms += ms;
    taper_ledger_update(&ledger, now_ms);
}

void setUp(void) {
    now_ms = START_ms;
    taper_ledger_init(&ledger, scene_four(), VALIDITY_ms, 1, now_ms);
    wait_ms(EXPIRED_ms); /* nothing of an earlier life is left */
    snapshot = scene_snapshot(now_ms, 4);
    memset(&target, 0, sizeof target);
    for (uint8_t i = 0; i < 4; i++) {
        rank[i] = i;
    }
}
void tearDown(void) {}

static void send(uint8_t connector, uint8_t counter, int32_t current_mA) {
    taper_ledger_sent(&ledger, connector, counter, current_mA, 0, now_ms);
}

static void hear_echo(uint8_t connector, uint8_t counter) {
    const taper_evse_status_t status = {.pilot = TAPER_PILOT_C, .ev_present = true, .setpoint_echo = counter};
    taper_ledger_hear(&ledger, connector, &status, now_ms);
}

static void hear_fallback(uint8_t connector) {
    const taper_evse_status_t status = {.pilot = TAPER_PILOT_C, .ev_present = true, .fallback_active = true};
    taper_ledger_hear(&ledger, connector, &status, now_ms);
}

static bool hand_over_passes(int32_t site_limit_W) {
    const taper_supply_t supply = taper_supply_of_W(site_limit_W);
    return taper_guard_hand_over_passes(&ledger, scene_four(), &snapshot, &supply, &granted);
}

static void grant(int32_t site_limit_W) {
    const taper_supply_t supply = taper_supply_of_W(site_limit_W);
    taper_ledger_grant(&ledger, scene_four(), &snapshot, rank, scene_rows(scene_four(), &snapshot, &supply),
                       &target, &granted);
    TEST_ASSERT_TRUE(taper_guard_hand_over_passes(&ledger, scene_four(), &snapshot, &supply, &granted));
}

static void test_at_the_start_a_connector_may_draw_its_maximum_until_old_setpoints_have_expired(void) {
    now_ms = START_ms;
    taper_ledger_init(&ledger, scene_four(), VALIDITY_ms, 1, now_ms);
    wait_ms(EXPIRED_ms - 1);
    TEST_ASSERT_EQUAL_INT32(32000, taper_ledger_may_mA(&ledger, 0));
    TEST_ASSERT_EQUAL_INT32(32000, taper_ledger_told_mA(&ledger, 0));
    wait_ms(1);
    TEST_ASSERT_EQUAL_INT32(0, taper_ledger_may_mA(&ledger, 0));
}

static void test_at_the_start_one_echo_may_be_of_an_earlier_life_and_a_second_one_is_not(void) {
    now_ms = START_ms;
    taper_ledger_init(&ledger, scene_four(), VALIDITY_ms, 1, now_ms);
    send(0, 0, 0);
    send(0, 1, 0);
    hear_echo(0, 0);
    hear_echo(0, 0);
    TEST_ASSERT_EQUAL_INT32(32000, taper_ledger_may_mA(&ledger, 0));
    hear_echo(0, 1);
    TEST_ASSERT_EQUAL_INT32(0, taper_ledger_may_mA(&ledger, 0));
}

static void test_at_the_start_a_connector_that_fell_back_or_is_empty_draws_nothing(void) {
    const taper_evse_status_t empty = {.pilot = TAPER_PILOT_A};
    now_ms = START_ms;
    taper_ledger_init(&ledger, scene_four(), VALIDITY_ms, 1, now_ms);
    hear_fallback(0);
    taper_ledger_hear(&ledger, 1, &empty, now_ms);
    TEST_ASSERT_EQUAL_INT32(0, taper_ledger_may_mA(&ledger, 0));
    TEST_ASSERT_EQUAL_INT32(0, taper_ledger_may_mA(&ledger, 1));
    TEST_ASSERT_EQUAL_INT32(32000, taper_ledger_may_mA(&ledger, 2));
}

static void test_the_highest_open_setpoint_counts_until_a_later_one_is_echoed(void) {
    send(0, 0, 16000);
    send(0, 1, 20000);
    send(0, 2, 6000);
    TEST_ASSERT_EQUAL_INT32(20000, taper_ledger_may_mA(&ledger, 0));
    hear_echo(0, 1);
    TEST_ASSERT_EQUAL_INT32(20000, taper_ledger_may_mA(&ledger, 0));
    hear_echo(0, 2);
    TEST_ASSERT_EQUAL_INT32(6000, taper_ledger_may_mA(&ledger, 0));
    TEST_ASSERT_EQUAL_INT32(0, taper_ledger_may_mA(&ledger, 1));
}

static void test_an_old_echo_proves_nothing_of_what_came_after(void) {
    send(0, 0, 16000);
    send(0, 1, 6000);
    hear_echo(0, 0);
    TEST_ASSERT_EQUAL_INT32(16000, taper_ledger_may_mA(&ledger, 0));
    hear_echo(0, 9); /* never sent */
    TEST_ASSERT_EQUAL_INT32(16000, taper_ledger_may_mA(&ledger, 0));
}

static void test_within_a_millisecond_the_counter_tells_which_setpoint_came_first(void) {
    send(0, 14, 16000);
    send(0, 15, 6000);
    send(0, 0, 12000); /* over the wrap of the counter */
    hear_echo(0, 15);
    TEST_ASSERT_EQUAL_INT32(12000, taper_ledger_may_mA(&ledger, 0));
    hear_echo(0, 0);
    TEST_ASSERT_EQUAL_INT32(12000, taper_ledger_may_mA(&ledger, 0));
    send(0, 1, 0);
    hear_echo(0, 1);
    TEST_ASSERT_EQUAL_INT32(0, taper_ledger_may_mA(&ledger, 0));
}

static void test_within_a_millisecond_the_counter_tells_for_less_than_half_a_turn_of_it(void) {
    for (uint8_t c = 0; c < 8; c++) {
        send(0, c, 16000 - 1000 * c);
    }
    hear_echo(0, 7);
    TEST_ASSERT_EQUAL_INT32(9000, taper_ledger_may_mA(&ledger, 0));
    send(1, 0, 16000);
    send(1, 8, 6000); /* before the other, or after: nobody knows */
    hear_echo(1, 8);
    TEST_ASSERT_EQUAL_INT32(16000, taper_ledger_may_mA(&ledger, 1));
}

static void test_a_setpoint_expires_after_its_validity_and_what_it_may_have_waited(void) {
    send(0, 0, 16000);
    wait_ms(EXPIRED_ms - 1);
    TEST_ASSERT_EQUAL_INT32(16000, taper_ledger_may_mA(&ledger, 0));
    wait_ms(1);
    TEST_ASSERT_EQUAL_INT32(0, taper_ledger_may_mA(&ledger, 0));
}

static void test_fallback_ends_what_cannot_have_crossed_the_report(void) {
    send(0, 0, 16000);
    wait_ms(TAPER_LEDGER_LATE_ms);
    send(0, 1, 10000);
    wait_ms(TAPER_LEDGER_LATE_ms);
    hear_fallback(0);
    TEST_ASSERT_EQUAL_INT32(10000, taper_ledger_may_mA(&ledger, 0));
    wait_ms(TAPER_LEDGER_LATE_ms);
    hear_fallback(0);
    TEST_ASSERT_EQUAL_INT32(0, taper_ledger_may_mA(&ledger, 0));
}

static void test_a_setpoint_does_not_outlive_its_vehicle(void) {
    const taper_evse_status_t pilot_a = {.pilot = TAPER_PILOT_A, .ev_present = true};
    const taper_evse_status_t absent = {.pilot = TAPER_PILOT_B, .ev_present = false};
    send(0, 0, 16000);
    send(1, 0, 16000);
    taper_ledger_hear(&ledger, 0, &pilot_a, now_ms);
    taper_ledger_hear(&ledger, 1, &absent, now_ms);
    TEST_ASSERT_EQUAL_INT32(0, taper_ledger_may_mA(&ledger, 0));
    TEST_ASSERT_EQUAL_INT32(0, taper_ledger_may_mA(&ledger, 1));
}

static void test_what_flows_without_a_vehicle_is_booked_for_as_long_as_it_is_told(void) {
    taper_evse_status_t welded = {.pilot = TAPER_PILOT_A, .current_mA = {16000, TAPER_ABSENT, TAPER_ABSENT}};
    send(0, 3, 16000);
    taper_ledger_hear(&ledger, 0, &welded, now_ms);
    TEST_ASSERT_EQUAL_INT32(16000, taper_ledger_may_mA(&ledger, 0));
    TEST_ASSERT_EQUAL_INT32(0, taper_ledger_told_mA(&ledger, 0));
    welded.current_mA[0] = 0;
    taper_ledger_hear(&ledger, 0, &welded, now_ms);
    TEST_ASSERT_EQUAL_INT32(0, taper_ledger_may_mA(&ledger, 0));
}

static void test_of_sixteen_setpoints_without_an_echo_none_is_sent_over_another(void) {
    for (uint8_t c = 0; c < TAPER_LEDGER_SETPOINTS; c++) {
        TEST_ASSERT_TRUE(taper_ledger_can_send(&ledger, 0, c));
        send(0, c, 1000 + 100 * c);
    }
    TEST_ASSERT_FALSE(taper_ledger_can_send(&ledger, 0, 0));
    TEST_ASSERT_TRUE(taper_ledger_can_send(&ledger, 1, 0));
    TEST_ASSERT_EQUAL_INT32(2500, taper_ledger_may_mA(&ledger, 0));
}

static void test_a_counter_is_free_again_when_no_report_can_name_the_setpoint_that_had_it(void) {
    send(0, 3, 16000);
    wait_ms(EXPIRED_ms + TAPER_LEDGER_LATE_ms - 1);
    TEST_ASSERT_EQUAL_INT32(0, taper_ledger_may_mA(&ledger, 0));
    TEST_ASSERT_FALSE(taper_ledger_can_send(&ledger, 0, 3));
    wait_ms(1);
    TEST_ASSERT_TRUE(taper_ledger_can_send(&ledger, 0, 3));
}

static void test_a_counter_is_free_at_once_when_a_later_one_was_echoed(void) {
    send(0, 3, 16000);
    wait_ms(1);
    send(0, 4, 16000);
    hear_echo(0, 4);
    TEST_ASSERT_TRUE(taper_ledger_can_send(&ledger, 0, 3));
    TEST_ASSERT_FALSE(taper_ledger_can_send(&ledger, 0, 4));
}

static void test_a_counter_is_free_at_once_when_the_connector_fell_back_or_has_no_vehicle(void) {
    const taper_evse_status_t absent = {.pilot = TAPER_PILOT_A};
    send(0, 3, 16000);
    send(1, 3, 16000);
    wait_ms(2 * TAPER_LEDGER_LATE_ms);
    hear_fallback(0);
    taper_ledger_hear(&ledger, 1, &absent, now_ms);
    TEST_ASSERT_TRUE(taper_ledger_can_send(&ledger, 0, 3));
    TEST_ASSERT_TRUE(taper_ledger_can_send(&ledger, 1, 3));
}

static void test_an_increase_gets_no_more_than_the_room_that_is_left(void) {
    send(0, 0, 20000);
    target.current_mA[0] = 6000;
    target.current_mA[1] = 32000;
    grant(9200);                                          /* 40 A */
    TEST_ASSERT_EQUAL_INT32(6000, granted.current_mA[0]); /* a decrease goes out at once */
    TEST_ASSERT_EQUAL_INT32(20000, granted.current_mA[1]);
    send(0, 1, 6000);
    hear_echo(0, 1);
    grant(9200);
    TEST_ASSERT_EQUAL_INT32(32000, granted.current_mA[1]);
}

static void test_what_is_granted_is_at_least_the_minimum_or_nothing(void) {
    send(0, 0, 34500); /* leaves 5.5 A */
    target.current_mA[1] = 10000;
    grant(9200);
    TEST_ASSERT_EQUAL_INT32(0, granted.current_mA[1]);
    snapshot.demand[1].min_mA = 0;
    grant(9200);
    TEST_ASSERT_EQUAL_INT32(5500, granted.current_mA[1]);
}

static void test_rank_decides_who_gets_the_room(void) {
    send(0, 0, 24000);
    target.current_mA[1] = target.current_mA[2] = 16000;
    rank[0] = 2;
    rank[2] = 0;
    grant(9200);
    TEST_ASSERT_EQUAL_INT32(16000, granted.current_mA[2]);
    TEST_ASSERT_EQUAL_INT32(0, granted.current_mA[1]);
}

static void test_a_feeder_holds_its_own_connectors_back_only(void) {
    send(0, 0, 32000); /* left: 20 of 52 A remain */
    target.current_mA[1] = target.current_mA[2] = 26000;
    grant(25000);
    TEST_ASSERT_EQUAL_INT32(20000, granted.current_mA[1]);
    TEST_ASSERT_EQUAL_INT32(26000, granted.current_mA[2]);
}

static void test_while_the_sum_is_above_a_limit_that_fell_nobody_is_told_more_than_last(void) {
    send(0, 0, 20000);
    send(1, 0, 10000);
    target.current_mA[0] = 6000;
    target.current_mA[1] = 12000;
    target.current_mA[2] = 6000;
    grant(5000); /* 30 A may be drawn already, of 21.7 A */
    TEST_ASSERT_EQUAL_INT32(6000, granted.current_mA[0]);
    TEST_ASSERT_EQUAL_INT32(10000, granted.current_mA[1]);
    TEST_ASSERT_EQUAL_INT32(0, granted.current_mA[2]);
    send(0, 1, 6000);
    target.current_mA[0] = 8000; /* it may draw 20 A still, but that has to end */
    grant(5000);
    TEST_ASSERT_EQUAL_INT32(6000, granted.current_mA[0]);
    grant(6900); /* 30 A: exactly what may be drawn */
    TEST_ASSERT_EQUAL_INT32(8000, granted.current_mA[0]);
    TEST_ASSERT_EQUAL_INT32(10000, granted.current_mA[1]);
}

static void test_a_setpoint_that_expired_is_not_told_again_without_room(void) {
    send(0, 0, 20000);
    wait_ms(EXPIRED_ms);
    send(1, 0, 30000);
    target.current_mA[0] = target.current_mA[1] = 20000;
    grant(6900 - 230 / 10); /* 0.1 A less than the 30 A of the other */
    TEST_ASSERT_EQUAL_INT32(0, granted.current_mA[0]);
    TEST_ASSERT_EQUAL_INT32(20000, granted.current_mA[1]);
}

static void test_below_a_row_that_is_overdrawn_who_ran_out_of_setpoints_is_told_nothing(void) {
    taper_ledger_sent(&ledger, 0, 0, 6000, 6000, now_ms);
    wait_ms(EXPIRED_ms); /* he draws 6 A if that arrived, or else nothing */
    send(1, 0, 16000);
    target.current_mA[0] = 6000;
    grant(22 * 230 - 1);
    TEST_ASSERT_EQUAL_INT32(0, granted.current_mA[0]);
    grant(22 * 230);
    TEST_ASSERT_EQUAL_INT32(6000, granted.current_mA[0]);
}

static void test_a_rank_that_names_nobody_or_one_twice_harms_nobody(void) {
    target.current_mA[0] = target.current_mA[1] = 16000;
    rank[0] = 4;
    rank[1] = 0;
    rank[2] = 0;
    rank[3] = TAPER_MAX_CONNECTORS - 1;
    granted.current_mA[4] = 777;
    grant(9200);
    TEST_ASSERT_EQUAL_INT32(777, granted.current_mA[4]);
    TEST_ASSERT_EQUAL_INT32(16000, granted.current_mA[0]);
    TEST_ASSERT_EQUAL_INT32(0, granted.current_mA[1]);
}

static void test_who_is_ranked_twice_takes_its_room_once_and_who_stands_behind_the_last_place_none(void) {
    static const uint8_t longer[5] = {0, 0, 2, 2, 3};
    const taper_supply_t supply = taper_supply_of_W(9200); /* 40 A */
    target.current_mA[0] = 10000;
    target.current_mA[2] = 20000;
    target.current_mA[3] = 10000;
    taper_ledger_grant(&ledger, scene_four(), &snapshot, longer, scene_rows(scene_four(), &snapshot, &supply),
                       &target, &granted);
    TEST_ASSERT_EQUAL_INT32(10000, granted.current_mA[0]);
    TEST_ASSERT_EQUAL_INT32(20000, granted.current_mA[2]);
    TEST_ASSERT_EQUAL_INT32(0, granted.current_mA[3]);
    target.current_mA[2] = 30000;
    taper_ledger_grant(&ledger, scene_four(), &snapshot, longer, scene_rows(scene_four(), &snapshot, &supply),
                       &target, &granted);
    TEST_ASSERT_EQUAL_INT32(30000, granted.current_mA[2]);
}

static void test_what_a_silent_connector_may_draw_counts_by_its_description(void) {
    send(0, 0, 32000);
    snapshot.demand[0] = (taper_demand_t){0};
    target.current_mA[2] = 32000;
    grant(9200);
    TEST_ASSERT_EQUAL_INT32(8000, granted.current_mA[2]);
}

static void test_phases_that_are_not_known_are_booked_when_granting(void) {
    target.current_mA[2] = 16000;
    snapshot.demand[2].booking.W_per_A = 690;
    grant(9200);
    TEST_ASSERT_EQUAL_INT32(13300, granted.current_mA[2]);
}

static void test_the_guard_of_the_hand_over_refuses_what_is_not_paid_for(void) {
    send(0, 0, 20000);
    memset(&granted, 0, sizeof granted);
    granted.current_mA[1] = 20000;
    TEST_ASSERT_TRUE(hand_over_passes(9200));
    granted.current_mA[1] = 20100;
    TEST_ASSERT_FALSE(hand_over_passes(9200));
    granted.current_mA[1] = 0;
    granted.current_mA[0] = 20000; /* above a limit that fell, but no more than it may draw already */
    TEST_ASSERT_TRUE(hand_over_passes(1000));
    granted.current_mA[0] = 20100;
    TEST_ASSERT_FALSE(hand_over_passes(1000));
    granted.current_mA[0] = 0;
    granted.current_mA[2] = granted.current_mA[3] = 26100; /* their feeder, within the site's limit */
    TEST_ASSERT_FALSE(hand_over_passes(25000));
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_at_the_start_a_connector_may_draw_its_maximum_until_old_setpoints_have_expired);
    RUN_TEST(test_at_the_start_one_echo_may_be_of_an_earlier_life_and_a_second_one_is_not);
    RUN_TEST(test_at_the_start_a_connector_that_fell_back_or_is_empty_draws_nothing);
    RUN_TEST(test_the_highest_open_setpoint_counts_until_a_later_one_is_echoed);
    RUN_TEST(test_an_old_echo_proves_nothing_of_what_came_after);
    RUN_TEST(test_within_a_millisecond_the_counter_tells_which_setpoint_came_first);
    RUN_TEST(test_within_a_millisecond_the_counter_tells_for_less_than_half_a_turn_of_it);
    RUN_TEST(test_a_setpoint_expires_after_its_validity_and_what_it_may_have_waited);
    RUN_TEST(test_fallback_ends_what_cannot_have_crossed_the_report);
    RUN_TEST(test_a_setpoint_does_not_outlive_its_vehicle);
    RUN_TEST(test_what_flows_without_a_vehicle_is_booked_for_as_long_as_it_is_told);
    RUN_TEST(test_of_sixteen_setpoints_without_an_echo_none_is_sent_over_another);
    RUN_TEST(test_a_counter_is_free_again_when_no_report_can_name_the_setpoint_that_had_it);
    RUN_TEST(test_a_counter_is_free_at_once_when_a_later_one_was_echoed);
    RUN_TEST(test_a_counter_is_free_at_once_when_the_connector_fell_back_or_has_no_vehicle);
    RUN_TEST(test_an_increase_gets_no_more_than_the_room_that_is_left);
    RUN_TEST(test_what_is_granted_is_at_least_the_minimum_or_nothing);
    RUN_TEST(test_rank_decides_who_gets_the_room);
    RUN_TEST(test_a_feeder_holds_its_own_connectors_back_only);
    RUN_TEST(test_while_the_sum_is_above_a_limit_that_fell_nobody_is_told_more_than_last);
    RUN_TEST(test_a_setpoint_that_expired_is_not_told_again_without_room);
    RUN_TEST(test_below_a_row_that_is_overdrawn_who_ran_out_of_setpoints_is_told_nothing);
    RUN_TEST(test_a_rank_that_names_nobody_or_one_twice_harms_nobody);
    RUN_TEST(test_who_is_ranked_twice_takes_its_room_once_and_who_stands_behind_the_last_place_none);
    RUN_TEST(test_what_a_silent_connector_may_draw_counts_by_its_description);
    RUN_TEST(test_phases_that_are_not_known_are_booked_when_granting);
    RUN_TEST(test_the_guard_of_the_hand_over_refuses_what_is_not_paid_for);
    return UNITY_END();
}
