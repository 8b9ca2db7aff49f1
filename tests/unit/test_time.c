/* Time and saturating arithmetic of taper/types.h. */
#include "taper/types.h"
#include "unity.h"

void setUp(void) {}
void tearDown(void) {}

static void test_a_time_is_reached_at_itself_and_later(void) {
    TEST_ASSERT_TRUE(taper_time_reached(1000, 1000));
    TEST_ASSERT_TRUE(taper_time_reached(1001, 1000));
    TEST_ASSERT_FALSE(taper_time_reached(999, 1000));
}

static void test_a_time_before_the_wrap_is_reached_after_it(void) {
    TEST_ASSERT_TRUE(taper_time_reached(5, UINT32_MAX - 5));
    TEST_ASSERT_TRUE(taper_time_reached(0, UINT32_MAX));
    TEST_ASSERT_FALSE(taper_time_reached(UINT32_MAX, 0));
    TEST_ASSERT_FALSE(taper_time_reached(UINT32_MAX - 5, 5));
}

static void test_the_comparison_holds_up_to_half_the_range(void) {
    TEST_ASSERT_TRUE(taper_time_reached(UINT32_C(0x7FFFFFFF), 0));
    TEST_ASSERT_FALSE(taper_time_reached(UINT32_C(0x80000000), 0));
    TEST_ASSERT_TRUE(taper_time_reached(UINT32_C(0x7FFFFFFF) + 77u, 77));
}

static void test_elapsed_time_goes_on_over_the_wrap(void) {
    TEST_ASSERT_EQUAL_UINT32(0, taper_elapsed_ms(42, 42));
    TEST_ASSERT_EQUAL_UINT32(16, taper_elapsed_ms(5, UINT32_MAX - 10));
}

static void test_saturation_never_makes_the_absent_code(void) {
    TEST_ASSERT_EQUAL_INT32(INT32_MAX, taper_saturate_i32(INT64_MAX));
    TEST_ASSERT_EQUAL_INT32(INT32_MAX, taper_saturate_i32((int64_t)INT32_MAX + 1));
    TEST_ASSERT_EQUAL_INT32(-INT32_MAX, taper_saturate_i32(INT64_MIN));
    TEST_ASSERT_EQUAL_INT32(-INT32_MAX, taper_saturate_i32(TAPER_ABSENT));
    TEST_ASSERT_EQUAL_INT32(-7, taper_saturate_i32(-7));
}

static void test_a_value_is_clamped_to_both_ends(void) {
    TEST_ASSERT_EQUAL_INT32(3, taper_clamp_i32(2, 3, 9));
    TEST_ASSERT_EQUAL_INT32(9, taper_clamp_i32(10, 3, 9));
    TEST_ASSERT_EQUAL_INT32(5, taper_clamp_i32(5, 3, 9));
    TEST_ASSERT_EQUAL_INT32(3, taper_clamp_i32(TAPER_ABSENT, 3, 9));
}

static void test_a_counter_stays_at_its_end(void) {
    uint32_t counter = UINT32_MAX - 1;
    taper_count(&counter);
    TEST_ASSERT_EQUAL_UINT32(UINT32_MAX, counter);
    taper_count(&counter);
    TEST_ASSERT_EQUAL_UINT32(UINT32_MAX, counter);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_a_time_is_reached_at_itself_and_later);
    RUN_TEST(test_a_time_before_the_wrap_is_reached_after_it);
    RUN_TEST(test_the_comparison_holds_up_to_half_the_range);
    RUN_TEST(test_elapsed_time_goes_on_over_the_wrap);
    RUN_TEST(test_saturation_never_makes_the_absent_code);
    RUN_TEST(test_a_value_is_clamped_to_both_ends);
    RUN_TEST(test_a_counter_stays_at_its_end);
    return UNITY_END();
}
