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

static void test_the_limits_that_the_planner_takes_are_not_in_whole_watts(void) {
    taper_demand_t demand = tapered(59996);
    demand.second_peak_W = 20000;
    demand.second_taper_W = 19999;
    TEST_ASSERT_EQUAL_INT32(3, taper_battery_limit_W(&demand));
    TEST_ASSERT_FLOAT_WITHIN(0.01F, 1360.4F, (float)taper_battery_line_now_W(&demand, 0));
    TEST_ASSERT_FLOAT_WITHIN(0.02F, 2.33F, (float)taper_battery_line_now_W(&demand, 1));
    demand.taper_W = 7360;
    demand.stored_Wh = 90000;
    TEST_ASSERT_TRUE(taper_battery_line_now_W(&demand, 0) == 0);
}

static taper_demand_t of_two_lines(int32_t stored_Wh) {
    taper_demand_t demand = tapered(stored_Wh); /* 7360 - 6000 SOC */
    demand.second_peak_W = 20000;
    demand.second_taper_W = 19800; /* they cross at SOC 0.9159 */
    return demand;
}

static void test_of_two_lines_the_lower_one_counts(void) {
    const taper_demand_t empty = of_two_lines(0);
    const taper_demand_t before = of_two_lines(54000); /* 0.9: 1960 and 2180 */
    const taper_demand_t behind = of_two_lines(57000); /* 0.95: 1660 and 1190 */
    const taper_demand_t full = of_two_lines(60000);
    TEST_ASSERT_EQUAL_INT32(7360, taper_battery_limit_W(&empty));
    TEST_ASSERT_EQUAL_INT32(1960, taper_battery_limit_W(&before));
    TEST_ASSERT_EQUAL_INT32(1190, taper_battery_limit_W(&behind));
    TEST_ASSERT_EQUAL_INT32(200, taper_battery_limit_W(&full));
    TEST_ASSERT_EQUAL_INT32(1190, taper_battery_useful_W(&behind, 1000));
}

static void test_each_line_by_itself(void) {
    const taper_demand_t demand = of_two_lines(54000);
    const taper_demand_t one = tapered(54000);
    TEST_ASSERT_FLOAT_WITHIN(0.01F, 1960, (float)taper_battery_line_now_W(&demand, 0));
    TEST_ASSERT_FLOAT_WITHIN(0.01F, 2180, (float)taper_battery_line_now_W(&demand, 1));
    TEST_ASSERT_TRUE(taper_battery_line_now_W(&one, 1) >= TAPER_REAL_UNBOUNDED);
    const taper_real_t per_mille = taper_battery_slope_per_h(&demand, 1) * 1000; /* 19.8 kW over 60 kWh */
    TEST_ASSERT_TRUE(per_mille > (taper_real_t)329.9 && per_mille < (taper_real_t)330.1);
}

static void test_a_line_may_begin_above_what_connector_and_vehicle_allow(void) {
    taper_demand_t demand = of_two_lines(12000); /* 0.2 */
    demand.peak_W = 100000;
    demand.taper_W = 90000;
    TEST_ASSERT_EQUAL_INT32(7360, taper_battery_useful_W(&demand, 1000));
    demand.stored_Wh = 58800; /* 0.98: 11800 and 596 */
    TEST_ASSERT_EQUAL_INT32(596, taper_battery_useful_W(&demand, 1000));
}

static void test_an_unknown_capacity_means_no_taper(void) {
    taper_demand_t demand = tapered(30000);
    demand.capacity_Wh = 0;
    TEST_ASSERT_EQUAL_INT32(7360, taper_battery_limit_W(&demand));
    TEST_ASSERT_TRUE(taper_battery_line_now_W(&demand, 0) == 7360);
    TEST_ASSERT_TRUE(taper_battery_slope_per_h(&demand, 0) == 0);
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
    const taper_real_t per_mille = taper_battery_slope_per_h(&demand, 0) * 1000;
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
    RUN_TEST(test_the_limits_that_the_planner_takes_are_not_in_whole_watts);
    RUN_TEST(test_of_two_lines_the_lower_one_counts);
    RUN_TEST(test_each_line_by_itself);
    RUN_TEST(test_a_line_may_begin_above_what_connector_and_vehicle_allow);
    RUN_TEST(test_an_unknown_capacity_means_no_taper);
    RUN_TEST(test_useful_power_is_bounded_by_connector_taper_and_need);
    RUN_TEST(test_nothing_is_useful_for_an_inactive_demand);
    RUN_TEST(test_the_slope_is_the_taper_over_the_capacity);
    RUN_TEST(test_no_real_value_becomes_a_wild_power);
    RUN_TEST(test_extreme_values_do_not_overflow);
    return UNITY_END();
}
