/* What vehicles of a station have in common, and what of it the next one is believed. */
#include <math.h>
#include <stdint.h>

#include "taper/fleet.h"
#include "unity.h"

#define CAPACITY_Wh 40000
#define PEAK_W      10000
#define NEED_Wh     20000
#define STORED_Wh   10000

static taper_fleet_t fleet;
static uint32_t random_state;

void setUp(void) {
    fleet = (taper_fleet_t){.noise = 0};
    random_state = 1;
}
void tearDown(void) {}

static double uniform(double low, double high) {
    random_state = random_state * 1664525u + 1013904223u;
    return low + (high - low) * (random_state >> 8) / 16777216.0;
}

static taper_learn_t arrives(int32_t told_taper_W, int32_t capacity_Wh) {
    const taper_demand_t told = {.active = true,
                                 .need_Wh = NEED_Wh,
                                 .capacity_Wh = capacity_Wh,
                                 .stored_Wh = STORED_Wh,
                                 .peak_W = PEAK_W,
                                 .taper_W = told_taper_W,
                                 .max_mA = 640000,
                                 .W_per_A = 230};
    taper_learn_t learn;
    taper_learn_begin(&learn, &told, 0);
    taper_fleet_advise(&fleet, &learn);
    return learn;
}

/** The true limit of a vehicle that loses this share of its peak until it is full. */
static double limit_W(double share, double energy_Wh) {
    return PEAK_W * (1.0 - share * (STORED_Wh + energy_Wh) / CAPACITY_Wh);
}

/** Half a charge at more than it takes, a look each minute. @return whether it was counted. */
static bool charges(taper_learn_t *learn, double share) {
    for (double energy_Wh = 0.0; energy_Wh < NEED_Wh / 2.0;) {
        const double power_W = limit_W(share, energy_Wh);
        const taper_learn_sample_t sample = {
            .energy_Wh = (int32_t)energy_Wh, .power_W = (int32_t)power_W, .offered_W = 2 * PEAK_W};
        taper_learn_take(learn, &sample);
        energy_Wh += power_W / 60.0;
    }
    taper_fleet_watch(&fleet, learn);
    return taper_fleet_count(&fleet, learn);
}

static void passes(int32_t told_taper_W, double share) {
    taper_learn_t learn = arrives(told_taper_W, CAPACITY_Wh);
    TEST_ASSERT_TRUE(charges(&learn, share));
}

/** By what the guess is off at the end of the charge, as a share of the peak. */
static double off(const taper_learn_t *learn, double share) {
    return fabs(taper_learn_limit_W(learn, NEED_Wh) - limit_W(share, NEED_Wh)) / PEAK_W;
}

static double doubt(const taper_learn_t *learn) {
    return (double)taper_learn_deviation_W(learn, NEED_Wh) / PEAK_W;
}

static void test_a_station_that_has_seen_nobody_changes_nothing(void) {
    const taper_learn_t learn = arrives(0, CAPACITY_Wh);
    TEST_ASSERT_FALSE(taper_learn_knows(&learn));
    TEST_ASSERT_EQUAL_INT32(PEAK_W, taper_learn_limit_W(&learn, NEED_Wh));
}

static void test_among_vehicles_that_are_alike_the_next_one_is_known_before_it_charges(void) {
    for (unsigned k = 0; k < 5; k++) {
        passes(0, 0.6);
    }
    const taper_learn_t learn = arrives(0, CAPACITY_Wh);
    TEST_ASSERT_TRUE(taper_learn_knows(&learn));
    TEST_ASSERT_TRUE(off(&learn, 0.6) <= 0.05);
}

static void test_the_more_alike_the_less_doubt(void) {
    const taper_learn_t nobody = arrives(0, CAPACITY_Wh);
    passes(0, 0.6);
    const taper_learn_t one = arrives(0, CAPACITY_Wh);
    for (unsigned k = 0; k < 60; k++) {
        passes(0, 0.6);
    }
    const taper_learn_t many = arrives(0, CAPACITY_Wh);
    TEST_ASSERT_TRUE(doubt(&one) <= doubt(&nobody));
    TEST_ASSERT_TRUE(doubt(&many) < 0.25 * doubt(&nobody));
}

static void test_vehicles_that_differ_leave_as_much_doubt_as_they_differ(void) {
    for (unsigned k = 0; k < 60; k++) {
        passes(0, uniform(0.0, 0.9));
    }
    const taper_learn_t learn = arrives(0, CAPACITY_Wh);
    TEST_ASSERT_TRUE(off(&learn, 0.45) <= 0.1);
    TEST_ASSERT_TRUE(doubt(&learn) >
                     0.75 * 0.9 / sqrt(12.0)); /* SOC at the end times the deviation of the shares */
}

static void test_those_that_tell_a_taper_are_another_fleet(void) {
    for (unsigned k = 0; k < 5; k++) {
        passes(0, 0.6);
    }
    const taper_learn_t told = arrives(3000, CAPACITY_Wh);
    TEST_ASSERT_FALSE(taper_learn_knows(&told));
    for (unsigned k = 0; k < 5; k++) {
        passes(3000, 0.4); /* they tell less than it is */
    }
    const taper_learn_t next = arrives(6000, CAPACITY_Wh);
    TEST_ASSERT_TRUE(off(&next, 0.7) <= 0.03);
}

static void test_without_a_capacity_a_vehicle_is_not_compared(void) {
    taper_learn_t learn = arrives(0, 0);
    TEST_ASSERT_FALSE(charges(&learn, 0.6));
    passes(0, 0.6);
    learn = arrives(0, 0);
    TEST_ASSERT_FALSE(taper_learn_knows(&learn));
}

static void test_a_vehicle_that_has_shown_little_is_not_counted(void) {
    taper_learn_t learn = arrives(0, CAPACITY_Wh);
    const taper_learn_sample_t sample = {.energy_Wh = 100, .power_W = 7000, .offered_W = 2 * PEAK_W};
    taper_learn_take(&learn, &sample);
    TEST_ASSERT_FALSE(taper_fleet_count(&fleet, &learn));
}

static void test_one_that_is_out_of_the_ordinary_moves_the_others_little(void) {
    for (unsigned k = 0; k < 30; k++) {
        passes(0, 0.6);
    }
    passes(0, 0.0);
    const taper_learn_t learn = arrives(0, CAPACITY_Wh);
    TEST_ASSERT_TRUE(off(&learn, 0.6) <= 0.02);
}

static void test_a_fleet_that_changes_is_followed(void) {
    for (unsigned k = 0; k < 200; k++) {
        passes(0, 0.2);
    }
    for (unsigned k = 0; k < 300; k++) {
        passes(0, 0.7);
    }
    const taper_learn_t learn = arrives(0, CAPACITY_Wh);
    TEST_ASSERT_TRUE(off(&learn, 0.7) <= 0.05);
}

static void test_one_unlike_the_others_is_followed_all_the_same(void) {
    for (unsigned k = 0; k < 60; k++) {
        passes(0, 0.6);
    }
    taper_learn_t learn = arrives(0, CAPACITY_Wh);
    (void)charges(&learn, 0.1);
    TEST_ASSERT_TRUE(off(&learn, 0.1) <= 0.05);
}

static void test_the_noise_of_the_meters_is_known_to_the_next_one(void) {
    passes(0, 0.6); /* without noise: the least that is assumed */
    const taper_learn_t learn = arrives(0, CAPACITY_Wh);
    TEST_ASSERT_EQUAL_INT32(10, taper_learn_noise_permille(&learn));
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_a_station_that_has_seen_nobody_changes_nothing);
    RUN_TEST(test_among_vehicles_that_are_alike_the_next_one_is_known_before_it_charges);
    RUN_TEST(test_the_more_alike_the_less_doubt);
    RUN_TEST(test_vehicles_that_differ_leave_as_much_doubt_as_they_differ);
    RUN_TEST(test_those_that_tell_a_taper_are_another_fleet);
    RUN_TEST(test_without_a_capacity_a_vehicle_is_not_compared);
    RUN_TEST(test_a_vehicle_that_has_shown_little_is_not_counted);
    RUN_TEST(test_one_that_is_out_of_the_ordinary_moves_the_others_little);
    RUN_TEST(test_a_fleet_that_changes_is_followed);
    RUN_TEST(test_one_unlike_the_others_is_followed_all_the_same);
    RUN_TEST(test_the_noise_of_the_meters_is_known_to_the_next_one);
    return UNITY_END();
}
