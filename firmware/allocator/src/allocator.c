#include "taper/allocator.h"

#include <string.h>

#include "rooms.h"

/** Everything one allocation needs, so that the helpers below take one argument. */
typedef struct {
    const taper_station_config_t *config;
    const taper_snapshot_t *snapshot;
    const taper_proposal_t *proposal;
    const taper_allocator_t *allocator; /* the switches' history */
    taper_rooms_t rooms;
    int32_t *current_mA;
} round_t;

void taper_allocator_init(taper_allocator_t *allocator) {
    memset(allocator, 0, sizeof *allocator);
}

/** Rooms less what connectors that cannot be told anything may still draw. */
static void open_rooms(round_t *round, const taper_supply_t *supply, const int32_t *reserved_mA) {
    taper_rooms_open(&round->rooms, round->config, supply);
    for (uint8_t i = 0; reserved_mA != NULL && i < round->config->connector_count; i++) {
        const taper_booking_t booking = taper_booking_now(round->config, round->snapshot, i);
        taper_rooms_take(&round->rooms, round->config, i, &booking, reserved_mA[i]);
    }
}

/** Current that `power_W` needs, rounded down. 1 mA carries W_per_A mW. */
static int32_t current_of_mA(const taper_demand_t *demand, int64_t power_mW) {
    return taper_saturate_i32(power_mW / demand->W_per_A);
}

static int32_t whole_steps(int32_t current_mA) {
    return current_mA - current_mA % TAPER_CURRENT_STEP_mA;
}

/** Raise a connector towards `target_mA` as far as every room allows; below its minimum not at all. */
static void raise(round_t *round, uint8_t i, int32_t target_mA) {
    const taper_demand_t *demand = &round->snapshot->demand[i];
    const int32_t present_mA = round->current_mA[i];
    const int32_t most_mA = taper_min_i32(target_mA, demand->max_mA);
    if (most_mA <= present_mA) {
        return;
    }
    const taper_booking_t booking = taper_booking_now(round->config, round->snapshot, i);
    const int32_t fits_mA = taper_max_i32(taper_rooms_left_mA(&round->rooms, round->config, i, &booking), 0);
    const int32_t raised_mA = whole_steps(present_mA + taper_min_i32(most_mA - present_mA, fits_mA));
    if (raised_mA <= present_mA || raised_mA < demand->min_mA) {
        return;
    }
    taper_rooms_take(&round->rooms, round->config, i, &booking, raised_mA - present_mA);
    round->current_mA[i] = raised_mA;
}

/** A switch that belongs to another session has no history. */
static const taper_turn_t *switch_of(const round_t *round, uint8_t i) {
    static const taper_turn_t fresh = {0};
    const taper_turn_t *state = &round->allocator->turn[i];
    return state->session == round->snapshot->demand[i].session ? state : &fresh;
}

static bool held(const taper_turn_t *state, bool on, uint32_t now_ms, uint32_t least_ms) {
    return state->switched && state->on == on && taper_elapsed_ms(now_ms, state->since_ms) < least_ms;
}

/** Current to start from for a wish: with a minimum, a wish below it becomes the minimum or nothing. */
static int32_t wished_mA(const round_t *round, uint8_t i) {
    const taper_demand_t *demand = &round->snapshot->demand[i];
    const int32_t wish_mA =
        current_of_mA(demand, (int64_t)taper_max_i32(round->proposal->wish_W[i], 0) * 1000);
    if (wish_mA >= demand->min_mA) {
        return wish_mA;
    }
    const bool stays_on = held(switch_of(round, i), true, round->snapshot->now_ms, round->config->min_on_ms);
    return stays_on || wish_mA >= demand->min_mA / 2 ? demand->min_mA : 0;
}

/** Current for a ceiling, rounded down, but at least the minimum: less than that cannot be offered. */
static int32_t ceiling_mA(const round_t *round, uint8_t i) {
    const taper_demand_t *demand = &round->snapshot->demand[i];
    const int32_t ceiling_W = taper_max_i32(round->proposal->ceiling_W[i], round->proposal->wish_W[i]);
    if (ceiling_W <= 0) {
        return 0;
    }
    const int32_t useful_mA = taper_min_i32(current_of_mA(demand, (int64_t)ceiling_W * 1000), demand->max_mA);
    return taper_max_i32(whole_steps(useful_mA), demand->min_mA);
}

/** The same rounded up: the last step carries the part of the ceiling that rounding down left out. */
static int32_t ceiling_rounded_up_mA(const round_t *round, uint8_t i) {
    const taper_demand_t *demand = &round->snapshot->demand[i];
    const int32_t whole_mA = ceiling_mA(round, i);
    const int64_t ceiling_mW =
        (int64_t)taper_max_i32(round->proposal->ceiling_W[i], round->proposal->wish_W[i]) * 1000;
    return (int64_t)whole_mA * demand->W_per_A < ceiling_mW ? whole_mA + TAPER_CURRENT_STEP_mA : whole_mA;
}

static bool may_have_current(const round_t *round, uint8_t i) {
    if (i >= round->snapshot->count || !round->snapshot->demand[i].active) {
        return false;
    }
    const bool kept_off =
        held(switch_of(round, i), false, round->snapshot->now_ms, round->config->min_off_ms);
    return round->snapshot->demand[i].min_mA == 0 || !kept_off;
}

static void note_switch(taper_turn_t *state, const taper_demand_t *demand, bool on, uint32_t now_ms) {
    if (!demand->active || state->session != demand->session) {
        *state = (taper_turn_t){.session = demand->active ? demand->session : 0};
    }
    if (state->on != on) {
        *state = (taper_turn_t){.on = on, .switched = true, .session = state->session, .since_ms = now_ms};
    }
}

/** One pass in the order of rank: raise every connector that may have current towards `target`. */
static void raise_all(round_t *round, int32_t (*target)(const round_t *, uint8_t)) {
    for (uint8_t place = 0; place < round->snapshot->count; place++) {
        const uint8_t i = round->proposal->rank[place];
        if (may_have_current(round, i)) {
            raise(round, i, target(round, i));
        }
    }
}

void taper_allocate(taper_allocator_t *allocator, const taper_station_config_t *config,
                    const taper_snapshot_t *snapshot, const taper_proposal_t *proposal,
                    const taper_supply_t *supply, const int32_t *reserved_mA, taper_setpoints_t *setpoints) {
    round_t round = {
        .config = config,
        .snapshot = snapshot,
        .proposal = proposal,
        .allocator = allocator,
        .current_mA = setpoints->current_mA,
    };
    memset(setpoints, 0, sizeof *setpoints);
    open_rooms(&round, supply, reserved_mA);
    raise_all(&round, wished_mA);
    raise_all(&round, ceiling_mA);
    raise_all(&round, ceiling_rounded_up_mA);
    for (uint8_t i = 0; i < snapshot->count; i++) {
        note_switch(&allocator->turn[i], &snapshot->demand[i], setpoints->current_mA[i] > 0,
                    snapshot->now_ms);
    }
}
