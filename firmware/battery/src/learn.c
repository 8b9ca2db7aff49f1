#include "taper/learn.h"

#include <tgmath.h>

#include "taper/battery.h"
#include "taper/battery_slope.h"
#include "taper/real_math.h"

#define PER_KILO ((taper_real_t)0.001)
/* Deviation of a measurement, as a share of it, and what one look changes of that. Of normal noise the difference of two is
   below 0.954 deviations in half of all cases. */
#define LEAST_NOISE  ((taper_real_t)0.01)
#define MOST_NOISE   ((taper_real_t)0.06)
#define NOISE_MOVES  ((taper_real_t)1.05)
#define NOISE_MEDIAN ((taper_real_t)0.954)
#define NO_LOOK      ((taper_real_t)2)
/* Doubt in what was told: its peak, at SOC 0, and its fall over the charge, as shares of the peak. */
#define PEAK_DOUBT ((taper_real_t)0.20)
#define FALL_DOUBT ((taper_real_t)0.35)
/* The CUSUM: residuals are counted up to so many deviations, less the drift; beyond the last the line is wrong. */
#define CLIP  ((taper_real_t)3)
#define DRIFT ((taper_real_t)0.5)
#define WRONG ((taper_real_t)12)
/* A vehicle that takes all it may, so many deviations above the line, lifts it; and so far above, at once. */
#define LIFTS ((taper_real_t)3)
#define LEAPS ((taper_real_t)4)
/* An offer so far above the line is refused, if the line is right. */
#define CLEAR     ((taper_real_t)2)
#define LEAST_kW  ((taper_real_t)0.01)
#define LEAST_kWh ((taper_real_t)0.1)

static taper_real_t kilo(int32_t value) {
    return (taper_real_t)value * PER_KILO;
}

/* Deviation of a measurement of `power`, in steps of `step`. */
static taper_real_t noise_of(const taper_learn_t *learn, taper_real_t power, taper_real_t step) {
    return taper_real_max(power, LEAST_kW) * learn->noise + step / 2;
}

static taper_real_t fall_of(const taper_learn_t *learn) {
    return taper_real_max(-learn->slant / learn->spread, 0);
}

static taper_real_t limit_at(const taper_learn_t *learn, taper_real_t energy) {
    return taper_real_max(learn->level - fall_of(learn) * (energy - learn->centre), 0);
}

/* Variance of the line at an energy, in that of one measurement. */
static taper_real_t doubt_at(const taper_learn_t *learn, taper_real_t energy) {
    const taper_real_t away = energy - learn->centre;
    return 1 / learn->weight + away * away / learn->spread;
}

/* Energy over which the fall was told: the charge, and no more than the battery holds. */
static taper_real_t charge_of(const taper_demand_t *told) {
    const taper_real_t need = kilo(told->need_Wh);
    const taper_real_t charge = told->capacity_Wh > 0 ? taper_real_min(need, kilo(told->capacity_Wh)) : need;
    return taper_real_max(charge, LEAST_kWh);
}

/* Greatest fall that is not out of the ordinary. */
static taper_real_t fall_doubt(const taper_learn_t *learn, const taper_demand_t *told) {
    const taper_real_t over_charge = FALL_DOUBT * learn->peak / charge_of(told);
    return told->capacity_Wh > 0
               ? taper_real_min(over_charge, learn->peak / taper_real_max(kilo(told->capacity_Wh), LEAST_kWh))
               : over_charge;
}

static void hold_fall(taper_learn_t *learn, taper_real_t fall, taper_real_t spread) {
    learn->spread = taper_real_max(spread, learn->least_spread);
    learn->slant = -fall * learn->spread;
}

void taper_learn_begin(taper_learn_t *learn, const taper_demand_t *told, int32_t energy_Wh) {
    const int32_t stored_Wh = told->capacity_Wh > 0 ? told->stored_Wh : 0;
    *learn = (taper_learn_t){.centre = kilo(taper_max_i32(energy_Wh, 0)) - kilo(stored_Wh),
                             .noise = LEAST_NOISE,
                             .strayed = NO_LOOK};
    learn->peak = taper_real_max(kilo(taper_min_i32(told->peak_W, taper_demand_allowed_W(told))), LEAST_kW);
    learn->level = kilo(told->peak_W);
    const taper_real_t deviation = noise_of(learn, learn->peak, 0);
    const taper_real_t level_share = deviation / (PEAK_DOUBT * learn->peak);
    const taper_real_t fall_share = deviation / fall_doubt(learn, told);
    learn->weight = level_share * level_share;
    learn->least_spread = fall_share * fall_share;
    hold_fall(learn, taper_battery_slope_per_h(told, 0), 0);
}

/* The line was wrong: from here on by this sample, with its fall as a weak guess. */
static void begin_anew(taper_learn_t *learn, taper_real_t energy, taper_real_t power) {
    const taper_real_t fall = fall_of(learn);
    hold_fall(learn, fall, learn->spread / taper_real_max(learn->weight, 1));
    learn->centre = energy;
    learn->level = power;
    learn->weight = 1;
    learn->rises = 0;
    learn->falls = 0;
}

static void fade(taper_learn_t *learn) {
    const taper_real_t keep = (taper_real_t)TAPER_LEARN_MOST / (learn->weight + 1);
    if (keep < 1) {
        learn->weight *= keep;
        learn->slant *= keep;
        learn->spread *= keep;
    }
}

/* Welford's step, for a weighted sample. */
static void add(taper_learn_t *learn, taper_real_t energy, taper_real_t power, taper_real_t weight) {
    fade(learn);
    const taper_real_t away = energy - learn->centre;
    const taper_real_t share = weight / (learn->weight + weight);
    const taper_real_t cross = weight * (1 - share) * away;
    learn->spread += cross * away;
    learn->slant += cross * (power - learn->level);
    learn->centre += share * away;
    learn->level += share * (power - learn->level);
    learn->weight += weight;
}

/* Residuals on one side in a row. @return whether the line is wrong. */
static bool is_wrong(taper_learn_t *learn, taper_real_t residual) {
    const taper_real_t clipped = taper_real_min(taper_real_max(residual, -CLIP), CLIP);
    learn->rises = taper_real_max(learn->rises + clipped - DRIFT, 0);
    learn->falls = taper_real_max(learn->falls - clipped - DRIFT, 0);
    return learn->rises > WRONG || learn->falls > WRONG;
}

static void fit(taper_learn_t *learn, taper_real_t energy, taper_real_t power, taper_real_t residual) {
    const taper_real_t huber = (taper_real_t)TAPER_LEARN_HUBER;
    const taper_real_t size = fabs(residual);
    learn->knows = true;
    if (is_wrong(learn, residual)) {
        begin_anew(learn, energy, power);
    } else {
        add(learn, energy, power, size > huber ? huber / size : 1);
    }
}

/* The noise, by what changes between two looks in what is off: a wrong line is off by the same in both. */
static void watch_noise(taper_learn_t *learn, taper_real_t energy, taper_real_t power, taper_real_t offered) {
    const taper_real_t expected = taper_real_min(limit_at(learn, energy), offered);
    const taper_real_t strays = expected > LEAST_kW ? power / expected - 1 : NO_LOOK;
    if (fabs(strays) < 1 && fabs(learn->strayed) < 1) {
        const bool more = fabs(strays - learn->strayed) > NOISE_MEDIAN * learn->noise;
        const taper_real_t noise = more ? learn->noise * NOISE_MOVES : learn->noise / NOISE_MOVES;
        learn->noise = taper_real_min(taper_real_max(noise, LEAST_NOISE), MOST_NOISE);
    }
    learn->strayed = strays;
}

/* A vehicle that takes all: its limit is at least this. */
static void lift(taper_learn_t *learn, taper_real_t energy, taper_real_t power, taper_real_t noise) {
    if (limit_at(learn, energy) < power - LEAPS * noise) {
        learn->knows = true;
        begin_anew(learn, energy, power);
    }
}

/*
 * All that is drawn of an offer clear of the line counts as a sample: to leave out what noise raises would pull the line down,
 * and most where it is poor; its slope would follow.
 */
void taper_learn_take(taper_learn_t *learn, const taper_learn_sample_t *sample) {
    if (!(learn->weight > 0) || sample->energy_Wh < 0 || sample->power_W < 0) {
        return;
    }
    const taper_real_t energy = kilo(sample->energy_Wh);
    const taper_real_t power = kilo(sample->power_W);
    const taper_real_t offered = kilo(sample->offered_W);
    watch_noise(learn, energy, power, offered);
    const taper_real_t noise = noise_of(learn, power, kilo(taper_max_i32(sample->step_W, 0)));
    const taper_real_t limit = limit_at(learn, energy);
    const taper_real_t residual = (power - limit) / (noise * sqrt(1 + doubt_at(learn, energy)));
    if (sample->limits || offered > limit + CLEAR * noise || residual >= LIFTS) {
        fit(learn, energy, power, residual);
    }
    if (!sample->limits) {
        lift(learn, energy, power, noise);
    }
}

int32_t taper_learn_limit_W(const taper_learn_t *learn, int32_t energy_Wh) {
    if (!(learn->weight > 0)) {
        return 0;
    }
    return taper_real_to_W(limit_at(learn, kilo(energy_Wh)) / PER_KILO, INT32_MAX);
}

int32_t taper_learn_noise_permille(const taper_learn_t *learn) {
    return taper_real_to_W(learn->noise * 1000, 1000);
}

bool taper_learn_knows(const taper_learn_t *learn) {
    return learn->knows;
}

bool taper_learn_is_sure(const taper_learn_t *learn, int32_t energy_Wh, int32_t need_Wh) {
    if (!learn->knows) {
        return false;
    }
    const taper_real_t end = kilo(energy_Wh) + kilo(taper_max_i32(need_Wh, 0));
    const taper_real_t most = learn->peak * TAPER_LEARN_SURE_permille * PER_KILO;
    const taper_real_t deviation = noise_of(learn, learn->level, 0);
    return deviation * deviation * doubt_at(learn, end) < most * most;
}

/* A battery that is not known: one that begins empty and ends with the need. */
static void assume_battery(taper_demand_t *demand, int32_t energy_Wh) {
    demand->stored_Wh = energy_Wh;
    demand->capacity_Wh = taper_max_i32(taper_saturate_i32((int64_t)energy_Wh + demand->need_Wh), 1000);
}

void taper_learn_apply(const taper_learn_t *learn, int32_t energy_Wh, taper_demand_t *demand) {
    if (!learn->knows || energy_Wh < 0) {
        return;
    }
    if (demand->capacity_Wh <= 0) {
        assume_battery(demand, energy_Wh);
    }
    const int32_t limit_W = taper_learn_limit_W(learn, energy_Wh);
    demand->taper_W = taper_real_to_W(fall_of(learn) * (taper_real_t)demand->capacity_Wh, INT32_MAX / 2);
    const int64_t fallen_W = (int64_t)demand->taper_W * demand->stored_Wh / demand->capacity_Wh;
    demand->peak_W = taper_saturate_i32(limit_W + fallen_W);
    demand->second_peak_W = demand->second_taper_W = 0; /* one line is learned */
}

bool taper_learn_moved(taper_learn_t *learn, int32_t energy_Wh, int32_t need_Wh, int32_t permille) {
    if (!learn->knows) {
        return false;
    }
    const taper_real_t now = kilo(energy_Wh);
    const taper_real_t end = now + kilo(need_Wh);
    const taper_real_t fall = fall_of(learn);
    const taper_real_t limit = learn->level + fall * learn->centre;
    const taper_real_t higher = limit - learn->noted_limit;
    const taper_real_t steeper = fall - learn->noted_fall;
    const taper_real_t most = taper_real_max(fabs(higher - steeper * now), fabs(higher - steeper * end));
    const bool moved = !learn->noted || most > learn->peak * kilo(permille);
    if (moved) {
        learn->noted = true;
        learn->noted_limit = limit;
        learn->noted_fall = fall;
    }
    return moved;
}
