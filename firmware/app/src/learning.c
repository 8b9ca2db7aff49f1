/* The tapers that vehicles show by what they accept (taper/learn.h), and the offers that make them show it. */
#include "taper/battery.h"

#include "station_internal.h"

/** A vehicle needs some time to rise to a higher offer, and to start: IEC 61851-1 knows no limit, most need less [ms]. */
#define RISE_ms UINT32_C(30000)
/** So much less than its offer is no noise of the measurement: so many deviations of that, at least 1 % each, and two steps. The
    margin of an offer is clear of that. */
#define LESS_deviations   2
#define LESS_mA           200
#define MARGIN_deviations 3
#define MARGIN_mA         300
#define MOST_DOUBLINGS    6
/** A vehicle is offered more, at the expense of others, for so long from when it has limited itself, or for a tick that is
    longer [ms]. Then it rests: so many times as long, if its line may be wrong by the margin here, or if not. */
#define SHOW_ms        UINT32_C(30000)
#define RESTS_IN_DOUBT 2
#define RESTS_IF_KNOWN 20
/** The planner is told of a line that has moved by this share of the vehicle's peak, at most so often. */
#define MOVED_permille 50
#define TELL_ms        UINT32_C(120000)
/** A plan this close to the limit is for all that the vehicle takes [permille]. */
#define ALL_permille 970

static int32_t part(int32_t value, int32_t thousandths) {
    return (int32_t)taper_quotient((int64_t)value * thousandths, 1000);
}

static int32_t margin_mA(const taper_learning_t *learning, int32_t takes_mA) {
    const int32_t deviation = taper_learn_noise_permille(&learning->line);
    return MARGIN_mA + part(takes_mA, MARGIN_deviations * deviation);
}

static int32_t margin_W(const taper_learning_t *learning, const taper_demand_t *demand, int32_t limit_W) {
    const int32_t takes_mA = taper_saturate_i32((int64_t)limit_W * 1000 / demand->W_per_A);
    const int64_t more_mA = (int64_t)margin_mA(learning, takes_mA) << learning->doublings;
    return taper_saturate_i32(more_mA * demand->W_per_A / 1000);
}

int32_t taper_learning_cap_mA(const taper_station_t *station, uint8_t i, int32_t cap_mA) {
    const taper_learning_t *learning = &station->learning[i];
    if (learning->session == 0 || cap_mA == TAPER_NO_LIMIT) {
        return cap_mA;
    }
    return cap_mA + taper_max_i32(margin_mA(learning, cap_mA) - TAPER_DRAW_UNUSED_mA, 0);
}

/**
 * Note what it is offered. A vehicle follows a lower offer at once, and one that is a little higher; others after a while.
 * @return whether it has.
 */
static bool follow_offer(const taper_station_t *station, uint8_t i, taper_learning_t *learning) {
    const int32_t offered_mA = taper_max_i32(station->sent_mA[i], 0);
    const uint32_t still_ms = taper_elapsed_ms(station->snapshot.now_ms, station->shape.changed_ms[i]);
    const bool has_risen = offered_mA <= learning->settled_mA + LESS_mA || still_ms >= RISE_ms;
    learning->settled_mA = has_risen ? offered_mA : taper_min_i32(learning->settled_mA, offered_mA);
    return has_risen;
}

/** Whether it took an offer that was above the line by half of the margin or more. */
static bool took_more(const taper_learning_t *learning, const taper_demand_t *demand, int32_t limit_W) {
    const int64_t offered_W = (int64_t)learning->settled_mA * demand->W_per_A / 1000;
    return offered_W - limit_W > margin_W(learning, demand, limit_W) / 2;
}

/** How long a vehicle is offered more. */
static uint32_t show_ms(const taper_station_t *station) {
    const uint32_t tick_ms = station->options.config->tick_ms;
    return tick_ms > SHOW_ms ? tick_ms : SHOW_ms;
}

/** It has limited itself: after a while of that it rests. */
static void note_show(const taper_station_t *station, taper_learning_t *learning) {
    const uint32_t now_ms = station->snapshot.now_ms;
    learning->doublings = 0;
    if (learning->rests) {
        return;
    }
    if (!learning->shown) {
        learning->shown = true;
        learning->since_ms = now_ms;
    }
    const uint32_t shows_ms = taper_elapsed_ms(now_ms, learning->since_ms) + station->options.config->tick_ms;
    if (shows_ms >= SHOW_ms) {
        learning->rests = true;
        learning->since_ms = now_ms;
    }
}

/** What it draws, against its line. One that draws next to nothing pauses, and shows nothing. */
static void take_sample(taper_station_t *station, taper_learning_t *learning, const taper_demand_t *demand,
                        int32_t measured_mA, bool has_risen) {
    if (measured_mA == TAPER_ABSENT || measured_mA <= TAPER_DRAW_FLOWS_mA) {
        return;
    }
    const int32_t deviation = taper_learn_noise_permille(&learning->line);
    const int32_t less_mA = LESS_mA + part(measured_mA, LESS_deviations * deviation);
    const taper_learn_sample_t sample = {
        .energy_Wh = learning->looked_Wh,
        /* EVSE_STATUS rounds up: the middle of its step. */
        .power_W = part(measured_mA - TAPER_CURRENT_STEP_mA / 2, demand->W_per_A),
        .step_W = part(TAPER_CURRENT_STEP_mA, demand->W_per_A),
        .offered_W = has_risen ? part(learning->settled_mA, demand->W_per_A) : 0,
    };
    const int32_t limit_W = taper_learn_limit_W(&learning->line, learning->looked_Wh);
    taper_learn_take(&learning->line, &sample);
    if (measured_mA < learning->settled_mA - less_mA) {
        note_show(station, learning);
    } else if (took_more(learning, demand, limit_W)) {
        learning->since_ms = learning->rests ? learning->since_ms : station->snapshot.now_ms;
        learning->doublings = (uint8_t)taper_min_i32(learning->doublings + 1, MOST_DOUBLINGS);
    }
}

static void tell_planner(taper_station_t *station, taper_learning_t *learning, const taper_demand_t *demand,
                         int32_t energy_Wh) {
    const uint32_t now_ms = station->snapshot.now_ms;
    const bool may = station->learned_ms == 0 || taper_elapsed_ms(now_ms, station->learned_ms) >= TELL_ms;
    if (may && taper_learn_moved(&learning->line, energy_Wh, demand->need_Wh, MOVED_permille)) {
        station->learned_ms = now_ms;
        station->sessions.revision++;
    }
}

/** A vehicle gives the fleet what it has shown, once; until then it takes the fleet's guess. */
static void ask_fleet(taper_station_t *station, taper_learning_t *learning) {
    taper_fleet_watch(&station->fleet, &learning->line);
    learning->counted = learning->counted || taper_fleet_count(&station->fleet, &learning->line);
    if (!learning->counted) {
        taper_fleet_advise(&station->fleet, &learning->line);
    }
}

void taper_learning_look(taper_station_t *station, uint8_t i, int32_t measured_mA) {
    taper_learning_t *learning = &station->learning[i];
    taper_demand_t *demand = &station->snapshot.demand[i];
    const int32_t energy_Wh = station->sessions.session[i].session_Wh;
    if (!demand->active || energy_Wh == TAPER_ABSENT) {
        return;
    }
    if (learning->session != demand->session) {
        *learning =
            (taper_learning_t){.session = demand->session,
                               .looked_Wh = energy_Wh,
                               .rests = true,
                               .since_ms = station->snapshot.now_ms - RESTS_IN_DOUBT * show_ms(station)};
        taper_learn_begin(&learning->line, demand, energy_Wh);
    }
    ask_fleet(station, learning);
    const bool has_risen = follow_offer(station, i, learning);
    take_sample(station, learning, demand, measured_mA, has_risen);
    learning->looked_Wh = energy_Wh;
    taper_learn_apply(&learning->line, energy_Wh, demand);
    tell_planner(station, learning, demand, energy_Wh);
}

/** By what the line may well be wrong: two deviations. */
static int32_t doubt_W(const taper_station_t *station, uint8_t i) {
    const int32_t energy_Wh = station->sessions.session[i].session_Wh;
    return taper_saturate_i32(2 * (int64_t)taper_learn_deviation_W(&station->learning[i].line, energy_Wh));
}

/** Whether it is time to offer more than the line at the expense of others. An offer that others' limits keep down shows nothing:
    it ends after its time as well. */
static bool is_due(const taper_station_t *station, uint8_t i, taper_learning_t *learning, int32_t limit_W) {
    const uint32_t now_ms = station->snapshot.now_ms;
    const bool in_doubt = doubt_W(station, i) >= margin_W(learning, &station->snapshot.demand[i], limit_W);
    const uint32_t rests = in_doubt ? RESTS_IN_DOUBT : RESTS_IF_KNOWN;
    const uint32_t lasts_ms = learning->rests ? rests * show_ms(station) : RISE_ms + show_ms(station);
    if (taper_elapsed_ms(now_ms, learning->since_ms) >= lasts_ms) {
        learning->rests = !learning->rests;
        learning->shown = false;
        learning->since_ms = now_ms;
    }
    return !learning->rests;
}

/**
 * The least that it is offered above its line: the margin. Below its minimum it would draw nothing, and never show that the line
 * is too low: it is offered that much if the line may be so wrong.
 */
static int32_t least_more_W(const taper_station_t *station, uint8_t i, int32_t limit_W) {
    const taper_demand_t *demand = &station->snapshot.demand[i];
    const int32_t clear_W = margin_W(&station->learning[i], demand, limit_W);
    const int32_t minimum_W = part(demand->min_mA + TAPER_CURRENT_STEP_mA, demand->W_per_A) - limit_W;
    const bool may_be = minimum_W <= doubt_W(station, i);
    const int32_t wanted_W = may_be ? taper_max_i32(clear_W, minimum_W) : clear_W;
    return taper_min_i32(wanted_W, taper_demand_allowed_W(demand) - limit_W);
}

/**
 * An offer that is just the line would never be refused, and so never show that the line is too low. So where the vehicle is
 * to get all that it takes, it is offered a margin more: now and then before others, and else of what is left if all have all
 * that is of use to them, then as much as the line may be too low. @return how much of that.
 */
static int32_t probe(taper_station_t *station, uint8_t i, int32_t left_W) {
    taper_learning_t *learning = &station->learning[i];
    const taper_demand_t *demand = &station->snapshot.demand[i];
    taper_proposal_t *proposal = &station->proposal;
    const int32_t limit_W = taper_battery_limit_W(demand);
    const int32_t allowed_W = taper_demand_allowed_W(demand);
    if (limit_W >= allowed_W || proposal->ceiling_W[i] < limit_W) {
        return 0;
    }
    const int32_t more_W = least_more_W(station, i, limit_W);
    if (more_W <= left_W) {
        const int32_t most_W = taper_min_i32(taper_max_i32(more_W, doubt_W(station, i)), allowed_W - limit_W);
        const int32_t taken_W = taper_min_i32(most_W, left_W);
        proposal->ceiling_W[i] = limit_W + taken_W;
        return taken_W;
    }
    if (proposal->wish_W[i] >= part(limit_W, ALL_permille) && is_due(station, i, learning, limit_W)) {
        proposal->wish_W[i] = proposal->ceiling_W[i] = limit_W + more_W;
    }
    return 0;
}

/** What the site has left if all get all that is of use to them; negative: there is not enough. */
static int32_t left_W(const taper_station_t *station) {
    int64_t sum_W = 0;
    for (uint8_t i = 0; i < station->snapshot.count; i++) {
        if (station->snapshot.demand[i].active) {
            sum_W += taper_max_i32(station->proposal.wish_W[i], station->proposal.ceiling_W[i]);
        }
    }
    return taper_saturate_i32(station->limit_now.supply.site_W - sum_W);
}

void taper_learning_probe(taper_station_t *station) {
    int32_t rest_W = left_W(station);
    for (uint8_t i = 0; i < station->snapshot.count; i++) {
        if (station->snapshot.demand[i].active &&
            station->learning[i].session == station->snapshot.demand[i].session) {
            rest_W -= probe(station, i, rest_W);
        }
    }
}
