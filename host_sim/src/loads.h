/**
 * What connectors put on their supply, in true phasors, and what of that is above a limit of the feeder tree.
 *
 * The firmware bounds phasors from above by sums (rows.h); this is the measure that it is held against, and shares no
 * arithmetic with it. Power factors are 1 and voltages nominal: the current of a phase is in phase with its voltage to
 * neutral, at 0, -120 and 120 degrees, that between two lines with the voltage between them, at 30 (L1-L2), -90 (L2-L3) and
 * 150 degrees (L3-L1).
 */
#ifndef SIM_LOADS_H
#define SIM_LOADS_H

#include <complex.h>
#include <stddef.h>
#include <stdint.h>

#include "taper/types.h"

typedef struct {
    double kw;                /**< with the losses of a DC connector's converter */
    double complex line_A[3]; /**< of L1, L2, L3 of the supply, towards the connector */
} sim_load_t;

/**
 * Load of connector `i` at `current_A` on each of its first `conductors` (1..3; on DC and line to line it does not count).
 * The converter of a DC connector draws from three phases alike.
 */
sim_load_t sim_load_of(const taper_station_config_t *station, unsigned i, unsigned conductors,
                       double current_A);

typedef enum {
    SIM_WITHIN,    /**< no limit is exceeded */
    SIM_POWER,     /**< limit_W of a group, or what the gateway told */
    SIM_PHASE,     /**< limit_mA */
    SIM_DELTA,     /**< delta_mA */
    SIM_IMBALANCE, /**< imbalance_mA */
} sim_limit_kind_t;

/** The limit that is exceeded most. */
typedef struct {
    sim_limit_kind_t kind;
    unsigned group;
    unsigned line; /**< 0..2, the first one of a difference */
    double by;     /**< kW, or A */
    double by_kw;  /**< the same as power: amperes at the site's voltage to neutral */
} sim_breach_t;

/**
 * Hold `load[connector_count]` against power, phase and delta limits of every group, group 0 against `limit_kw` too. Less
 * than a millionth is rounding of doubles and does not count. `group[group_count]` receives the sums.
 */
sim_breach_t sim_loads_check(const taper_station_config_t *station, const sim_load_t *load, double limit_kw,
                             sim_load_t *group);

/** Hold the setpoints of all connectors [A], on so many conductors each as they report, against the limits of imbalance. */
sim_breach_t sim_loads_check_imbalance(const taper_station_config_t *station, const double *setpoint_A,
                                       const uint8_t *conductors);

/** The greater one of two. */
sim_breach_t sim_breach_worse(sim_breach_t one, sim_breach_t other);

/** A breach in words, such as "group 2: L3 by 1.250 A". `text` holds `size` bytes. */
void sim_breach_text(const sim_breach_t *breach, char *text, size_t size);

#endif
