/* What a tick decides: who wants what, who proposes, what holds every limit, and what of it may be told by now. */
#include <string.h>

#include "station_internal.h"

/** Setpoints that a guard refuses are lowered to this share of themselves, so many times; then to nothing. */
#define SCALE_percent 75
#define SCALE_ROUNDS  4

/** The greatest current of a connector's conductors, or absent. */
static int32_t measured_mA(const taper_station_t *station, uint8_t i, uint32_t now_ms) {
    const taper_evse_status_t *status = &station->sessions.session[i].status;
    if (!taper_session_is_online(&station->sessions, i, now_ms)) {
        return TAPER_ABSENT;
    }
    const int32_t most_mA = taper_max_i32(status->current_mA[0], status->current_mA[1]);
    return taper_max_i32(most_mA, status->current_mA[2]); /* absent is below any other */
}

static void note_draw(taper_station_t *station, uint8_t i, taper_draw_state_t before, int32_t drawn_mA) {
    const taper_connector_config_t *connector = &station->options.config->connectors[i];
    const taper_draw_state_t state = station->draw[i].state;
    if (state == before) {
        return;
    }
    if (state == TAPER_DRAW_LOCKED || before == TAPER_DRAW_LOCKED) {
        station->sessions.changes++; /* a restart must not unlock it */
    }
    if (state == TAPER_DRAW_OVER) {
        taper_station_count(station, TAPER_COUNTER_OVER_DRAWS);
        taper_event_note(&station->events, TAPER_EVENT_OVER_DRAW, connector->bus, connector->node,
                         drawn_mA / TAPER_CURRENT_STEP_mA);
    }
    if (state == TAPER_DRAW_LOCKED) {
        taper_station_count(station, TAPER_COUNTER_LOCKOUTS);
        taper_event_note(&station->events, TAPER_EVENT_LOCKED_OUT, connector->bus, connector->node, 0);
    }
}

/** What the vehicle on a connector really draws bounds what it is given. */
static void watch_draw(taper_station_t *station, uint8_t i, uint32_t now_ms) {
    taper_demand_t *demand = &station->snapshot.demand[i];
    taper_draw_t *draw = &station->draw[i];
    const taper_draw_state_t before = draw->state;
    const taper_draw_report_t report = {
        .plugged = taper_session_may_be_there(&station->sessions, i),
        .session = taper_session_number(&station->sessions, i),
        .allowed_mA = taper_ledger_told_mA(&station->ledger, i),
        .setpoint_mA = taper_max_i32(station->sent_mA[i], 0),
        .measured_mA = measured_mA(station, i, now_ms),
        .min_mA = demand->min_mA,
    };
    if (taper_draw_update(draw, &report, taper_station_world_ms(station, now_ms)) &&
        !station->options.config->planning.on_events) { /* the paper's rule knows of no such event */
        station->sessions.revision++;                   /* the planner is to know */
    }
    note_draw(station, i, before, report.measured_mA);
    if (draw->state != TAPER_DRAW_NORMAL) {
        const taper_connector_config_t *connector = &station->options.config->connectors[i];
        taper_alarm_raise(station, TAPER_EVENT_OVER_DRAW, connector->bus, connector->node, now_ms);
        *demand = (taper_demand_t){.booking = demand->booking}; /* what it draws still counts */
    } else if (demand->active && !station->options.config->planning.ignores_draw) {
        const int32_t most_mA = taper_learning_cap_mA(station, i, draw->cap_mA);
        const int32_t cap_mA = most_mA - most_mA % TAPER_CURRENT_STEP_mA;
        demand->max_mA = taper_min_i32(demand->max_mA, taper_max_i32(cap_mA, demand->min_mA));
    }
    if (station->options.config->planning.learns_taper) {
        taper_learning_look(station, i, report.measured_mA);
    }
}

static void take_snapshot(taper_station_t *station, uint32_t now_ms) {
    taper_session_snapshot(&station->sessions, now_ms, &station->snapshot);
    for (uint8_t i = 0; i < station->snapshot.count; i++) {
        taper_phases_update(station, i, now_ms);
        watch_draw(station, i, now_ms);
    }
}

static void note_mode(taper_station_t *station, taper_mode_t before) {
    const taper_mode_t mode = station->supervisor.mode;
    if (mode != before) {
        taper_event_note(&station->events, TAPER_EVENT_MODE, 0, 0, (int32_t)mode);
    }
    if (mode == TAPER_MODE_FALLBACK || mode == TAPER_MODE_FAILSAFE) {
        taper_station_count(station, TAPER_COUNTER_FALLBACK_TICKS);
    }
}

static taper_mode_t decide_mode(taper_station_t *station, uint32_t now_ms) {
    const taper_mode_t before = station->supervisor.mode;
    const taper_situation_t situation = {
        .gateway_alive = taper_limits_gateway_alive(&station->limits, now_ms),
        .gateway_heard = station->limits.heard,
        .tick_overran = station->self.overran,
        .proposal_ready = station->options.policy != NULL || taper_station_has_plan(station),
    };
    const taper_mode_t mode = taper_supervisor_update(&station->supervisor, &situation, now_ms);
    note_mode(station, before);
    return mode;
}

static void propose(taper_station_t *station, taper_mode_t mode) {
    const taper_policy_t *policy = station->options.policy;
    if (mode != TAPER_MODE_PLAN) {
        taper_propose_edf(&station->snapshot, station->options.config->tick_ms, &station->proposal);
    } else if (policy != NULL) {
        policy->propose(policy->context, &station->snapshot, station->limit_now.supply.site_W,
                        &station->proposal);
    } else {
        taper_station_propose_plan(station);
    }
    if (station->options.config->planning.learns_taper) {
        taper_learning_probe(station);
    }
}

/** What a connector draws whatever it is told: all that it may if it is silent or has to stop, what it takes if that is too
    much, or the fallback current of one that reports but is not known to hear us. */
static int32_t reserve_mA(const taper_station_t *station, uint8_t i, uint32_t now_ms) {
    const bool obeys =
        taper_session_is_online(&station->sessions, i, now_ms) && station->draw[i].state == TAPER_DRAW_NORMAL;
    if (!obeys) {
        return taper_ledger_may_mA(&station->ledger, i);
    }
    return taper_max_i32(station->ledger.entry[i].drawn_mA, taper_ledger_unreached_mA(&station->ledger, i));
}

/** Currents for the proposal that hold every limit, once all connectors have followed. */
static void allocate(taper_station_t *station, uint32_t now_ms) {
    const taper_station_config_t *config = station->options.config;
    int32_t reserved_mA[TAPER_MAX_CONNECTORS];
    for (uint8_t i = 0; i < config->connector_count; i++) {
        reserved_mA[i] = reserve_mA(station, i, now_ms);
        station->setpoint_session[i] = taper_session_number(&station->sessions, i);
    }
    taper_record_resume_turns(station, now_ms);
    taper_allocate(&station->allocator, config, &station->snapshot, &station->proposal, &station->rows,
                   reserved_mA, &station->target);
    if (station->rival_heard || station->stopped) {
        memset(&station->target, 0, sizeof station->target);
    }
}

void taper_station_seal(taper_station_t *station) {
    for (uint8_t i = 0; i < station->options.config->connector_count; i++) {
        station->inverse.current_mA[i] = ~station->setpoints.current_mA[i];
        station->fallback_inverse.current_mA[i] = ~station->fallback.current_mA[i];
    }
}

/** Whether setpoints and fallback currents are as they were decided. */
static bool is_sealed(const taper_station_t *station) {
    int32_t differs = 0;
    for (uint8_t i = 0; i < station->options.config->connector_count; i++) {
        differs |= station->inverse.current_mA[i] ^ ~station->setpoints.current_mA[i];
        differs |= station->fallback_inverse.current_mA[i] ^ ~station->fallback.current_mA[i];
    }
    return differs == 0;
}

static bool guards_pass(const taper_station_t *station, const taper_setpoints_t *granted) {
    const taper_station_config_t *config = station->options.config;
    const taper_supply_t *supply = &station->limit_now.supply;
    return taper_guard_passes(config, &station->snapshot, supply, granted) &&
           taper_guard_hand_over_passes(&station->ledger, config, &station->snapshot, supply, granted);
}

/** Less for everybody, in whole steps, and nothing for whom it is too little. */
static void scale(const taper_station_t *station, taper_setpoints_t *granted) {
    for (uint8_t i = 0; i < station->options.config->connector_count; i++) {
        const int32_t less_mA = (int32_t)((int64_t)granted->current_mA[i] * SCALE_percent / 100);
        granted->current_mA[i] =
            less_mA < station->snapshot.demand[i].min_mA ? 0 : less_mA - less_mA % TAPER_CURRENT_STEP_mA;
    }
}

/** Fault 25. No setpoint gets past a guard that refuses it: less for all, then nothing. */
static void enforce(taper_station_t *station, taper_setpoints_t *granted) {
    if (guards_pass(station, granted)) {
        return;
    }
    taper_station_count(station, TAPER_COUNTER_GUARD_VIOLATIONS);
    taper_event_note(&station->events, TAPER_EVENT_GUARD, 0, 0, 0);
    for (unsigned round = 0; round < SCALE_ROUNDS && !guards_pass(station, granted); round++) {
        scale(station, granted);
    }
    if (!guards_pass(station, granted)) {
        memset(granted, 0, sizeof *granted);
    }
}

static void grant_fallback(taper_station_t *station) {
    const taper_station_config_t *config = station->options.config;
    const int32_t failsafe_W = station->limits.failsafe_W;
    taper_ledger_grant_fallback(&station->ledger, config, &station->snapshot, &station->rows,
                                station->proposal.rank, failsafe_W, &station->setpoints, &station->fallback);
    if (!taper_guard_fallback_passes(&station->ledger, config, &station->snapshot, failsafe_W,
                                     &station->setpoints, &station->fallback)) {
        taper_station_count(station, TAPER_COUNTER_GUARD_VIOLATIONS);
        taper_event_note(&station->events, TAPER_EVENT_GUARD, 0, 0, 1);
        memset(&station->fallback, 0, sizeof station->fallback);
    }
}

/** What of the target may be told and is paid for by now. */
static void grant(taper_station_t *station, uint32_t now_ms) {
    const taper_station_config_t *config = station->options.config;
    taper_setpoints_t granted = {{0}}; /* all of it: it is compared whole */
    taper_shape_bound(&station->shape, config, &station->snapshot, &station->target,
                      taper_station_world_ms(station, now_ms), &station->shaped);
    taper_ledger_grant(&station->ledger, config, &station->snapshot, station->proposal.rank, &station->rows,
                       &station->shaped, &granted);
    enforce(station, &granted);
    station->setpoints = granted;
    grant_fallback(station);
    taper_station_seal(station);
}

bool taper_station_is_settled(const taper_station_t *station) {
    return memcmp(&station->target, &station->setpoints, sizeof station->target) == 0;
}

bool taper_station_hands_over(const taper_station_t *station) {
    return memcmp(&station->shaped, &station->setpoints, sizeof station->shaped) != 0;
}

void taper_station_regrant(taper_station_t *station, uint32_t now_ms) {
    if (!station->stopped && !taper_station_is_settled(station)) {
        grant(station, now_ms);
    }
}

void taper_station_check_seal(taper_station_t *station, uint32_t now_ms) {
    if (is_sealed(station)) {
        return;
    }
    taper_self_flipped(&station->self);
    taper_station_count(station, TAPER_COUNTER_SETPOINT_FLIPS);
    taper_event_note(&station->events, TAPER_EVENT_SETPOINT_FLIP, 0, 0, 0);
    grant(station, now_ms);
}

void taper_station_decide(taper_station_t *station, uint32_t now_ms) {
    take_snapshot(station, now_ms);
    station->limit_now = taper_limits_now(&station->limits, now_ms);
    taper_station_plan(station, station->limit_now.supply.site_W);
    const taper_mode_t mode = decide_mode(station, now_ms);
    if (mode == TAPER_MODE_INIT) {
        station->limit_now.supply.site_W = 0;
    }
    taper_rows_now(&station->rows, station->options.config, &station->snapshot, &station->limit_now.supply);
    propose(station, mode);
    allocate(station, now_ms);
    grant(station, now_ms);
    taper_station_sum_rows(station);
}
