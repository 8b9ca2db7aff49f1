/* Setpoints: the firmware's allocator, then rates and fill, and the firmware's guard over all of it. */
#include <string.h>

#include "scheduler_internal.h"
#include "taper/battery.h"

/** As in the firmware: setpoints that the guard refuses are lowered to this share, so many times; then to nothing. */
#define SCALE_percent 75
#define SCALE_ROUNDS  4

bool scheduler_guard_passes(const taper_scheduler_t *scheduler, const taper_setpoints_t *setpoints) {
    return taper_guard_passes(&scheduler->config, &scheduler->snapshot, &scheduler->supply, setpoints);
}

/* ---- Rates */

/** The greatest current that connector `i` can give, of at most `most_mA`. */
static int32_t rate_below_mA(const taper_scheduler_t *scheduler, uint8_t i, int32_t most_mA) {
    const rates_t *rates = &scheduler->rates[i];
    if (rates->count == 0) {
        return most_mA < scheduler->connector[i].min_mA ? 0 : most_mA - most_mA % TAPER_CURRENT_STEP_mA;
    }
    int32_t found_mA = 0;
    for (unsigned k = 0; k < rates->count && rates->rate_mA[k] <= most_mA; k++) {
        found_mA = rates->rate_mA[k];
    }
    return found_mA;
}

int32_t scheduler_next_mA(const taper_scheduler_t *scheduler, uint8_t i, int32_t current_mA) {
    const rates_t *rates = &scheduler->rates[i];
    const taper_connector_config_t *connector = &scheduler->connector[i];
    if (rates->count == 0) {
        const int32_t next_mA = taper_max_i32(current_mA + TAPER_CURRENT_STEP_mA, connector->min_mA);
        return next_mA <= connector->max_mA ? next_mA : 0;
    }
    for (unsigned k = 0; k < rates->count; k++) {
        if (rates->rate_mA[k] > current_mA) {
            return rates->rate_mA[k];
        }
    }
    return 0;
}

static void round_down(const taper_scheduler_t *scheduler, taper_setpoints_t *setpoints) {
    for (uint8_t i = 0; i < scheduler->config.connector_count; i++) {
        setpoints->current_mA[i] = rate_below_mA(scheduler, i, setpoints->current_mA[i]);
    }
}

/* ---- Fill */

/** Whether a connector draws from a pair of lines: 0 L1-L2, 1 L2-L3, 2 L3-L1. */
static bool is_on_pair(const taper_scheduler_t *scheduler, uint8_t i, unsigned pair) {
    const taper_booking_t *booking = &scheduler->snapshot.demand[i].booking;
    return booking->line_to_line && booking->phases == (1u << pair | 1u << (pair + 1) % 3);
}

/**
 * Whether the guard passes, however little of these currents is drawn. The length of a sum of phasors is convex in each pair's
 * current, so it is greatest where pairs draw all or nothing; lines to neutral only add.
 */
static bool holds_however_drawn(const taper_scheduler_t *scheduler, const taper_setpoints_t *setpoints) {
    bool passes = scheduler_guard_passes(scheduler, setpoints);
    for (unsigned pair = 0; passes && scheduler->config.line_to_line && pair < 3; pair++) {
        taper_setpoints_t without = *setpoints;
        for (uint8_t i = 0; i < scheduler->config.connector_count; i++) {
            without.current_mA[i] = is_on_pair(scheduler, i, pair) ? 0 : without.current_mA[i];
        }
        passes = scheduler_guard_passes(scheduler, &without);
    }
    return passes;
}

/** Raise connector `i` as far as `most_mA`, to a current that holds: those that do are next to each other. */
static void raise(const taper_scheduler_t *scheduler, uint8_t i, int32_t most_mA,
                  taper_setpoints_t *setpoints) {
    int32_t held_mA = setpoints->current_mA[i];
    int32_t tried_mA = rate_below_mA(scheduler, i, most_mA);
    int32_t refused_mA = tried_mA + 1;
    while (tried_mA > held_mA) { /* bisection, on the rates */
        setpoints->current_mA[i] = tried_mA;
        if (holds_however_drawn(scheduler, setpoints)) {
            held_mA = tried_mA;
        } else {
            refused_mA = tried_mA;
        }
        tried_mA = rate_below_mA(scheduler, i, held_mA + (refused_mA - held_mA) / 2);
        if (tried_mA <= held_mA) {
            const int32_t next_mA = scheduler_next_mA(scheduler, i, held_mA);
            tried_mA = next_mA < refused_mA ? next_mA : 0;
        }
    }
    setpoints->current_mA[i] = held_mA;
}

static int32_t ceiling_mA(const taper_scheduler_t *scheduler, uint8_t i) {
    const taper_demand_t *demand = &scheduler->snapshot.demand[i];
    const int64_t ceiling_mW = (int64_t)scheduler->proposal.ceiling_W[i] * 1000;
    return taper_min_i32(taper_saturate_i32(ceiling_mW / demand->W_per_A), demand->max_mA);
}

/** The next rate above the ceiling, where a whole period of it is no more than the vehicle takes or wants. */
static int32_t rounded_up_mA(const taper_scheduler_t *scheduler, uint8_t i) {
    const taper_demand_t *demand = &scheduler->snapshot.demand[i];
    const int32_t below_mA = rate_below_mA(scheduler, i, ceiling_mA(scheduler, i));
    const int32_t next_mA = scheduler_next_mA(scheduler, i, below_mA);
    const int64_t takes_mWs = (int64_t)taper_battery_limit_W(demand) * scheduler->period_ms;
    const bool is_charged_by_then = takes_mWs > (int64_t)demand->need_Wh * 3600000;
    const bool is_enough =
        (int64_t)below_mA * demand->W_per_A >= (int64_t)scheduler->proposal.ceiling_W[i] * 1000;
    return is_charged_by_then || is_enough || next_mA > demand->max_mA ? below_mA : next_mA;
}

/** The wish, rounded to the nearest rate that is not more than the vehicle takes or wants. */
static int32_t nearest_to_wish_mA(const taper_scheduler_t *scheduler, uint8_t i) {
    const taper_demand_t *demand = &scheduler->snapshot.demand[i];
    const int64_t wish_mW = (int64_t)scheduler->proposal.wish_W[i] * 1000;
    const int32_t wish_mA = taper_min_i32(taper_saturate_i32(wish_mW / demand->W_per_A), demand->max_mA);
    const int32_t below_mA = rate_below_mA(scheduler, i, wish_mA);
    const int32_t next_mA = scheduler_next_mA(scheduler, i, below_mA);
    const bool is_nearer = next_mA - wish_mA <= wish_mA - below_mA && next_mA <= rounded_up_mA(scheduler, i);
    return is_nearer ? next_mA : below_mA;
}

/** One pass by urgency. Who is off for want of a place keeps waiting for his turn. */
static void fill(const taper_scheduler_t *scheduler, taper_setpoints_t *setpoints,
                 int32_t (*most_mA)(const taper_scheduler_t *, uint8_t)) {
    for (uint8_t place = 0; place < scheduler->snapshot.count; place++) {
        const uint8_t i = scheduler->proposal.rank[place];
        const taper_demand_t *demand = &scheduler->snapshot.demand[i];
        if (demand->active && (demand->min_mA == 0 || setpoints->current_mA[i] > 0)) {
            raise(scheduler, i, most_mA(scheduler, i), setpoints);
        }
    }
}

/**
 * The current with which a vehicle ends the period so that it still wants what the least current gives in the next, if with
 * `current_mA` it would want less than that, and never get it; else `current_mA`.
 */
static int32_t with_a_useful_rest_mA(const taper_scheduler_t *scheduler, uint8_t i, int32_t current_mA) {
    const taper_demand_t *demand = &scheduler->snapshot.demand[i];
    const int64_t takes_mW = (int64_t)taper_battery_limit_W(demand) * 1000;
    const int64_t given_mW = (int64_t)current_mA * demand->W_per_A;
    const int64_t least_mW = (int64_t)demand->min_mA * demand->W_per_A;
    const int64_t need_mW = (int64_t)demand->need_Wh * 3600000 / scheduler->options.period_s;
    const int64_t rest_mW = need_mW - given_mW;
    const bool leaves = demand->departs_in_s <= scheduler->options.period_s;
    if (leaves || takes_mW < given_mW || rest_mW <= 0 || rest_mW >= least_mW || need_mW < 2 * least_mW) {
        return current_mA;
    }
    return rate_below_mA(scheduler, i, (int32_t)((need_mW - least_mW) / demand->W_per_A));
}

/** Nothing is raised, so what held however drawn still does. */
static void keep_rests_useful(const taper_scheduler_t *scheduler, taper_setpoints_t *setpoints) {
    for (uint8_t i = 0; i < scheduler->snapshot.count; i++) {
        if (setpoints->current_mA[i] > 0 && scheduler->snapshot.demand[i].min_mA > 0) {
            setpoints->current_mA[i] = with_a_useful_rest_mA(scheduler, i, setpoints->current_mA[i]);
        }
    }
}

/* ---- Guard */

static void scale(const taper_scheduler_t *scheduler, taper_setpoints_t *setpoints) {
    for (uint8_t i = 0; i < scheduler->config.connector_count; i++) {
        const int64_t less_mA = (int64_t)setpoints->current_mA[i] * SCALE_percent / 100;
        setpoints->current_mA[i] = rate_below_mA(scheduler, i, (int32_t)less_mA);
    }
}

/** No current gets past a guard that refuses it. */
static void enforce(const taper_scheduler_t *scheduler, taper_setpoints_t *setpoints) {
    for (unsigned round = 0; round < SCALE_ROUNDS && !scheduler_guard_passes(scheduler, setpoints); round++) {
        scale(scheduler, setpoints);
    }
    if (!scheduler_guard_passes(scheduler, setpoints)) {
        memset(setpoints, 0, sizeof *setpoints);
    }
}

void scheduler_allocate(taper_scheduler_t *scheduler) {
    taper_setpoints_t *setpoints = &scheduler->setpoints;
    taper_rows_now(&scheduler->rows, &scheduler->config, &scheduler->snapshot, &scheduler->supply);
    taper_allocate(&scheduler->allocator, &scheduler->config, &scheduler->snapshot, &scheduler->proposal,
                   &scheduler->rows, NULL, setpoints);
    round_down(scheduler, setpoints);
    if (scheduler->options.fill != 0 && scheduler_guard_passes(scheduler, setpoints)) {
        fill(scheduler, setpoints, nearest_to_wish_mA);
        fill(scheduler, setpoints, ceiling_mA);
        fill(scheduler, setpoints, rounded_up_mA);
        keep_rests_useful(scheduler, setpoints);
    }
    if (!scheduler_guard_passes(scheduler, setpoints)) {
        scheduler->account.lowered++;
        enforce(scheduler, setpoints);
    }
}
