/* Identifiers from connectors, the log for a tool, and all of it at once. */
#include <string.h>

#include "transfers_bench.h"
#include "unity.h"

static uint8_t message[64], second_message[64];
static bench_peer_t one, two;
static taper_event_log_t events;

void setUp(void) {
    bench_start();
    memset(&events, 0, sizeof events);
    scene.events = &events;
    bench_open_peer(&one, 0, 1);
    bench_open_peer(&two, 0, 2);
}
void tearDown(void) {}

static uint16_t identifier(uint8_t *bytes, const char *text) {
    const uint16_t length = (uint16_t)strlen(text);
    return bench_seal(bytes, TAPER_TRANSFER_IDENTIFIER, length, text, length);
}

static taper_transfer_result_t tell(bench_peer_t *peer, const char *text) {
    return bench_transfer(peer, message, identifier(message, text));
}

static void assert_identifier(uint8_t index, const char *text) {
    TEST_ASSERT_EQUAL_STRING(text, taper_transfers_identifier(&transfers, index));
}

/** No connector has had the link that they share. */
static void assert_link_free(void) {
    TEST_ASSERT_EQUAL_UINT8(transfers.config->connector_count, transfers.connector_index);
}

static void test_an_identifier_is_kept_for_its_connector(void) {
    assert_identifier(1, "");
    TEST_ASSERT_EQUAL(TAPER_RESULT_IDENTIFIER, tell(&two, "DE*ABC*E123~ 4"));
    TEST_ASSERT_EQUAL_UINT8(1, content.connector);
    bench_answered(&two, TAPER_ANSWER_ACCEPTED);
    assert_identifier(0, "");
    assert_identifier(1, "DE*ABC*E123~ 4");
    TEST_ASSERT_EQUAL_UINT32(1, transfers.accepted);
}

static void test_the_longest_identifier_fits_and_a_shorter_one_replaces_it_whole(void) {
    TEST_ASSERT_EQUAL(TAPER_RESULT_IDENTIFIER, tell(&one, "123456789012345678901234"));
    assert_identifier(0, "123456789012345678901234");
    TEST_ASSERT_EQUAL(TAPER_RESULT_IDENTIFIER, tell(&one, "abcdefghijklmnopqrstuvw"));
    assert_identifier(0, "abcdefghijklmnopqrstuvw");
    TEST_ASSERT_EQUAL(TAPER_RESULT_IDENTIFIER, tell(&one, "A"));
    assert_identifier(0, "A");
    TEST_ASSERT_EQUAL(TAPER_RESULT_REFUSED, tell(&one, "1234567890123456789012345"));
    assert_identifier(0, "A");
    TEST_ASSERT_EQUAL(TAPER_ISOTP_OVERFLOW, taper_isotp_sending(&one.link));
}

static void test_an_empty_identifier_or_a_vehicle_that_leaves_makes_it_forgotten(void) {
    (void)tell(&one, "A");
    TEST_ASSERT_EQUAL(TAPER_RESULT_IDENTIFIER, tell(&one, ""));
    assert_identifier(0, "");
    (void)tell(&one, "B");
    (void)tell(&two, "C");
    taper_transfers_forget(&transfers, 0);
    assert_identifier(0, "");
    assert_identifier(1, "C");
}

static void test_a_connector_that_does_not_exist_has_no_identifier(void) {
    taper_transfers_forget(&transfers, UINT8_MAX);
    taper_transfers_forget(&transfers, TAPER_MAX_CONNECTORS);
    assert_identifier(UINT8_MAX, "");
    assert_identifier(TAPER_MAX_CONNECTORS, "");
}

static void test_what_does_not_print_is_refused_and_the_old_one_stays(void) {
    (void)tell(&one, "OLD");
    for (unsigned byte = 0; byte < 256; byte++) {
        const bool prints = byte >= ' ' && byte <= '~';
        const uint8_t text[] = {'X', (uint8_t)byte, 'Z'};
        const uint16_t length = bench_seal(message, TAPER_TRANSFER_IDENTIFIER, 3, text, 3);
        const taper_transfer_result_t result = bench_transfer(&one, message, length);
        TEST_ASSERT_EQUAL(prints ? TAPER_RESULT_IDENTIFIER : TAPER_RESULT_REFUSED, result);
        bench_answered(&one, prints ? TAPER_ANSWER_ACCEPTED : TAPER_ANSWER_CONTENT);
        if (prints) {
            (void)tell(&one, "OLD");
        }
        assert_identifier(0, "OLD");
    }
}

static void test_a_flipped_byte_is_refused_and_the_old_one_stays(void) {
    (void)tell(&one, "OLD");
    const uint16_t length = identifier(message, "NEW-ONE");
    for (uint16_t i = 0; i < length; i++) {
        message[i] ^= 0x04u;
        TEST_ASSERT_EQUAL(TAPER_RESULT_REFUSED, bench_transfer(&one, message, length));
        bench_answered(&one, TAPER_ANSWER_CRC);
        message[i] ^= 0x04u;
        assert_identifier(0, "OLD");
    }
}

static void test_a_connector_may_not_send_a_curve(void) {
    const uint16_t length = bench_seal(message, TAPER_TRANSFER_LIMIT_CURVE, 0, "", 0);
    TEST_ASSERT_EQUAL(TAPER_RESULT_REFUSED, bench_transfer(&one, message, length));
    bench_answered(&one, TAPER_ANSWER_VERSION);
}

static void test_strangers_are_not_heard(void) {
    bench_peer_t strangers[3];
    bench_open_peer(&strangers[0], 0, 5); /* the station has four connectors */
    bench_open_peer(&strangers[1], 1, 1);
    bench_open_peer(&strangers[2], 1, TAPER_NODE_GATEWAY);
    for (unsigned k = 0; k < 3; k++) {
        TEST_ASSERT_EQUAL(TAPER_RESULT_NONE, tell(&strangers[k], "A"));
        TEST_ASSERT_EQUAL(TAPER_ISOTP_TIMEOUT, taper_isotp_sending(&strangers[k].link));
    }
    TEST_ASSERT_EQUAL_UINT32(0, transfers.refused);
}

static void test_frames_of_other_functions_are_left_alone(void) {
    taper_frame_t frame = {.bus = 0, .length = 8, .data = {0x01, 0x55}};
    for (unsigned id = 0; id < 0x800; id++) {
        if (id >> 6 != TAPER_MESSAGE_ISOTP_FROM) {
            frame.id = (uint16_t)id;
            TEST_ASSERT_EQUAL(TAPER_RESULT_NONE, taper_transfers_take(&transfers, &frame, &scene, &content));
        }
    }
    frame.id = 0x640; /* the controller itself */
    TEST_ASSERT_EQUAL(TAPER_RESULT_NONE, taper_transfers_take(&transfers, &frame, &scene, &content));
    TEST_ASSERT_EQUAL_UINT32(0, transfers.refused);
    TEST_ASSERT_FALSE(bench_to_peer(&one));
    assert_link_free();
}

static void test_nodes_of_the_same_number_on_two_buses_are_two_connectors(void) {
    taper_connector_config_t connectors[4];
    taper_station_config_t station = *transfers.config;
    memcpy(connectors, station.connectors, sizeof connectors);
    connectors[2].bus = 1;
    connectors[2].node = 1;
    station.connectors = connectors;
    taper_transfers_init(&transfers, &station);
    bench_open_peer(&two, 1, 1);
    TEST_ASSERT_EQUAL(TAPER_RESULT_IDENTIFIER, tell(&one, "ON-BUS-0"));
    TEST_ASSERT_EQUAL(TAPER_RESULT_IDENTIFIER, tell(&two, "ON-BUS-1"));
    TEST_ASSERT_EQUAL_UINT8(2, content.connector);
    bench_answered(&two, TAPER_ANSWER_ACCEPTED);
    assert_identifier(0, "ON-BUS-0");
    assert_identifier(2, "ON-BUS-1");
}

static void test_a_second_connector_is_not_heard_until_the_first_is_answered(void) {
    taper_transfer_result_t result = TAPER_RESULT_NONE;
    bench_send(&one, message, identifier(message, "FIRST"));
    TEST_ASSERT_TRUE(bench_from_peer(&one, &result));
    bench_send(&two, second_message, identifier(second_message, "SECOND"));
    TEST_ASSERT_TRUE(bench_from_peer(&two, &result));
    TEST_ASSERT_EQUAL(TAPER_RESULT_IDENTIFIER, bench_settle(&one));
    bench_answered(&one, TAPER_ANSWER_ACCEPTED);
    assert_identifier(0, "FIRST");
    assert_identifier(1, "");
    scene.now_ms += 1001;
    TEST_ASSERT_FALSE(bench_from_peer(&two, &result));
    TEST_ASSERT_EQUAL(TAPER_ISOTP_TIMEOUT, taper_isotp_sending(&two.link));
    TEST_ASSERT_EQUAL(TAPER_RESULT_IDENTIFIER, tell(&two, "SECOND"));
    assert_identifier(1, "SECOND");
}

static void test_a_connector_that_falls_silent_frees_the_link_after_its_timeout(void) {
    taper_transfer_result_t result = TAPER_RESULT_NONE;
    bench_send(&one, message, identifier(message, "FIRST"));
    TEST_ASSERT_TRUE(bench_from_peer(&one, &result));
    TEST_ASSERT_TRUE(bench_to_peer(&one));
    scene.now_ms += 1001;
    TEST_ASSERT_FALSE(bench_to_peer(&one));
    TEST_ASSERT_EQUAL_UINT32(1, transfers.refused);
    TEST_ASSERT_EQUAL(TAPER_RESULT_IDENTIFIER, tell(&two, "SECOND"));
    assert_identifier(0, "");
}

static void test_stray_frames_do_not_take_the_link(void) {
    taper_frame_t frame = {.id = 0x641, .bus = 0, .length = 8};
    const uint8_t kinds[] = {0x20, 0x30, 0x40, 0xFF};
    for (unsigned k = 0; k < sizeof kinds; k++) {
        frame.data[0] = kinds[k];
        TEST_ASSERT_EQUAL(TAPER_RESULT_NONE, taper_transfers_take(&transfers, &frame, &scene, &content));
    }
    frame.length = 0;
    frame.data[0] = 0x01;
    (void)taper_transfers_take(&transfers, &frame, &scene, &content);
    assert_link_free();
}

static void note(uint32_t k) {
    events.event[events.count % TAPER_EVENTS] = (taper_event_t){.time_ms = 0x01020300u + k,
                                                                .unix_s = 0x65000000u + k,
                                                                .data = -1 - (int32_t)k,
                                                                .code = (uint8_t)k,
                                                                .bus = 3,
                                                                .node = 60};
    events.count++;
}

static void request_log(void) {
    const uint16_t length = bench_seal(message, TAPER_TRANSFER_LOG_REQUEST, 0, "", 0);
    TEST_ASSERT_EQUAL(TAPER_RESULT_NONE, bench_transfer(&tool, message, length));
}

static void assert_log(uint16_t count, uint8_t oldest) {
    static uint8_t items[TAPER_EVENTS * 16], expected[TAPER_EVENTS * 16 + 8];
    for (uint16_t k = 0; k < count; k++) {
        const uint8_t n = (uint8_t)(oldest + k);
        const uint8_t item[16] = {n,    3,    2,    1, n, 0,  0, 0x65, (uint8_t)(0xFF - n),
                                  0xFF, 0xFF, 0xFF, n, 3, 60, 0};
        memcpy(items + k * 16u, item, sizeof item);
    }
    const uint16_t length = bench_seal(expected, TAPER_TRANSFER_LOG, count, items, (uint16_t)(count * 16u));
    uint16_t got = 0;
    TEST_ASSERT_EQUAL(TAPER_ISOTP_DONE, taper_isotp_received(&tool.link, &got));
    TEST_ASSERT_EQUAL_UINT16(length, got);
    TEST_ASSERT_EQUAL_HEX8_ARRAY(expected, tool.buffer, length);
}

static void test_the_log_is_sent_oldest_first(void) {
    request_log();
    assert_log(0, 0);
    note(0);
    note(1);
    note(2);
    request_log();
    assert_log(3, 0);
    TEST_ASSERT_EQUAL_UINT32(2, transfers.accepted);
}

static void test_of_a_full_log_the_newest_events_are_sent(void) {
    for (uint32_t k = 0; k < TAPER_EVENTS; k++) {
        note(k);
    }
    (void)tell(&one, "STAYS");
    request_log();
    assert_identifier(0, "STAYS"); /* it lies next to the log */
    assert_log(TAPER_EVENTS, 0);
    for (uint32_t k = 0; k < 37; k++) {
        note(TAPER_EVENTS + k);
    }
    request_log();
    assert_log(TAPER_EVENTS, 37);
}

static void test_the_log_on_its_way_does_not_change_with_new_events(void) {
    taper_transfer_result_t result = TAPER_RESULT_NONE;
    note(0);
    note(1);
    bench_send(&tool, message, bench_seal(message, TAPER_TRANSFER_LOG_REQUEST, 0, "", 0));
    while (taper_isotp_sending(&tool.link) == TAPER_ISOTP_BUSY) {
        (void)bench_from_peer(&tool, &result);
        (void)bench_to_peer(&tool);
    }
    note(2);
    events.event[0].code = 99;
    (void)bench_settle(&tool);
    assert_log(2, 0);
}

static void test_a_new_request_ends_the_log_that_nobody_takes(void) {
    taper_transfer_result_t result = TAPER_RESULT_NONE;
    note(0);
    bench_send(&tool, message, bench_seal(message, TAPER_TRANSFER_LOG_REQUEST, 0, "", 0));
    while (taper_isotp_sending(&transfers.tool) != TAPER_ISOTP_BUSY) {
        (void)bench_from_peer(&tool, &result);
        (void)bench_to_peer(&tool);
    }
    note(1);
    request_log();
    assert_log(2, 0);
}

static void test_a_tool_is_told_what_is_wrong(void) {
    const uint16_t length = bench_seal(message, TAPER_TRANSFER_LOG_REQUEST, 0, "", 0);
    message[7] ^= 1u;
    TEST_ASSERT_EQUAL(TAPER_RESULT_REFUSED, bench_transfer(&tool, message, length));
    bench_answered(&tool, TAPER_ANSWER_CRC);
    TEST_ASSERT_EQUAL(
        TAPER_RESULT_REFUSED,
        bench_transfer(&tool, message, bench_seal(message, TAPER_TRANSFER_LOG_REQUEST, 1, "", 0)));
    bench_answered(&tool, TAPER_ANSWER_CRC);
    TEST_ASSERT_EQUAL(
        TAPER_RESULT_REFUSED,
        bench_transfer(&tool, message, bench_seal(message, TAPER_TRANSFER_LIMIT_CURVE, 0, "", 0)));
    bench_answered(&tool, TAPER_ANSWER_VERSION);
    TEST_ASSERT_EQUAL_UINT32(3, transfers.refused);
}

static void test_a_frame_that_does_not_leave_does_not_block_the_others(void) {
    taper_transfer_result_t result = TAPER_RESULT_NONE;
    uint8_t curve_message[32];
    const uint32_t at[] = {BENCH_UNIX_s + 1};
    const uint16_t watts[] = {1};
    bench_send(&gateway, curve_message, bench_curve(curve_message, 1, at, watts));
    TEST_ASSERT_TRUE(bench_from_peer(&gateway, &result));
    bench_send(&one, message, identifier(message, "FIRST"));
    TEST_ASSERT_TRUE(bench_from_peer(&one, &result));
    taper_frame_t frame;
    for (int k = 0; k < 3; k++) { /* only the connector's is ever sent, and each has its turn */
        TEST_ASSERT_TRUE(taper_transfers_next(&transfers, scene.now_ms, &frame));
        TEST_ASSERT_EQUAL_HEX16(k == 1 ? 0x601 : 0x63E, frame.id);
        if (frame.id == 0x601) {
            taper_transfers_sent(&transfers, &frame, scene.now_ms);
        }
    }
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_an_identifier_is_kept_for_its_connector);
    RUN_TEST(test_the_longest_identifier_fits_and_a_shorter_one_replaces_it_whole);
    RUN_TEST(test_an_empty_identifier_or_a_vehicle_that_leaves_makes_it_forgotten);
    RUN_TEST(test_a_connector_that_does_not_exist_has_no_identifier);
    RUN_TEST(test_what_does_not_print_is_refused_and_the_old_one_stays);
    RUN_TEST(test_a_flipped_byte_is_refused_and_the_old_one_stays);
    RUN_TEST(test_a_connector_may_not_send_a_curve);
    RUN_TEST(test_strangers_are_not_heard);
    RUN_TEST(test_frames_of_other_functions_are_left_alone);
    RUN_TEST(test_nodes_of_the_same_number_on_two_buses_are_two_connectors);
    RUN_TEST(test_a_second_connector_is_not_heard_until_the_first_is_answered);
    RUN_TEST(test_a_connector_that_falls_silent_frees_the_link_after_its_timeout);
    RUN_TEST(test_stray_frames_do_not_take_the_link);
    RUN_TEST(test_the_log_is_sent_oldest_first);
    RUN_TEST(test_of_a_full_log_the_newest_events_are_sent);
    RUN_TEST(test_the_log_on_its_way_does_not_change_with_new_events);
    RUN_TEST(test_a_new_request_ends_the_log_that_nobody_takes);
    RUN_TEST(test_a_tool_is_told_what_is_wrong);
    RUN_TEST(test_a_frame_that_does_not_leave_does_not_block_the_others);
    return UNITY_END();
}
