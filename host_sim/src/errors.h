/**
 * What vehicles and meters of a run get wrong. All of it follows from the seed of the run, the vehicle's session id, and, for
 * noise, from how often its connector has reported before.
 */
#ifndef SIM_ERRORS_H
#define SIM_ERRORS_H

#include <stdbool.h>
#include <stdint.h>

/** All 0: nothing. */
typedef struct {
    bool soc_absent; /**< vehicles tell no SOC, neither now nor at plug-in */
    double soc;      /**< else one that is off by a constant of each vehicle, up to this; 0..0.1 */
    double taper;    /**< the taper told is off by a factor of each vehicle, 1 - this to 1 + this; 0..1 */
    double
        meter_noise; /**< standard deviation of each report of current and power, as a share of it; 0..0.1 */
    uint64_t seed;
} sim_errors_t;

/** What one vehicle gets wrong, and the state of the noise of its connector's meter. */
typedef struct {
    double soc;     /**< added to every SOC that it tells */
    double taper;   /**< factor of the taper that it tells */
    double metered; /**< factor of the report of its connector's meter */
    uint64_t noise; /**< state of that */
} sim_vehicle_errors_t;

/** The errors of the vehicle of a session. */
sim_vehicle_errors_t sim_errors_of(const sim_errors_t *errors, const char *session_id);

/** The next report of its meter: another factor. */
void sim_errors_measure(const sim_errors_t *errors, sim_vehicle_errors_t *vehicle);

#endif
