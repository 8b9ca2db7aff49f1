/* What plan or EDF want: the firmware's planner, worked to its end within the call. */
#include "scheduler_internal.h"
#include "taper/fallback.h"

/** The present limit as a message of the gateway that has just come, beside the known course. */
static taper_limit_now_t limit_now(taper_scheduler_t *scheduler, uint32_t now_ms) {
    const taper_site_limit_t message = {
        .active = true,
        .limit_W = scheduler->limit_W,
        .failsafe_W = TAPER_ABSENT,
        .validity_s = TAPER_ABSENT,
    };
    taper_limits_apply(&scheduler->limits, &message, now_ms);
    taper_limits_update(&scheduler->limits, now_ms);
    return taper_limits_now(&scheduler->limits, now_ms);
}

/** Solve, from the last answer on. @return whether the plan may be used. */
static bool make_plan(taper_scheduler_t *scheduler, uint32_t now_ms) {
    taper_planner_t *planner = &scheduler->planner;
    taper_course_t course;
    taper_limits_course(&scheduler->limits, now_ms, &course);
    taper_planner_start(planner, &scheduler->snapshot, &course);
    while (taper_planner_run(planner, TAPER_MAX_ITERATIONS) == TAPER_VERDICT_SOLVING) {
    }
    scheduler->account.verdict = planner->verdict;
    scheduler->account.iterations = taper_planner_iterations(planner);
    return taper_planner_is_usable(planner->verdict);
}

/**
 * The plan's first step, as power for as long as the vehicle is there: a step counts whole in the plan, so to who leaves before
 * its end, its energy has to be given in less time.
 */
static int32_t planned_W(const taper_scheduler_t *scheduler, uint8_t i) {
    const int64_t plan_W = taper_planner_power_W(&scheduler->planner, i, 0);
    const int32_t step_s = scheduler->config.step_s;
    const int32_t stay_s =
        taper_max_i32(scheduler->snapshot.demand[i].departs_in_s, scheduler->options.period_s);
    return taper_saturate_i32(stay_s < step_s ? plan_W * step_s / stay_s : plan_W);
}

/** The first step is the wish, what is useful beyond it the ceiling; by the log utility nobody gets more than planned. As in
    the firmware's station. */
static void follow_plan(taper_scheduler_t *scheduler) {
    taper_proposal_t *proposal = &scheduler->proposal;
    const bool is_exact = scheduler->planner.horizon.log_utility;
    for (uint8_t i = 0; i < scheduler->snapshot.count; i++) {
        proposal->wish_W[i] = taper_min_i32(planned_W(scheduler, i), proposal->ceiling_W[i]);
        proposal->ceiling_W[i] = is_exact ? proposal->wish_W[i] : proposal->ceiling_W[i];
    }
}

void scheduler_propose(taper_scheduler_t *scheduler, uint32_t now_ms) {
    scheduler->supply = limit_now(scheduler, now_ms).supply;
    taper_propose_edf(&scheduler->snapshot, scheduler->period_ms, &scheduler->proposal);
    scheduler->account.planned = 0;
    if (scheduler->options.policy == TAPER_SCHEDULER_SOC_MPC && make_plan(scheduler, now_ms)) {
        scheduler->account.planned = 1;
        follow_plan(scheduler);
    }
}
