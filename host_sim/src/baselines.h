/** The policies of a run: what the firmware has, and baselines that only the simulation needs. */
#ifndef SIM_BASELINES_H
#define SIM_BASELINES_H

#include <stdbool.h>
#include <stdint.h>

#include "taper/types.h"

typedef struct {
    const char *name;
    const char *help;
    bool tells_taper; /**< the vehicles tell the station their taper */
    /** NULL: the planner. Else called with a pointer to the tick in ms (uint32_t) as its context. */
    void (*propose)(void *tick_ms, const taper_snapshot_t *snapshot, int32_t site_limit_W,
                    taper_proposal_t *proposal);
    taper_objective_t objective; /**< of the planner */
    bool learns;                 /**< the station learns tapers from what vehicles accept */
    int on_board;                /**< taper_drive_policy_t; negative: only this program has it */
    bool ignores_draw;           /**< the station does not plan with what vehicles were seen to take */
} sim_policy_t;

extern const sim_policy_t sim_policies[];
extern const unsigned sim_policy_count;

/** @return the policy of that name, or NULL. */
const sim_policy_t *sim_policy_find(const char *name);

#endif
