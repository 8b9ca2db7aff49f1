/* Which fallback currents go out with the setpoints. scene_four(): 230 V, 6..32 A; configured here 10, 10, 8 and 6 A. */
#include <string.h>

#include "scene.h"
#include "taper/ledger.h"
#include "unity.h"

#define VALIDITY_ms 3000u
#define EXPIRED_ms  (VALIDITY_ms + TAPER_LEDGER_LATE_ms)
#define START_ms    (UINT32_MAX - 1000u)

static taper_connector_config_t connectors[5]; /* the last one is not there */
static taper_station_config_t config;
static taper_ledger_t ledger;
static taper_snapshot_t snapshot;
static taper_setpoints_t granted, fallback;
static uint8_t rank[4];
static uint8_t counter[4];
static uint32_t now_ms;

static const taper_evse_status_t empty = {.pilot = TAPER_PILOT_A};

void setUp(void) {
    const int32_t configured_mA[4] = {10000, 10000, 8000, 6000};
    now_ms = START_ms;
    memcpy(connectors, scene_four()->connectors, 4 * sizeof connectors[0]);
    connectors[4] = connectors[0];
    connectors[4].fallback_mA = 10000;
    config = *scene_four();
    config.connectors = connectors;
    snapshot = scene_snapshot(now_ms, 4);
    for (uint8_t i = 0; i < 4; i++) {
        connectors[i].fallback_mA = configured_mA[i];
        granted.current_mA[i] = 32000;
        rank[i] = i;
        counter[i] = 0;
    }
    taper_ledger_init(&ledger, &config, VALIDITY_ms, 1, now_ms);
    for (uint8_t i = 0; i < 4; i++) {
        taper_ledger_hear(&ledger, i, &empty, now_ms); /* nothing of an earlier life is left */
    }
}
void tearDown(void) {}

static const taper_supply_t supply; /* what the site may have now does not matter */

/** In tenths of an ampere at 230 V. */
static int32_t W_of_dA(int32_t current_dA) {
    return current_dA * 23;
}

static void choose(int32_t failsafe_W) {
    memset(&fallback, 0x55, sizeof fallback);
    fallback.current_mA[4] = 0;
    taper_ledger_grant_fallback(&ledger, &config, &snapshot, scene_rows(&config, &snapshot, &supply), rank,
                                failsafe_W, &granted, &fallback);
    TEST_ASSERT_TRUE(
        taper_guard_fallback_passes(&ledger, &config, &snapshot, failsafe_W, &granted, &fallback));
}

static void send(uint8_t i) {
    taper_ledger_sent(&ledger, i, counter[i], granted.current_mA[i], fallback.current_mA[i], now_ms);
}

static void echo(uint8_t i) {
    const taper_evse_status_t status = {
        .pilot = TAPER_PILOT_C, .ev_present = true, .setpoint_echo = counter[i]};
    taper_ledger_hear(&ledger, i, &status, now_ms);
    counter[i]++;
}

static void send_and_echo_all(void) {
    for (uint8_t i = 0; i < 4; i++) {
        send(i);
        echo(i);
    }
    now_ms++;
}

static void assert_chosen(int32_t mA_0, int32_t mA_1, int32_t mA_2, int32_t mA_3) {
    TEST_ASSERT_EQUAL_INT32(mA_0, fallback.current_mA[0]);
    TEST_ASSERT_EQUAL_INT32(mA_1, fallback.current_mA[1]);
    TEST_ASSERT_EQUAL_INT32(mA_2, fallback.current_mA[2]);
    TEST_ASSERT_EQUAL_INT32(mA_3, fallback.current_mA[3]);
}

static void test_with_room_for_all_everybody_has_the_configured_one(void) {
    choose(W_of_dA(340));
    assert_chosen(10000, 10000, 8000, 6000);
}

static void test_rank_decides_who_has_it_and_the_last_one_gets_what_is_left_or_nothing(void) {
    choose(W_of_dA(340) - 1);
    assert_chosen(10000, 10000, 8000, 0);
    choose(W_of_dA(265));
    assert_chosen(10000, 10000, 6500, 0);
    choose(W_of_dA(265) - 1);
    assert_chosen(10000, 10000, 6000, 0);
    choose(W_of_dA(260) - 1);
    assert_chosen(10000, 10000, 0, 0);
    rank[0] = 3;
    rank[3] = 0;
    choose(W_of_dA(340) - 1);
    assert_chosen(9500, 10000, 8000, 6000);
    choose(W_of_dA(299));
    assert_chosen(0, 10000, 8000, 6000);
}

static void test_who_cannot_have_its_minimum_leaves_the_room_to_the_next(void) {
    choose(W_of_dA(60));
    assert_chosen(6000, 0, 0, 0);
    connectors[0].min_mA = 7000;
    choose(W_of_dA(60));
    assert_chosen(0, 6000, 0, 0);
    connectors[0].min_mA = 6000;
    snapshot.demand[0].min_mA = 6001;
    choose(W_of_dA(60));
    assert_chosen(0, 6000, 0, 0);
}

static void test_without_a_failsafe_limit_nobody_has_any(void) {
    choose(0);
    assert_chosen(0, 0, 0, 0);
    choose(-1);
    assert_chosen(0, 0, 0, 0);
    connectors[0].voltage_mV = 1000; /* not even the least there is: 0.5 A of 1 V */
    connectors[0].min_mA = 0;
    snapshot.demand[0] = (taper_demand_t){0};
    choose(0);
    assert_chosen(0, 0, 0, 0);
}

static void test_it_is_never_above_what_is_granted(void) {
    granted.current_mA[0] = 0;
    granted.current_mA[1] = 6000;
    granted.current_mA[2] = 7900;
    choose(10000);
    assert_chosen(0, 6000, 7500, 6000);
}

static void test_it_is_a_whole_number_of_steps_of_the_wire_and_no_more_than_the_wire_holds(void) {
    connectors[0].fallback_mA = 7499;
    connectors[1].fallback_mA = 200000;
    granted.current_mA[1] = 200000;
    connectors[2].min_mA = snapshot.demand[2].min_mA = 7600;
    connectors[2].fallback_mA = 7900;
    choose(100000);
    assert_chosen(7000, 127000, 0, 6000);
}

static void test_who_may_still_be_told_an_old_one_counts_with_it(void) {
    choose(W_of_dA(340));
    send_and_echo_all();
    granted.current_mA[0] = 0; /* told, not echoed: 10 A count still */
    choose(W_of_dA(340));
    assert_chosen(0, 10000, 8000, 6000);
    send(0);
    connectors[3].fallback_mA = 16000;
    choose(W_of_dA(340));
    assert_chosen(0, 10000, 8000, 6000);
    echo(0);
    choose(W_of_dA(340));
    assert_chosen(0, 10000, 8000, 16000);
}

static void test_a_silent_connector_counts_with_what_it_was_told_last_for_ever(void) {
    choose(W_of_dA(340));
    send_and_echo_all();
    now_ms += EXPIRED_ms;
    taper_ledger_update(&ledger, now_ms);
    now_ms += 3600000;
    taper_ledger_update(&ledger, now_ms);
    granted.current_mA[3] = 0;
    snapshot.demand[3] = (taper_demand_t){0};
    connectors[0].fallback_mA = 16000;
    choose(W_of_dA(340));
    assert_chosen(10000, 10000, 8000, 0);
    taper_ledger_hear(&ledger, 3, &empty, now_ms);
    choose(W_of_dA(340));
    assert_chosen(16000, 10000, 8000, 0);
}

static void test_what_was_told_stays_whatever_the_rank_becomes(void) {
    choose(W_of_dA(200));
    assert_chosen(10000, 10000, 0, 0);
    send_and_echo_all();
    rank[0] = 3;
    rank[1] = 2;
    rank[2] = 1;
    rank[3] = 0;
    choose(W_of_dA(200));
    assert_chosen(10000, 10000, 0, 0);
    choose(W_of_dA(260));
    assert_chosen(10000, 10000, 0, 6000);
}

static void test_when_the_failsafe_limit_falls_the_last_of_the_rank_lose_it_once_all_gave_up(void) {
    choose(W_of_dA(340));
    send_and_echo_all();
    choose(W_of_dA(264));
    assert_chosen(0, 0, 0, 0);
    send_and_echo_all();
    choose(W_of_dA(264)); /* all that counts is what was told now */
    assert_chosen(10000, 10000, 6000, 0);
    choose(W_of_dA(265));
    assert_chosen(10000, 10000, 6500, 0);
}

static void test_while_the_sum_is_above_the_limit_nobody_is_told_any(void) {
    choose(W_of_dA(340));
    send_and_echo_all();
    choose(W_of_dA(180));
    assert_chosen(0, 0, 0, 0);
    for (uint8_t i = 0; i < 4; i++) {
        send(i);
    }
    choose(W_of_dA(340) - 1); /* nothing was echoed: 34 A may still be told */
    assert_chosen(0, 0, 0, 0);
    choose(W_of_dA(340)); /* no more than counts already */
    assert_chosen(10000, 10000, 8000, 6000);
}

static void test_after_a_start_what_an_earlier_life_told_counts_until_it_is_heard_to_be_over(void) {
    taper_ledger_init(&ledger, &config, VALIDITY_ms, 1, now_ms);
    choose(W_of_dA(340) - 1);
    assert_chosen(0, 0, 0, 0);
    choose(W_of_dA(340));
    assert_chosen(10000, 10000, 8000, 6000);
    taper_ledger_hear(&ledger, 0, &empty, now_ms);
    choose(W_of_dA(300));
    assert_chosen(6000, 10000, 8000, 6000);
}

static void test_power_counts_as_it_is_booked(void) {
    snapshot.demand[0].booking.W_per_A = 690; /* its phases are not known */
    snapshot.demand[1].W_per_A = 250;
    choose(690 * 10 + 250 * 10 + 230 * 7);
    assert_chosen(10000, 10000, 7000, 0);
}

static void test_a_rank_that_names_nobody_or_one_twice_harms_nobody(void) {
    rank[0] = 4;
    rank[1] = rank[2] = 1;
    rank[3] = UINT8_MAX;
    choose(W_of_dA(340));
    assert_chosen(0, 10000, 0, 0);
    send_and_echo_all();
    choose(W_of_dA(100));
    assert_chosen(0, 10000, 0, 0);
    TEST_ASSERT_EQUAL_INT32(0, fallback.current_mA[4]);
}

static void test_who_is_not_there_is_left_alone(void) {
    rank[0] = 4;
    granted.current_mA[4] = 32000;
    ledger.entry[4].last_fallback_mA = 10000;
    choose(10000);
    TEST_ASSERT_EQUAL_INT32(0, fallback.current_mA[4]);
    fallback.current_mA[4] = 777;
    taper_ledger_grant_fallback(&ledger, &config, &snapshot, scene_rows(&config, &snapshot, &supply), rank, 0,
                                &granted, &fallback);
    TEST_ASSERT_EQUAL_INT32(777, fallback.current_mA[4]);
}

static void test_what_is_not_there_takes_no_room_and_nobody_stands_behind_the_last_place(void) {
    static const uint8_t longer[5] = {0, 1, 2, 2, 3};
    ledger.entry[4].over_fallback_mA = 10000;
    choose(W_of_dA(340));
    assert_chosen(10000, 10000, 8000, 6000);
    send_and_echo_all();
    taper_ledger_grant_fallback(&ledger, &config, &snapshot, scene_rows(&config, &snapshot, &supply), longer,
                                W_of_dA(340), &granted, &fallback);
    assert_chosen(10000, 10000, 8000, 0);
}

static void test_a_connector_that_costs_nothing_is_bounded_by_nothing(void) {
    connectors[0].voltage_mV = 0;
    snapshot.demand[0] = (taper_demand_t){0};
    choose(0);
    assert_chosen(10000, 0, 0, 0);
}

/** Whatever is granted, echoed or lost: the sum never rises above the limit, and what is chosen is allowed. */
static void test_whatever_happens_the_sum_is_within_a_constant_limit(void) {
    uint32_t state = 0xfa11;
    uint64_t told_mA = 0;
    for (int k = 0; k < 100000; k++) {
        now_ms += scene_random(&state) % 700;
        taper_ledger_update(&ledger, now_ms);
        for (uint8_t i = 0; i < 4; i++) {
            granted.current_mA[i] = (int32_t)(scene_random(&state) % 160) * 100;
            rank[i] = (uint8_t)(scene_random(&state) % 4);
        }
        choose(W_of_dA(220));
        for (uint8_t i = 0; i < 4; i++) {
            if (taper_ledger_can_send(&ledger, i, counter[i])) {
                send(i);
                if (scene_random(&state) % 3 != 0) {
                    echo(i);
                } else {
                    counter[i]++;
                }
                counter[i] &= 15;
            }
            TEST_ASSERT_TRUE(fallback.current_mA[i] == 0 || fallback.current_mA[i] >= 6000);
            TEST_ASSERT_LESS_OR_EQUAL_INT32(connectors[i].fallback_mA, fallback.current_mA[i]);
            told_mA += (uint64_t)fallback.current_mA[i];
        }
        int32_t sum_mA = 0;
        for (uint8_t i = 0; i < 4; i++) {
            sum_mA += taper_ledger_fallback_mA(&ledger, i);
        }
        TEST_ASSERT_LESS_OR_EQUAL_INT32(22000, sum_mA);
    }
    TEST_ASSERT_GREATER_THAN_UINT64(UINT64_C(100000) * 5000, told_mA); /* and not by telling nothing */
}

static void test_when_the_failsafe_limit_falls_who_can_be_reached_gives_up_for_who_cannot(void) {
    choose(W_of_dA(340));
    send_and_echo_all();
    for (uint8_t i = 0; i < 2;
         i++) { /* the other two do not answer, and their setpoints did not run out yet */
        choose(W_of_dA(160));
        assert_chosen(0, 0, 0, 0);
        send(i);
        echo(i);
    }
    choose(W_of_dA(140) - 1);
    assert_chosen(0, 0, 0, 0);
    choose(W_of_dA(140)); /* what they hold fits by now */
    assert_chosen(0, 0, 8000, 6000);
}

static void test_after_a_bus_that_was_off_each_that_is_reached_gives_up_until_the_rest_fits(void) {
    choose(W_of_dA(340));
    send_and_echo_all();
    now_ms += EXPIRED_ms;
    taper_ledger_update(&ledger, now_ms);
    for (uint8_t i = 0; i < 2; i++) {
        choose(W_of_dA(160));
        assert_chosen(0, 0, 0, 0);
        send(i);
        echo(i);
    }
    choose(W_of_dA(160));
    assert_chosen(0, 0, 8000, 6000);
}

static void test_who_cannot_be_reached_and_is_told_less_frees_nothing_before_he_is_heard(void) {
    choose(W_of_dA(340));
    send_and_echo_all();
    now_ms += EXPIRED_ms;
    taper_ledger_update(&ledger, now_ms);
    granted.current_mA[0] = 6000;
    connectors[1].fallback_mA = 14000;
    choose(W_of_dA(340));
    assert_chosen(6000, 10000, 8000, 6000);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_with_room_for_all_everybody_has_the_configured_one);
    RUN_TEST(test_rank_decides_who_has_it_and_the_last_one_gets_what_is_left_or_nothing);
    RUN_TEST(test_who_cannot_have_its_minimum_leaves_the_room_to_the_next);
    RUN_TEST(test_without_a_failsafe_limit_nobody_has_any);
    RUN_TEST(test_it_is_never_above_what_is_granted);
    RUN_TEST(test_it_is_a_whole_number_of_steps_of_the_wire_and_no_more_than_the_wire_holds);
    RUN_TEST(test_who_may_still_be_told_an_old_one_counts_with_it);
    RUN_TEST(test_a_silent_connector_counts_with_what_it_was_told_last_for_ever);
    RUN_TEST(test_what_was_told_stays_whatever_the_rank_becomes);
    RUN_TEST(test_when_the_failsafe_limit_falls_the_last_of_the_rank_lose_it_once_all_gave_up);
    RUN_TEST(test_while_the_sum_is_above_the_limit_nobody_is_told_any);
    RUN_TEST(test_after_a_start_what_an_earlier_life_told_counts_until_it_is_heard_to_be_over);
    RUN_TEST(test_power_counts_as_it_is_booked);
    RUN_TEST(test_a_rank_that_names_nobody_or_one_twice_harms_nobody);
    RUN_TEST(test_who_is_not_there_is_left_alone);
    RUN_TEST(test_what_is_not_there_takes_no_room_and_nobody_stands_behind_the_last_place);
    RUN_TEST(test_a_connector_that_costs_nothing_is_bounded_by_nothing);
    RUN_TEST(test_whatever_happens_the_sum_is_within_a_constant_limit);
    RUN_TEST(test_when_the_failsafe_limit_falls_who_can_be_reached_gives_up_for_who_cannot);
    RUN_TEST(test_after_a_bus_that_was_off_each_that_is_reached_gives_up_until_the_rest_fits);
    RUN_TEST(test_who_cannot_be_reached_and_is_told_less_frees_nothing_before_he_is_heard);
    return UNITY_END();
}
