/* The messages that drive a board: golden bytes written by hand, and every message there and back. */
#include "taper/drive.h"
#include "taper/slcan.h"
#include "unity.h"

void setUp(void) {}

void tearDown(void) {}

/** What becomes of a message on the wire. */
static taper_slcan_message_t over_the_wire(taper_slcan_message_t message) {
    char line[TAPER_SLCAN_LINE];
    taper_slcan_message_t back;
    const size_t length = taper_slcan_encode(&message, line);
    TEST_ASSERT_TRUE(length > 0);
    TEST_ASSERT_TRUE(taper_slcan_decode(line, length - 1, &back));
    return back;
}

static void assert_kind(uint8_t kind, uint8_t index, const taper_slcan_message_t *message) {
    uint8_t got_kind = 0;
    uint8_t got_index = 0;
    TEST_ASSERT_TRUE(taper_drive_split(message, &got_kind, &got_index));
    TEST_ASSERT_EQUAL_HEX8(kind, got_kind);
    TEST_ASSERT_EQUAL_HEX8(index, got_index);
}

static void assert_line(const char *expected, taper_slcan_message_t message) {
    char line[TAPER_SLCAN_LINE + 1];
    const size_t length = taper_slcan_encode(&message, line);
    line[length] = '\0';
    TEST_ASSERT_EQUAL_STRING(expected, line);
}

static void test_golden_lines(void) {
    const taper_drive_setup_t setup = {.tick_ms = 1000,
                                       .iterations_per_tick = 50,
                                       .policy = TAPER_DRIVE_LLF,
                                       .min_mA = 6000,
                                       .price_weight_permille = TAPER_ABSENT};
    const taper_drive_done_t done = {
        .ok = true, .is_settled = true, .planned = true, .mode = 2, .plans = 0x1234, .instructions = 48000};
    assert_line("T1FFF0400478563412\r", taper_drive_u32(TAPER_DRIVE_STEP, 0, 0x12345678));
    assert_line("T1FFF0A000\r", taper_drive_plain(TAPER_DRIVE_RESET, 0));
    assert_line("T1FFF01008E803000032000200\r", taper_drive_setup(&setup, 0));
    assert_line("T1FFF010187017000000000080\r", taper_drive_setup(&setup, 1));
    assert_line("T1FFF8104880BB000034120215\r", taper_drive_done(TAPER_DRIVE_STEP, &done));
}

static void test_a_number_comes_back(void) {
    static const uint32_t numbers[] = {0, 1, 0x7FFFFFFF, 0x80000000, 0xFFFFFFFF, 0x12345678};
    for (unsigned i = 0; i < sizeof numbers / sizeof numbers[0]; i++) {
        const taper_slcan_message_t message =
            over_the_wire(taper_drive_u32(TAPER_DRIVE_VALUE, (uint8_t)(255 - i), numbers[i]));
        assert_kind(TAPER_DRIVE_VALUE, (uint8_t)(255 - i), &message);
        TEST_ASSERT_EQUAL_HEX32(numbers[i], taper_drive_get_u32(&message));
    }
}

static void test_other_frames_are_none_of_these(void) {
    const taper_slcan_message_t of_others[] = {
        {.id = 0x1FFE0400, .is_extended = true},
        {.id = 0x0FFF0400, .is_extended = true},
        {.id = 0x1FFF0400, .is_extended = true, .is_remote = true},
        {.id = 0x1FFF0400 & 0x7FF},
    };
    uint8_t kind = 0;
    uint8_t index = 0;
    for (unsigned i = 0; i < sizeof of_others / sizeof of_others[0]; i++) {
        TEST_ASSERT_FALSE(taper_drive_split(&of_others[i], &kind, &index));
    }
}

static void test_settings_come_back_at_both_ends_of_their_ranges(void) {
    static const taper_drive_setup_t all[] = {
        {.min_mA = TAPER_ABSENT, .price_weight_permille = TAPER_ABSENT},
        {.tick_ms = UINT32_MAX,
         .iterations_per_tick = UINT16_MAX,
         .policy = UINT8_MAX,
         .min_mA = INT32_MAX,
         .price_weight_permille = INT32_MAX},
        {.tick_ms = 1000,
         .iterations_per_tick = 50,
         .policy = TAPER_DRIVE_EDF,
         .min_mA = -1,
         .price_weight_permille = 500},
    };
    for (unsigned i = 0; i < sizeof all / sizeof all[0]; i++) {
        taper_drive_setup_t back = {0};
        for (unsigned part = 0; part < 2; part++) {
            const taper_slcan_message_t message = over_the_wire(taper_drive_setup(&all[i], part));
            assert_kind(TAPER_DRIVE_SETUP, (uint8_t)part, &message);
            TEST_ASSERT_TRUE(taper_drive_get_setup(&message, &back));
        }
        TEST_ASSERT_EQUAL_UINT32(all[i].tick_ms, back.tick_ms);
        TEST_ASSERT_EQUAL_UINT16(all[i].iterations_per_tick, back.iterations_per_tick);
        TEST_ASSERT_EQUAL_UINT8(all[i].policy, back.policy);
        TEST_ASSERT_EQUAL_INT32(all[i].min_mA, back.min_mA);
        TEST_ASSERT_EQUAL_INT32(all[i].price_weight_permille, back.price_weight_permille);
    }
}

static void test_what_was_done_comes_back_flag_by_flag(void) {
    for (unsigned flags = 0; flags < 32; flags++) {
        const taper_drive_done_t done = {
            .ok = (flags & 1u) != 0,
            .hands_over = (flags & 2u) != 0,
            .is_settled = (flags & 4u) != 0,
            .watchdog_kicked = (flags & 8u) != 0,
            .planned = (flags & 16u) != 0,
            .mode = (uint8_t)(255u - flags),
            .plans = (uint16_t)(65535u - flags),
            .instructions = UINT32_MAX - flags,
        };
        taper_drive_done_t back = {0};
        const taper_slcan_message_t message = over_the_wire(taper_drive_done(TAPER_DRIVE_POLL, &done));
        assert_kind(TAPER_DRIVE_DONE, TAPER_DRIVE_POLL, &message);
        TEST_ASSERT_TRUE(taper_drive_get_done(&message, &back));
        TEST_ASSERT_EQUAL(done.ok, back.ok);
        TEST_ASSERT_EQUAL(done.hands_over, back.hands_over);
        TEST_ASSERT_EQUAL(done.is_settled, back.is_settled);
        TEST_ASSERT_EQUAL(done.watchdog_kicked, back.watchdog_kicked);
        TEST_ASSERT_EQUAL(done.planned, back.planned);
        TEST_ASSERT_EQUAL_UINT8(done.mode, back.mode);
        TEST_ASSERT_EQUAL_UINT16(done.plans, back.plans);
        TEST_ASSERT_EQUAL_UINT32(done.instructions, back.instructions);
    }
}

static void assert_outlook(const taper_outlook_t *expected, const taper_outlook_t *outlook) {
    TEST_ASSERT_EQUAL_INT32(expected->soc_at_departure_permille, outlook->soc_at_departure_permille);
    TEST_ASSERT_EQUAL_INT32(expected->short_Wh, outlook->short_Wh);
    TEST_ASSERT_EQUAL_UINT8(expected->reason, outlook->reason);
    TEST_ASSERT_EQUAL_UINT8(expected->because, outlook->because);
    TEST_ASSERT_EQUAL_UINT8(expected->waiting_place, outlook->waiting_place);
    TEST_ASSERT_EQUAL_UINT8(expected->waiting_of, outlook->waiting_of);
    TEST_ASSERT_EQUAL(expected->soc_estimated, outlook->soc_estimated);
    TEST_ASSERT_EQUAL(expected->by_energy, outlook->by_energy);
    TEST_ASSERT_EQUAL(expected->departure_passed, outlook->departure_passed);
    TEST_ASSERT_EQUAL(expected->no_clock, outlook->no_clock);
}

static void test_an_outlook_comes_back_at_both_ends_of_its_ranges(void) {
    static const taper_outlook_t all[] = {
        {.soc_at_departure_permille = TAPER_ABSENT, .short_Wh = TAPER_ABSENT},
        {.soc_at_departure_permille = 0, .short_Wh = 0, .soc_estimated = true},
        {.soc_at_departure_permille = 1000,
         .short_Wh = 655340,
         .reason = 63,
         .because = 63,
         .waiting_place = 15,
         .waiting_of = 15,
         .soc_estimated = true,
         .by_energy = true,
         .departure_passed = true,
         .no_clock = true},
        {.soc_at_departure_permille = 512,
         .short_Wh = TAPER_ABSENT,
         .reason = 1,
         .because = 32,
         .by_energy = true},
        {.soc_at_departure_permille = TAPER_ABSENT,
         .short_Wh = 1,
         .waiting_place = 1,
         .departure_passed = true},
        {.waiting_of = 8, .no_clock = true},
    };
    for (unsigned i = 0; i < sizeof all / sizeof all[0]; i++) {
        taper_outlook_t back = {0};
        const taper_slcan_message_t message = over_the_wire(taper_drive_looked((uint8_t)(i * 47), &all[i]));
        assert_kind(TAPER_DRIVE_LOOKED, (uint8_t)(i * 47), &message);
        TEST_ASSERT_TRUE(taper_drive_get_looked(&message, &back));
        assert_outlook(&all[i], &back);
    }
}

static void test_messages_that_are_too_short_are_refused(void) {
    taper_slcan_message_t message = taper_drive_u32(TAPER_DRIVE_VALUE, 0, 7);
    taper_drive_setup_t setup;
    taper_drive_done_t done;
    taper_outlook_t outlook;
    for (uint8_t length = 0; length < TAPER_FRAME_LENGTH; length++) {
        message.length = length;
        TEST_ASSERT_EQUAL_UINT32(length < 4 ? 0 : 7, taper_drive_get_u32(&message));
        TEST_ASSERT_FALSE(taper_drive_get_setup(&message, &setup));
        TEST_ASSERT_FALSE(taper_drive_get_done(&message, &done));
        TEST_ASSERT_FALSE(taper_drive_get_looked(&message, &outlook));
    }
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_golden_lines);
    RUN_TEST(test_a_number_comes_back);
    RUN_TEST(test_other_frames_are_none_of_these);
    RUN_TEST(test_settings_come_back_at_both_ends_of_their_ranges);
    RUN_TEST(test_what_was_done_comes_back_flag_by_flag);
    RUN_TEST(test_an_outlook_comes_back_at_both_ends_of_its_ranges);
    RUN_TEST(test_messages_that_are_too_short_are_refused);
    return UNITY_END();
}
