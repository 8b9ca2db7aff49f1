#include "taper/learn.h"

#include <tgmath.h>

#include "taper/battery.h"
#include "taper/battery_slope.h"
#include "taper/real_math.h"

#define PER_KILO ((taper_real_t)0.001)
/* Deviation of a measurement, as a share of it, and what one look changes of that. Of normal noise the difference of two is
   below 0.954 deviations in half of all cases; for a median, to move by 1/n at the n-th look is about best. */
#define LEAST_NOISE  ((taper_real_t)0.01)
#define FIRST_NOISE  ((taper_real_t)0.025)
#define SETTLED      16
#define MOST_NOISE   ((taper_real_t)0.06)
#define NOISE_MOVES  ((taper_real_t)0.05)
#define NOISE_MEDIAN ((taper_real_t)0.954)
#define NO_LOOK      ((taper_real_t)2)
/* Doubt in what was told: its peak, at SOC 0, and its fall over the charge, as shares of the peak. */
#define PEAK_DOUBT ((taper_real_t)0.20)
#define FALL_DOUBT ((taper_real_t)0.35)
/* The CUSUM: residuals are counted up to so many deviations, less the drift; beyond the last the line is wrong. */
#define CLIP  ((taper_real_t)3)
#define DRIFT ((taper_real_t)0.5)
#define WRONG ((taper_real_t)12)
/* A vehicle that takes so many deviations more than the line, or less than it may, has shown that at once: no noise does that,
   even if its deviation is taken for half of what it is. */
#define LEAPS ((taper_real_t)8)
/* So many deviations less than an offer are not held against a vehicle that follows it. */
#define SPARED ((taper_real_t)1)
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

static taper_real_t square(taper_real_t value) {
    return value * value;
}

/* Of both together. Neither weight is negative, and one is not 0. */
static taper_learn_sums_t merged(const taper_learn_sums_t *one, const taper_learn_sums_t *other) {
    const taper_real_t weight = one->weight + other->weight;
    const taper_real_t share = other->weight / weight;
    const taper_real_t away = other->centre - one->centre;
    const taper_real_t higher = other->level - one->level;
    const taper_real_t cross = one->weight * share * away;
    return (taper_learn_sums_t){.weight = weight,
                                .centre = one->centre + share * away,
                                .level = one->level + share * higher,
                                .spread = one->spread + other->spread + cross * away,
                                .slant = one->slant + other->slant + cross * higher};
}

/* The line: samples, and a guess that weighs as samples would that know as much. */
static taper_learn_sums_t line_of(const taper_learn_t *learn) {
    const taper_learn_guess_t *guess = &learn->guess;
    const taper_real_t variance = square(noise_of(learn, learn->peak, 0));
    const taper_real_t spread = variance / guess->fall_variance;
    const taper_learn_sums_t weighed = {.weight = variance / guess->level_variance,
                                        .centre = guess->centre,
                                        .level = guess->level,
                                        .spread = spread,
                                        .slant = -guess->fall * spread};
    return merged(&weighed, &learn->samples);
}

static taper_real_t fall_of(const taper_learn_sums_t *line) {
    return taper_real_max(-line->slant / line->spread, 0);
}

static taper_real_t limit_at(const taper_learn_sums_t *line, taper_real_t energy) {
    return taper_real_max(line->level - fall_of(line) * (energy - line->centre), 0);
}

/* Variance of the line at an energy, in that of one measurement. */
static taper_real_t doubt_at(const taper_learn_sums_t *line, taper_real_t energy) {
    const taper_real_t away = energy - line->centre;
    return 1 / line->weight + away * away / line->spread;
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

void taper_learn_begin(taper_learn_t *learn, const taper_demand_t *told, int32_t energy_Wh) {
    const int32_t stored_Wh = told->capacity_Wh > 0 ? told->stored_Wh : 0;
    *learn = (taper_learn_t){.noise = FIRST_NOISE, .strayed = NO_LOOK, .tells = told->taper_W > 0};
    learn->peak = taper_real_max(kilo(taper_min_i32(told->peak_W, taper_demand_allowed_W(told))), LEAST_kW);
    learn->capacity = told->capacity_Wh > 0 ? taper_real_max(kilo(told->capacity_Wh), LEAST_kWh) : 0;
    learn->told = (taper_learn_guess_t){.centre = kilo(taper_max_i32(energy_Wh, 0)) - kilo(stored_Wh),
                                        .level = kilo(told->peak_W),
                                        .fall = taper_real_max(taper_battery_slope_per_h(told, 0), 0),
                                        .level_variance = square(PEAK_DOUBT * learn->peak),
                                        .fall_variance = square(fall_doubt(learn, told))};
    learn->guess = learn->told;
}

bool taper_learn_tells(const taper_learn_t *learn) {
    return learn->tells;
}

bool taper_learn_first(const taper_learn_t *learn, taper_learn_shift_t *shift) {
    if (!(learn->capacity > 0)) {
        return false;
    }
    *shift = (taper_learn_shift_t){.level_variance = square(PEAK_DOUBT),
                                   .fall_variance =
                                       learn->told.fall_variance * square(learn->capacity / learn->peak)};
    return true;
}

bool taper_learn_shown(const taper_learn_t *learn, taper_learn_shift_t *shift) {
    const taper_learn_sums_t *samples = &learn->samples;
    if (!(learn->capacity > 0) || !(samples->spread > 0)) {
        return false;
    }
    const taper_real_t fall = -samples->slant / samples->spread;
    const taper_real_t level = samples->level - fall * (learn->told.centre - samples->centre);
    *shift =
        (taper_learn_shift_t){.level = (level - learn->told.level) / learn->peak,
                              .fall = (fall - learn->told.fall) * learn->capacity / learn->peak,
                              .level_variance = square(learn->noise) * doubt_at(samples, learn->told.centre),
                              .fall_variance = square(learn->noise * learn->capacity) / samples->spread};
    return true;
}

void taper_learn_assume(taper_learn_t *learn, const taper_learn_shift_t *shift) {
    if (learn->anew || !(learn->capacity > 0)) {
        return;
    }
    const taper_real_t per_kWh = learn->peak / learn->capacity;
    learn->guess.level = learn->told.level + shift->level * learn->peak;
    learn->guess.fall = taper_real_max(learn->told.fall + shift->fall * per_kWh, 0);
    learn->guess.level_variance = shift->level_variance * square(learn->peak);
    learn->guess.fall_variance = shift->fall_variance * square(per_kWh);
    learn->knows = true;
}

bool taper_learn_noise(const taper_learn_t *learn, taper_real_t *noise) {
    *noise = learn->noise;
    return learn->looks >= SETTLED;
}

void taper_learn_assume_noise(taper_learn_t *learn, taper_real_t noise) {
    if (learn->looks == 0) {
        learn->noise = taper_real_min(taper_real_max(noise, LEAST_NOISE), MOST_NOISE);
        learn->looks = SETTLED;
    }
}

/* The line was wrong: from here on by this sample, its fall in doubt as at first. Its noise had a part in choosing it, so it
   counts for two deviations. */
static void begin_anew(taper_learn_t *learn, const taper_learn_sums_t *line, taper_real_t energy,
                       taper_real_t power) {
    learn->guess = (taper_learn_guess_t){.centre = energy,
                                         .level = power,
                                         .fall = fall_of(line),
                                         .level_variance = square(2 * noise_of(learn, learn->peak, 0)),
                                         .fall_variance = learn->told.fall_variance};
    learn->samples = (taper_learn_sums_t){.weight = 0};
    learn->rises = 0;
    learn->falls = 0;
    learn->anew = true;
}

static void fade(taper_learn_sums_t *samples) {
    const taper_real_t keep = (taper_real_t)TAPER_LEARN_MOST / (samples->weight + 1);
    if (keep < 1) {
        samples->weight *= keep;
        samples->slant *= keep;
        samples->spread *= keep;
    }
}

static void add(taper_learn_t *learn, taper_real_t energy, taper_real_t power, taper_real_t weight) {
    const taper_learn_sums_t sample = {.weight = weight, .centre = energy, .level = power};
    fade(&learn->samples);
    learn->samples = merged(&learn->samples, &sample);
}

/* Residuals on one side in a row. @return whether the line is wrong. */
static bool is_wrong(taper_learn_t *learn, taper_real_t residual) {
    const taper_real_t clipped = taper_real_min(taper_real_max(residual, -CLIP), CLIP);
    learn->rises = taper_real_max(learn->rises + clipped - DRIFT, 0);
    learn->falls = taper_real_max(learn->falls - clipped - DRIFT, 0);
    return learn->rises > WRONG || learn->falls > WRONG;
}

/* A line that lies below what the vehicle takes by so much is left at once: what was drawn is possible. */
static void fit(taper_learn_t *learn, const taper_learn_sums_t *line, taper_real_t energy, taper_real_t power,
                taper_real_t noise) {
    const taper_real_t huber = (taper_real_t)TAPER_LEARN_HUBER;
    const taper_real_t higher = power - limit_at(line, energy);
    const taper_real_t residual = higher / (noise * sqrt(1 + doubt_at(line, energy)));
    const taper_real_t size = fabs(residual);
    learn->knows = true;
    if (is_wrong(learn, residual) || higher > LEAPS * noise) {
        begin_anew(learn, line, energy, power);
    } else {
        add(learn, energy, power, size > huber ? huber / size : 1);
    }
}

static void move_noise(taper_learn_t *learn, bool more) {
    learn->looks = learn->looks < UINT8_MAX ? (uint8_t)(learn->looks + 1) : learn->looks;
    const taper_real_t factor = 1 + taper_real_max(1 / (taper_real_t)learn->looks, NOISE_MOVES);
    const taper_real_t noise = more ? learn->noise * factor : learn->noise / factor;
    learn->noise = taper_real_min(taper_real_max(noise, LEAST_NOISE), MOST_NOISE);
}

/* The noise, by what changes between two looks in what is off: a wrong line is off by the same in both. */
static void watch_noise(taper_learn_t *learn, taper_real_t limit, taper_real_t power, taper_real_t offered) {
    const taper_real_t expected = taper_real_min(limit, offered);
    const taper_real_t strays = expected > LEAST_kW ? power / expected - 1 : NO_LOOK;
    if (fabs(strays) < 1 && fabs(learn->strayed) < 1) {
        move_noise(learn, fabs(strays - learn->strayed) > NOISE_MEDIAN * learn->noise);
    }
    learn->strayed = strays;
}

/*
 * Of an offer that is not clear of the line, what noise lowers looks like a limit: to take that for a sample would pull the line
 * down, offers with it, and so on. Only what noise hardly does counts at once; else it takes several looks in a row.
 */
static void watch_shortfall(taper_learn_t *learn, const taper_learn_sums_t *line, taper_real_t energy,
                            taper_real_t power, taper_real_t short_by) {
    const taper_real_t counts = taper_real_min(taper_real_max(short_by - SPARED, -CLIP), CLIP);
    learn->falls = taper_real_max(learn->falls + counts - DRIFT, 0);
    if (short_by > LEAPS || learn->falls > WRONG) {
        learn->knows = true;
        begin_anew(learn, line, energy, power);
    }
}

/*
 * All that is drawn of an offer clear of the line counts as a sample: to leave out what noise raises would pull the line down,
 * and most where it is poor; its slope would follow.
 */
void taper_learn_take(taper_learn_t *learn, const taper_learn_sample_t *sample) {
    if (!(learn->peak > 0) || sample->energy_Wh < 0 || sample->power_W < 0) {
        return;
    }
    const taper_real_t energy = kilo(sample->energy_Wh);
    const taper_real_t power = kilo(sample->power_W);
    const taper_real_t offered = kilo(sample->offered_W);
    const taper_learn_sums_t before = line_of(learn);
    watch_noise(learn, limit_at(&before, energy), power, offered);
    const taper_learn_sums_t line = line_of(learn); /* the guess weighs by the noise */
    const taper_real_t noise = noise_of(learn, power, kilo(taper_max_i32(sample->step_W, 0)));
    const taper_real_t limit = limit_at(&line, energy);
    if (offered > limit + CLEAR * noise) {
        fit(learn, &line, energy, power, noise);
    } else if (offered > 0) {
        watch_shortfall(learn, &line, energy, power, (taper_real_min(limit, offered) - power) / noise);
    }
}

int32_t taper_learn_limit_W(const taper_learn_t *learn, int32_t energy_Wh) {
    if (!(learn->peak > 0)) {
        return 0;
    }
    const taper_learn_sums_t line = line_of(learn);
    return taper_real_to_W(limit_at(&line, kilo(energy_Wh)) / PER_KILO, INT32_MAX);
}

int32_t taper_learn_deviation_W(const taper_learn_t *learn, int32_t energy_Wh) {
    if (!(learn->peak > 0)) {
        return 0;
    }
    const taper_learn_sums_t line = line_of(learn);
    const taper_real_t deviation = noise_of(learn, line.level, 0) * sqrt(doubt_at(&line, kilo(energy_Wh)));
    return taper_real_to_W(deviation / PER_KILO, INT32_MAX);
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
    const taper_learn_sums_t line = line_of(learn);
    const taper_real_t end = kilo(energy_Wh) + kilo(taper_max_i32(need_Wh, 0));
    const taper_real_t most = learn->peak * TAPER_LEARN_SURE_permille * PER_KILO;
    return square(noise_of(learn, line.level, 0)) * doubt_at(&line, end) < square(most);
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
    const taper_learn_sums_t line = line_of(learn);
    const taper_real_t limit = limit_at(&line, kilo(energy_Wh)) / PER_KILO;
    demand->taper_W = taper_real_to_W(fall_of(&line) * (taper_real_t)demand->capacity_Wh, INT32_MAX / 2);
    const int64_t fallen_W = (int64_t)demand->taper_W * demand->stored_Wh / demand->capacity_Wh;
    demand->peak_W = taper_saturate_i32(taper_real_to_W(limit, INT32_MAX) + fallen_W);
    demand->second_peak_W = demand->second_taper_W = 0; /* one line is learned */
}

bool taper_learn_moved(taper_learn_t *learn, int32_t energy_Wh, int32_t need_Wh, int32_t permille) {
    if (!learn->knows) {
        return false;
    }
    const taper_learn_sums_t line = line_of(learn);
    const taper_real_t now = kilo(energy_Wh);
    const taper_real_t end = now + kilo(need_Wh);
    const taper_real_t fall = fall_of(&line);
    const taper_real_t limit = line.level + fall * line.centre;
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
