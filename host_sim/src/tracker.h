/** Holds what the connectors draw, and what they may draw, against the limits of power and phases in force. */
#ifndef SIM_TRACKER_H
#define SIM_TRACKER_H

#include <stdbool.h>
#include <stdint.h>

#include "loads.h"
#include "taper/types.h"

/** Falls of the limit within one time of grace that are told apart; of more, the oldest are given no grace. */
#define SIM_FALLS_KEPT 32u

/** How often and how long one kind of sum was above a limit. */
typedef struct {
    bool now;
    uint32_t times;    /**< from first above to below again is once */
    uint64_t ms;       /**< in all */
    uint64_t first_ms; /**< when it was first so, if times > 0 */
    double worst_kw;   /**< amperes above a limit as power, see sim_breach_t */
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
 * At `now_ms` (never falling) `limit_kw` is in force for the site, and per connector [connector_count] `drawn` is drawn and
 * `may` is allowed. The limits of groups and phases are the station's, without grace. Imbalance is not held against its
 * limit: setpoints of one tick reach their connectors one after the other.
 */
void sim_tracker_look(sim_tracker_t *tracker, uint64_t now_ms, double limit_kw, const sim_load_t *drawn,
                      const sim_load_t *may);

#endif
