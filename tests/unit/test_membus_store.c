/* The in-memory bus's store: whole records, torn ones, and rotten bits. */
#include <string.h>

#include "taper/membus.h"
#include "unity.h"

static taper_membus_t bus;
static taper_port_t port;
static uint8_t read[TAPER_STORE_RECORD_MAX];

void setUp(void) {
    taper_membus_init(&bus);
    port = taper_membus_station_port(&bus);
    memset(read, 0xEE, sizeof read);
}

void tearDown(void) {}

static void test_a_copy_that_was_never_written_cannot_be_read(void) {
    TEST_ASSERT_TRUE(port.store_write(port.context, TAPER_STORE_STATION, 0, "record", 6));
    TEST_ASSERT_FALSE(port.store_read(port.context, TAPER_STORE_STATION, 1, read, 6));
}

static void test_each_copy_keeps_its_own_record_through_a_power_cycle(void) {
    TEST_ASSERT_TRUE(port.store_write(port.context, TAPER_STORE_STATION, 0, "first", 5));
    TEST_ASSERT_TRUE(port.store_write(port.context, TAPER_STORE_STATION, 1, "other", 5));
    taper_membus_power_cycle(&bus);
    TEST_ASSERT_TRUE(port.store_read(port.context, TAPER_STORE_STATION, 0, read, 5));
    TEST_ASSERT_EQUAL_MEMORY("first", read, 5);
    TEST_ASSERT_TRUE(port.store_read(port.context, TAPER_STORE_STATION, 1, read, 5));
    TEST_ASSERT_EQUAL_MEMORY("other", read, 5);
    TEST_ASSERT_EQUAL_UINT32(2, bus.store_writes);
}

static void test_a_record_of_the_greatest_length_fits_and_none_longer(void) {
    static uint8_t record[TAPER_STORE_RECORD_MAX + 1];
    memset(record, 0x5A, sizeof record);
    TEST_ASSERT_TRUE(port.store_write(port.context, TAPER_STORE_STATION, 0, record, TAPER_STORE_RECORD_MAX));
    TEST_ASSERT_TRUE(port.store_read(port.context, TAPER_STORE_STATION, 0, read, TAPER_STORE_RECORD_MAX));
    TEST_ASSERT_EQUAL_MEMORY(record, read, TAPER_STORE_RECORD_MAX);
    TEST_ASSERT_FALSE(
        port.store_write(port.context, TAPER_STORE_STATION, 0, record, TAPER_STORE_RECORD_MAX + 1));
    TEST_ASSERT_FALSE(
        port.store_read(port.context, TAPER_STORE_STATION, 0, read, TAPER_STORE_RECORD_MAX + 1));
}

static void test_there_are_no_more_copies_than_the_port_says(void) {
    TEST_ASSERT_FALSE(port.store_write(port.context, TAPER_STORE_STATION, TAPER_STORE_COPIES, "x", 1));
    TEST_ASSERT_FALSE(port.store_read(port.context, TAPER_STORE_STATION, TAPER_STORE_COPIES, read, 1));
    TEST_ASSERT_FALSE(port.store_write(port.context, TAPER_STORE_AREAS, 0, "x", 1));
    TEST_ASSERT_FALSE(port.store_read(port.context, TAPER_STORE_AREAS, 0, read, 1));
}

static void test_each_area_keeps_its_own_records(void) {
    TEST_ASSERT_TRUE(port.store_write(port.context, TAPER_STORE_STATION, 0, "first", 5));
    TEST_ASSERT_FALSE(port.store_read(port.context, TAPER_STORE_SETTINGS, 0, read, 5));
    TEST_ASSERT_TRUE(port.store_write(port.context, TAPER_STORE_SETTINGS, 0, "other", 5));
    TEST_ASSERT_TRUE(port.store_read(port.context, TAPER_STORE_STATION, 0, read, 5));
    TEST_ASSERT_EQUAL_MEMORY("first", read, 5);
    TEST_ASSERT_TRUE(port.store_read(port.context, TAPER_STORE_SETTINGS, 0, read, 5));
    TEST_ASSERT_EQUAL_MEMORY("other", read, 5);
}

static void test_a_torn_write_leaves_the_new_head_and_the_old_tail_in_that_copy_alone(void) {
    TEST_ASSERT_TRUE(port.store_write(port.context, TAPER_STORE_STATION, 0, "oldold", 6));
    TEST_ASSERT_TRUE(port.store_write(port.context, TAPER_STORE_STATION, 1, "second", 6));
    taper_membus_tear_next_write(&bus, 4);
    TEST_ASSERT_FALSE(port.store_write(port.context, TAPER_STORE_STATION, 0, "newnew", 6));
    TEST_ASSERT_TRUE(port.store_read(port.context, TAPER_STORE_STATION, 0, read, 6));
    TEST_ASSERT_EQUAL_MEMORY("newnld", read, 6);
    TEST_ASSERT_TRUE(port.store_read(port.context, TAPER_STORE_STATION, 1, read, 6));
    TEST_ASSERT_EQUAL_MEMORY("second", read, 6);
}

static void test_only_the_next_write_is_torn(void) {
    taper_membus_tear_next_write(&bus, 0);
    TEST_ASSERT_FALSE(port.store_write(port.context, TAPER_STORE_STATION, 0, "lost", 4));
    TEST_ASSERT_FALSE(port.store_read(port.context, TAPER_STORE_STATION, 0, read, 4));
    TEST_ASSERT_TRUE(port.store_write(port.context, TAPER_STORE_STATION, 0, "kept", 4));
    TEST_ASSERT_TRUE(port.store_read(port.context, TAPER_STORE_STATION, 0, read, 4));
    TEST_ASSERT_EQUAL_MEMORY("kept", read, 4);
}

static void test_a_first_write_that_is_torn_ends_in_blank_memory(void) {
    taper_membus_tear_next_write(&bus, 2);
    TEST_ASSERT_FALSE(port.store_write(port.context, TAPER_STORE_STATION, 1, "abcd", 4));
    TEST_ASSERT_TRUE(port.store_read(port.context, TAPER_STORE_STATION, 1, read, 4));
    TEST_ASSERT_EQUAL_MEMORY("ab\xFF\xFF", read, 4);
}

static void test_a_write_that_ends_before_the_power_does_is_whole(void) {
    taper_membus_tear_next_write(&bus, 4);
    TEST_ASSERT_TRUE(port.store_write(port.context, TAPER_STORE_STATION, 0, "abcd", 4));
}

static void test_a_rotten_bit_is_one_bit(void) {
    TEST_ASSERT_TRUE(port.store_write(port.context, TAPER_STORE_STATION, 0, "abcd", 4));
    taper_membus_rot(&bus, TAPER_STORE_STATION, 0, 9);
    TEST_ASSERT_TRUE(port.store_read(port.context, TAPER_STORE_STATION, 0, read, 4));
    TEST_ASSERT_EQUAL_MEMORY("a`cd", read, 4);
}

static void test_rot_outside_the_store_hits_nothing(void) {
    const taper_membus_t before = bus;
    taper_membus_rot(&bus, TAPER_STORE_STATION, TAPER_STORE_COPIES, 0);
    taper_membus_rot(&bus, TAPER_STORE_AREAS, 0, 0);
    taper_membus_rot(&bus, TAPER_STORE_STATION, 0, TAPER_STORE_RECORD_MAX * 8);
    TEST_ASSERT_EQUAL_MEMORY(before.store, bus.store, sizeof bus.store);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_a_copy_that_was_never_written_cannot_be_read);
    RUN_TEST(test_each_copy_keeps_its_own_record_through_a_power_cycle);
    RUN_TEST(test_a_record_of_the_greatest_length_fits_and_none_longer);
    RUN_TEST(test_there_are_no_more_copies_than_the_port_says);
    RUN_TEST(test_each_area_keeps_its_own_records);
    RUN_TEST(test_a_torn_write_leaves_the_new_head_and_the_old_tail_in_that_copy_alone);
    RUN_TEST(test_only_the_next_write_is_torn);
    RUN_TEST(test_a_first_write_that_is_torn_ends_in_blank_memory);
    RUN_TEST(test_a_write_that_ends_before_the_power_does_is_whole);
    RUN_TEST(test_a_rotten_bit_is_one_bit);
    RUN_TEST(test_rot_outside_the_store_hits_nothing);
    return UNITY_END();
}
