/* The planner within the station: when to think, and for how long the result is good. */
#include "station_internal.h"

/** A plan is followed so much longer while its renewal is in work. One that could not be renewed ends at once. */
#define SPARE_STEPS 1u
/** After a plan that was no good, the next try. */
#define RETRY_ms UINT32_C(60000)

/** Steps after which a plan is made anew if nothing happens. The paper's rule follows it until its last step. */
static uint32_t renewed_after_steps(const taper_station_config_t *config) {
    const uint8_t planned =
        config->planning.horizon_steps > 0 ? config->planning.horizon_steps : config->steps;
    return config->planning.on_events ? planned - 1U : 1U;
}

/** Events that make the planner think again; otherwise it does so after its time, and sooner after a failure. */
static bool plan_is_due(const taper_station_t *station, int32_t site_limit_W) {
    const taper_station_config_t *config = station->options.config;
    const uint32_t step_ms = config->step_s * UINT32_C(1000);
    const uint32_t retry_ms = step_ms < RETRY_ms ? step_ms : RETRY_ms;
    const uint32_t lasts_ms = station->plan_usable ? step_ms * renewed_after_steps(config) : retry_ms;
    return station->planner.verdict == TAPER_VERDICT_NONE || station->planned_limit_W != site_limit_W ||
           station->planned_revision != station->sessions.revision ||
           station->planned_curves != station->limits.revision ||
           taper_elapsed_ms(station->snapshot.now_ms, station->planner.started_ms) >= lasts_ms;
}

static void start_plan(taper_station_t *station, int32_t site_limit_W) {
    taper_course_t course;
    taper_limits_course(&station->limits, station->events.now_ms, &course);
    taper_planner_start(&station->planner, &station->snapshot, &course);
    station->planned_limit_W = site_limit_W;
    station->planned_revision = station->sessions.revision;
    station->planned_curves = station->limits.revision;
    station->solve_us = 0;
}

static uint32_t clock_us(const taper_station_t *station) {
    const taper_port_t *port = station->options.port;
    return port->clock_us != NULL ? port->clock_us(port->context) : 0;
}

/** What the plan gives a vehicle within the horizon, for its outlook. */
static void keep_prospect(taper_station_t *station, uint8_t i, bool usable) {
    const taper_station_config_t *config = station->options.config;
    int64_t sum_Ws = 0;
    for (uint8_t t = 0; usable && t < config->steps; t++) {
        sum_Ws += (int64_t)taper_planner_power_W(&station->planner, i, t) * config->step_s;
    }
    station->prospect[i] = (taper_prospect_t){.made_ms = station->planner.started_ms,
                                              .planned_Wh = taper_saturate_i32(sum_Ws / 3600),
                                              .need_Wh = station->snapshot.demand[i].need_Wh};
}

/** Keep a finished plan: the solver's memory is about to be used for the next one. */
static void keep_plan(taper_station_t *station) {
    const bool usable = taper_planner_is_usable(station->planner.verdict);
    taper_station_count(station, TAPER_COUNTER_PLANS);
    station->last_solve_us = station->solve_us;
    if (!usable) {
        taper_station_count(station, TAPER_COUNTER_PLANS_REJECTED);
    }
    if (taper_health_judge(&station->health, usable, station->snapshot.now_ms)) {
        taper_station_count(station, TAPER_COUNTER_PLANNER_OFFS);
        taper_event_note(&station->events, TAPER_EVENT_PLANNER_OFF, 0, 0, (int32_t)station->planner.verdict);
    }
    station->plan_usable = usable;
    station->plan_made_ms = station->planner.started_ms;
    for (uint8_t i = 0; i < station->snapshot.count; i++) {
        for (uint8_t t = 0; t < station->options.config->steps; t++) {
            station->plan_W[t][i] = usable ? taper_planner_power_W(&station->planner, i, t) : 0;
        }
        station->plan_session[i] = station->planner.session[i];
        station->plan_waits[i] = usable && station->planner.horizon.waits[i];
        keep_prospect(station, i, usable);
    }
}

/** Whether the planner may be asked; notes when it may again. */
static bool may_plan(taper_station_t *station) {
    const bool was_off = station->health.off;
    const bool may = taper_health_may_plan(&station->health, station->snapshot.now_ms);
    if (was_off && may) {
        taper_event_note(&station->events, TAPER_EVENT_PLANNER_ON, 0, 0, 0);
    }
    return may;
}

/**
 * A tick's work at a plan. One that has room for a whole solve has it for all quadratic programmes of a plan by log utility:
 * where a tick stands for a planning step, a plan that is ready some ticks later is of no use.
 */
static void work(taper_station_t *station, uint16_t iterations) {
    taper_verdict_t verdict = TAPER_VERDICT_NONE;
    do {
        verdict = taper_planner_run(&station->planner, iterations);
    } while (iterations >= TAPER_MAX_ITERATIONS && verdict == TAPER_VERDICT_SOLVING);
}

void taper_station_plan(taper_station_t *station, int32_t site_limit_W) {
    if (station->options.solver == NULL || station->options.policy != NULL || !may_plan(station)) {
        return;
    }
    const uint32_t began_us = clock_us(station);
    const bool begins = station->planner.verdict != TAPER_VERDICT_SOLVING;
    const uint16_t iterations = station->options.iterations_per_tick;
    if (begins) {
        if (!plan_is_due(station, site_limit_W)) {
            return;
        }
        start_plan(station, site_limit_W);
    }
    if (!begins || iterations >= TAPER_MIN_SLICE) { /* where slices are short, to state a problem is one */
        work(station, iterations);
    }
    station->solve_us += clock_us(station) - began_us;
    if (station->planner.verdict != TAPER_VERDICT_SOLVING) {
        keep_plan(station);
    }
}

bool taper_station_has_plan(const taper_station_t *station) {
    const taper_station_config_t *config = station->options.config;
    const uint32_t lasts_steps = renewed_after_steps(config) + SPARE_STEPS;
    const uint32_t lasts_ms = config->step_s * UINT32_C(1000) * lasts_steps;
    return station->plan_usable &&
           taper_elapsed_ms(station->snapshot.now_ms, station->plan_made_ms) < lasts_ms;
}

/** The step of the plan that is followed now: the first, if it is renewed each step; by the paper's rule the present one. */
static uint8_t followed_step(const taper_station_t *station) {
    const taper_station_config_t *config = station->options.config;
    const uint32_t age_ms = taper_elapsed_ms(station->snapshot.now_ms, station->plan_made_ms);
    const uint32_t step = config->planning.on_events ? age_ms / (config->step_s * UINT32_C(1000)) : 0;
    return (uint8_t)taper_min_i32((int32_t)step, config->steps);
}

int32_t taper_station_planned_W(const taper_station_t *station, uint8_t i, uint8_t ahead) {
    const unsigned step = (unsigned)followed_step(station) + ahead;
    return step < station->options.config->steps ? station->plan_W[step][i] : 0;
}

/**
 * The plan's first step is the wish; what is useful beyond it is the ceiling, so that what rounding, the solver's
 * tolerance or a falling taper leave over goes to whom the deadline presses most. Who waits for a lower price gets no more
 * than his wish, and so does everybody by the log utility: to spread energy is what it is for. A vehicle that came after the plan was made has no wish yet, only a ceiling.
 */
void taper_station_propose_plan(taper_station_t *station) {
    taper_propose_edf(&station->snapshot, station->options.config->tick_ms, &station->proposal);
    const bool is_exact = station->planner.horizon.log_utility;
    for (uint8_t i = 0; i < station->snapshot.count; i++) {
        const bool planned = station->plan_session[i] == station->snapshot.demand[i].session;
        const int32_t plan_W = planned ? taper_station_planned_W(station, i, 0) : 0;
        station->proposal.wish_W[i] = taper_min_i32(plan_W, station->proposal.ceiling_W[i]);
        if (planned && (station->plan_waits[i] || is_exact)) {
            station->proposal.ceiling_W[i] = station->proposal.wish_W[i];
        }
    }
}
