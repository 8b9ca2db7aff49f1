/* Sessions over a restart of the whole station: what the store kept of them, and what confirms it (fault 29). */
#include <string.h>

#include "fault_bench.h"
#include "unity.h"

#define LIMIT_KW    60.0
#define RESUMES_ms  10000u
#define LATE_ms     11100u /* the store has what was so by then */
#define ACCOUNT_ms  900000u
#define RECORD_HEAD 12u

/** What the field keeps to itself. */
static bool sleeps;    /* vehicles, and with them their parameters */
static double draws_A; /* connector 1, whatever it is told, as long as nobody says stop */

static bool is_of_a_vehicle(uint32_t function) {
    return function == TAPER_MESSAGE_EV_STATUS || function == TAPER_MESSAGE_EV_PARAM_A ||
           function == TAPER_MESSAGE_EV_PARAM_B || function == TAPER_MESSAGE_EV_PARAM_C ||
           function == TAPER_MESSAGE_EV_PARAM_D || function == TAPER_MESSAGE_EV_PARAM_E;
}

static void alter(taper_frame_t *frame) {
    taper_message_t message;
    if (sleeps && is_of_a_vehicle((uint32_t)frame->id >> 6)) {
        frame->id = 0x7FF; /* for nobody */
    }
    if (draws_A > 0.0 && fault_read(frame, &message) && message.kind == TAPER_MESSAGE_EVSE_STATUS &&
        message.node == 1 && message.as.evse_status.ev_present) {
        const bool open = fault_setpoint(1).command == TAPER_COMMAND_STOP;
        message.as.evse_status.current_mA[0] = open ? 0 : (int32_t)(draws_A * 1000.0);
        fault_rewrite(frame, &message);
    }
}

void setUp(void) {
    sleeps = false;
    draws_A = 0.0;
    fault_start(4, LIMIT_KW);
    fault.alter = alter;
    live_bench_run_ms(LATE_ms);
}

void tearDown(void) {
    live_bench_end();
}

static void restart(uint32_t outage_ms) {
    live_bench_kill_station();
    live_bench_run_ms(outage_ms);
    live_bench_revive_station();
    fault_begins();
}

static taper_session_t *session(unsigned connector) {
    return &live.station.sessions.session[connector];
}

static uint32_t stay_ms(unsigned connector) {
    return taper_elapsed_ms(live.now_ms, session(connector)->plugged_in_ms);
}

static void test_row_29_sessions_are_resumed_with_their_stay_and_told_so(void) {
    const uint32_t before_ms = stay_ms(0);
    restart(7000);
    live_bench_run_ms(4000);
    TEST_ASSERT_EQUAL_UINT(4, fault_events(TAPER_EVENT_SESSION_RESUMED));
    TEST_ASSERT_EQUAL_UINT(0, fault_events(TAPER_EVENT_SESSION_BEGUN));
    TEST_ASSERT_EQUAL_INT32(session(3)->used.a.session, fault_last_event(TAPER_EVENT_SESSION_RESUMED)->data);
    TEST_ASSERT_UINT32_WITHIN(1500, before_ms + 11000, stay_ms(0));
    fault_assert_limits_held();
}

static void test_row_29_vehicles_that_sleep_charge_again_within_10_s(void) {
    static const uint32_t outages_ms[] = {0, 1000, 5000, 60000};
    for (unsigned k = 0; k < sizeof outages_ms / sizeof outages_ms[0]; k++) {
        sleeps = true;
        restart(outages_ms[k]);
        live_bench_run_ms(4000); /* what was drawn by old setpoints is over */
        TEST_ASSERT_LESS_THAN_UINT32(RESUMES_ms, 4000 + fault_wait_until_drawn(43.9, RESUMES_ms));
        TEST_ASSERT_EQUAL_UINT(4, fault_events(TAPER_EVENT_SESSION_RESUMED));
        TEST_ASSERT_TRUE(live.station.snapshot.demand[0].soc_estimated);
        TEST_ASSERT_INT32_WITHIN(500, (int32_t)(80000.0 * sim_evse_soc(&live.field.evse[0])),
                                 live.station.snapshot.demand[0].stored_Wh);
        sleeps = false;
        live_bench_run_ms(LATE_ms);
    }
    fault_assert_limits_held();
}

static void test_row_29_a_vehicle_that_came_meanwhile_is_not_taken_for_the_one_before(void) {
    live_bench_kill_station();
    live_bench_run_ms(1000);
    sim_evse_restart(&live.field.evse[1]); /* another number, by whatever cause */
    live_bench_run_ms(1000);
    sleeps = true;
    live_bench_revive_station();
    live_bench_run_ms(20000);
    TEST_ASSERT_EQUAL_UINT(3, fault_events(TAPER_EVENT_SESSION_RESUMED));
    TEST_ASSERT_EQUAL_INT32(0,
                            fault_setpoint(2).current_mA); /* its connector accepts nothing for the old one */
    sleeps = false;
    live_bench_run_ms(4000);
    TEST_ASSERT_EQUAL_UINT(1, fault_events(TAPER_EVENT_SESSION_ENDED));
    TEST_ASSERT_EQUAL_UINT(1, fault_events(TAPER_EVENT_SESSION_BEGUN));
    TEST_ASSERT_EQUAL_UINT8(live.field.evse[1].session, session(1)->used.a.session);
    TEST_ASSERT_LESS_THAN_UINT32(26000, stay_ms(1));
    TEST_ASSERT_LESS_THAN_UINT32(RESUMES_ms, fault_wait_until_drawn(43.9, RESUMES_ms));
    fault_assert_limits_held();
}

static void test_row_29_nobody_gets_current_for_a_session_that_is_only_in_the_store(void) {
    sim_field_kill(&live.field, 0);
    restart(1000);
    live_bench_run_ms(20000);
    TEST_ASSERT_EQUAL_UINT(3, fault_events(TAPER_EVENT_SESSION_RESUMED));
    TEST_ASSERT_EQUAL_INT32(0, fault_setpoint(1).current_mA);
    restart(1000); /* it is still in the store */
    sim_field_revive(&live.field, 0);
    sleeps = true;
    live_bench_run_ms(9000);
    TEST_ASSERT_EQUAL_UINT(4, fault_events(TAPER_EVENT_SESSION_RESUMED));
    fault_assert_limits_held();
}

static void test_row_29_a_vehicle_that_is_locked_out_stays_so(void) {
    draws_A = 30.0;
    for (unsigned s = 0; s < 60 && live.station.draw[0].state != TAPER_DRAW_LOCKED; s++) {
        live_bench_run_ms(1000);
    }
    live_bench_run_ms(LATE_ms);
    for (unsigned k = 0; k < 2; k++) {
        restart(k * 4000u);
        live_bench_run_ms(15000);
        TEST_ASSERT_EQUAL(TAPER_COMMAND_STOP, fault_setpoint(1).command);
        TEST_ASSERT_EQUAL(TAPER_REASON_LOCKED_OUT, taper_station_reason(&live.station, 0));
        TEST_ASSERT_EQUAL_UINT(0, fault_events(TAPER_EVENT_LOCKED_OUT)); /* no news */
    }
    live.session[0].departure_s = sim_field_world_s(&live.field);
    live_bench_run_ms(LATE_ms);
    restart(0);
    live_bench_run_ms(2000);
    TEST_ASSERT_EQUAL(TAPER_DRAW_NORMAL, live.station.draw[0].state);
}

static void test_row_29_the_vehicles_identifier_is_kept_with_its_session(void) {
    strcpy(live.station.transfers.identifier[0], "DE*ABC*E1");
    strcpy(live.station.transfers.identifier[1], "the one before");
    live.station.sessions.changes++;
    live_bench_run_ms(LATE_ms);
    live_bench_kill_station();
    live_bench_run_ms(1000);
    sim_evse_restart(&live.field.evse[1]);
    live_bench_revive_station();
    live_bench_run_ms(4000);
    TEST_ASSERT_EQUAL_STRING("DE*ABC*E1", taper_transfers_identifier(&live.station.transfers, 0));
    TEST_ASSERT_EQUAL_STRING("", taper_transfers_identifier(&live.station.transfers, 1));
}

static void test_row_29_of_another_station_nothing_is_taken_over(void) {
    live.config.name = "another";
    restart(1000);
    live_bench_run_ms(4000);
    TEST_ASSERT_EQUAL_UINT(0, fault_events(TAPER_EVENT_SESSION_RESUMED));
    TEST_ASSERT_EQUAL_UINT(4, fault_events(TAPER_EVENT_SESSION_BEGUN));
    TEST_ASSERT_EQUAL_INT32(16 + TAPER_STORE_STATION, fault_last_event(TAPER_EVENT_STORE_RESET)->data);
    TEST_ASSERT_EQUAL_INT32(1, fault_last_event(TAPER_EVENT_STARTED)->data);
}

/** Put a record into a copy, with the CRC-32 that belongs to it. */
static void forge(unsigned copy, const uint8_t *record, uint32_t length) {
    uint8_t *to = live.bus.store[TAPER_STORE_STATION][copy].data;
    const uint32_t crc = taper_crc32(record, length);
    memcpy(to, record, length);
    for (unsigned i = 0; i < 4; i++) {
        to[length + i] = (uint8_t)(crc >> 8 * i);
    }
    live.bus.store[TAPER_STORE_STATION][copy].written = true;
}

static uint32_t newest_record(uint8_t *record) {
    const uint8_t *from = live.bus.store[TAPER_STORE_STATION][1u - live.station.record.next_copy].data;
    const uint32_t length = RECORD_HEAD + from[4] + 256u * from[5];
    memcpy(record, from, length);
    return length;
}

static void test_row_30_a_record_of_another_layout_is_refused_whole(void) {
    uint8_t record[TAPER_STORE_RECORD_MAX];
    const uint32_t length = newest_record(record);
    record[3]++; /* what a newer image would write */
    for (unsigned copy = 0; copy < TAPER_STORE_COPIES; copy++) {
        forge(copy, record, length);
    }
    restart(1000);
    live_bench_run_ms(4000);
    TEST_ASSERT_EQUAL_UINT(4, fault_events(TAPER_EVENT_SESSION_BEGUN));
    TEST_ASSERT_EQUAL_INT32(16 + TAPER_STORE_STATION, fault_last_event(TAPER_EVENT_STORE_RESET)->data);
    restart(1000);
    live_bench_run_ms(1000);
    TEST_ASSERT_EQUAL_UINT(0, fault_events(TAPER_EVENT_STORE_RESET));
    TEST_ASSERT_EQUAL_UINT(0, fault_events(TAPER_EVENT_STORE_OLD_COPY)); /* the other one is sound, and old */
}

static void test_row_30_whatever_a_record_with_a_right_checksum_says_does_no_harm(void) {
    uint8_t good[TAPER_STORE_RECORD_MAX], record[TAPER_STORE_RECORD_MAX];
    const uint32_t length = newest_record(good);
    uint32_t chance = 1;
    for (unsigned k = 0; k < 300 / TEST_SHARE; k++) {
        memcpy(record, good, length);
        for (unsigned n = 0; n < 20; n++) {
            chance = chance * 1664525u + 1013904223u;
            record[RECORD_HEAD + 4 + (chance >> 8) % (length - RECORD_HEAD - 4)] = (uint8_t)(chance >> 24);
        }
        forge(0, record, length);
        forge(1, record, length);
        restart(0);
        live_bench_run_ms(k % 10 == 0 ? 12000 : 2000);
        fault_assert_limits_held();
    }
}

static void test_row_29_while_nothing_comes_or_goes_the_store_is_written_every_15_minutes(void) {
    const uint32_t before = live.bus.store_writes;
    live_bench_run_ms(2 * ACCOUNT_ms);
    TEST_ASSERT_EQUAL_UINT32(before + 2, live.bus.store_writes);
}

static void test_row_29_without_vehicles_the_store_is_not_written(void) {
    for (unsigned i = 0; i < 4; i++) {
        live.session[i].departure_s = sim_field_world_s(&live.field);
    }
    live_bench_run_ms(2 * LATE_ms);
    const uint32_t before = live.bus.store_writes;
    live_bench_run_ms(2 * ACCOUNT_ms);
    TEST_ASSERT_EQUAL_UINT32(before, live.bus.store_writes);
}

static void test_row_29_who_had_a_turn_has_it_again_where_not_all_have_room(void) {
    tearDown();
    live_options_t options = live_options(10.0); /* two minima of 4.14 kW */
    sim_session_t sessions[4];
    for (unsigned i = 0; i < 4; i++) {
        sessions[i] = live_vehicle(0.0);
    }
    options.as_described = true;
    fault_open(&options, sessions, 4);
    live_bench_run_ms(450000);
    live.station.sessions
        .changes++;            /* so that it is not written because of the time soon after the next switch */
    live_bench_run_ms(460000); /* the first turn of 15 minutes is over, the second one just begun */
    live_bench_run_ms(2 * LATE_ms);
    bool had[4];
    for (unsigned i = 0; i < 4; i++) {
        had[i] = fault_setpoint((uint8_t)(i + 1)).current_mA > 0;
    }
    TEST_ASSERT_TRUE(had[2] && had[3]); /* by laxity alone the first two would be next */
    restart(20000);
    live_bench_run_ms(RESUMES_ms);
    for (unsigned i = 0; i < 4; i++) {
        TEST_ASSERT_EQUAL(had[i], fault_setpoint((uint8_t)(i + 1)).current_mA > 0);
    }
    live_bench_run_ms(830000); /* and no longer than it would have been */
    TEST_ASSERT_TRUE(fault_setpoint(3).current_mA > 0);
    live_bench_run_ms(60000);
    TEST_ASSERT_EQUAL_INT32(0, fault_setpoint(3).current_mA);
    fault_assert_limits_held();
}

static void test_row_29_a_turn_grows_older_while_its_connector_is_awaited(void) {
    sim_field_kill(&live.field, 2);
    restart(30000);
    live_bench_run_ms(60000);
    live.station.sessions.changes++; /* it is written again */
    live_bench_run_ms(LATE_ms);
    restart(30000);
    live_bench_run_ms(2000);
    const taper_turn_kept_t *turn = &live.station.turn_kept[2];
    TEST_ASSERT_TRUE(turn->on);
    TEST_ASSERT_GREATER_THAN_UINT32(90, turn->since_s);
    TEST_ASSERT_UINT32_WITHIN(5, live.now_ms / 1000,
                              turn->since_s +
                                  taper_session_since_kept_s(&live.station.sessions, live.now_ms));
    fault_assert_limits_held();
}

static void test_row_30_a_start_that_could_not_be_written_is_written_later(void) {
    taper_membus_tear_next_write(&live.bus, 30);
    restart(1000);
    live_bench_run_ms(2 * LATE_ms);
    restart(1000);
    live_bench_run_ms(1000);
    TEST_ASSERT_EQUAL_INT32(3, fault_last_event(TAPER_EVENT_STARTED)->data);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_row_29_sessions_are_resumed_with_their_stay_and_told_so);
    RUN_TEST(test_row_29_vehicles_that_sleep_charge_again_within_10_s);
    RUN_TEST(test_row_29_a_vehicle_that_came_meanwhile_is_not_taken_for_the_one_before);
    RUN_TEST(test_row_29_nobody_gets_current_for_a_session_that_is_only_in_the_store);
    RUN_TEST(test_row_29_a_vehicle_that_is_locked_out_stays_so);
    RUN_TEST(test_row_29_the_vehicles_identifier_is_kept_with_its_session);
    RUN_TEST(test_row_29_of_another_station_nothing_is_taken_over);
    RUN_TEST(test_row_30_a_record_of_another_layout_is_refused_whole);
    RUN_TEST(test_row_30_whatever_a_record_with_a_right_checksum_says_does_no_harm);
    RUN_TEST(test_row_29_while_nothing_comes_or_goes_the_store_is_written_every_15_minutes);
    RUN_TEST(test_row_29_without_vehicles_the_store_is_not_written);
    RUN_TEST(test_row_29_who_had_a_turn_has_it_again_where_not_all_have_room);
    RUN_TEST(test_row_29_a_turn_grows_older_while_its_connector_is_awaited);
    RUN_TEST(test_row_30_a_start_that_could_not_be_written_is_written_later);
    return UNITY_END();
}
