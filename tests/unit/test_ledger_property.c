/*
 * Whatever gets lost, late, replugged or restarted: what all vehicles draw together never exceeds the limit at any
 * millisecond, but by what the limit fell less than the worst reaction ago; nor do the fallback currents exceed the failsafe
 * limit. The world here is a model of its own: four connectors that accept setpoints, echo them, let them expire and fall
 * back, with frames in order but late in both directions, and vehicles that take their time to follow decreases and none to
 * follow increases.
 */
#include <string.h>

#include "scene.h"
#include "taper/allocator.h"
#include "taper/ledger.h"
#include "unity.h"

#define CONNECTORS  4u
#define STEPS       (100000u / TEST_SHARE)
#define VALIDITY_ms 3000u
#define CYCLE_ms    500u
#define LIMIT_W     9200 /* at most: 40 A of the 104 A that the four could draw by their feeders */
#define FAILSAFE_W  4000 /* and never less than that: 17.4 A, two fallback currents of 6 A */
#define SILENT_ms   1000u
#define REACTION_ms 5000u /* in the world's time */
/* Frames wait this long at most, in queues and on the way: less than what the ledger grants. */
#define WORST_WAY_ms 450u
#define IN_FLIGHT    64u
/*
 * After a limit fell: who heard nothing of it has its old setpoint for 3 s from when it came, and falls back; the station
 * books that at its next tick, and lowers the others, who may not hear of it either. And vehicles follow.
 */
#define WORST_ms (2u * (WORST_WAY_ms + VALIDITY_ms + TAPER_LEDGER_LATE_ms) + 1200u + REACTION_ms)
#define PAST     64u

typedef struct {
    uint32_t arrives_ms;
    uint8_t counter, session;
    int32_t current_mA, fallback_mA;
} flying_setpoint_t;

typedef struct {
    uint32_t arrives_ms;
    uint8_t session;
    taper_evse_status_t status;
} flying_status_t;

/** What a connector let through until a time. */
typedef struct {
    int32_t mA;
    uint32_t end_ms;
} past_t;

/** A connector as it is, and what the station knows of it. */
typedef struct {
    uint8_t session; /**< 0: no vehicle */
    uint8_t sessions;
    uint8_t echo;
    bool in_force;
    int32_t in_force_mA, fallback_mA; /**< of the last setpoint accepted; 0: none yet for this vehicle */
    int32_t lets_mA;                  /**< lets the vehicle draw now */
    uint32_t follows_ms;              /**< the vehicle's reaction, on the clock of the bus */
    past_t past[PAST];                /**< ring */
    uint32_t past_head, past_tail;
    uint32_t accepted_ms;
    uint32_t deaf_until_ms, mute_until_ms;
    flying_setpoint_t setpoint[IN_FLIGHT];
    flying_status_t report[IN_FLIGHT];
    uint32_t setpoint_head, setpoint_tail, report_head, report_tail;
    uint32_t last_setpoint_ms, last_report_ms; /**< arrivals, which do not overtake one another */
    uint8_t known_session;
    uint8_t decided_session; /**< whom the last wish was for */
    uint32_t heard_ms;
    bool heard;
    uint8_t counter;
    uint32_t sent_ms;
    int32_t sent_mA, sent_fallback_mA;
} connector_t;

static connector_t world[CONNECTORS];
static taper_ledger_t ledger;
static taper_allocator_t allocator;
static taper_snapshot_t snapshot;
static taper_setpoints_t target, granted, fallback;
static taper_supply_t supply;
static taper_connector_config_t connectors[CONNECTORS];
static taper_station_config_t config;
static uint32_t time_scale;
static int32_t held_W; /* what the limit was */
static uint32_t held_until_ms;
static taper_proposal_t proposal;
static uint32_t now_ms, tick_ms, state;
static uint64_t used_Wms, run_ms, exact_ms;

static uint32_t below(uint32_t bound) {
    return scene_random(&state) % bound;
}

static bool is_until(uint32_t until_ms) {
    return !taper_time_reached(now_ms, until_ms);
}

static uint32_t arrival(uint32_t *last_ms) {
    const uint32_t at_ms = now_ms + below(WORST_WAY_ms);
    *last_ms = taper_time_reached(at_ms, *last_ms) ? at_ms : *last_ms;
    return *last_ms;
}

/** The vehicle draws the most that it was let in the time that it takes to follow. */
static int32_t draws_mA(connector_t *c) {
    while (c->past_tail != c->past_head &&
           taper_time_reached(now_ms, c->past[c->past_tail % PAST].end_ms + c->follows_ms)) {
        c->past_tail++;
    }
    int32_t most_mA = c->lets_mA;
    for (uint32_t k = c->past_tail; k != c->past_head; k++) {
        most_mA = taper_max_i32(most_mA, c->past[k % PAST].mA);
    }
    return most_mA;
}

static void let(connector_t *c, int32_t current_mA) {
    if (current_mA == c->lets_mA) {
        return;
    }
    TEST_ASSERT_LESS_THAN_UINT32(PAST, c->past_head - c->past_tail);
    c->past[c->past_head++ % PAST] = (past_t){.mA = c->lets_mA, .end_ms = now_ms};
    c->lets_mA = current_mA;
}

/** The contactor opens; the next vehicle was told nothing. */
static void open_contactor(connector_t *c, uint8_t session) {
    c->in_force = false;
    c->in_force_mA = c->fallback_mA = c->lets_mA = 0;
    c->past_tail = c->past_head;
    c->session = session;
    c->follows_ms = below(2) == 0 ? REACTION_ms / time_scale : below(REACTION_ms / time_scale);
}

/** The station begins anew. What was on its way, to it or from it, has arrived by then or never will. */
static void start_station(void) {
    taper_ledger_init(&ledger, &config, VALIDITY_ms, time_scale, now_ms);
    taper_allocator_init(&allocator);
    memset(&target, 0, sizeof target);
    memset(&granted, 0, sizeof granted);
    for (unsigned i = 0; i < CONNECTORS; i++) {
        world[i].counter = 0;
        world[i].setpoint_tail = world[i].setpoint_head;
        world[i].report_tail = world[i].report_head;
        world[i].sent_mA = -1;
        world[i].heard = false;
        world[i].known_session = world[i].decided_session = 0;
    }
}

static void set_up_world(uint32_t seed, uint32_t scale) {
    state = seed;
    time_scale = scale;
    memcpy(connectors, scene_four()->connectors, sizeof connectors);
    for (unsigned i = 0; i < CONNECTORS; i++) {
        connectors[i].fallback_mA = 6000;
        connectors[i].reaction_ms = REACTION_ms;
    }
    config = *scene_four();
    config.connectors = connectors;
    supply = taper_supply_of_W(LIMIT_W);
    memset(world, 0, sizeof world);
    memset(&snapshot, 0, sizeof snapshot);
    now_ms = UINT32_MAX - 100000u; /* it wraps on the way */
    tick_ms = now_ms;
    held_until_ms = now_ms;
    used_Wms = run_ms = exact_ms = 0;
    for (unsigned i = 0; i < CONNECTORS; i++) {
        world[i].deaf_until_ms = world[i].mute_until_ms = now_ms;
        world[i].last_setpoint_ms = world[i].last_report_ms = now_ms;
        world[i].sessions = 1;
        open_contactor(&world[i], 1);
    }
    start_station();
}

static void take_setpoints(connector_t *c) {
    while (c->setpoint_tail != c->setpoint_head &&
           taper_time_reached(now_ms, c->setpoint[c->setpoint_tail % IN_FLIGHT].arrives_ms)) {
        const flying_setpoint_t *s = &c->setpoint[c->setpoint_tail % IN_FLIGHT];
        c->setpoint_tail++;
        if (s->session == c->session && !is_until(c->deaf_until_ms)) {
            c->in_force = true;
            c->in_force_mA = s->current_mA;
            c->fallback_mA = s->fallback_mA;
            c->accepted_ms = now_ms;
            c->echo = s->counter;
        }
    }
    if (c->in_force && taper_elapsed_ms(now_ms, c->accepted_ms) >= VALIDITY_ms) {
        c->in_force = false;
    }
    if (c->session != 0) {
        let(c, c->in_force ? c->in_force_mA : c->fallback_mA);
    }
}

static void report(connector_t *c) {
    if (is_until(c->mute_until_ms) || c->report_head - c->report_tail == IN_FLIGHT) {
        return;
    }
    flying_status_t *r = &c->report[c->report_head % IN_FLIGHT];
    *r = (flying_status_t){.arrives_ms = arrival(&c->last_report_ms), .session = c->session};
    r->status = (taper_evse_status_t){.pilot = c->session == 0 ? TAPER_PILOT_A : TAPER_PILOT_C,
                                      .ev_present = c->session != 0,
                                      .fallback_active = !c->in_force,
                                      .setpoint_echo = c->echo,
                                      .current_mA = {draws_mA(c), TAPER_ABSENT, 0}};
    c->report_head++;
}

static uint8_t next_session(connector_t *c) {
    c->sessions = (uint8_t)(c->sessions == UINT8_MAX ? 1 : c->sessions + 1);
    return c->sessions;
}

/** Plugs, restarts and broken cables. */
static void mishap(connector_t *c) {
    switch (below(600)) {
    case 0: open_contactor(c, 0); break; /* the vehicle leaves */
    case 1: /* the controller of the connector restarts, or a vehicle is replaced: it starts from nothing */
        c->echo = 0;
        open_contactor(c, next_session(c));
        break;
    case 2: c->deaf_until_ms = now_ms + below(30000); break;
    case 3: c->mute_until_ms = now_ms + below(30000); break;
    default:
        if (c->session == 0 && below(50) == 0) {
            open_contactor(c, next_session(c));
        }
        break;
    }
}

static void hear_reports(uint8_t i) {
    connector_t *c = &world[i];
    while (c->report_tail != c->report_head &&
           taper_time_reached(now_ms, c->report[c->report_tail % IN_FLIGHT].arrives_ms)) {
        const flying_status_t *r = &c->report[c->report_tail % IN_FLIGHT];
        c->report_tail++;
        if (below(10) != 0) { /* lost */
            taper_ledger_hear(&ledger, i, &r->status, r->arrives_ms);
            c->known_session = r->session;
            c->heard_ms = r->arrives_ms;
            c->heard = true;
        }
    }
}

/** Now and then the limit is another one. */
static void move_limit(void) {
    if (below(40) != 0) {
        return;
    }
    const int32_t before_W = supply.site_W;
    supply.site_W = FAILSAFE_W + (int32_t)below(LIMIT_W - FAILSAFE_W + 1);
    if (supply.site_W < before_W) {
        held_W = is_until(held_until_ms) ? taper_max_i32(held_W, before_W) : before_W;
        held_until_ms = now_ms + WORST_ms;
    }
}

/** A new wish, bounded by all limits, as the allocator does it. */
static void think(void) {
    int32_t reserved_mA[CONNECTORS];
    move_limit();
    snapshot.now_ms = now_ms;
    snapshot.count = CONNECTORS;
    for (uint8_t i = 0; i < CONNECTORS; i++) {
        connector_t *c = &world[i];
        const bool online = c->heard && taper_elapsed_ms(now_ms, c->heard_ms) <= SILENT_ms;
        c->decided_session = c->known_session;
        reserved_mA[i] = online ? taper_ledger_unreached_mA(&ledger, i) : taper_ledger_may_mA(&ledger, i);
        snapshot.demand[i] = scene_demand();
        snapshot.demand[i].active = online && c->known_session != 0;
        snapshot.demand[i].session = c->known_session;
        proposal.wish_W[i] = proposal.ceiling_W[i] = (int32_t)below(8000);
        proposal.rank[i] = (uint8_t)((i + below(2)) % CONNECTORS);
    }
    taper_allocate(&allocator, &config, &snapshot, &proposal, scene_rows(&config, &snapshot, &supply),
                   reserved_mA, &target);
    tick_ms = now_ms;
}

static void send(uint8_t i) {
    connector_t *c = &world[i];
    const int32_t current_mA = granted.current_mA[i];
    const bool due = current_mA != c->sent_mA || fallback.current_mA[i] != c->sent_fallback_mA ||
                     taper_elapsed_ms(now_ms, c->sent_ms) >= CYCLE_ms;
    if (!due || !taper_ledger_can_send(&ledger, i, c->counter) ||
        c->setpoint_head - c->setpoint_tail == IN_FLIGHT) {
        return;
    }
    taper_ledger_sent(&ledger, i, c->counter, current_mA, fallback.current_mA[i], now_ms);
    const uint32_t arrives_ms = arrival(&c->last_setpoint_ms);
    if (below(10) != 0) { /* lost */
        c->setpoint[c->setpoint_head % IN_FLIGHT] =
            (flying_setpoint_t){.arrives_ms = arrives_ms,
                                .counter = c->counter,
                                .session = c->decided_session,
                                .current_mA = current_mA,
                                .fallback_mA = fallback.current_mA[i]};
        c->setpoint_head++;
    }
    c->counter = (uint8_t)((c->counter + 1u) & 0x0Fu);
    c->sent_ms = now_ms;
    c->sent_mA = current_mA;
    c->sent_fallback_mA = fallback.current_mA[i];
}

static void run_station(void) {
    for (uint8_t i = 0; i < CONNECTORS; i++) {
        hear_reports(i);
    }
    taper_ledger_update(&ledger, now_ms);
    if (taper_elapsed_ms(now_ms, tick_ms) >= 1000) {
        think();
    }
    taper_ledger_grant(&ledger, &config, &snapshot, proposal.rank, scene_rows(&config, &snapshot, &supply),
                       &target, &granted);
    TEST_ASSERT_TRUE(taper_guard_passes(&config, &snapshot, &supply, &granted));
    TEST_ASSERT_TRUE(taper_guard_hand_over_passes(&ledger, &config, &snapshot, &supply, &granted));
    taper_ledger_grant_fallback(&ledger, &config, &snapshot, scene_rows(&config, &snapshot, &supply),
                                proposal.rank, FAILSAFE_W, &granted, &fallback);
    TEST_ASSERT_TRUE(
        taper_guard_fallback_passes(&ledger, &config, &snapshot, FAILSAFE_W, &granted, &fallback));
    for (uint8_t i = 0; i < CONNECTORS; i++) {
        send(i);
    }
}

/** One millisecond of the world; the station sleeps. */
static void pass_millisecond(void) {
    int32_t sum_mA = 0, sum_fallback_mA = 0;
    for (unsigned i = 0; i < CONNECTORS; i++) {
        take_setpoints(&world[i]);
        sum_mA += draws_mA(&world[i]);
        sum_fallback_mA += world[i].fallback_mA;
    }
    const bool held = is_until(held_until_ms);
    const int32_t limit_W = held ? taper_max_i32(held_W, supply.site_W) : supply.site_W;
    TEST_ASSERT_LESS_OR_EQUAL_INT32(limit_W, sum_mA * 23 / 100);
    TEST_ASSERT_LESS_OR_EQUAL_INT32(FAILSAFE_W, sum_fallback_mA * 23 / 100);
    used_Wms += (uint64_t)(sum_mA * 23 / 100);
    exact_ms += held ? 0 : 1;
    run_ms++;
}

static void step(void) {
    for (uint32_t left_ms = 1 + below(120); left_ms > 0; left_ms--) {
        now_ms++;
        pass_millisecond();
    }
    for (unsigned i = 0; i < CONNECTORS; i++) {
        mishap(&world[i]);
        if (below(3) == 0) {
            report(&world[i]);
        }
    }
    if (below(2000) == 0) {
        start_station();
    }
    run_station();
}

static void run_world(uint32_t seed, uint32_t scale) {
    set_up_world(seed, scale);
    for (uint32_t k = 0; k < STEPS; k++) {
        step();
        for (uint8_t i = 0; i < CONNECTORS; i++) { /* the account of one is never short either */
            TEST_ASSERT_GREATER_OR_EQUAL_INT32(draws_mA(&world[i]), taper_ledger_told_mA(&ledger, i));
            TEST_ASSERT_GREATER_OR_EQUAL_INT32(world[i].fallback_mA, taper_ledger_fallback_mA(&ledger, i));
        }
    }
    /* who gives nothing is not safe, but off: a quarter of the highest limit is in use on the average, all mishaps told */
    TEST_ASSERT_GREATER_THAN_UINT64(run_ms * LIMIT_W / 4, used_Wms);
    TEST_ASSERT_GREATER_THAN_UINT64(run_ms * 2 / 3, exact_ms);
}

void setUp(void) {}
void tearDown(void) {}

static void test_what_vehicles_draw_never_exceeds_the_limit(void) {
    run_world(0x1ed6e, 1);
}

static void test_nor_in_another_hundred_thousand_steps(void) {
    run_world(0xbeef01, 1);
}

static void test_nor_where_vehicles_react_ten_times_as_fast_as_the_bus_goes(void) {
    run_world(0x71ae, 10);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_what_vehicles_draw_never_exceeds_the_limit);
    RUN_TEST(test_nor_in_another_hundred_thousand_steps);
    RUN_TEST(test_nor_where_vehicles_react_ten_times_as_fast_as_the_bus_goes);
    return UNITY_END();
}
