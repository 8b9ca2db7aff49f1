#include "taper/version.h"

#include <stdio.h>

#include "unity.h"

void setUp(void) {}
void tearDown(void) {}

void test_this_version_and_all_before_it_are_reached(void) {
    TEST_ASSERT_TRUE(TAPER_VERSION_AT_LEAST(TAPER_VERSION_MAJOR, TAPER_VERSION_MINOR, TAPER_VERSION_PATCH));
    TEST_ASSERT_TRUE(TAPER_VERSION_AT_LEAST(TAPER_VERSION_MAJOR, TAPER_VERSION_MINOR - 1, 99));
    TEST_ASSERT_TRUE(TAPER_VERSION_AT_LEAST(TAPER_VERSION_MAJOR - 1, 99, 99));
}

void test_no_later_version_is_reached(void) {
    TEST_ASSERT_FALSE(
        TAPER_VERSION_AT_LEAST(TAPER_VERSION_MAJOR, TAPER_VERSION_MINOR, TAPER_VERSION_PATCH + 1));
    TEST_ASSERT_FALSE(TAPER_VERSION_AT_LEAST(TAPER_VERSION_MAJOR, TAPER_VERSION_MINOR + 1, 0));
    TEST_ASSERT_FALSE(TAPER_VERSION_AT_LEAST(TAPER_VERSION_MAJOR + 1, 0, 0));
}

void test_the_preprocessor_can_ask_too(void) {
#if TAPER_VERSION_AT_LEAST(TAPER_VERSION_MAJOR, TAPER_VERSION_MINOR, TAPER_VERSION_PATCH)
    const char *answer = "reached";
#else
    const char *answer = "not reached";
#endif
    TEST_ASSERT_EQUAL_STRING("reached", answer);
}

void test_text_numbers_and_library_agree(void) {
    char text[32];
    (void)snprintf(text, sizeof text, "%d.%d.%d", TAPER_VERSION_MAJOR, TAPER_VERSION_MINOR,
                   TAPER_VERSION_PATCH);
    TEST_ASSERT_EQUAL_STRING(text, TAPER_VERSION);
    TEST_ASSERT_EQUAL_STRING(TAPER_VERSION, taper_version());
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_this_version_and_all_before_it_are_reached);
    RUN_TEST(test_no_later_version_is_reached);
    RUN_TEST(test_the_preprocessor_can_ask_too);
    RUN_TEST(test_text_numbers_and_library_agree);
    return UNITY_END();
}
