#include "taper/station.h"

#include <string.h>

#include "station_io.h"
#include "taper/config_check.h"

/** A plan is followed this many steps while its renewal is in work. One that could not be renewed ends at once. */
#define PLAN_LASTS_STEPS 2u
/** After a plan that was no good, the next try. */
#define RETRY_ms UINT32_C(60000)

static bool options_are_sound(const taper_station_options_t *options) {
    return options->config != NULL && options->port != NULL && options->port->receive != NULL &&
           options->port->send != NULL && (options->policy == NULL || options->policy->propose != NULL) &&
           options->iterations_per_tick >= TAPER_MIN_SLICE;
}

taper_status_t taper_station_init(taper_station_t *station, const taper_station_options_t *options) {
    if (station == NULL || options == NULL || !options_are_sound(options)) {
        return TAPER_ERR_ARGUMENT;
    }
    const taper_status_t config_status = taper_config_check(options->config);
    if (config_status != TAPER_OK) {
        return config_status;
    }
    memset(station, 0, sizeof *station);
    station->options = *options;
    taper_session_init(&station->sessions, options->config);
    taper_limits_init(&station->limits, options->config);
    taper_supervisor_init(&station->supervisor);
    taper_allocator_init(&station->allocator);
    if (options->solver != NULL) {
        return taper_planner_init(&station->planner, options->solver, options->config);
    }
    return TAPER_OK;
}

/** Events that make the planner think again; otherwise it does so once a step, and sooner after a failure. */
static bool plan_is_due(const taper_station_t *station, int32_t site_limit_W) {
    const uint32_t step_ms = station->options.config->step_s * UINT32_C(1000);
    const uint32_t lasts_ms = station->plan_usable || step_ms < RETRY_ms ? step_ms : RETRY_ms;
    return station->planner.verdict == TAPER_VERDICT_NONE || station->planned_limit_W != site_limit_W ||
           station->planned_revision != station->sessions.revision ||
           taper_elapsed_ms(station->snapshot.now_ms, station->planner.started_ms) >= lasts_ms;
}

static void start_plan(taper_station_t *station, int32_t site_limit_W) {
    int32_t course_W[TAPER_MAX_STEPS];
    taper_limits_course(&station->limits, station->snapshot.now_ms, course_W);
    taper_planner_start(&station->planner, &station->snapshot, course_W);
    station->planned_limit_W = site_limit_W;
    station->planned_revision = station->sessions.revision;
    station->solve_us = 0;
}

static uint32_t clock_us(const taper_station_t *station) {
    const taper_port_t *port = station->options.port;
    return port->clock_us != NULL ? port->clock_us(port->context) : 0;
}

/** Keep the first step of a finished plan: the solver's memory is about to be used for the next one. */
static void keep_plan(taper_station_t *station) {
    const bool usable = taper_planner_is_usable(station->planner.verdict);
    taper_count(&station->counters.plans);
    station->last_solve_us = station->solve_us;
    if (!usable) {
        taper_count(&station->counters.plans_rejected);
    }
    station->plan_usable = usable;
    station->plan_made_ms = station->planner.started_ms;
    for (uint8_t i = 0; i < station->snapshot.count; i++) {
        station->plan_W[i] = usable ? taper_planner_power_W(&station->planner, i, 0) : 0;
        station->plan_session[i] = station->planner.session[i];
    }
}

/** One slice of planning: start a problem if one is due, work on the one under way, keep the result. */
static void plan(taper_station_t *station, int32_t site_limit_W) {
    if (station->options.solver == NULL || station->options.policy != NULL) {
        return;
    }
    const uint32_t began_us = clock_us(station);
    if (station->planner.verdict != TAPER_VERDICT_SOLVING) {
        if (!plan_is_due(station, site_limit_W)) {
            return;
        }
        start_plan(station, site_limit_W);
    }
    const taper_verdict_t verdict =
        taper_planner_run(&station->planner, station->options.iterations_per_tick);
    station->solve_us += clock_us(station) - began_us;
    if (verdict != TAPER_VERDICT_SOLVING) {
        keep_plan(station);
    }
}

static bool plan_is_usable(const taper_station_t *station) {
    const uint32_t lasts_ms = station->options.config->step_s * UINT32_C(1000) * PLAN_LASTS_STEPS;
    return station->plan_usable &&
           taper_elapsed_ms(station->snapshot.now_ms, station->plan_made_ms) < lasts_ms;
}

/**
 * The plan as a proposal: its first step is the wish; what is useful beyond it is the ceiling, so that what rounding,
 * the solver's tolerance or a falling taper leave over goes to whom the deadline presses most. A vehicle that came
 * after the plan was made has no wish yet, only a ceiling.
 */
static void propose_plan(taper_station_t *station) {
    taper_propose_edf(&station->snapshot, station->options.config->tick_ms, &station->proposal);
    for (uint8_t i = 0; i < station->snapshot.count; i++) {
        const bool planned = station->plan_session[i] == station->snapshot.demand[i].session;
        const int32_t plan_W = planned ? station->plan_W[i] : 0;
        station->proposal.wish_W[i] = taper_min_i32(plan_W, station->proposal.ceiling_W[i]);
    }
}

static void propose(taper_station_t *station, taper_mode_t mode, int32_t site_limit_W) {
    const taper_policy_t *policy = station->options.policy;
    if (mode != TAPER_MODE_PLAN) {
        taper_propose_edf(&station->snapshot, station->options.config->tick_ms, &station->proposal);
    } else if (policy != NULL) {
        policy->propose(policy->context, &station->snapshot, site_limit_W, &station->proposal);
    } else {
        propose_plan(station);
    }
}

static taper_mode_t decide_mode(taper_station_t *station) {
    const uint32_t now_ms = station->snapshot.now_ms;
    const taper_situation_t situation = {
        .gateway_alive = taper_limits_gateway_alive(&station->limits, now_ms),
        .gateway_heard = station->limits.heard,
        .proposal_ready = station->options.policy != NULL || plan_is_usable(station),
    };
    const taper_mode_t mode = taper_supervisor_update(&station->supervisor, &situation, now_ms);
    if (mode == TAPER_MODE_FALLBACK || mode == TAPER_MODE_FAILSAFE) {
        taper_count(&station->counters.fallback_ticks);
    }
    return mode;
}

/** Setpoints for the proposal; nothing that the guard refuses gets out. */
static void allocate(taper_station_t *station, int32_t site_limit_W) {
    const taper_station_config_t *config = station->options.config;
    taper_allocate(&station->allocator, config, &station->snapshot, &station->proposal, site_limit_W,
                   &station->setpoints);
    if (!taper_guard_passes(config, &station->snapshot, site_limit_W, &station->setpoints)) {
        taper_count(&station->counters.guard_violations);
        memset(&station->setpoints, 0, sizeof station->setpoints);
    }
}

void taper_station_step(taper_station_t *station, uint32_t now_ms) {
    taper_station_receive(station, now_ms);
    taper_session_update(&station->sessions, now_ms);
    taper_limits_update(&station->limits, now_ms);
    taper_session_snapshot(&station->sessions, now_ms, &station->snapshot);
    station->limit_now = taper_limits_now(&station->limits, now_ms);
    plan(station, station->limit_now.site_W);
    const taper_mode_t mode = decide_mode(station);
    if (mode == TAPER_MODE_INIT) {
        station->limit_now.site_W = 0;
    }
    propose(station, mode, station->limit_now.site_W);
    allocate(station, station->limit_now.site_W);
    taper_station_send(station);
    if (station->options.port->kick_watchdog != NULL) {
        station->options.port->kick_watchdog(station->options.port->context);
    }
}

taper_status_t taper_station_set_limit_curve(taper_station_t *station, const taper_limit_curve_t *curve) {
    return curve == NULL ? TAPER_ERR_ARGUMENT : taper_limits_set_curve(&station->limits, curve);
}

taper_mode_t taper_station_mode(const taper_station_t *station) {
    return station->supervisor.mode;
}

int32_t taper_station_site_limit_W(const taper_station_t *station) {
    return station->limit_now.site_W;
}
