#include "taper/fleet.h"

#include <tgmath.h>

#include "taper/real_math.h"

/* A vehicle is counted once its shift is known to a tenth of its peak. */
#define KNOWN_VARIANCE ((taper_real_t)0.01)
/* Share of the way to a vehicle's noise that each look moves the station's. */
#define NOISE_MOVES ((taper_real_t)0.01)

static unsigned kind_of(const taper_learn_t *learn) {
    return taper_learn_tells(learn) ? 1U : 0U;
}

/* Variance of one vehicle about the mean. `first`: before anybody was seen; it weighs as one vehicle. */
static taper_real_t variance_of(const taper_fleet_mean_t *mean, taper_real_t first) {
    return (first + mean->squares) / (1 + mean->weight);
}

static void fade(taper_fleet_mean_t *mean) {
    const taper_real_t keep = (taper_real_t)TAPER_FLEET_MOST / (mean->weight + 1);
    if (keep < 1) {
        mean->weight *= keep;
        mean->squares *= keep;
    }
}

/* Welford's step, for a value of this variance. */
static void add(taper_fleet_mean_t *mean, taper_real_t value, taper_real_t variance, taper_real_t first) {
    const taper_real_t away = value - mean->mean;
    const taper_real_t expected = variance_of(mean, first) + variance;
    const taper_real_t size = fabs(away) / sqrt(expected);
    const taper_real_t huber = (taper_real_t)TAPER_LEARN_HUBER;
    const taper_real_t robust = mean->weight > 0 && size > huber ? huber / size : 1;
    const taper_real_t weight = robust * first / (first + variance);
    fade(mean);
    const taper_real_t share = weight / (mean->weight + weight);
    mean->squares += mean->weight * share * away * away;
    mean->mean += share * away;
    mean->weight += weight;
}

bool taper_fleet_count(taper_fleet_t *fleet, const taper_learn_t *learn) {
    taper_learn_shift_t first;
    taper_learn_shift_t shown;
    if (!taper_learn_first(learn, &first) || !taper_learn_shown(learn, &shown) ||
        !(shown.level_variance < KNOWN_VARIANCE) || !(shown.fall_variance < KNOWN_VARIANCE)) {
        return false;
    }
    taper_fleet_kind_t *kind = &fleet->kind[kind_of(learn)];
    add(&kind->level, shown.level, shown.level_variance, first.level_variance);
    add(&kind->fall, shown.fall, shown.fall_variance, first.fall_variance);
    return true;
}

void taper_fleet_watch(taper_fleet_t *fleet, const taper_learn_t *learn) {
    taper_real_t noise;
    if (taper_learn_noise(learn, &noise)) {
        fleet->noise = fleet->noise > 0 ? fleet->noise + (noise - fleet->noise) * NOISE_MOVES : noise;
    }
}

/* The shift of the next vehicle: the mean, drawn towards none by what is not known of it. @return its variance. */
static taper_real_t guess(const taper_fleet_mean_t *mean, taper_real_t first, taper_real_t *shift) {
    const taper_real_t variance = variance_of(mean, first);
    const taper_real_t of_mean = variance * first / (variance + mean->weight * first);
    *shift = mean->mean * (1 - of_mean / first);
    return variance + of_mean;
}

void taper_fleet_advise(const taper_fleet_t *fleet, taper_learn_t *learn) {
    const taper_fleet_kind_t *kind = &fleet->kind[kind_of(learn)];
    taper_learn_shift_t first;
    if (fleet->noise > 0) {
        taper_learn_assume_noise(learn, fleet->noise);
    }
    if (!taper_learn_first(learn, &first) || !(kind->fall.weight > 0)) {
        return;
    }
    taper_learn_shift_t shift;
    shift.level_variance = guess(&kind->level, first.level_variance, &shift.level);
    shift.fall_variance = guess(&kind->fall, first.fall_variance, &shift.fall);
    taper_learn_assume(learn, &shift);
}
