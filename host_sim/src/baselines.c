#include "baselines.h"

#include <stddef.h>
#include <string.h>

#include "taper/drive.h"
#include "taper/fallback.h"

static void propose_edf(void *tick_ms, const taper_snapshot_t *snapshot, int32_t site_limit_W,
                        taper_proposal_t *proposal) {
    (void)site_limit_W;
    taper_propose_edf(snapshot, *(const uint32_t *)tick_ms, proposal);
}

static void propose_llf(void *tick_ms, const taper_snapshot_t *snapshot, int32_t site_limit_W,
                        taper_proposal_t *proposal) {
    (void)site_limit_W;
    taper_propose_llf(snapshot, *(const uint32_t *)tick_ms, proposal);
}

/** Most that a vehicle says it can take, whatever its SOC [W]. */
static int32_t flat_maximum_W(const taper_demand_t *demand) {
    return taper_min_i32(taper_demand_allowed_W(demand), demand->peak_W);
}

/** Settle those whose flat maximum is within the present share. @return how many were settled. */
static unsigned settle(const taper_snapshot_t *snapshot, int32_t share_W, bool *settled, int32_t *left_W,
                       taper_proposal_t *proposal) {
    unsigned count = 0;
    for (unsigned i = 0; i < snapshot->count; i++) {
        const int32_t most_W = flat_maximum_W(&snapshot->demand[i]);
        if (!settled[i] && most_W <= share_W) {
            proposal->wish_W[i] = most_W;
            *left_W -= most_W;
            settled[i] = true;
            count++;
        }
    }
    return count;
}

/** The site limit in equal parts; what one cannot take by its flat maximum is shared by the others. */
static void propose_equal_share(void *tick_ms, const taper_snapshot_t *snapshot, int32_t site_limit_W,
                                taper_proposal_t *proposal) {
    (void)tick_ms;
    bool settled[TAPER_MAX_CONNECTORS];
    int32_t left_W = taper_max_i32(site_limit_W, 0);
    unsigned open = 0;
    for (unsigned i = 0; i < snapshot->count; i++) {
        settled[i] = !snapshot->demand[i].active;
        open += settled[i] ? 0 : 1;
        proposal->wish_W[i] = 0;
        proposal->rank[i] = (uint8_t)i;
    }
    while (open > 0) {
        const int32_t share_W = left_W / (int32_t)open;
        const unsigned count = settle(snapshot, share_W, settled, &left_W, proposal);
        if (count == 0) {
            for (unsigned i = 0; i < snapshot->count; i++) {
                proposal->wish_W[i] = settled[i] ? proposal->wish_W[i] : share_W;
            }
            break;
        }
        open -= count;
    }
    memcpy(proposal->ceiling_W, proposal->wish_W, sizeof proposal->ceiling_W);
}

#define THROUGHPUT  TAPER_OBJECTIVE_THROUGHPUT
#define LOG_UTILITY TAPER_OBJECTIVE_LOG_UTILITY

const sim_policy_t sim_policies[] = {
    {"soc-mpc", "planner that knows the taper", true, NULL, THROUGHPUT, false, TAPER_DRIVE_PLANNER, false},
    {"soc-mpc-learned", "the same, with tapers that nobody tells: it learns them", false, NULL, THROUGHPUT,
     true, -1, false},
    {"mpc", "the same planner, without the taper", false, NULL, THROUGHPUT, false, TAPER_DRIVE_PLANNER,
     false},
    {"soc-mpc-log", "planner of the paper, by log utility (eq. 7)", true, NULL, LOG_UTILITY, false, -1,
     false},
    {"mpc-log", "the same, without the taper (eq. 4) and without what vehicles were seen to take", false,
     NULL, LOG_UTILITY, false, -1, true},
    {"edf", "earliest deadline first, without the taper", false, propose_edf, THROUGHPUT, false,
     TAPER_DRIVE_EDF, false},
    {"edf-soc", "earliest deadline first, clamped to the taper", true, propose_edf, THROUGHPUT, false,
     TAPER_DRIVE_EDF, false},
    {"llf", "least laxity first, clamped to the taper", true, propose_llf, THROUGHPUT, false, TAPER_DRIVE_LLF,
     false},
    {"equal-share", "equal parts of the site limit, without the taper", false, propose_equal_share,
     THROUGHPUT, false, -1, false},
};
const unsigned sim_policy_count = sizeof sim_policies / sizeof sim_policies[0];

const sim_policy_t *sim_policy_find(const char *name) {
    for (unsigned i = 0; i < sim_policy_count; i++) {
        if (strcmp(sim_policies[i].name, name) == 0) {
            return &sim_policies[i];
        }
    }
    return NULL;
}
