#include "scene.h"
#include "taper/battery.h"
#include "taper/battery_slope.h"
#include "unity.h"

void setUp(void) {}
void tearDown(void) {}

static taper_demand_t tapered(int32_t stored_Wh) {
    taper_demand_t demand = scene_demand();
    demand.taper_W = 6000;
    demand.stored_Wh = stored_Wh;
    return demand;
}

static void test_the_limit_falls_on_a_line_from_the_peak(void) {
    const taper_demand_t empty = tapered(0);
    const taper_demand_t half = tapered(30000);
    const taper_demand_t full = tapered(60000);
    TEST_ASSERT_EQUAL_INT32(7360, taper_battery_limit_W(&empty));
    TEST_ASSERT_EQUAL_INT32(4360, taper_battery_limit_W(&half));
    TEST_ASSERT_EQUAL_INT32(1360, taper_battery_limit_W(&full));
}

static void test_the_limit_is_never_negative(void) {
    taper_demand_t demand = tapered(60000);
    demand.taper_W = 7360;
    demand.stored_Wh = 90000;
    TEST_ASSERT_EQUAL_INT32(0, taper_battery_limit_W(&demand));
}

static void test_the_limit_that_the_planner_takes_is_not_in_whole_watts(void) {
    taper_demand_t demand = tapered(59996);
    TEST_ASSERT_EQUAL_INT32(1361, taper_battery_limit_W(&demand));
    TEST_ASSERT_FLOAT_WITHIN(0.01F, 1360.4F, (float)taper_battery_limit_now_W(&demand));
    demand.taper_W = 7360;
    demand.stored_Wh = 90000;
    TEST_ASSERT_TRUE(taper_battery_limit_now_W(&demand) == 0);
}

static void test_an_unknown_capacity_means_no_taper(void) {
    taper_demand_t demand = tapered(30000);
    demand.capacity_Wh = 0;
    TEST_ASSERT_EQUAL_INT32(7360, taper_battery_limit_W(&demand));
    TEST_ASSERT_TRUE(taper_battery_limit_now_W(&demand) == 7360);
    TEST_ASSERT_TRUE(taper_battery_slope_per_h(&demand) == 0);
}

static void test_useful_power_is_bounded_by_connector_taper_and_need(void) {
    taper_demand_t demand = tapered(0);
    demand.peak_W = 20000;
    TEST_ASSERT_EQUAL_INT32(7360, taper_battery_useful_W(&demand, 1000)); /* 32 A x 230 V */
    demand = tapered(30000);
    TEST_ASSERT_EQUAL_INT32(4360, taper_battery_useful_W(&demand, 1000));
    demand.need_Wh = 500;
    TEST_ASSERT_EQUAL_INT32(2000,
                            taper_battery_useful_W(&demand, 900000)); /* 500 Wh in a quarter of an hour */
}

static void test_nothing_is_useful_for_an_inactive_demand(void) {
    taper_demand_t demand = scene_demand();
    demand.active = false;
    TEST_ASSERT_EQUAL_INT32(0, taper_battery_useful_W(&demand, 1000));
}

static void test_the_slope_is_the_taper_over_the_capacity(void) {
    const taper_demand_t demand = tapered(30000);
    const taper_real_t per_mille = taper_battery_slope_per_h(&demand) * 1000;
    TEST_ASSERT_TRUE(per_mille > (taper_real_t)99.99 && per_mille < (taper_real_t)100.01);
}

static void test_extreme_values_do_not_overflow(void) {
    taper_demand_t demand = scene_demand();
    demand.peak_W = INT32_MAX;
    demand.taper_W = INT32_MAX;
    demand.need_Wh = INT32_MAX;
    demand.capacity_Wh = 1;
    demand.stored_Wh = INT32_MAX;
    demand.max_mA = INT32_MAX;
    demand.W_per_A = 690;
    TEST_ASSERT_EQUAL_INT32(0, taper_battery_limit_W(&demand));
    demand.stored_Wh = 0;
    TEST_ASSERT_GREATER_THAN_INT32(0, taper_battery_useful_W(&demand, 1));
}

static void test_no_real_value_becomes_a_wild_power(void) {
    const taper_real_t zero = 0;
    TEST_ASSERT_EQUAL_INT32(0, taper_real_to_W(zero / zero, 5000));
    TEST_ASSERT_EQUAL_INT32(0, taper_real_to_W(-1 / zero, 5000));
    TEST_ASSERT_EQUAL_INT32(5000, taper_real_to_W(1 / zero, 5000));
    TEST_ASSERT_EQUAL_INT32(5000, taper_real_to_W((taper_real_t)1e30, 5000));
    TEST_ASSERT_EQUAL_INT32(0, taper_real_to_W(-3, 5000));
    TEST_ASSERT_EQUAL_INT32(INT32_MAX, taper_real_to_W((taper_real_t)2147483647.0, INT32_MAX));
    TEST_ASSERT_EQUAL_INT32(7, taper_real_to_W((taper_real_t)6.6, 5000));
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_the_limit_falls_on_a_line_from_the_peak);
    RUN_TEST(test_the_limit_is_never_negative);
    RUN_TEST(test_the_limit_that_the_planner_takes_is_not_in_whole_watts);
    RUN_TEST(test_an_unknown_capacity_means_no_taper);
    RUN_TEST(test_useful_power_is_bounded_by_connector_taper_and_need);
    RUN_TEST(test_nothing_is_useful_for_an_inactive_demand);
    RUN_TEST(test_the_slope_is_the_taper_over_the_capacity);
    RUN_TEST(test_no_real_value_becomes_a_wild_power);
    RUN_TEST(test_extreme_values_do_not_overflow);
    return UNITY_END();
}
