/* The daemon's store in files: what was never written, and what cannot be read, are not the same. */
#define _POSIX_C_SOURCE 200809L // mkdtemp

#include "store.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "taper/port.h"
#include "unity.h"

static char folder[40];
static char path[60];
static unsigned char bytes[8];

void setUp(void) {
    strcpy(folder, "/tmp/taper-store-XXXXXX");
    TEST_ASSERT_NOT_NULL(mkdtemp(folder));
    snprintf(path, sizeof path, "%s/store", folder);
    memset(bytes, 0xA5, sizeof bytes);
}

void tearDown(void) {
    char file[80];
    snprintf(file, sizeof file, "%s.settings.0", path);
    (void)remove(file);
    (void)rmdir(folder);
}

static bool read_settings(void) {
    return taper_store_read(path, TAPER_STORE_SETTINGS, 0, bytes, sizeof bytes);
}

static void assert_zero_from(unsigned first) {
    for (unsigned i = first; i < sizeof bytes; i++) {
        TEST_ASSERT_EQUAL_UINT8(0, bytes[i]);
    }
}

static void test_what_was_never_written_says_so(void) {
    TEST_ASSERT_FALSE(read_settings());
}

static void test_a_file_that_is_too_short_ends_in_zeros(void) {
    TEST_ASSERT_TRUE(taper_store_write(path, TAPER_STORE_SETTINGS, 0, "abc", 3));
    TEST_ASSERT_TRUE(read_settings());
    TEST_ASSERT_EQUAL_MEMORY("abc", bytes, 3);
    assert_zero_from(3);
}

static void test_what_cannot_be_read_does_not_pass_for_never_written(void) {
    char file[80];
    snprintf(file, sizeof file, "%s.settings.0", path);
    TEST_ASSERT_EQUAL_INT(0, mkdir(file, 0700)); /* reading a folder fails, for root too */
    TEST_ASSERT_TRUE(read_settings());
    assert_zero_from(0);
}

static void test_what_no_store_has_is_refused(void) {
    TEST_ASSERT_FALSE(taper_store_read(path, TAPER_STORE_AREAS, 0, bytes, sizeof bytes));
    TEST_ASSERT_FALSE(taper_store_read(path, TAPER_STORE_SETTINGS, TAPER_STORE_COPIES, bytes, sizeof bytes));
    TEST_ASSERT_FALSE(taper_store_write(path, TAPER_STORE_SETTINGS, 0, bytes, TAPER_STORE_RECORD_MAX + 1));
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_what_was_never_written_says_so);
    RUN_TEST(test_a_file_that_is_too_short_ends_in_zeros);
    RUN_TEST(test_what_cannot_be_read_does_not_pass_for_never_written);
    RUN_TEST(test_what_no_store_has_is_refused);
    return UNITY_END();
}
