/** Holds what the connectors draw, and what they may draw, against the limits in force. */
#ifndef SIM_TRACKER_H
#define SIM_TRACKER_H

#include <stdbool.h>
#include <stdint.h>

#include "taper/types.h"

/** Falls of the limit within one time of grace that are told apart; of more, the oldest are given no grace. */
#define SIM_FALLS_KEPT 32u

/**
 * Most by which a group of the feeder tree is above its limit, group 0 above `limit_kw` too [kW]; 0: none is. Less than
 * a milliwatt is rounding of doubles and does not count. `kw[connector_count]` is per connector; `group_kw[group_count]`
 * receives the sums.
 */
double sim_groups_excess_kw(const taper_station_config_t *station, const double *kw, double limit_kw,
                            double *group_kw);

/** How often and how long one kind of sum was above a limit. */
typedef struct {
    bool now;
    uint32_t times;    /**< from first above to below again is once */
    uint64_t ms;       /**< in all */
    uint64_t first_ms; /**< when it was first so, if times > 0 */
    double worst_kw;
} sim_excess_t;

typedef struct {
    const taper_station_config_t *station;
    uint32_t grace_ms;
    struct {
        uint64_t until_ms;
        double kw;
    } fall
        [SIM_FALLS_KEPT]; /**< limits that were higher than the present one, descending; each counts until its time */
    uint32_t falls;
    double told_kw;   /**< the present one */
    double limit_kw;  /**< what site power is held against: with grace */
    double drawn_kw;  /**< by the site */
    double may_kw;    /**< what it may draw */
    uint64_t last_ms; /**< time of the last look */
    bool started;
    sim_excess_t drawn, may;
} sim_tracker_t;

/** Nothing seen yet. After a fall of the site's limit the old one counts for another `grace_ms`. */
void sim_tracker_init(sim_tracker_t *tracker, const taper_station_config_t *station, uint32_t grace_ms);

/**
 * At `now_ms` (never falling) `limit_kw` is in force for the site, and per connector [connector_count] `drawn_kw` is
 * drawn and `may_kw` is allowed. The limits of the groups are the station's, without grace.
 */
void sim_tracker_look(sim_tracker_t *tracker, uint64_t now_ms, double limit_kw, const double *drawn_kw,
                      const double *may_kw);

#endif
