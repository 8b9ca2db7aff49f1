/*
 * Whatever gets lost, late, replugged or restarted: what all connectors have in force together never exceeds a limit that
 * does not change. The world here is a model of its own: four connectors that accept setpoints, let them expire, and
 * echo them, with frames in order but late in both directions.
 */
#include <string.h>

#include "scene.h"
#include "taper/allocator.h"
#include "taper/ledger.h"
#include "unity.h"

#define CONNECTORS  4u
#define STEPS       250000u
#define VALIDITY_ms 3000u
#define CYCLE_ms    500u
#define LIMIT_W     9200 /* 40 A of the 104 A that the four could draw by their feeders */
#define SILENT_ms   1000u
/* Frames wait this long at most, in queues and on the way: less than what the ledger grants. */
#define WORST_WAY_ms 450u
#define IN_FLIGHT    64u

typedef struct {
    uint32_t arrives_ms;
    uint8_t counter, session;
    int32_t current_mA;
} flying_setpoint_t;

typedef struct {
    uint32_t arrives_ms;
    uint8_t session;
    taper_evse_status_t status;
} flying_status_t;

/** A connector as it is, and what the station knows of it. */
typedef struct {
    uint8_t session; /**< 0: no vehicle */
    uint8_t sessions;
    uint8_t echo;
    bool in_force;
    int32_t in_force_mA;
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
    int32_t sent_mA;
} connector_t;

static connector_t world[CONNECTORS];
static taper_ledger_t ledger;
static taper_allocator_t allocator;
static taper_snapshot_t snapshot;
static taper_setpoints_t target, granted;
static const taper_supply_t supply = {.site_W = LIMIT_W,
                                      .phase_mA = {TAPER_NO_LIMIT, TAPER_NO_LIMIT, TAPER_NO_LIMIT}};
static taper_proposal_t proposal;
static uint32_t now_ms, tick_ms, state;
static uint64_t used_W;

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

/** The station begins anew. What was on its way, to it or from it, has arrived by then or never will. */
static void start_station(void) {
    taper_ledger_init(&ledger, scene_four(), VALIDITY_ms, 1, now_ms);
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

static void set_up_world(uint32_t seed) {
    state = seed;
    memset(world, 0, sizeof world);
    memset(&snapshot, 0, sizeof snapshot);
    now_ms = UINT32_MAX - 100000u; /* it wraps on the way */
    tick_ms = now_ms;
    used_W = 0;
    for (unsigned i = 0; i < CONNECTORS; i++) {
        world[i].deaf_until_ms = world[i].mute_until_ms = now_ms;
        world[i].last_setpoint_ms = world[i].last_report_ms = now_ms;
        world[i].session = world[i].sessions = 1;
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
            c->accepted_ms = s->arrives_ms;
            c->echo = s->counter;
        }
    }
    if (c->in_force && taper_elapsed_ms(now_ms, c->accepted_ms) >= VALIDITY_ms) {
        c->in_force = false;
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
                                      .setpoint_echo = c->echo};
    c->report_head++;
}

/** Plugs, restarts and broken cables. */
static void mishap(connector_t *c) {
    switch (below(400)) {
    case 0:
    case 1: /* the vehicle leaves */
        c->session = 0;
        c->in_force = false;
        break;
    case 2: /* the controller of the connector restarts, or a vehicle is replaced: it starts from nothing */
        c->echo = 0;
        c->in_force = false;
        c->session = c->sessions = (uint8_t)(c->sessions == UINT8_MAX ? 1 : c->sessions + 1);
        break;
    case 3: c->deaf_until_ms = now_ms + below(8000); break;
    case 4: c->mute_until_ms = now_ms + below(8000); break;
    default:
        if (c->session == 0 && below(50) == 0) {
            c->session = c->sessions = (uint8_t)(c->sessions == UINT8_MAX ? 1 : c->sessions + 1);
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

/** A new wish, bounded by all limits, as the allocator does it. */
static void think(void) {
    snapshot.now_ms = now_ms;
    snapshot.count = CONNECTORS;
    for (uint8_t i = 0; i < CONNECTORS; i++) {
        connector_t *c = &world[i];
        const bool online = c->heard && taper_elapsed_ms(now_ms, c->heard_ms) <= SILENT_ms;
        c->decided_session = c->known_session;
        snapshot.demand[i] = scene_demand();
        snapshot.demand[i].active = online && c->known_session != 0;
        snapshot.demand[i].session = c->known_session;
        proposal.wish_W[i] = proposal.ceiling_W[i] = (int32_t)below(8000);
        proposal.rank[i] = (uint8_t)((i + below(2)) % CONNECTORS);
    }
    taper_allocate(&allocator, scene_four(), &snapshot, &proposal, &supply, NULL, &target);
    tick_ms = now_ms;
}

static void send(uint8_t i) {
    connector_t *c = &world[i];
    const int32_t current_mA = granted.current_mA[i];
    const bool due = current_mA != c->sent_mA || taper_elapsed_ms(now_ms, c->sent_ms) >= CYCLE_ms;
    if (!due || !taper_ledger_can_send(&ledger, i, c->counter) ||
        c->setpoint_head - c->setpoint_tail == IN_FLIGHT) {
        return;
    }
    taper_ledger_sent(&ledger, i, c->counter, current_mA, 0, now_ms);
    const uint32_t arrives_ms = arrival(&c->last_setpoint_ms);
    if (below(10) != 0) { /* lost */
        c->setpoint[c->setpoint_head % IN_FLIGHT] = (flying_setpoint_t){.arrives_ms = arrives_ms,
                                                                        .counter = c->counter,
                                                                        .session = c->decided_session,
                                                                        .current_mA = current_mA};
        c->setpoint_head++;
    }
    c->counter = (uint8_t)((c->counter + 1u) & 0x0Fu);
    c->sent_ms = now_ms;
    c->sent_mA = current_mA;
}

static void run_station(void) {
    for (uint8_t i = 0; i < CONNECTORS; i++) {
        hear_reports(i);
    }
    taper_ledger_update(&ledger, now_ms);
    if (taper_elapsed_ms(now_ms, tick_ms) >= 1000) {
        think();
    }
    taper_ledger_grant(&ledger, scene_four(), &snapshot, proposal.rank, &supply, &target, &granted);
    TEST_ASSERT_TRUE(taper_guard_passes(scene_four(), &snapshot, &supply, &granted));
    TEST_ASSERT_TRUE(taper_guard_hand_over_passes(&ledger, scene_four(), &snapshot, &supply, &granted));
    for (uint8_t i = 0; i < CONNECTORS; i++) {
        send(i);
    }
}

static int32_t in_force_W(unsigned first, unsigned last) {
    int32_t sum_W = 0;
    for (unsigned i = first; i <= last; i++) {
        sum_W += world[i].in_force ? world[i].in_force_mA * 230 / 1000 : 0;
    }
    return sum_W;
}

static void step(void) {
    now_ms += below(120);
    for (unsigned i = 0; i < CONNECTORS; i++) {
        take_setpoints(&world[i]);
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

static void run_world(uint32_t seed) {
    set_up_world(seed);
    for (uint32_t k = 0; k < STEPS; k++) {
        step();
        const int32_t sum_W = in_force_W(0, CONNECTORS - 1);
        TEST_ASSERT_LESS_OR_EQUAL_INT32(LIMIT_W, sum_W);
        used_W += (uint64_t)sum_W;
        for (uint8_t i = 0; i < CONNECTORS; i++) {
            if (world[i].in_force) { /* the account of one is never short either */
                TEST_ASSERT_GREATER_OR_EQUAL_INT32(world[i].in_force_mA, taper_ledger_may_mA(&ledger, i));
            }
        }
    }
    /* who gives nothing is not safe, but off: a quarter of the limit is in use on the average, all mishaps told */
    TEST_ASSERT_GREATER_THAN_UINT64((uint64_t)STEPS * LIMIT_W / 4, used_W);
}

void setUp(void) {}
void tearDown(void) {}

static void test_what_is_in_force_never_exceeds_a_constant_limit(void) {
    run_world(0x1ed6e);
}

static void test_nor_in_another_quarter_of_a_million_steps(void) {
    run_world(0xbeef01);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_what_is_in_force_never_exceeds_a_constant_limit);
    RUN_TEST(test_nor_in_another_quarter_of_a_million_steps);
    return UNITY_END();
}
