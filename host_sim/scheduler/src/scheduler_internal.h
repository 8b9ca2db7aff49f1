/** Private to the library: one open station, and the steps of a call. */
#ifndef TAPER_SCHEDULER_INTERNAL_H
#define TAPER_SCHEDULER_INTERNAL_H

#include "taper/allocator.h"
#include "taper/limits.h"
#include "taper/planner.h"
#include "taper_scheduler.h"

/** Most rates of one EVSE. */
#define MAX_RATES 64

/** Currents that an EVSE can give besides 0; without any, all that the allocator gives. */
typedef struct {
    uint8_t count;
    int32_t rate_mA[MAX_RATES]; /**< ascending, multiples of TAPER_CURRENT_STEP_mA */
} rates_t;

struct taper_scheduler {
    taper_scheduler_t *next; /**< of those that are open */
    const char *station;
    taper_station_config_t
        config; /**< the description with what was set since; its tables are the two below */
    taper_connector_config_t connector[TAPER_MAX_CONNECTORS];
    taper_group_config_t group[TAPER_MAX_GROUPS];
    rates_t rates[TAPER_MAX_CONNECTORS];
    taper_scheduler_options_t options;
    uint32_t period_ms;

    taper_scheduler_vehicle_t vehicle[TAPER_MAX_CONNECTORS];
    bool has_vehicle[TAPER_MAX_CONNECTORS];
    uint8_t number[TAPER_MAX_CONNECTORS]; /**< of the session, as on the wire: 1..255; 0 before the first */
    int32_t limit_W;                      /**< of now */
    double now_s;                         /**< of the last call; below 0 before the first */

    taper_limits_t limits;
    taper_snapshot_t snapshot;
    taper_supply_t supply;
    taper_rows_t rows;
    taper_planner_t planner;
    taper_proposal_t proposal;
    taper_allocator_t allocator;
    taper_setpoints_t setpoints;
    taper_scheduler_account_t account;
};

/** Whether `value` is a number in [least, most]: NaN is not. */
static inline bool is_within(double value, double least, double most) {
    return value >= least && value <= most;
}

/** Seconds on the firmware's wrapping clock. */
uint32_t scheduler_ms(double time_s);

/* vehicle.c */

/** The firmware's view of the vehicles at `now_s`. */
void scheduler_take_snapshot(taper_scheduler_t *scheduler, double now_s);

/* propose.c */

/** Supply of now, and what plan or EDF want for it. */
void scheduler_propose(taper_scheduler_t *scheduler, uint32_t now_ms);

/* allocate.c */

/** Setpoints for the proposal: allocator, rates, fill, guard. */
void scheduler_allocate(taper_scheduler_t *scheduler);

/** The next higher current that connector `i` could have, or 0: there is none. */
int32_t scheduler_next_mA(const taper_scheduler_t *scheduler, uint8_t i, int32_t current_mA);

/** Whether the guard lets these setpoints pass. */
bool scheduler_guard_passes(const taper_scheduler_t *scheduler, const taper_setpoints_t *setpoints);

/* explain.c */

/** Why connector `i` has its current. */
taper_scheduler_why_t scheduler_why(const taper_scheduler_t *scheduler, uint8_t i);

#endif
