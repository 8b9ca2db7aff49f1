/* What a vehicle accepts shows its taper: how soon, how well, and what cannot lead the estimate astray. */
#include <math.h>
#include <stdint.h>
#include <stdio.h>

#include "taper/battery.h"
#include "taper/battery_slope.h"
#include "taper/learn.h"
#include "unity.h"

#define STEP_mA 100
#define VOLTS   230

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
                                         .offered_W = (int32_t)offered_W,
                                         .limits = draws_W < offered_W * 0.97 - 50.0 || outlier};
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
    for (uint32_t seed = 1; seed <= 200; seed++) {
        begin(scene, seed);
        charge_to(0.1);
        worst = fmax(worst, error());
    }
    return worst;
}

static void report(const char *name, scene_t scene) {
    printf("%s:", name);
    for (int k = 0; k < 3; k++) {
        scene_t s = scene;
        s.fall_per_h = (double[]){0.05, 0.15, 0.22}[k];
        printf(" %.4f", error_after_a_tenth(&s));
    }
    printf("\n");
}

static void test_lab(void) {
    scene_t s = plain;
    report("plain 1Hz", s);
    s.told_taper_W = 9000;
    s.told_peak_W = 9100;
    report("told 2x", s);
    s = plain;
    s.told_peak_W = 9100;
    report("peak +30", s);
    s = plain;
    s.told_peak_W = 4900;
    report("peak -30", s);
    s = plain;
    s.outlier_every = 20;
    report("outliers", s);
    s = plain;
    s.outlier_every = 20;
    s.told_peak_W = 4900;
    report("outliers, peak -30", s);
    s = plain;
    s.noise = 0;
    report("noiseless 1 s", s);
    s = plain;
    s.noise = 0;
    s.period_s = 60;
    report("noiseless 60 s", s);
    s.told_peak_W = 4900;
    report("noiseless 60 s peak -30", s);
    s.told_taper_W = 9000;
    s.told_peak_W = 9100;
    report("noiseless 60 s 2x", s);
    s = plain;
    s.period_s = 60;
    report("60 s noise 1 %", s);
    s = plain;
    s.charge_Wh = 8000;
    report("8 kWh", s);
    s = plain;
    s.charge_Wh = 8000;
    s.noise = 0;
    s.period_s = 60;
    report("8 kWh noiseless 60 s", s);
    s = plain;
    s.charge_Wh = 100000;
    s.peak_W = 100000;
    s.told_peak_W = 90000;
    s.noise = 0.01;
    report("DC", s);
}
int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_lab);
    return UNITY_END();
}
