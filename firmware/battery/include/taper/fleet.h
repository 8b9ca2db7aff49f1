/**
 * What the vehicles of a station have in common: a first guess of the taper of the next one, better than what it tells.
 *
 * Model: vehicles differ from what they tell by a shift (taper/learn.h) that is normal, with a mean and a variance that are
 * the station's own. Both are learned from vehicles whose lines are known, each counted once, in fixed memory: at most
 * TAPER_FLEET_MOST weigh in full, older ones fade. The mean begins at no shift, and the variance at the doubt in what a
 * stranger tells, which weighs as one vehicle. So where vehicles are alike the guess is good after a few of them; where they
 * are not, it is their mean, in as much doubt as they differ. One that differs by more than TAPER_LEARN_HUBER deviations
 * counts less.
 *
 * Those that tell a taper and those that tell none are two fleets. Vehicles of unknown capacity belong to none: their lines
 * cannot be compared. One whose line is flat at first and falls later is counted by what it showed first. The noise of the
 * station's meters is taken from all.
 *
 * Source: shrinkage of a normal mean (empirical Bayes).
 */
#ifndef TAPER_FLEET_H
#define TAPER_FLEET_H

#include "taper/learn.h"
#include "taper/real.h"

/** Vehicles that weigh in full. */
#define TAPER_FLEET_MOST 64

/** Weighted mean of a number, and the sum of squares about it. */
typedef struct {
    taper_real_t weight, mean, squares;
} taper_fleet_mean_t;

/** Vehicles that tell the same kind of thing. All 0: none was seen yet. */
typedef struct {
    taper_fleet_mean_t level, fall;
} taper_fleet_kind_t;

/** The caller's memory; its content is private. All 0 is a station that has seen nobody. */
typedef struct {
    taper_fleet_kind_t kind[2]; /**< those that tell no taper, and those that do */
    taper_real_t noise;         /**< of a measurement, as a share of it; 0: not known */
} taper_fleet_t;

/**
 * Count a vehicle, if its own samples say enough by now: to a tenth of its peak in level and fall.
 * @return whether it was counted: the caller is not to ask for it again. Cost: constant, as below.
 */
bool taper_fleet_count(taper_fleet_t *fleet, const taper_learn_t *learn);

/** Take the noise of its measurements into account: after each look. */
void taper_fleet_watch(taper_fleet_t *fleet, const taper_learn_t *learn);

/** Give a vehicle that was not counted the fleet's guess. As long as nobody was counted that is of the noise only. */
void taper_fleet_advise(const taper_fleet_t *fleet, taper_learn_t *learn);

#endif
