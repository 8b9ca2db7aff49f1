/* What a vehicle accepts shows its taper: how soon, how well, and what cannot lead the estimate astray. */
#include <math.h>
#include <stdint.h>

#include "taper/battery.h"
#include "taper/battery_slope.h"
#include "taper/learn.h"
#include "unity.h"

#define STEP_mA 100
#define VOLTS   230
#define TRIALS  50

/** A vehicle, and what it tells of itself. */
typedef struct {
    double peak_W, fall_per_h; /**< of its limit, over the energy charged */
    double flat_Wh;            /**< until then the limit does not fall */
    double charge_Wh;
    double told_peak_W, told_taper_W; /**< over the charge */
    double noise;                     /**< of a measurement */
    unsigned outlier_every;           /**< so many samples are right, one is half; 0: all are */
    unsigned period_s;
} scene_t;

typedef struct {
    scene_t scene;
    taper_learn_t learn;
    double energy_Wh;
    uint32_t random, count;
} trial_t;

static trial_t trial;

void setUp(void) {}
void tearDown(void) {}

static const scene_t plain = {.peak_W = 7000,
                              .fall_per_h = 0.15,
                              .charge_Wh = 30000,
                              .told_peak_W = 7000,
                              .told_taper_W = 0,
                              .noise = 0.01,
                              .period_s = 1};

static double uniform(void) {
    trial.random = trial.random * 1664525u + 1013904223u;
    return (trial.random >> 8) / 16777216.0;
}

/** Irwin and Hall's: near enough to normal. */
static double normal(void) {
    double sum = -6.0;
    for (unsigned i = 0; i < 12; i++) {
        sum += uniform();
    }
    return sum;
}

static double limit_W(double energy_Wh) {
    const scene_t *scene = &trial.scene;
    return fmax(scene->peak_W - scene->fall_per_h * fmax(energy_Wh - scene->flat_Wh, 0.0), 0.0);
}

static void begin(const scene_t *scene, uint32_t seed) {
    trial = (trial_t){.scene = *scene, .random = seed};
    const taper_demand_t told = {.active = true,
                                 .need_Wh = (int32_t)scene->charge_Wh,
                                 .capacity_Wh = (int32_t)scene->charge_Wh,
                                 .peak_W = (int32_t)scene->told_peak_W,
                                 .taper_W = (int32_t)scene->told_taper_W,
                                 .max_mA = 640000,
                                 .W_per_A = VOLTS};
    taper_learn_begin(&trial.learn, &told, 0);
}

/** As EVSE_STATUS carries it: rounded up, the middle of the step. */
static int32_t measured_W(double power_W) {
    const double current_mA = power_W / VOLTS * 1000.0;
    return (int32_t)((ceil(current_mA / STEP_mA) - 0.5) * STEP_mA / 1000.0 * VOLTS);
}

static void look(double offered_W) {
    const scene_t *scene = &trial.scene;
    const double draws_W = fmin(limit_W(trial.energy_Wh), offered_W);
    const bool outlier = scene->outlier_every > 0 && ++trial.count % scene->outlier_every == 0;
    const double seen_W = draws_W * (1.0 + scene->noise * normal()) * (outlier ? 0.5 : 1.0);
    const taper_learn_sample_t sample = {.energy_Wh = (int32_t)(trial.energy_Wh / 10.0) * 10,
                                         .power_W = measured_W(seen_W),
                                         .step_W = STEP_mA * VOLTS / 1000,
                                         .offered_W = (int32_t)offered_W};
    taper_learn_take(&trial.learn, &sample);
    trial.energy_Wh += draws_W * scene->period_s / 3600.0;
}

/** Charge up to a share of the whole, at more than the vehicle takes. */
static void charge_to(double share) {
    while (trial.energy_Wh < share * trial.scene.charge_Wh) {
        look(2.0 * trial.scene.peak_W);
    }
}

/** The greatest error from now to the end of the charge, as a share of the peak. */
static double error(void) {
    double worst = 0.0;
    for (double e = trial.energy_Wh; e <= trial.scene.charge_Wh; e += 100.0) {
        worst = fmax(worst, fabs(taper_learn_limit_W(&trial.learn, (int32_t)e) - limit_W(e)));
    }
    return worst / trial.scene.peak_W;
}

static double error_after_a_tenth(const scene_t *scene) {
    double worst = 0.0;
    for (uint32_t seed = 1; seed <= TRIALS; seed++) {
        begin(scene, seed);
        charge_to(0.1);
        worst = fmax(worst, error());
    }
    return worst;
}

/** Of flat, usual and steep tapers, the worst after a tenth of the charge. */
static void assert_learned_after_a_tenth(scene_t scene, double most) {
    static const double falls_per_h[] = {0.0, 0.05, 0.15, 0.22};
    for (unsigned k = 0; k < sizeof falls_per_h / sizeof falls_per_h[0]; k++) {
        scene.fall_per_h = falls_per_h[k];
        TEST_ASSERT_TRUE_MESSAGE(error_after_a_tenth(&scene) <= most, "the line is further off");
    }
}

static void test_a_taper_is_known_to_5_percent_after_a_tenth_of_a_charge(void) {
    assert_learned_after_a_tenth(plain, 0.05);
}

static void test_a_wrong_first_guess_is_overcome(void) {
    scene_t scene = plain;
    scene.told_taper_W = 9000; /* twice the steepest, nearly */
    scene.told_peak_W = 9100;
    assert_learned_after_a_tenth(scene, 0.05);
    scene.told_taper_W = 0;
    assert_learned_after_a_tenth(scene, 0.05); /* 30 % too high */
    scene.told_peak_W = 4900;
    assert_learned_after_a_tenth(scene, 0.05); /* 30 % too low */
}

static void test_outliers_do_not_lead_astray(void) {
    scene_t scene = plain;
    scene.outlier_every = 20;
    assert_learned_after_a_tenth(scene, 0.05);
    scene.told_peak_W = 4900;
    assert_learned_after_a_tenth(scene, 0.05);
}

static void test_a_sample_each_minute_does_where_there_is_no_noise(void) {
    scene_t scene = plain;
    scene.noise = 0.0;
    scene.period_s = 60;
    assert_learned_after_a_tenth(scene, 0.05);
    scene.told_peak_W = 4900;
    assert_learned_after_a_tenth(scene, 0.05);
    scene.told_peak_W = 9100;
    scene.told_taper_W = 9000;
    assert_learned_after_a_tenth(scene, 0.05);
}

static void test_energies_up_to_100_kWh_lose_no_precision(void) {
    scene_t scene = plain;
    scene.noise = 0.0;
    scene.charge_Wh = 100000;
    scene.fall_per_h = 0.06;
    begin(&scene, 1);
    charge_to(0.9);
    TEST_ASSERT_TRUE(error() <= 0.01);
}

static void test_noise_of_3_percent_is_noticed_and_averaged(void) {
    scene_t scene = plain;
    scene.noise = 0.03;
    begin(&scene, 1);
    charge_to(0.02);
    TEST_ASSERT_INT32_WITHIN(10, 30, taper_learn_noise_permille(&trial.learn));
    charge_to(0.3);
    TEST_ASSERT_TRUE(error() <= 0.05);
}

static void test_a_battery_that_was_flat_so_far_is_followed_round_its_knee(void) {
    scene_t scene = plain;
    scene.flat_Wh = 12000;
    scene.fall_per_h = 0.3;
    begin(&scene, 1);
    charge_to(0.39);
    TEST_ASSERT_INT32_WITHIN(100, 7000, taper_learn_limit_W(&trial.learn, (int32_t)trial.energy_Wh));
    charge_to(0.6);
    TEST_ASSERT_TRUE(error() <= 0.05);
}

static void test_what_was_drawn_is_possible(void) {
    begin(&plain, 1);
    charge_to(0.1);
    trial.scene.peak_W += 2000; /* it was cold, and is warm now */
    look(limit_W(trial.energy_Wh));
    const double drawn_W = limit_W(trial.energy_Wh);
    TEST_ASSERT_TRUE(taper_learn_limit_W(&trial.learn, (int32_t)trial.energy_Wh) >= 0.93 * drawn_W);
}

static void test_a_vehicle_that_takes_all_it_may_lowers_nothing(void) {
    scene_t scene = plain;
    begin(&scene, 1);
    for (unsigned k = 0; k < 600; k++) {
        look(3000.0);
    }
    TEST_ASSERT_FALSE(taper_learn_knows(&trial.learn));
    TEST_ASSERT_INT32_WITHIN(1, 7000, taper_learn_limit_W(&trial.learn, (int32_t)trial.energy_Wh));
}

static void test_noise_of_offers_that_are_taken_whole_lowers_nothing(void) {
    scene_t scene = plain;
    scene.noise = 0.05;
    for (uint32_t seed = 1; seed <= TRIALS; seed++) {
        begin(&scene, seed);
        charge_to(0.02);
        for (unsigned k = 0; k < 3600; k++) {
            look(fmin(taper_learn_limit_W(&trial.learn, (int32_t)trial.energy_Wh), limit_W(trial.energy_Wh)));
        }
        const double now_W = taper_learn_limit_W(&trial.learn, (int32_t)trial.energy_Wh);
        TEST_ASSERT_TRUE(now_W >= 0.9 * limit_W(trial.energy_Wh));
    }
}

static void test_a_vehicle_that_goes_on_taking_less_than_it_may_has_a_lower_limit(void) {
    begin(&plain, 1);
    trial.scene.peak_W = 6600;
    for (unsigned k = 0; k < 60; k++) {
        look(taper_learn_limit_W(&trial.learn, (int32_t)trial.energy_Wh));
    }
    TEST_ASSERT_INT32_WITHIN(150, 6600, taper_learn_limit_W(&trial.learn, (int32_t)trial.energy_Wh));
}

static void test_a_guess_weighs_by_the_noise_that_there_is(void) {
    scene_t scene = plain;
    scene.told_taper_W = scene.fall_per_h * scene.charge_Wh;
    scene.noise = 0.05;
    for (uint32_t seed = 1; seed <= TRIALS; seed++) {
        begin(&scene, seed);
        taper_learn_assume(&trial.learn, &(taper_learn_shift_t){.level_variance = (taper_real_t)0.0004,
                                                                .fall_variance = (taper_real_t)0.0016});
        charge_to(0.02);
        TEST_ASSERT_TRUE(error() <= 0.05); /* samples alone leave a multiple of that */
    }
}

static void test_a_limit_that_rises_with_energy_is_taken_for_flat(void) {
    scene_t scene = plain;
    scene.fall_per_h = -0.1;
    begin(&scene, 1);
    for (unsigned k = 0; k < 3000; k++) {
        look(20000.0);
        taper_demand_t demand = {.active = true, .need_Wh = 20000, .capacity_Wh = 30000};
        taper_learn_apply(&trial.learn, (int32_t)trial.energy_Wh, &demand);
        TEST_ASSERT_TRUE(demand.taper_W >= 0);
    }
}

static void test_the_demand_gets_limit_and_slope_of_the_line(void) {
    scene_t scene = plain;
    scene.noise = 0.0;
    begin(&scene, 1);
    charge_to(0.2);
    const int32_t energy_Wh = (int32_t)trial.energy_Wh;
    taper_demand_t known = {.active = true, .need_Wh = 24000, .capacity_Wh = 60000, .stored_Wh = 25000};
    taper_demand_t unknown = {.active = true, .need_Wh = 24000};
    taper_learn_apply(&trial.learn, energy_Wh, &known);
    taper_learn_apply(&trial.learn, energy_Wh, &unknown);
    TEST_ASSERT_INT32_WITHIN(70, (int32_t)limit_W(energy_Wh), taper_battery_limit_W(&known));
    TEST_ASSERT_INT32_WITHIN(70, (int32_t)limit_W(energy_Wh), taper_battery_limit_W(&unknown));
    TEST_ASSERT_TRUE(fabs((double)taper_battery_slope_per_h(&known, 0) - 0.15) < 0.005);
    TEST_ASSERT_TRUE(fabs((double)taper_battery_slope_per_h(&unknown, 0) - 0.15) < 0.005);
    TEST_ASSERT_EQUAL_INT32(25000, known.stored_Wh);
    TEST_ASSERT_EQUAL_INT32(60000, known.capacity_Wh);
}

static void test_without_a_sample_the_demand_stays_as_told(void) {
    begin(&plain, 1);
    taper_demand_t demand = {.active = true, .need_Wh = 24000, .peak_W = 5000, .taper_W = 77};
    taper_learn_apply(&trial.learn, 0, &demand);
    TEST_ASSERT_EQUAL_INT32(5000, demand.peak_W);
    TEST_ASSERT_EQUAL_INT32(77, demand.taper_W);
    TEST_ASSERT_EQUAL_INT32(0, demand.capacity_Wh);
}

static void test_a_line_is_sure_after_a_while_and_told_when_it_moves(void) {
    begin(&plain, 1);
    const int32_t charge_Wh = (int32_t)plain.charge_Wh;
    TEST_ASSERT_FALSE(taper_learn_is_sure(&trial.learn, 0, charge_Wh));
    TEST_ASSERT_FALSE(taper_learn_moved(&trial.learn, 0, charge_Wh, 50));
    charge_to(0.3);
    const int32_t left_Wh = charge_Wh - (int32_t)trial.energy_Wh;
    TEST_ASSERT_TRUE(taper_learn_is_sure(&trial.learn, (int32_t)trial.energy_Wh, left_Wh));
    TEST_ASSERT_TRUE(taper_learn_moved(&trial.learn, (int32_t)trial.energy_Wh, left_Wh, 50));
    charge_to(0.4); /* it falls, on the same line */
    TEST_ASSERT_FALSE(taper_learn_moved(&trial.learn, (int32_t)trial.energy_Wh, left_Wh, 50));
    trial.scene.peak_W = 4000;
    charge_to(0.45);
    TEST_ASSERT_TRUE(taper_learn_moved(&trial.learn, (int32_t)trial.energy_Wh, left_Wh, 50));
}

static int32_t any(void) {
    static const int32_t odd[] = {INT32_MIN, INT32_MAX, 0, 1, -1, 100000};
    const double pick = uniform();
    return pick < 0.5 ? odd[(unsigned)(pick * 12.0)] : (int32_t)((uniform() - 0.5) * 4e9);
}

static void test_garbage_makes_no_nonsense(void) {
    trial.random = 7;
    for (unsigned k = 0; k < 20000; k++) {
        if (k % 50 == 0) {
            const taper_demand_t told = {.active = true,
                                         .need_Wh = taper_max_i32(any(), 1),
                                         .capacity_Wh = taper_max_i32(any(), 0),
                                         .stored_Wh = taper_max_i32(any(), 0),
                                         .peak_W = taper_max_i32(any(), 0),
                                         .taper_W = taper_max_i32(any(), 0),
                                         .max_mA = 32000,
                                         .W_per_A = 230};
            taper_learn_begin(&trial.learn, &told, any());
        }
        const taper_learn_sample_t sample = {
            .energy_Wh = any(), .power_W = any(), .step_W = any(), .offered_W = any()};
        taper_learn_take(&trial.learn, &sample);
        const int32_t energy_Wh = any();
        taper_demand_t demand = {.active = true, .need_Wh = 1000, .capacity_Wh = 60000};
        taper_learn_apply(&trial.learn, energy_Wh, &demand);
        TEST_ASSERT_TRUE(taper_learn_limit_W(&trial.learn, energy_Wh) >= 0);
        TEST_ASSERT_TRUE(demand.taper_W >= 0 && demand.peak_W >= 0);
        TEST_ASSERT_TRUE(taper_learn_noise_permille(&trial.learn) >= 10);
        taper_learn_shift_t shown = {0};
        if (taper_learn_shown(&trial.learn, &shown)) {
            TEST_ASSERT_TRUE(isfinite((double)shown.level) && isfinite((double)shown.fall));
        }
    }
}

static void test_a_line_that_was_never_begun_says_nothing(void) {
    trial = (trial_t){.random = 1};
    taper_learn_take(&trial.learn, &(taper_learn_sample_t){.energy_Wh = 1, .power_W = 1, .offered_W = 2});
    TEST_ASSERT_FALSE(taper_learn_knows(&trial.learn));
    TEST_ASSERT_EQUAL_INT32(0, taper_learn_limit_W(&trial.learn, 0));
    TEST_ASSERT_FALSE(taper_learn_is_sure(&trial.learn, 0, 1000));
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_a_taper_is_known_to_5_percent_after_a_tenth_of_a_charge);
    RUN_TEST(test_a_wrong_first_guess_is_overcome);
    RUN_TEST(test_outliers_do_not_lead_astray);
    RUN_TEST(test_a_sample_each_minute_does_where_there_is_no_noise);
    RUN_TEST(test_energies_up_to_100_kWh_lose_no_precision);
    RUN_TEST(test_noise_of_3_percent_is_noticed_and_averaged);
    RUN_TEST(test_a_battery_that_was_flat_so_far_is_followed_round_its_knee);
    RUN_TEST(test_what_was_drawn_is_possible);
    RUN_TEST(test_a_vehicle_that_takes_all_it_may_lowers_nothing);
    RUN_TEST(test_noise_of_offers_that_are_taken_whole_lowers_nothing);
    RUN_TEST(test_a_vehicle_that_goes_on_taking_less_than_it_may_has_a_lower_limit);
    RUN_TEST(test_a_guess_weighs_by_the_noise_that_there_is);
    RUN_TEST(test_a_limit_that_rises_with_energy_is_taken_for_flat);
    RUN_TEST(test_the_demand_gets_limit_and_slope_of_the_line);
    RUN_TEST(test_without_a_sample_the_demand_stays_as_told);
    RUN_TEST(test_a_line_is_sure_after_a_while_and_told_when_it_moves);
    RUN_TEST(test_garbage_makes_no_nonsense);
    RUN_TEST(test_a_line_that_was_never_begun_says_nothing);
    return UNITY_END();
}
