/* Settings of a site: applied all or none, and kept in the store whatever happens to one copy of it. */
#include "taper/settings.h"

#include <string.h>

#include "taper/crc32.h"
#include "taper/membus.h"
#include "taper/planner.h"
#include "taper/stations.h"
#include "unity.h"

/** Bytes of a settings record. */
#define RECORD 44u

static taper_membus_t bus;
static taper_port_t port;
static taper_site_t site;
static const taper_station_config_t *built;

void setUp(void) {
    built = &taper_station_hub;
    taper_membus_init(&bus);
    port = taper_membus_station_port(&bus);
    memset(&site, 0xEE, sizeof site);
}

void tearDown(void) {}

/** Every setting is given, and none as described. */
static taper_settings_t all_set(void) {
    return (taper_settings_t){.limit_W = 30000,
                              .failsafe_W = 5000,
                              .min_ac_mA = 8000,
                              .min_dc_mA = 2000,
                              .price_weight_permille = 250,
                              .tick_ms = 500,
                              .iterations_per_tick = 30,
                              .proposer = TAPER_PROPOSER_LLF};
}

static void assert_same(const taper_settings_t *expected, const taper_settings_t *found) {
    TEST_ASSERT_EQUAL_INT32(expected->limit_W, found->limit_W);
    TEST_ASSERT_EQUAL_INT32(expected->failsafe_W, found->failsafe_W);
    TEST_ASSERT_EQUAL_INT32(expected->min_ac_mA, found->min_ac_mA);
    TEST_ASSERT_EQUAL_INT32(expected->min_dc_mA, found->min_dc_mA);
    TEST_ASSERT_EQUAL_INT32(expected->price_weight_permille, found->price_weight_permille);
    TEST_ASSERT_EQUAL_UINT32(expected->tick_ms, found->tick_ms);
    TEST_ASSERT_EQUAL_UINT16(expected->iterations_per_tick, found->iterations_per_tick);
    TEST_ASSERT_EQUAL_UINT8(expected->proposer, found->proposer);
}

static taper_stored_t load(taper_settings_t *settings) {
    memset(settings, 0xEE, sizeof *settings);
    return taper_settings_load(&port, built, settings);
}

static void assert_loads(taper_stored_t found, const taper_settings_t *expected) {
    taper_settings_t settings;
    TEST_ASSERT_EQUAL(found, load(&settings));
    assert_same(expected, &settings);
}

/** As described, in memory of its own. */
static void assert_built(void) {
    TEST_ASSERT_EQUAL_INT32(built->groups[0].limit_W, site.config.groups[0].limit_W);
    TEST_ASSERT_EQUAL_INT32(built->failsafe_W, site.config.failsafe_W);
    TEST_ASSERT_EQUAL_UINT32(built->tick_ms, site.config.tick_ms);
    TEST_ASSERT_EQUAL_INT32(built->price_weight_permille, site.config.price_weight_permille);
    TEST_ASSERT_EQUAL_PTR(site.groups, site.config.groups);
    TEST_ASSERT_EQUAL_PTR(site.connectors, site.config.connectors);
    TEST_ASSERT_EQUAL_MEMORY(built->connectors, site.connectors,
                             built->connector_count * sizeof site.connectors[0]);
}

static void test_without_settings_the_station_is_as_described(void) {
    const taper_settings_t none = taper_settings_none();
    TEST_ASSERT_EQUAL(TAPER_OK, taper_settings_apply(&none, built, &site));
    assert_built();
}

static void test_every_setting_takes_the_place_of_what_is_described(void) {
    const taper_settings_t settings = all_set();
    TEST_ASSERT_EQUAL(TAPER_OK, taper_settings_apply(&settings, built, &site));
    TEST_ASSERT_EQUAL_INT32(30000, site.config.groups[0].limit_W);
    TEST_ASSERT_EQUAL_INT32(5000, site.config.failsafe_W);
    TEST_ASSERT_EQUAL_INT32(250, site.config.price_weight_permille);
    TEST_ASSERT_EQUAL_UINT32(500, site.config.tick_ms);
    for (unsigned i = 0; i < built->connector_count; i++) {
        TEST_ASSERT_EQUAL_INT32(8000, site.connectors[i].min_mA);
        TEST_ASSERT_EQUAL_INT32(0, site.connectors[i].fallback_mA); /* 6 A cannot be offered any more */
        TEST_ASSERT_EQUAL_INT32(built->connectors[i].max_mA, site.connectors[i].max_mA);
    }
    TEST_ASSERT_EQUAL_STRING(built->name, site.config.name);
}

static void test_the_failsafe_limit_follows_a_lower_limit_of_the_site(void) {
    taper_settings_t settings = taper_settings_none();
    settings.limit_W = built->failsafe_W - 1;
    TEST_ASSERT_EQUAL(TAPER_OK, taper_settings_apply(&settings, built, &site));
    TEST_ASSERT_EQUAL_INT32(built->failsafe_W - 1, site.config.failsafe_W);
}

static void test_a_minimum_of_one_kind_leaves_the_other_alone(void) {
    taper_settings_t settings = taper_settings_none();
    settings.min_dc_mA = 10000;
    TEST_ASSERT_EQUAL(TAPER_OK, taper_settings_apply(&settings, built, &site));
    assert_built(); /* a hub has no DC connectors */
    settings.min_ac_mA = 0;
    TEST_ASSERT_EQUAL(TAPER_OK, taper_settings_apply(&settings, built, &site));
    TEST_ASSERT_EQUAL_INT32(0, site.connectors[0].min_mA);
    TEST_ASSERT_EQUAL_INT32(built->connectors[0].fallback_mA, site.connectors[0].fallback_mA);
}

/** `settings` are refused, and nothing of them is used. */
static void assert_refused(const taper_settings_t *settings) {
    memset(&site, 0xEE, sizeof site);
    TEST_ASSERT_EQUAL(TAPER_ERR_CONFIG, taper_settings_apply(settings, built, &site));
    assert_built();
}

static void test_of_settings_with_one_that_is_out_of_range_none_is_used(void) {
    const taper_settings_t good = all_set();
    taper_settings_t bad[16];
    for (unsigned k = 0; k < sizeof bad / sizeof bad[0]; k++) {
        bad[k] = good;
    }
    bad[0].limit_W = built->groups[0].limit_W + 1;
    bad[1].limit_W = 0;
    bad[2].limit_W = -1;
    bad[3].failsafe_W = built->failsafe_W + 1;
    bad[4].failsafe_W = -1;
    bad[5].min_ac_mA = 5900;
    bad[6].min_ac_mA = built->connectors[0].max_mA + 100;
    bad[7].min_ac_mA = 8050;
    bad[8].min_ac_mA = -100;
    bad[9].price_weight_permille = 1001;
    bad[10].price_weight_permille = -1;
    bad[11].tick_ms = UINT32_MAX;
    bad[12].iterations_per_tick = TAPER_MAX_ITERATIONS + 1;
    bad[13].proposer = TAPER_PROPOSER_LLF + 1;
    bad[14].limit_W = INT32_MAX;
    bad[15].limit_W = TAPER_ABSENT + 1;
    for (unsigned k = 0; k < sizeof bad / sizeof bad[0]; k++) {
        assert_refused(&bad[k]);
    }
    TEST_ASSERT_EQUAL(TAPER_OK, taper_settings_apply(&good, built, &site));
}

static void test_a_description_that_is_refused_is_refused_with_any_settings(void) {
    taper_station_config_t wrong = *built;
    wrong.failsafe_W = built->groups[0].limit_W + 1; /* with these settings it would not show */
    const taper_settings_t settings = all_set();
    TEST_ASSERT_EQUAL(TAPER_ERR_CONFIG, taper_settings_apply(&settings, &wrong, &site));
    TEST_ASSERT_EQUAL_INT32(wrong.failsafe_W, site.config.failsafe_W);
}

static void test_an_empty_store_means_that_nothing_is_set(void) {
    const taper_settings_t none = taper_settings_none();
    assert_loads(TAPER_STORED_NONE, &none);
    TEST_ASSERT_EQUAL_UINT32(0, bus.store_writes);
}

static void test_a_board_without_a_store_has_no_settings_and_keeps_none(void) {
    const taper_settings_t settings = all_set();
    const taper_settings_t none = taper_settings_none();
    port.store_read = NULL;
    port.store_write = NULL;
    assert_loads(TAPER_STORED_NONE, &none);
    TEST_ASSERT_FALSE(taper_settings_save(&port, &settings));
}

static void test_what_was_saved_is_loaded_and_both_copies_hold_it(void) {
    const taper_settings_t settings = all_set();
    TEST_ASSERT_TRUE(taper_settings_save(&port, &settings));
    assert_loads(TAPER_STORED_GOOD, &settings);
    TEST_ASSERT_EQUAL_UINT32(2, bus.store_writes); /* loading them wrote nothing */
    for (unsigned copy = 0; copy < TAPER_STORE_COPIES; copy++) {
        bus.store[TAPER_STORE_SETTINGS][copy].data[20] ^= 1;
        assert_loads(TAPER_STORED_OLD_COPY, &settings);
        assert_loads(TAPER_STORED_GOOD, &settings); /* it was mended */
    }
}

static void test_absent_settings_stay_absent(void) {
    const taper_settings_t none = taper_settings_none();
    TEST_ASSERT_TRUE(taper_settings_save(&port, &none));
    assert_loads(TAPER_STORED_GOOD, &none);
}

static void test_the_bytes_are_as_the_layout_says_on_every_machine(void) {
    static const uint8_t expected[RECORD - 4] = {
        'T',  'P',  1, 1, 28,   0,    0, 0, 1,    0,    0, 0, /* header, sequence 1 */
        0x30, 0x75, 0, 0, 0x88, 0x13, 0, 0, 0x40, 0x1F, 0, 0, /* limits, 8 A */
        0xD0, 0x07, 0, 0, 0xFA, 0,    0, 0, 0xF4, 0x01, 0, 0, /* 2 A, price, tick */
        30,   0,    3, 0};
    const taper_settings_t settings = all_set();
    TEST_ASSERT_TRUE(taper_settings_save(&port, &settings));
    for (unsigned copy = 0; copy < TAPER_STORE_COPIES; copy++) {
        TEST_ASSERT_EQUAL_HEX8_ARRAY(expected, bus.store[TAPER_STORE_SETTINGS][copy].data, sizeof expected);
    }
}

/** Bytes that are written before power goes. */
static uint32_t power_B;
static taper_port_t whole;

static bool write_until_power_goes(void *context, unsigned area, unsigned copy, const void *data,
                                   uint32_t length) {
    if (power_B < length) {
        taper_membus_tear_next_write(&bus, power_B);
    }
    power_B -= power_B < length ? power_B : length;
    return whole.store_write(context, area, copy, data, length);
}

static void test_row_30_whenever_power_goes_while_settings_are_saved_old_or_new_ones_hold(void) {
    const taper_settings_t before = all_set();
    taper_settings_t after = before;
    after.limit_W = 20000;
    for (uint32_t cut_B = 0; cut_B < 2 * RECORD; cut_B++) {
        setUp();
        TEST_ASSERT_TRUE(taper_settings_save(&port, &before));
        whole = port;
        power_B = cut_B;
        port.store_write = write_until_power_goes;
        TEST_ASSERT_FALSE(taper_settings_save(&port, &after));
        port = whole;
        taper_settings_t found;
        (void)load(&found);
        assert_same(cut_B < RECORD ? &before : &after, &found);
        assert_loads(TAPER_STORED_GOOD, &found); /* mended, and both copies alike */
        const taper_membus_copy_t *copies = bus.store[TAPER_STORE_SETTINGS];
        TEST_ASSERT_EQUAL_MEMORY(copies[0].data, copies[1].data, RECORD);
    }
}

static void test_every_single_bit_that_rots_in_either_copy_is_found_and_mended(void) {
    const taper_settings_t settings = all_set();
    TEST_ASSERT_TRUE(taper_settings_save(&port, &settings));
    for (unsigned copy = 0; copy < TAPER_STORE_COPIES; copy++) {
        for (uint32_t bit = 0; bit < 8 * RECORD; bit++) {
            taper_membus_rot(&bus, TAPER_STORE_SETTINGS, copy, bit);
            taper_settings_t found;
            const taper_stored_t verdict = load(&found);
            assert_same(&settings, &found);
            TEST_ASSERT_TRUE(verdict == TAPER_STORED_OLD_COPY || verdict == TAPER_STORED_GOOD);
            assert_loads(TAPER_STORED_GOOD, &settings);
        }
    }
}

/** Give a copy another sequence and another limit. */
static void forge(unsigned copy, uint32_t sequence, uint8_t limit_low) {
    uint8_t *record = bus.store[TAPER_STORE_SETTINGS][copy].data;
    for (unsigned i = 0; i < 4; i++) {
        record[8 + i] = (uint8_t)(sequence >> 8 * i);
    }
    record[12] = limit_low;
    const uint32_t crc = taper_crc32(record, RECORD - 4);
    for (unsigned i = 0; i < 4; i++) {
        record[RECORD - 4 + i] = (uint8_t)(crc >> 8 * i);
    }
}

static void test_of_two_good_copies_the_newer_one_counts_when_the_sequence_wraps_too(void) {
    taper_settings_t settings = all_set();
    const int32_t base_W = settings.limit_W - settings.limit_W % 256;
    const uint32_t newer[] = {8, 0, 5, UINT32_C(0x80000001)};
    const uint32_t older[] = {7, UINT32_MAX, UINT32_MAX - 5, 3};
    for (unsigned k = 0; k < sizeof newer / sizeof newer[0]; k++) {
        for (unsigned copy = 0; copy < TAPER_STORE_COPIES; copy++) {
            setUp();
            TEST_ASSERT_TRUE(taper_settings_save(&port, &settings));
            forge(copy, newer[k], 2);
            forge(1 - copy, older[k], 1);
            taper_settings_t found;
            TEST_ASSERT_EQUAL(TAPER_STORED_GOOD, load(&found));
            TEST_ASSERT_EQUAL_INT32(base_W + 2, found.limit_W);
            bus.store[TAPER_STORE_SETTINGS][copy].data[12] ^= 1; /* the other one holds the same by now */
            TEST_ASSERT_EQUAL(TAPER_STORED_OLD_COPY, load(&found));
            TEST_ASSERT_EQUAL_INT32(base_W + 2, found.limit_W);
        }
    }
}

static void test_row_30_settings_that_are_lost_leave_the_failsafe_limit_until_they_are_set_again(void) {
    taper_settings_t settings = all_set();
    TEST_ASSERT_TRUE(taper_settings_save(&port, &settings));
    taper_membus_rot(&bus, TAPER_STORE_SETTINGS, 0, 100);
    taper_membus_rot(&bus, TAPER_STORE_SETTINGS, 1, 200);
    TEST_ASSERT_EQUAL(TAPER_STORED_BAD, load(&settings));
    TEST_ASSERT_EQUAL(TAPER_OK, taper_settings_apply(&settings, built, &site));
    TEST_ASSERT_EQUAL_INT32(built->failsafe_W, site.config.groups[0].limit_W);
    TEST_ASSERT_EQUAL(TAPER_STORED_BAD, load(&settings));
    settings = all_set();
    TEST_ASSERT_TRUE(taper_settings_save(&port, &settings));
    assert_loads(TAPER_STORED_GOOD, &settings);
}

static void test_settings_of_another_layout_are_refused_and_kept_until_somebody_saves(void) {
    taper_settings_t settings = all_set();
    TEST_ASSERT_TRUE(taper_settings_save(&port, &settings));
    for (unsigned copy = 0; copy < TAPER_STORE_COPIES; copy++) { /* the sound record of a newer image */
        static const uint8_t newer[] = {'T', 'P', 1, 2, 1, 0, 0, 0, 7, 0, 0, 0, 99, 0x25, 0xB6, 0xA7, 0x4E};
        memcpy(bus.store[TAPER_STORE_SETTINGS][copy].data, newer, sizeof newer);
    }
    const taper_membus_copy_t before = bus.store[TAPER_STORE_SETTINGS][1];
    TEST_ASSERT_EQUAL(TAPER_STORED_OTHER, load(&settings));
    TEST_ASSERT_EQUAL_INT32(built->failsafe_W, settings.limit_W);
    TEST_ASSERT_EQUAL_MEMORY(&before, &bus.store[TAPER_STORE_SETTINGS][1], sizeof before);
}

static void test_a_site_without_a_failsafe_limit_is_left_a_watt_when_settings_are_lost(void) {
    taper_station_config_t none = *built;
    none.failsafe_W = 0;
    const taper_settings_t settings = taper_settings_cautious(&none);
    TEST_ASSERT_EQUAL(TAPER_OK, taper_settings_apply(&settings, &none, &site));
    TEST_ASSERT_EQUAL_INT32(1, site.config.groups[0].limit_W);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_without_settings_the_station_is_as_described);
    RUN_TEST(test_every_setting_takes_the_place_of_what_is_described);
    RUN_TEST(test_the_failsafe_limit_follows_a_lower_limit_of_the_site);
    RUN_TEST(test_a_minimum_of_one_kind_leaves_the_other_alone);
    RUN_TEST(test_of_settings_with_one_that_is_out_of_range_none_is_used);
    RUN_TEST(test_a_description_that_is_refused_is_refused_with_any_settings);
    RUN_TEST(test_an_empty_store_means_that_nothing_is_set);
    RUN_TEST(test_a_board_without_a_store_has_no_settings_and_keeps_none);
    RUN_TEST(test_what_was_saved_is_loaded_and_both_copies_hold_it);
    RUN_TEST(test_absent_settings_stay_absent);
    RUN_TEST(test_the_bytes_are_as_the_layout_says_on_every_machine);
    RUN_TEST(test_row_30_whenever_power_goes_while_settings_are_saved_old_or_new_ones_hold);
    RUN_TEST(test_every_single_bit_that_rots_in_either_copy_is_found_and_mended);
    RUN_TEST(test_of_two_good_copies_the_newer_one_counts_when_the_sequence_wraps_too);
    RUN_TEST(test_row_30_settings_that_are_lost_leave_the_failsafe_limit_until_they_are_set_again);
    RUN_TEST(test_settings_of_another_layout_are_refused_and_kept_until_somebody_saves);
    RUN_TEST(test_a_site_without_a_failsafe_limit_is_left_a_watt_when_settings_are_lost);
    return UNITY_END();
}
