/* The store keeps each copy of each area apart, whole, and over a restart. */
#include <string.h>

#include "expect.h"

static uint8_t written[TAPER_STORE_RECORD_MAX + 1];
static uint8_t got[TAPER_STORE_RECORD_MAX + 1];

static uint32_t longest(void) {
    const uint32_t length = rig.record_max();
    TEST_ASSERT_TRUE_MESSAGE(length <= TAPER_STORE_RECORD_MAX,
                             "built for a larger station than this program");
    return length;
}

/** Bytes that no other copy, area, length or generation has. */
static void make(unsigned area, unsigned copy, uint32_t length, unsigned generation) {
    for (uint32_t i = 0; i < length; i++) {
        written[i] = (uint8_t)(i * 7u + i / 251u + area * 64u + copy * 128u + generation * 31u + length);
    }
}

static bool write_copy(unsigned area, unsigned copy, uint32_t length, unsigned generation) {
    make(area, copy, length, generation);
    return rig.port->store_write(rig.port->context, area, copy, written, length);
}

static bool read_copy(unsigned area, unsigned copy, uint32_t length) {
    memset(got, 0xA5, sizeof got);
    return rig.port->store_read(rig.port->context, area, copy, got, length);
}

static void assert_holds(unsigned area, unsigned copy, uint32_t length, unsigned generation) {
    TEST_ASSERT_TRUE_MESSAGE(read_copy(area, copy, length), "cannot be read");
    make(area, copy, length, generation);
    TEST_ASSERT_EQUAL_HEX8_ARRAY(written, got, length);
}

typedef void (*visit_t)(unsigned area, unsigned copy);

static void for_each(visit_t visit) {
    for (unsigned area = 0; area < TAPER_STORE_AREAS; area++) {
        for (unsigned copy = 0; copy < TAPER_STORE_COPIES; copy++) {
            visit(area, copy);
        }
    }
}

static uint32_t length_of(unsigned area, unsigned copy) {
    return 40 + 20 * area + 10 * copy;
}

static void write_one(unsigned area, unsigned copy) {
    TEST_ASSERT_TRUE(write_copy(area, copy, length_of(area, copy), 0));
}

static void read_one(unsigned area, unsigned copy) {
    assert_holds(area, copy, length_of(area, copy), 0);
}

static void read_none(unsigned area, unsigned copy) {
    TEST_ASSERT_FALSE(read_copy(area, copy, 1));
    TEST_ASSERT_FALSE(read_copy(area, copy, longest()));
}

static void test_what_was_never_written_cannot_be_read(void) {
    for_each(read_none);
    TEST_ASSERT_TRUE(write_copy(TAPER_STORE_SETTINGS, 1, 10, 0));
    TEST_ASSERT_FALSE(read_copy(TAPER_STORE_SETTINGS, 0, 10));
    TEST_ASSERT_FALSE(read_copy(TAPER_STORE_STATION, 1, 10));
}

static void test_each_copy_of_each_area_keeps_its_own_record(void) {
    for_each(write_one);
    for_each(read_one);
}

static void test_all_records_are_there_after_a_restart(void) {
    for_each(write_one);
    rig.restart();
    for_each(read_one);
}

static void test_a_new_record_takes_the_place_of_its_old_one_alone(void) {
    for_each(write_one);
    TEST_ASSERT_TRUE(write_copy(TAPER_STORE_STATION, 1, length_of(TAPER_STORE_STATION, 1), 1));
    assert_holds(TAPER_STORE_STATION, 1, length_of(TAPER_STORE_STATION, 1), 1);
    read_one(TAPER_STORE_STATION, 0);
    read_one(TAPER_STORE_SETTINGS, 0);
    read_one(TAPER_STORE_SETTINGS, 1);
}

static void test_a_read_may_be_shorter_or_longer_than_what_was_written(void) {
    TEST_ASSERT_TRUE(write_copy(TAPER_STORE_STATION, 0, 100, 0));
    TEST_ASSERT_TRUE(read_copy(TAPER_STORE_STATION, 0, 30));
    TEST_ASSERT_EQUAL_HEX8_ARRAY(written, got, 30);
    TEST_ASSERT_EQUAL_HEX8(0xA5, got[30]);
    TEST_ASSERT_TRUE(read_copy(TAPER_STORE_STATION, 0, longest()));
    TEST_ASSERT_EQUAL_HEX8_ARRAY(written, got, 100);
}

static void test_the_longest_record_fits_into_each_area(void) {
    for (unsigned area = 0; area < TAPER_STORE_AREAS; area++) {
        TEST_ASSERT_TRUE(write_copy(area, 0, longest(), area));
    }
    for (unsigned area = 0; area < TAPER_STORE_AREAS; area++) {
        assert_holds(area, 0, longest(), area);
    }
}

static void test_what_is_too_long_or_has_no_place_is_refused_and_harms_nothing(void) {
    for_each(write_one);
    make(0, 0, longest() + 1, 9);
    const taper_port_t *port = rig.port;
    TEST_ASSERT_FALSE(port->store_write(port->context, TAPER_STORE_STATION, 0, written, longest() + 1));
    TEST_ASSERT_FALSE(port->store_write(port->context, TAPER_STORE_STATION, TAPER_STORE_COPIES, written, 10));
    TEST_ASSERT_FALSE(port->store_write(port->context, TAPER_STORE_AREAS, 0, written, 10));
    TEST_ASSERT_FALSE(read_copy(TAPER_STORE_STATION, 0, longest() + 1));
    TEST_ASSERT_FALSE(read_copy(TAPER_STORE_STATION, TAPER_STORE_COPIES, 10));
    TEST_ASSERT_FALSE(read_copy(TAPER_STORE_AREAS, 0, 10));
    for_each(read_one);
}

static void test_power_cut_in_a_write_harms_no_other_copy_and_the_next_write_mends_it(void) {
    if (rig.tear_next_write == NULL) {
        return; /* no way to cut one: rig.h */
    }
    for (uint32_t bytes = 0; bytes < 40; bytes += 13) {
        for_each(write_one);
        rig.tear_next_write(bytes);
        TEST_ASSERT_FALSE(write_copy(TAPER_STORE_STATION, 1, length_of(TAPER_STORE_STATION, 1), 1));
        rig.restart();
        read_one(TAPER_STORE_STATION, 0);
        read_one(TAPER_STORE_SETTINGS, 0);
        read_one(TAPER_STORE_SETTINGS, 1);
        write_one(TAPER_STORE_STATION, 1);
        read_one(TAPER_STORE_STATION, 1);
    }
}

static void test_a_port_without_a_store_says_so_by_both_callbacks(void) {
    TEST_ASSERT_NULL(rig.port->store_read);
    TEST_ASSERT_NULL(rig.port->store_write);
    TEST_ASSERT_NULL(rig.tear_next_write);
}

void expect_store(void) {
    if (!rig.has.store) {
        RUN_TEST(test_a_port_without_a_store_says_so_by_both_callbacks);
        return;
    }
    RUN_TEST(test_what_was_never_written_cannot_be_read);
    RUN_TEST(test_each_copy_of_each_area_keeps_its_own_record);
    RUN_TEST(test_all_records_are_there_after_a_restart);
    RUN_TEST(test_a_new_record_takes_the_place_of_its_old_one_alone);
    RUN_TEST(test_a_read_may_be_shorter_or_longer_than_what_was_written);
    RUN_TEST(test_the_longest_record_fits_into_each_area);
    RUN_TEST(test_what_is_too_long_or_has_no_place_is_refused_and_harms_nothing);
    RUN_TEST(test_power_cut_in_a_write_harms_no_other_copy_and_the_next_write_mends_it);
}
