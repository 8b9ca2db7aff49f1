/** Loads on a three-phase supply, as phasors at a power factor of 1. */
#ifndef HOSTILE_PHASOR_H
#define HOSTILE_PHASOR_H

#include "taper/types.h"

/** What loads add up to in one group of the feeder tree. */
typedef struct {
    double power_W;
    double neutral_mA[3]; /**< from each phase to neutral, or balanced */
    double pair_mA[3];    /**< L1-L2, L2-L3, L3-L1 */
} load_t;

/** Add what `connector` draws with `mA` on each of its first `conductors`. */
void load_add(load_t *load, const taper_station_config_t *config, unsigned connector, unsigned conductors,
              const double mA[3]);

/** Current of a line (0..2) with everything on; nothing less can be more, since all parts are within 60 degrees. */
double load_line_mA(const load_t *load, unsigned line);

/** Current of a line of the delta side of a transformer that feeds the load, times its ratio of windings: the worst of all
    ways to switch parts of the load off. */
double load_delta_mA(const load_t *load, unsigned line);

#endif
