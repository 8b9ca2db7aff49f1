#include "turns.h"

/** A longer wait or turn is as good as this [s]. */
#define AGE_MOST_s 1000000u
/** Longest time that is booked at once: what lies between two ticks further apart was no charging under control. */
#define BOOKED_AT_ONCE_ms 3600000

int32_t taper_turns_least_mA(const taper_demand_t *demand) {
    return (demand->min_mA + TAPER_CURRENT_STEP_mA - 1) / TAPER_CURRENT_STEP_mA * TAPER_CURRENT_STEP_mA;
}

static int64_t minimum_mW(const taper_demand_t *demand) {
    return (int64_t)demand->min_mA * demand->W_per_A;
}

static int64_t at_most(int64_t value, int64_t most) {
    return value < most ? value : most;
}

/** What the vehicle draws at most until the next tick, whatever it is offered [mW]. */
static int64_t draws_mW(const taper_station_config_t *config, const taper_demand_t *demand) {
    const int64_t takes_W = taper_demand_battery_W(demand);
    const int64_t need_mWs = (int64_t)demand->need_Wh * 3600 * 1000;
    if (takes_W * config->tick_ms <= need_mWs) {
        return takes_W * 1000; /* it is not complete by then */
    }
    return (need_mWs + config->tick_ms - 1) / config->tick_ms * 1000;
}

/** Time to departure less the time to charge; who cannot charge is helped least by a place [s]. */
static int32_t laxity_s(const taper_demand_t *demand) {
    const int32_t power_W = taper_min_i32(taper_demand_allowed_W(demand), taper_demand_battery_W(demand));
    if (power_W <= 0) {
        return INT32_MAX;
    }
    return taper_saturate_i32(demand->departs_in_s -
                              taper_quotient((int64_t)demand->need_Wh * 3600, power_W));
}

/* ---- Owed energy: a wish below the minimum, followed over time */

static int64_t wish_mW(const taper_proposal_t *proposal, uint8_t i) {
    return (int64_t)taper_max_i32(proposal->wish_W[i], 0) * 1000;
}

static int64_t ceiling_mW(const taper_proposal_t *proposal, uint8_t i) {
    return (int64_t)taper_max_i32(proposal->ceiling_W[i], proposal->wish_W[i]) * 1000;
}

/** Energy of the minimum over a time. */
static int64_t minimum_mWs(const taper_demand_t *demand, int64_t time_ms) {
    return minimum_mW(demand) * time_ms / 1000;
}

static void book(taper_turn_t *turn, const taper_station_config_t *config, const taper_demand_t *demand,
                 uint32_t passed_ms) {
    const int64_t most_mWs = minimum_mWs(demand, (int64_t)config->min_on_ms + passed_ms);
    const int64_t owed_mWs = turn->owed_mWs + turn->lacks_mW * passed_ms / 1000;
    turn->owed_mWs = owed_mWs < -most_mWs ? -most_mWs : at_most(owed_mWs, most_mWs);
}

void taper_turns_begin(taper_allocator_t *allocator, const taper_station_config_t *config,
                       const taper_snapshot_t *snapshot) {
    const uint32_t elapsed_ms = taper_elapsed_ms(snapshot->now_ms, allocator->updated_ms);
    const uint32_t passed_ms = allocator->started ? (uint32_t)at_most(elapsed_ms, BOOKED_AT_ONCE_ms) : 0;
    for (uint8_t i = 0; i < snapshot->count; i++) {
        const taper_demand_t *demand = &snapshot->demand[i];
        taper_turn_t *turn = &allocator->turn[i];
        if (!demand->active || turn->session != demand->session) {
            *turn = (taper_turn_t){.session = demand->session};
        } else {
            book(turn, config, demand, passed_ms);
        }
    }
    allocator->started = true;
    allocator->updated_ms = snapshot->now_ms;
}

/** What was wished for until the next tick, and will not be charged [mW]. */
static int64_t lacks_mW(const taper_station_config_t *config, const taper_demand_t *demand,
                        const taper_proposal_t *proposal, uint8_t i, int32_t given_mA) {
    const int64_t allowed_mW = (int64_t)demand->max_mA * demand->W_per_A;
    const int64_t given_mW = at_most((int64_t)given_mA * demand->W_per_A, draws_mW(config, demand));
    return at_most(wish_mW(proposal, i), allowed_mW) - given_mW;
}

/* ---- The queue */

static bool held(const taper_turn_t *turn, bool on, uint32_t now_ms, uint32_t least_ms) {
    return turn->switched && turn->on == on && taper_elapsed_ms(now_ms, turn->since_ms) < least_ms;
}

/** A wish below the minimum: due when half of what the least time on will give is owed, until all is given. */
static bool is_due(const taper_turn_t *turn, const taper_station_config_t *config,
                   const taper_demand_t *demand) {
    return turn->owed_mWs > 0 && (turn->on || turn->owed_mWs >= minimum_mWs(demand, config->min_on_ms) / 2);
}

static bool calls_for_minimum(const taper_turn_t *turn, const taper_station_config_t *config,
                              const taper_snapshot_t *snapshot, const taper_proposal_t *proposal, uint8_t i) {
    const taper_demand_t *demand = &snapshot->demand[i];
    return held(turn, true, snapshot->now_ms, config->min_on_ms) ||
           wish_mW(proposal, i) >= minimum_mW(demand) ||
           (proposal->wish_W[i] > 0 && is_due(turn, config, demand));
}

/** Whether the ceiling has room for what the minimum makes the vehicle draw, but for a step that rounding cost. */
static bool allows_minimum(const taper_station_config_t *config, const taper_demand_t *demand,
                           const taper_proposal_t *proposal, uint8_t i) {
    const int64_t useful_mW = ceiling_mW(proposal, i);
    const int64_t step_mW = (int64_t)TAPER_CURRENT_STEP_mA * demand->W_per_A;
    return useful_mW > 0 && useful_mW + step_mW >= at_most(minimum_mW(demand), draws_mW(config, demand));
}

static bool needs_turn(const taper_demand_t *demand) {
    return demand->active && demand->min_mA > 0 && taper_turns_least_mA(demand) <= demand->max_mA;
}

/** Least laxity first. */
static taper_candidate_t by_laxity(taper_stage_t stage, const taper_demand_t *demand, uint8_t i) {
    const uint32_t key = (uint32_t)((int64_t)laxity_s(demand) - INT32_MIN);
    return (taper_candidate_t){.stage = (uint8_t)stage, .connector = i, .key = key};
}

/** Of a shorter turn, the hand-over would leave nothing: it would be over before the current came. */
static uint32_t whole_turn_ms(const taper_station_config_t *config) {
    uint32_t turn_ms = config->turn_ms;
    for (uint8_t i = 0; i < config->connector_count; i++) {
        const uint32_t reaction_ms = config->connectors[i].reaction_ms;
        const uint32_t least_ms = reaction_ms == 0 ? 0 : 2u * (reaction_ms + config->change_ms);
        turn_ms = least_ms > turn_ms ? least_ms : turn_ms;
    }
    return turn_ms;
}

static taper_candidate_t candidate_of(const taper_turn_t *turn, const taper_station_config_t *config,
                                      const taper_snapshot_t *snapshot, uint8_t i, uint32_t turn_ms) {
    const taper_demand_t *demand = &snapshot->demand[i];
    const uint32_t now_ms = snapshot->now_ms;
    if (held(turn, true, now_ms, config->min_on_ms)) {
        return by_laxity(TAPER_STAGE_HELD, demand, i);
    }
    if (held(turn, true, now_ms, turn_ms)) {
        return by_laxity(TAPER_STAGE_TURN, demand, i);
    }
    if (held(turn, false, now_ms, config->min_off_ms)) {
        return by_laxity(TAPER_STAGE_KEPT_OFF, demand, i);
    }
    const uint32_t waited_ms = taper_elapsed_ms(now_ms, turn->waiting_ms);
    if (turn->place > 0 && waited_ms >= turn_ms) {
        return (taper_candidate_t){
            .stage = TAPER_STAGE_OVERDUE, .connector = i, .key = UINT32_MAX - waited_ms};
    }
    return by_laxity(TAPER_STAGE_REST, demand, i);
}

static bool stands_before(const taper_candidate_t *a, const taper_candidate_t *b) {
    return a->stage != b->stage ? a->stage < b->stage : a->key < b->key;
}

/** Add to the end of the queue, which is in order from `first` on; ties stay in the order of coming. */
static void line_up_one(taper_queue_t *queue, uint8_t first, taper_candidate_t candidate) {
    uint8_t place = queue->count++;
    while (place > first && stands_before(&candidate, &queue->candidate[place - 1])) {
        queue->candidate[place] = queue->candidate[place - 1];
        place--;
    }
    queue->candidate[place] = candidate;
}

void taper_turns_line_up(const taper_allocator_t *allocator, const taper_station_config_t *config,
                         const taper_snapshot_t *snapshot, const taper_proposal_t *proposal,
                         taper_queue_t *queue) {
    bool left_over[TAPER_MAX_CONNECTORS] = {false};
    const uint32_t turn_ms = whole_turn_ms(config);
    queue->count = 0;
    for (uint8_t i = 0; i < snapshot->count; i++) {
        const taper_turn_t *turn = &allocator->turn[i];
        if (!needs_turn(&snapshot->demand[i])) {
            continue;
        }
        if (calls_for_minimum(turn, config, snapshot, proposal, i)) {
            line_up_one(queue, 0, candidate_of(turn, config, snapshot, i, turn_ms));
        } else {
            left_over[i] = allows_minimum(config, &snapshot->demand[i], proposal, i);
        }
    }
    queue->wishing = queue->count;
    for (uint8_t i = 0; i < snapshot->count; i++) {
        if (left_over[i]) {
            line_up_one(queue, queue->wishing,
                        candidate_of(&allocator->turn[i], config, snapshot, i, turn_ms));
        }
    }
}

/* ---- Afterwards */

static void note_switch(taper_allocator_t *allocator, taper_turn_t *turn, bool on, uint32_t now_ms) {
    if (turn->on != on) {
        turn->on = on;
        turn->switched = true;
        turn->since_ms = now_ms;
        allocator->switches++;
    }
}

/** Number those who wait. `waited` [connectors]: who did before. */
static void note_places(taper_allocator_t *allocator, const taper_queue_t *queue, const bool *waited,
                        const taper_setpoints_t *setpoints) {
    allocator->waiting = 0;
    for (uint8_t place = 0; place < queue->count; place++) {
        const uint8_t i = queue->candidate[place].connector;
        if (setpoints->current_mA[i] > 0) {
            continue;
        }
        allocator->turn[i].place = ++allocator->waiting;
        if (!waited[i]) {
            allocator->turn[i].waiting_ms = allocator->updated_ms;
        }
    }
}

void taper_turns_end(taper_allocator_t *allocator, const taper_station_config_t *config,
                     const taper_snapshot_t *snapshot, const taper_proposal_t *proposal,
                     const taper_queue_t *queue, const taper_setpoints_t *setpoints) {
    bool waited[TAPER_MAX_CONNECTORS];
    for (uint8_t i = 0; i < snapshot->count; i++) {
        taper_turn_t *turn = &allocator->turn[i];
        const taper_demand_t *demand = &snapshot->demand[i];
        waited[i] = turn->place > 0;
        turn->place = 0;
        note_switch(allocator, turn, setpoints->current_mA[i] > 0, snapshot->now_ms);
        turn->lacks_mW = demand->active ? lacks_mW(config, demand, proposal, i, setpoints->current_mA[i]) : 0;
    }
    note_places(allocator, queue, waited, setpoints);
}

/* ---- Over a restart */

taper_turn_kept_t taper_allocator_keep(const taper_allocator_t *allocator, uint8_t connector,
                                       uint32_t now_ms) {
    const taper_turn_t *turn = &allocator->turn[connector];
    return (taper_turn_kept_t){
        .on = turn->on,
        .switched = turn->switched,
        .waits = turn->place > 0,
        .since_s = taper_elapsed_ms(now_ms, turn->since_ms) / 1000u,
        .waiting_s = taper_elapsed_ms(now_ms, turn->waiting_ms) / 1000u,
        .owed_Ws = taper_saturate_i32(turn->owed_mWs / 1000),
    };
}

/** The time `age_s` and `later_s` before `now_ms`; no further back than the clock can tell. */
static uint32_t back_ms(uint32_t age_s, uint32_t later_s, uint32_t now_ms) {
    const uint64_t back_s = (uint64_t)age_s + later_s;
    return now_ms - (back_s < AGE_MOST_s ? (uint32_t)back_s : AGE_MOST_s) * 1000u;
}

void taper_allocator_restore(taper_allocator_t *allocator, uint8_t connector, uint8_t session,
                             const taper_turn_kept_t *kept, uint32_t later_s, uint32_t now_ms) {
    allocator->turn[connector] = (taper_turn_t){
        .on = kept->on,
        .switched = kept->switched,
        .place = kept->waits ? 1 : 0, /* the next allocation numbers them */
        .session = session,
        .since_ms = back_ms(kept->since_s, later_s, now_ms),
        .waiting_ms = back_ms(kept->waiting_s, later_s, now_ms),
        .owed_mWs = (int64_t)kept->owed_Ws * 1000,
    };
}

taper_waiting_t taper_allocator_waiting(const taper_allocator_t *allocator, uint8_t connector) {
    const uint8_t place = allocator->turn[connector].place;
    return (taper_waiting_t){.place = place, .of = place > 0 ? allocator->waiting : 0};
}
