/**
 * The taper learned on line, from what a vehicle accepts.
 *
 * Model: the vehicle's limit is a line in the energy `e` charged since its session began,
 *
 *     limit(e) = level - fall * (e - centre),  fall >= 0, never below 0
 *
 * so neither SOC nor capacity is needed. The line is a recursive weighted least-squares fit of samples (e, power), kept as
 * centred sums (Welford's), which single precision bears for any energy. What the vehicle told is its first guess: off by
 * 20 % of its peak at SOC 0, and by a third of that in its fall over the charge, if nothing else is known (taper/fleet.h may
 * know better). It weighs by its doubt against the noise of the samples, so it holds as long as, and as far as, these do not
 * know better.
 *
 * - **Both sides.** Of an offer that is clear of the line all that is drawn is a sample. Of one that is not, a reading that is
 *   lower may be noise, and to choose by noise would pull the line down, and offers after it: only several in a row, or
 *   one that no noise explains, show a limit. An offer that is taken shows nothing.
 * - **Outliers.** A residual counts by the deviation that is expected at its energy, so that a poor line doubts itself before
 *   it doubts a sample; beyond TAPER_LEARN_HUBER of these its weight falls (Huber).
 * - **Change.** Residuals that lie on one side in a row (a CUSUM) show that the line is wrong: a wrong first guess, or the knee
 *   of a battery that was flat so far. The line is then begun anew from the sample, its fall in doubt as at first.
 * - **Memory.** At most TAPER_LEARN_MOST samples weigh in full; beyond, the oldest fade.
 *
 * - **Noise.** The deviation of a measurement is taken from what changes from look to look, which no wrong line does: 1 to
 *   6 % of it, and half a step of its resolution. It begins in the middle of that, and the first looks move it most.
 */
#ifndef TAPER_LEARN_H
#define TAPER_LEARN_H

#include <stdbool.h>
#include <stdint.h>

#include "taper/real.h"
#include "taper/types.h"

/** Samples that weigh in full: 2.3 h of one each second. */
#define TAPER_LEARN_MOST 8192
/** Residuals beyond so many deviations weigh less. */
#define TAPER_LEARN_HUBER 2.5
/** A line whose deviation at the end of the charge is below this share of the vehicle's peak is sure [permille]. */
#define TAPER_LEARN_SURE_permille 25

/** Weighted samples, centred. [kW], [kWh] */
typedef struct {
    taper_real_t weight;
    taper_real_t centre, level; /**< weighted means: energy and power */
    taper_real_t spread, slant; /**< sums of squares of energy, and of its products with power */
} taper_learn_sums_t;

/** A line in doubt: what holds until samples know better. [kW], [kWh] */
typedef struct {
    taper_real_t centre, level, fall;           /**< power at an energy, and its fall */
    taper_real_t level_variance, fall_variance; /**< > 0, independent of each other */
} taper_learn_guess_t;

/** By what a line differs from the told one: at SOC 0, and in its fall to SOC 1, as shares of the peak, with variances. */
typedef struct {
    taper_real_t level, fall;
    taper_real_t level_variance, fall_variance;
} taper_learn_shift_t;

/** What is known of one vehicle. The caller's memory; its content is private. [kW], [kWh] */
typedef struct {
    taper_learn_guess_t told, guess; /**< by the vehicle; and what holds before its samples */
    taper_learn_sums_t samples;
    taper_real_t rises, falls;            /**< CUSUMs */
    taper_real_t peak;                    /**< what shares are of; 0: not begun */
    taper_real_t capacity;                /**< 0: unknown */
    taper_real_t noted_limit, noted_fall; /**< at energy 0, when taper_learn_moved() was true last */
    taper_real_t noise;                   /**< deviation of a measurement, as a share of it */
    taper_real_t strayed;                 /**< by how much the last look was off, the same; beyond 1: none */
    uint8_t looks;                        /**< that have moved the noise, saturating */
    bool tells;                           /**< a taper */
    bool noted;                           /**< it was, ever */
    bool knows;                           /**< more than what was told */
    bool anew;                            /**< the first guess was wrong */
} taper_learn_t;

/** One look at a vehicle. */
typedef struct {
    int32_t energy_Wh; /**< charged since the session began */
    int32_t power_W;   /**< that it draws */
    int32_t step_W;    /**< resolution of that, >= 0 */
    int32_t
        offered_W; /**< most that it may draw, for long enough; 0: that has changed just now, and nothing is shown */
} taper_learn_sample_t;

/** Begin with what `told` says, at `energy_Wh` of its session. Cost: constant, like that of all calls here. */
void taper_learn_begin(taper_learn_t *learn, const taper_demand_t *told, int32_t energy_Wh);

/** Whether it told a taper. */
bool taper_learn_tells(const taper_learn_t *learn);

/** The variances that a line begins with; shifts of 0. @return false if the capacity is unknown. */
bool taper_learn_first(const taper_learn_t *learn, taper_learn_shift_t *shift);

/** What its samples alone say. @return false if they are too few to say anything, or the capacity is unknown. */
bool taper_learn_shown(const taper_learn_t *learn, taper_learn_shift_t *shift);

/** Hold this shift of what was told for its first guess. No effect once that has proved wrong. */
void taper_learn_assume(taper_learn_t *learn, const taper_learn_shift_t *shift);

/** The deviation of a measurement, as a share of it. @return false as long as that rests on a few looks. */
bool taper_learn_noise(const taper_learn_t *learn, taper_real_t *noise);

/** Hold that for it, as if looks had shown it. No effect after looks. */
void taper_learn_assume_noise(taper_learn_t *learn, taper_real_t noise);

/** Take a look into account. Energies or powers that are negative are ignored. */
void taper_learn_take(taper_learn_t *learn, const taper_learn_sample_t *sample);

/** The limit at an energy [W], >= 0. */
int32_t taper_learn_limit_W(const taper_learn_t *learn, int32_t energy_Wh);

/** The deviation of that, by what is known [W]. */
int32_t taper_learn_deviation_W(const taper_learn_t *learn, int32_t energy_Wh);

/** The deviation of a measurement [permille of it]. */
int32_t taper_learn_noise_permille(const taper_learn_t *learn);

/** Whether a sample or a shift was taken into account: before, taper_learn_apply() changes nothing. */
bool taper_learn_knows(const taper_learn_t *learn);

/** Whether the limit is known for the next `need_Wh` (TAPER_LEARN_SURE_permille). */
bool taper_learn_is_sure(const taper_learn_t *learn, int32_t energy_Wh, int32_t need_Wh);

/**
 * Replace the taper of `demand`, at `energy_Wh`, by the line: `peak_W` and `taper_W`; and a battery that is not known by one
 * that ends with the need. `taper_W` may be above `peak_W`: the line reaches 0 before SOC 1.
 */
void taper_learn_apply(const taper_learn_t *learn, int32_t energy_Wh, taper_demand_t *demand);

/** Whether the line has moved by more than `permille` of the peak, now or after `need_Wh`, since this was true last. */
bool taper_learn_moved(taper_learn_t *learn, int32_t energy_Wh, int32_t need_Wh, int32_t permille);

#endif
