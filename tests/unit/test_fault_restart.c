/* A controller that restarts, and the memory that it restarts from: faults 29 and 30 of docs/protocol.md. */
#include "fault_bench.h"
#include "unity.h"

#define LIMIT_KW   30.0
#define RESUMES_ms 10000u

void setUp(void) {
    fault_start(8, LIMIT_KW);
}

void tearDown(void) {
    live_bench_end();
}

/** Power fails in the middle of a session, for `outage_ms`. */
static void restart(uint32_t outage_ms) {
    live_bench_kill_station();
    live_bench_run_ms(outage_ms);
    live_bench_revive_station();
    fault_begins();
}

static void test_row_29_a_restart_mid_session_never_exceeds_the_limit_and_resumes_within_10_s(void) {
    static const uint32_t outages_ms[] = {0, 20, 200, 480, 1000, 2980, 3020, 10000};
    for (unsigned k = 0; k < sizeof outages_ms / sizeof outages_ms[0]; k++) {
        restart(outages_ms[k]);
        TEST_ASSERT_EQUAL(TAPER_MODE_INIT, taper_station_mode(&live.station));
        live_bench_run_ms(4000); /* what the vehicles drew by the old setpoints is over */
        const uint32_t waited_ms = fault_wait_until_drawn(LIMIT_KW - 5.0, RESUMES_ms);
        TEST_ASSERT_LESS_THAN_UINT32(RESUMES_ms, waited_ms + 4000);
        TEST_ASSERT_EQUAL_INT32((int32_t)(k + 2),
                                fault_last_event(TAPER_EVENT_STARTED)->data); /* starts, ever */
        fault_assert_limits_held();
        live_bench_run_ms(10000);
    }
}

static void test_row_29_a_restarted_station_gives_nobody_current_before_it_heard_a_limit(void) {
    sim_field_kill(&live.field, SIM_GATEWAY);
    restart(0);
    while (fault_passed_ms() < 9000) {
        live_bench_run_ms(LIVE_POLL_ms);
        TEST_ASSERT_EQUAL(TAPER_MODE_INIT, taper_station_mode(&live.station));
        for (uint8_t node = 1; node <= 8; node++) {
            TEST_ASSERT_EQUAL_INT32(0, fault_setpoint(node).current_mA);
        }
    }
    TEST_ASSERT_EQUAL(TAPER_REASON_STATION, fault_reason(1));
    live_bench_run_ms(5000); /* the gateway is not waited for longer than 10 s */
    TEST_ASSERT_EQUAL(TAPER_MODE_FAILSAFE, taper_station_mode(&live.station));
    TEST_ASSERT_GREATER_THAN_INT32(0, fault_setpoint(1).current_mA + fault_setpoint(2).current_mA);
    fault_assert_limits_held();
}

static void test_row_29_a_connector_that_was_not_heard_yet_gets_nothing(void) {
    sim_field_kill(&live.field, 0);
    restart(0);
    live_bench_run_ms(RESUMES_ms);
    TEST_ASSERT_EQUAL_INT32(0, fault_setpoint(1).current_mA);
    TEST_ASSERT_DOUBLE_WITHIN(1.0, LIMIT_KW, live.field.tracker.drawn_kw);
    fault_assert_limits_held();
}

/** The gateway sets the failsafe limit, and the station has had time to keep it. */
static void set_failsafe(int32_t failsafe_W) {
    taper_message_t message = {.kind = TAPER_MESSAGE_SITE_LIMIT, .node = TAPER_NODE_GATEWAY};
    message.as.site_limit = (taper_site_limit_t){
        .active = true, .limit_W = 30000, .failsafe_W = failsafe_W, .validity_s = TAPER_ABSENT};
    sim_field_kill(&live.field, SIM_GATEWAY);
    for (unsigned k = 0; k < 12; k++) {
        fault_say(&message);
        live_bench_run_ms(1000);
    }
    TEST_ASSERT_EQUAL_INT32(failsafe_W, live.station.limits.failsafe_W);
}

static void test_row_29_the_gateways_failsafe_limit_survives_a_restart(void) {
    set_failsafe(7000);
    restart(1000);
    live_bench_run_ms(14000);
    TEST_ASSERT_EQUAL(TAPER_MODE_FAILSAFE, taper_station_mode(&live.station));
    TEST_ASSERT_EQUAL_INT32(7000, taper_station_site_limit_W(&live.station));
    TEST_ASSERT_EQUAL_UINT(0, fault_events(TAPER_EVENT_STORE_OLD_COPY));
    TEST_ASSERT_EQUAL_UINT(0, fault_events(TAPER_EVENT_STORE_RESET));
}

static void test_row_29_the_store_is_not_worn_out_by_a_limit_that_changes_all_the_time(void) {
    set_failsafe(7000);
    const uint32_t before = live.bus.store_writes;
    for (int32_t k = 0; k < 5; k++) {
        set_failsafe(7000 + 100 * (k % 2 + 1));
    }
    TEST_ASSERT_LESS_OR_EQUAL_UINT32(before + 7, live.bus.store_writes); /* a minute: once in 10 s */
}

static void test_row_30_of_a_torn_record_the_older_copy_is_used(void) {
    set_failsafe(7000);
    taper_membus_tear_next_write(&live.bus, 40);
    live_bench_kill_station();
    live_bench_revive_station(); /* it writes the record at its start, and power goes */
    live_bench_kill_station();
    live_bench_revive_station();
    live_bench_run_ms(LIVE_POLL_ms);
    TEST_ASSERT_EQUAL_INT32(7000, live.station.limits.failsafe_W);
    TEST_ASSERT_EQUAL_UINT(1, fault_events(TAPER_EVENT_STORE_OLD_COPY));
    TEST_ASSERT_EQUAL_UINT(0, fault_events(TAPER_EVENT_STORE_RESET));
    live_bench_revive_station();
    live_bench_run_ms(LIVE_POLL_ms);
    TEST_ASSERT_EQUAL_UINT(0,
                           fault_events(TAPER_EVENT_STORE_OLD_COPY)); /* mended by the write at the start */
}

static void test_row_30_with_both_copies_bad_the_factorys_failsafe_limit_holds(void) {
    set_failsafe(7000);
    taper_membus_rot(&live.bus, TAPER_STORE_STATION, 0, 40);
    taper_membus_rot(&live.bus, TAPER_STORE_STATION, 1, 3);
    live_bench_revive_station();
    live_bench_run_ms(LIVE_POLL_ms);
    TEST_ASSERT_EQUAL_INT32(11000, live.station.limits.failsafe_W);
    TEST_ASSERT_EQUAL_UINT(1, fault_events(TAPER_EVENT_STORE_RESET));
    sim_field_revive(&live.field, SIM_GATEWAY);
    live_bench_run_ms(4000);
    TEST_ASSERT_LESS_THAN_UINT32(RESUMES_ms, fault_wait_until_drawn(LIMIT_KW - 5.0, RESUMES_ms));
    live_bench_revive_station();
    live_bench_run_ms(LIVE_POLL_ms);
    TEST_ASSERT_EQUAL_UINT(0, fault_events(TAPER_EVENT_STORE_RESET)); /* the reset was written down */
}

/** Bytes of the newest record: its body, 12 before it, 4 behind. */
static uint32_t record_length(void) {
    const uint8_t *bytes = live.bus.store[TAPER_STORE_STATION][1u - live.station.record.next_copy].data;
    return 16u + bytes[4] + 256u * bytes[5];
}

static void test_row_30_every_single_bit_that_rots_is_found(void) {
    set_failsafe(7000);
    live_bench_revive_station(); /* both copies have it */
    live_bench_run_ms(LIVE_POLL_ms);
    for (uint32_t bit = 0; bit < 8 * record_length(); bit++) {
        const unsigned newest = 1u - live.station.record.next_copy;
        taper_membus_rot(&live.bus, TAPER_STORE_STATION, newest, bit);
        live_bench_revive_station();
        live_bench_run_ms(LIVE_POLL_ms);
        TEST_ASSERT_EQUAL_UINT(1, fault_events(TAPER_EVENT_STORE_OLD_COPY));
        TEST_ASSERT_EQUAL_INT32(7000, live.station.limits.failsafe_W);
        live_bench_revive_station(); /* both copies are good again */
        live_bench_run_ms(LIVE_POLL_ms);
    }
}

static void test_row_30_a_write_that_failed_is_tried_again(void) {
    set_failsafe(7000);
    taper_membus_tear_next_write(&live.bus, 0);
    set_failsafe(5000);
    set_failsafe(5000);
    live_bench_revive_station();
    TEST_ASSERT_EQUAL_INT32(5000, live.station.limits.failsafe_W);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_row_29_a_restart_mid_session_never_exceeds_the_limit_and_resumes_within_10_s);
    RUN_TEST(test_row_29_a_restarted_station_gives_nobody_current_before_it_heard_a_limit);
    RUN_TEST(test_row_29_a_connector_that_was_not_heard_yet_gets_nothing);
    RUN_TEST(test_row_29_the_gateways_failsafe_limit_survives_a_restart);
    RUN_TEST(test_row_29_the_store_is_not_worn_out_by_a_limit_that_changes_all_the_time);
    RUN_TEST(test_row_30_of_a_torn_record_the_older_copy_is_used);
    RUN_TEST(test_row_30_with_both_copies_bad_the_factorys_failsafe_limit_holds);
    RUN_TEST(test_row_30_every_single_bit_that_rots_is_found);
    RUN_TEST(test_row_30_a_write_that_failed_is_tried_again);
    return UNITY_END();
}
