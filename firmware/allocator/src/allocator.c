#include "taper/allocator.h"

#include <string.h>

#include "rooms.h"
#include "turns.h"

/** Everything one allocation needs, so that the helpers below take one argument. */
typedef struct {
    const taper_station_config_t *config;
    const taper_snapshot_t *snapshot;
    const taper_proposal_t *proposal;
    const taper_rows_t *rows;
    taper_rooms_t rooms;
    bool keeps;         /* `kept` is what others leave for one who has waited too long already */
    taper_rooms_t kept; /* until then: the rooms before anybody had anything */
    int32_t reserved_mA[TAPER_MAX_CONNECTORS];
    int32_t *current_mA;
} round_t;

void taper_allocator_init(taper_allocator_t *allocator) {
    memset(allocator, 0, sizeof *allocator);
}

/** Rooms less what connectors draw whatever they are told. */
static void open_rooms(round_t *round, const int32_t *reserved_mA) {
    taper_rooms_open(&round->rooms, round->config, round->rows);
    for (uint8_t i = 0; i < round->config->connector_count; i++) {
        round->reserved_mA[i] = reserved_mA == NULL ? 0 : reserved_mA[i];
        if (round->reserved_mA[i] > 0) {
            taper_rooms_draw(&round->rooms, round->config, round->rows, i, round->reserved_mA[i]);
        }
    }
    round->keeps = false;
    round->kept = round->rooms;
}

/** Current that `power_W` needs, rounded down. 1 mA carries W_per_A mW. */
static int32_t current_of_mA(const taper_demand_t *demand, int32_t power_W) {
    return taper_saturate_i32(taper_quotient((int64_t)taper_max_i32(power_W, 0) * 1000, demand->W_per_A));
}

static int32_t whole_steps(int32_t current_mA) {
    return current_mA - current_mA % TAPER_CURRENT_STEP_mA;
}

/* ---- Minima, by turns */

/** Of `more_mA` for a connector what its own reservation does not cover. */
static int32_t unpaid_mA(const round_t *round, uint8_t i, int32_t more_mA) {
    const int32_t paid_mA = taper_max_i32(round->reserved_mA[i] - round->current_mA[i], 0);
    return taper_max_i32(more_mA - paid_mA, 0);
}

/** How much of `more_mA` fits; negative: a row is overdrawn. */
static int32_t fitting_mA(const round_t *round, const taper_rooms_t *rooms, uint8_t i, int32_t more_mA) {
    const int32_t beyond_mA = unpaid_mA(round, i, more_mA);
    const int32_t fits_mA = taper_rooms_fit_mA(rooms, round->config, round->rows, i, beyond_mA);
    return fits_mA < 0 ? fits_mA : more_mA - beyond_mA + fits_mA;
}

static bool fits(const round_t *round, const taper_rooms_t *rooms, uint8_t i, int32_t current_mA) {
    return fitting_mA(round, rooms, i, current_mA) >= current_mA;
}

static void draw(round_t *round, taper_rooms_t *rooms, uint8_t i, int32_t more_mA) {
    taper_rooms_draw(rooms, round->config, round->rows, i, unpaid_mA(round, i, more_mA));
}

/** Keep room for one who waited too long from those who would be switched on meanwhile; not for what never fits. */
static void keep_room_for(round_t *round, uint8_t i, int32_t least_mA) {
    if (!round->keeps && fits(round, &round->kept, i, least_mA)) {
        round->keeps = true;
        round->kept = round->rooms;
        draw(round, &round->kept, i, least_mA);
    }
}

static void serve_minimum(round_t *round, const taper_candidate_t *candidate, bool is_on) {
    const uint8_t i = candidate->connector;
    const int32_t least_mA = taper_turns_least_mA(&round->snapshot->demand[i]);
    const bool may = is_on || !round->keeps || fits(round, &round->kept, i, least_mA);
    if (may && fits(round, &round->rooms, i, least_mA)) {
        draw(round, &round->rooms, i, least_mA);
        if (round->keeps) {
            draw(round, &round->kept, i, least_mA);
        }
        round->current_mA[i] = least_mA;
    } else if (candidate->stage == TAPER_STAGE_OVERDUE) {
        keep_room_for(round, i, least_mA);
    }
}

/** The queue's minima from place `first` to before `end`. */
static void serve_minima(round_t *round, const taper_allocator_t *allocator, const taper_queue_t *queue,
                         uint8_t first, uint8_t end) {
    for (uint8_t place = first; place < end; place++) {
        const taper_candidate_t *candidate = &queue->candidate[place];
        if (candidate->stage != TAPER_STAGE_KEPT_OFF) {
            serve_minimum(round, candidate, allocator->turn[candidate->connector].on);
        }
    }
}

/* ---- What goes beyond them, by rank */

static int32_t wished_mA(const round_t *round, uint8_t i) {
    return current_of_mA(&round->snapshot->demand[i], round->proposal->wish_W[i]);
}

static int32_t ceiling_W(const round_t *round, uint8_t i) {
    return taper_max_i32(round->proposal->ceiling_W[i], round->proposal->wish_W[i]);
}

static int32_t ceiling_mA(const round_t *round, uint8_t i) {
    const taper_demand_t *demand = &round->snapshot->demand[i];
    return whole_steps(taper_min_i32(current_of_mA(demand, ceiling_W(round, i)), demand->max_mA));
}

/** The same rounded up: the last step carries the part of the ceiling that rounding down left out. */
static int32_t ceiling_rounded_up_mA(const round_t *round, uint8_t i) {
    const int32_t whole_mA = ceiling_mA(round, i);
    const int64_t whole_mW = (int64_t)whole_mA * round->snapshot->demand[i].W_per_A;
    return whole_mW < (int64_t)ceiling_W(round, i) * 1000 ? whole_mA + TAPER_CURRENT_STEP_mA : whole_mA;
}

/** Raise a connector towards `target_mA` as far as every room allows. */
static void raise(round_t *round, uint8_t i, int32_t target_mA) {
    const int32_t present_mA = round->current_mA[i];
    const int32_t more_mA = taper_min_i32(target_mA, round->snapshot->demand[i].max_mA) - present_mA;
    if (more_mA < TAPER_CURRENT_STEP_mA) {
        return;
    }
    const int32_t fits_mA = fitting_mA(round, &round->rooms, i, more_mA);
    if (fits_mA >= TAPER_CURRENT_STEP_mA) {
        draw(round, &round->rooms, i, whole_steps(fits_mA));
        round->current_mA[i] = present_mA + whole_steps(fits_mA);
    }
}

/** Whether it has its minimum, or needs none. A rank binds nobody: it may name a connector that there is not. */
static bool may_be_raised(const round_t *round, uint8_t i) {
    return i < round->snapshot->count && round->snapshot->demand[i].active &&
           (round->snapshot->demand[i].min_mA == 0 || round->current_mA[i] > 0);
}

/** One pass in the order of rank: raise every connector that may have more towards `target`. */
static void raise_all(round_t *round, int32_t (*target)(const round_t *, uint8_t)) {
    for (uint8_t place = 0; place < round->snapshot->count; place++) {
        const uint8_t i = round->proposal->rank[place];
        if (may_be_raised(round, i)) {
            raise(round, i, target(round, i));
        }
    }
}

/** Who is to be cut last when phases are balanced: the queue, as it stands; then those that need no turn, by rank. */
static void order_for_balance(const round_t *round, const taper_queue_t *queue, uint8_t *order) {
    uint8_t count = 0;
    memset(order, UINT8_MAX, round->snapshot->count);
    while (count < queue->count) {
        order[count] = queue->candidate[count].connector;
        count++;
    }
    for (uint8_t place = 0; place < round->snapshot->count && count < round->snapshot->count; place++) {
        const uint8_t i = round->proposal->rank[place];
        if (i < round->snapshot->count && round->snapshot->demand[i].min_mA == 0) {
            order[count++] = i;
        }
    }
}

void taper_allocate(taper_allocator_t *allocator, const taper_station_config_t *config,
                    const taper_snapshot_t *snapshot, const taper_proposal_t *proposal,
                    const taper_rows_t *rows, const int32_t *reserved_mA, taper_setpoints_t *setpoints) {
    taper_queue_t queue;
    uint8_t order[TAPER_MAX_CONNECTORS];
    round_t round;
    round.config = config;
    round.snapshot = snapshot;
    round.proposal = proposal;
    round.rows = rows;
    round.current_mA = setpoints->current_mA;
    memset(setpoints, 0, sizeof *setpoints);
    open_rooms(&round, reserved_mA);
    taper_turns_begin(allocator, config, snapshot);
    taper_turns_line_up(allocator, config, snapshot, proposal, &queue);
    serve_minima(&round, allocator, &queue, 0, queue.wishing);
    raise_all(&round, wished_mA);
    serve_minima(&round, allocator, &queue, queue.wishing, queue.count);
    raise_all(&round, ceiling_mA);
    raise_all(&round, ceiling_rounded_up_mA);
    order_for_balance(&round, &queue, order);
    taper_balance(config, snapshot, rows, order, setpoints);
    taper_turns_end(allocator, config, snapshot, proposal, &queue, setpoints);
}
