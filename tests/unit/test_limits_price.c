/* The known course of the price: means over steps, and what becomes of steps without one. */
#include <string.h>

#include "limits_bench.h"
#include "unity.h"

#define HOUR_ms 3600000u

static taper_price_curve_t price;

void setUp(void) {
    bench_start();
    memset(&price, 0, sizeof price);
}
void tearDown(void) {}

static void point(uint32_t time_ms, int32_t milli_per_kWh) {
    price.point[price.count] = (taper_price_point_t){time_ms, milli_per_kWh};
    price.count++;
}

static void set(void) {
    TEST_ASSERT_EQUAL(TAPER_OK, taper_limits_set_price(&limits, &price));
}

static void assert_step(unsigned t, int32_t milli_per_kWh) {
    TEST_ASSERT_EQUAL_INT32(milli_per_kWh, course.milli_per_kWh[t]);
}

static void assert_not_priced(uint32_t now_ms) {
    static const int32_t zero[TAPER_MAX_STEPS];
    bench_course(now_ms);
    TEST_ASSERT_FALSE(course.priced);
    TEST_ASSERT_EQUAL_INT32_ARRAY(zero, course.milli_per_kWh, TAPER_MAX_STEPS);
}

/** Hours 0..`hours` - 1, at 100, 110, 120... */
static void set_hours(unsigned hours) {
    for (unsigned k = 0; k < hours; k++) {
        point(k * HOUR_ms, 100 + 10 * (int32_t)k);
    }
    set();
}

static void test_without_prices_the_course_has_none(void) {
    assert_not_priced(0);
}

static void test_every_step_has_the_price_of_its_time(void) {
    set_hours(6); /* of the horizon of 6 h */
    bench_course(0);
    TEST_ASSERT_TRUE(course.priced);
    assert_step(0, 100);
    assert_step(3, 100);
    assert_step(4, 110);
    assert_step(23, 150);
}

static void test_a_step_with_a_change_in_it_has_the_mean_and_negative_prices_count(void) {
    set_hours(7);
    price.point[1].milli_per_kWh = -200;
    set();
    bench_course(HOUR_ms - STEP_ms / 3);
    assert_step(0, (100 - 2 * 200) / 3);
    assert_step(1, -200);
    assert_step(4, (-200 + 2 * 120) / 3);
}

static void test_several_changes_in_a_step_are_averaged(void) {
    point(0, 90);
    point(STEP_ms / 3, 0);
    point(2 * STEP_ms / 3, -30);
    point(STEP_ms, 7);
    for (uint32_t k = 1; k < 8; k++) {
        point(STEP_ms + k * HOUR_ms, 7);
    }
    set();
    bench_course(0);
    assert_step(0, 20);
    assert_step(1, 7);
}

static void test_means_are_rounded_towards_zero(void) {
    point(0, 0);
    point(2 * STEP_ms / 3, 1);
    point(STEP_ms, 0);
    point(STEP_ms + 2 * STEP_ms / 3, -1);
    point(2 * STEP_ms, 5);
    point(8 * HOUR_ms, 5);
    set();
    bench_course(0);
    assert_step(0, 0);
    assert_step(1, 0);
    assert_step(2, 5);
}

static void test_the_last_price_holds_for_an_hour_and_steps_beyond_it_have_the_mean_of_the_others(void) {
    set_hours(4); /* 16 of 24 steps */
    bench_course(0);
    TEST_ASSERT_TRUE(course.priced);
    assert_step(15, 130);
    assert_step(16, 115);
    assert_step(23, 115);
}

static void test_a_step_that_is_known_in_part_has_the_mean_of_that_part(void) {
    set_hours(4);
    bench_course(STEP_ms / 2);
    assert_step(15, 130); /* half of it is beyond the end */
    assert_step(3, 105);
    assert_step(16, (3 * 460 + 105 + 115 + 125 + 130) / 16);
}

static void test_half_of_the_steps_are_enough_and_fewer_are_not(void) {
    set_hours(3);
    bench_course(0);
    TEST_ASSERT_TRUE(course.priced); /* 12 of 24 */
    assert_step(12, 110);
    assert_not_priced(STEP_ms); /* 11 */
}

static void test_before_the_first_price_nothing_is_known(void) {
    set_hours(6);
    bench_course((uint32_t)-2 * STEP_ms);
    TEST_ASSERT_TRUE(course.priced);
    assert_step(0, (4 * (100 + 110 + 120 + 130 + 140) + 2 * 150) / 22);
    assert_step(1, course.milli_per_kWh[0]);
    assert_step(2, 100);
    assert_not_priced((uint32_t)-13 * STEP_ms);
}

static void test_a_price_lasts_until_the_next_one_however_late_that_is(void) {
    point(0, 100);
    point(20 * 24 * HOUR_ms, 200);
    set();
    for (uint32_t day = 0; day < 20; day++) {
        const uint32_t now_ms = day * 24 * HOUR_ms;
        taper_limits_update(&limits, now_ms);
        bench_course(now_ms);
        TEST_ASSERT_TRUE(course.priced);
        assert_step(23, 100);
    }
}

static void test_prices_past_are_forgotten_and_do_not_come_back_with_the_clock(void) {
    set_hours(4);
    bench_course(3 * HOUR_ms + STEP_ms);
    TEST_ASSERT_FALSE(course.priced);
    for (uint64_t now_ms = 0; now_ms <= UINT64_C(0x100000000); now_ms += HOUR_ms) {
        taper_limits_update(&limits, (uint32_t)now_ms);
        if (now_ms == 2 * HOUR_ms) {
            TEST_ASSERT_EQUAL_UINT16(2, limits.price.count);
        }
    }
    TEST_ASSERT_EQUAL_UINT16(0, limits.price.count);
    assert_not_priced(0);
}

static void test_looking_after_the_curve_does_not_make_its_last_price_last_longer(void) {
    set_hours(4);
    for (uint32_t now_ms = 0; now_ms < 4 * HOUR_ms; now_ms += 60000) {
        taper_limits_update(&limits, now_ms);
        TEST_ASSERT_GREATER_THAN_UINT16(0, limits.price.count);
    }
    taper_limits_update(&limits, 4 * HOUR_ms);
    TEST_ASSERT_EQUAL_UINT16(0, limits.price.count);
}

static void test_prices_go_across_the_wrap_of_the_clock(void) {
    for (uint32_t k = 0; k < 7; k++) {
        point(UINT32_MAX - HOUR_ms + 1 + k * HOUR_ms, 100 + (int32_t)k);
    }
    set();
    bench_course(UINT32_MAX - 2 * STEP_ms + 1);
    assert_step(1, 100);
    assert_step(2, 101);
    taper_limits_update(&limits, STEP_ms);
    bench_course(STEP_ms);
    assert_step(0, 101);
    assert_step(3, 102);
}

static void test_at_time_scale_600_prices_run_600_times_faster_than_the_bus(void) {
    limits.time_scale = 600;
    set_hours(8);
    taper_limits_update(&limits, 6000); /* an hour of the world */
    bench_course(6000);
    assert_step(0, 110);
    assert_step(4, 120);
}

static void test_a_curve_without_points_forgets_the_prices(void) {
    set_hours(6);
    price.count = 0;
    set();
    assert_not_priced(0);
}

static void test_a_price_curve_that_is_not_sound_is_refused_and_the_old_one_stays(void) {
    set_hours(6);
    price.point[3].time_ms = price.point[2].time_ms;
    TEST_ASSERT_EQUAL(TAPER_ERR_ARGUMENT, taper_limits_set_price(&limits, &price));
    price.point[3].time_ms = price.point[4].time_ms + 1;
    TEST_ASSERT_EQUAL(TAPER_ERR_ARGUMENT, taper_limits_set_price(&limits, &price));
    price.point[3] = (taper_price_point_t){3 * HOUR_ms, TAPER_ABSENT};
    TEST_ASSERT_EQUAL(TAPER_ERR_ARGUMENT, taper_limits_set_price(&limits, &price));
    price.point[3].milli_per_kWh = 0;
    price.point[0].milli_per_kWh = TAPER_ABSENT;
    TEST_ASSERT_EQUAL(TAPER_ERR_ARGUMENT, taper_limits_set_price(&limits, &price));
    price.point[0].milli_per_kWh = 0;
    price.point[5].time_ms = TAPER_CURVE_SPAN_ms + 1;
    TEST_ASSERT_EQUAL(TAPER_ERR_ARGUMENT, taper_limits_set_price(&limits, &price));
    price.count = TAPER_MAX_PRICE_POINTS + 1;
    TEST_ASSERT_EQUAL(TAPER_ERR_ARGUMENT, taper_limits_set_price(&limits, &price));
    bench_course(0);
    assert_step(12, 130);
}

static void test_the_longest_curve_and_the_greatest_prices_are_taken(void) {
    for (uint32_t k = 0; k < TAPER_MAX_PRICE_POINTS; k++) {
        point(k * STEP_ms, k % 2 == 0 ? INT32_MAX : -INT32_MAX);
    }
    set();
    bench_course(0);
    assert_step(0, INT32_MAX);
    assert_step(1, -INT32_MAX);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_without_prices_the_course_has_none);
    RUN_TEST(test_every_step_has_the_price_of_its_time);
    RUN_TEST(test_a_step_with_a_change_in_it_has_the_mean_and_negative_prices_count);
    RUN_TEST(test_several_changes_in_a_step_are_averaged);
    RUN_TEST(test_means_are_rounded_towards_zero);
    RUN_TEST(test_the_last_price_holds_for_an_hour_and_steps_beyond_it_have_the_mean_of_the_others);
    RUN_TEST(test_a_step_that_is_known_in_part_has_the_mean_of_that_part);
    RUN_TEST(test_half_of_the_steps_are_enough_and_fewer_are_not);
    RUN_TEST(test_before_the_first_price_nothing_is_known);
    RUN_TEST(test_a_price_lasts_until_the_next_one_however_late_that_is);
    RUN_TEST(test_prices_past_are_forgotten_and_do_not_come_back_with_the_clock);
    RUN_TEST(test_looking_after_the_curve_does_not_make_its_last_price_last_longer);
    RUN_TEST(test_prices_go_across_the_wrap_of_the_clock);
    RUN_TEST(test_at_time_scale_600_prices_run_600_times_faster_than_the_bus);
    RUN_TEST(test_a_curve_without_points_forgets_the_prices);
    RUN_TEST(test_a_price_curve_that_is_not_sound_is_refused_and_the_old_one_stays);
    RUN_TEST(test_the_longest_curve_and_the_greatest_prices_are_taken);
    return UNITY_END();
}
