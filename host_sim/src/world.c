#include "world.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "account.h"
#include "curve.h"
#include "fleet.h"
#include "frames_log.h"
#include "gateway.h"
#include "memory.h"
#include "problems.h"
#include "progress.h"
#include "queue.h"
#include "tapers.h"

/** Connectors echo their first setpoints this long after the tick began [ms]. */
#define ECHO_ms TAPER_EVSE_STATUS_CYCLE_ms
/** Then they report, and the station is polled, this often: well within every timeout of the bus. */
#define ROUND_ms 800u
/** A hand-over that did not get through so long after the slowest vehicle has reacted goes on in the next tick. */
#define PATIENCE_ms 1000u
/** Then rounds come with the pause that setpoints keep between two changes, until deadbands have settled as well. */
#define LATER_ROUND_ms 5200
#define SETTLED_ms     (TAPER_SHAPE_SETTLE_ms + 2u * LATER_ROUND_ms)
/** The longest validity of a setpoint: a tick beyond it ends with one more round, so that none has run out at its end. */
#define VALIDITY_ms 127000u
/** The longest curve takes some 1000. */
#define CURVE_ROUNDS 5000

typedef struct {
    const sim_case_t *run;
    sim_results_t *results;
    int64_t tick_s;
    sim_link_t *link; /**< the station */
    sim_frames_log_t log;
    taper_port_t port; /**< the world's end of the bus */
    sim_fleet_t fleet;
    sim_gateway_t gateway;
    sim_curve_t curve;
    uint32_t curve_ms; /**< its clock, which counts rounds */
    sim_queue_t queue;
    sim_account_t account;
    sim_tapers_t tapers;
    uint32_t reaction_ms;                   /**< of the slowest vehicle */
    uint64_t random;                        /**< state of next_random() */
    uint8_t turn[TAPER_MAX_CONNECTORS + 1]; /**< nodes in the order of sending; the last is the gateway */
    uint32_t plans;                         /**< of the station, seen so far */
} world_t;

/** The splitmix64 generator. */
static uint64_t next_random(world_t *world) {
    world->random += UINT64_C(0x9E3779B97F4A7C15);
    uint64_t z = world->random;
    z = (z ^ (z >> 30)) * UINT64_C(0xBF58476D1CE4E5B9);
    z = (z ^ (z >> 27)) * UINT64_C(0x94D049BB133111EB);
    return z ^ (z >> 31);
}

static void set_time(world_t *world, uint64_t now_ms) {
    world->log.time_ms = now_ms;
    world->link->calls->set_time(world->link, (uint32_t)now_ms);
}

/** @return whether the station takes its description and options. */
static bool start_station(const world_t *world) {
    const sim_case_t *run = world->run;
    const sim_station_setup_t setup = {
        .config = run->station,
        .solver = run->solver,
        .policy = run->policy,
        .iterations_per_tick = run->iterations,
    };
    return world->link->calls->start(world->link, &setup);
}

static bool step(world_t *world, uint32_t now_ms) {
    const bool good = world->link->calls->step(world->link, now_ms);
    sim_work_add(&world->results->work, SIM_STEP, world->link->state.planned,
                 world->link->state.instructions);
    return good;
}

static bool poll(world_t *world, uint32_t now_ms) {
    const bool good = world->link->calls->poll(world->link, now_ms);
    sim_work_add(&world->results->work, SIM_POLL, false, world->link->state.instructions);
    return good;
}

/** @return false, after one line: the world has sent more than the station's queue holds. */
static bool has_room(const world_t *world, bool sent) {
    if (sent && !world->link->calls->is_overrun(world->link)) {
        return true;
    }
    fprintf(stderr, "taper-sim: internal error at %llu s: the bus refused what was sent to the station\n",
            (unsigned long long)(world->log.time_ms / 1000u));
    return false;
}

/** Every node sends what it has to say, in an order that the seed decides anew for each tick. */
static bool send_reports(world_t *world, int64_t now_s) {
    const unsigned connectors = world->run->station->connector_count;
    bool sent = true;
    for (unsigned left = connectors + 1; left > 0; left--) {
        const unsigned pick = (unsigned)(next_random(world) % left);
        const uint8_t node = world->turn[pick];
        world->turn[pick] = world->turn[left - 1];
        world->turn[left - 1] = node;
        const bool ok = node == connectors ? sim_gateway_report(&world->gateway, now_s)
                                           : sim_fleet_report(&world->fleet, node);
        sent = sent && ok;
    }
    return has_room(world, sent);
}

/** Take note of a solve that the station finished in this tick. */
static bool note_solve(world_t *world) {
    const taper_station_t *station = world->link->station;
    sim_solve_t solve = {0};
    if (world->link->state.plans == world->plans) {
        return true;
    }
    world->plans = world->link->state.plans;
    if (!world->link->calls->solve(world->link, &solve)) {
        return false;
    }
    sim_samples_add(&world->results->iterations, solve.iterations);
    if (solve.solve_ms >= 0.0) {
        sim_samples_add(&world->results->solve_ms, solve.solve_ms);
    }
    if (world->run->problems != NULL &&
        station->plan_made_ms == station->snapshot.now_ms) { // else: older snapshot
        sim_problems_add(world->run->problems, station);
    }
    return true;
}

/** All report again at `passed_ms` into the tick. In every second round the vehicles and the gateway do so too. */
static bool repeat_reports(world_t *world, int64_t now_s, uint32_t passed_ms, bool whole) {
    bool sent = true;
    for (unsigned i = 0; i < world->run->station->connector_count; i++) {
        sent = sim_fleet_echo(&world->fleet, i, whole) && sent;
    }
    sent = (!whole || sim_gateway_repeat(&world->gateway, now_s, (double)passed_ms / 1000.0)) && sent;
    return has_room(world, sent);
}

/** The time of the next round of a hand-over. One of them is that at which the slowest vehicle has just reacted. */
static uint32_t next_round_ms(const world_t *world, uint32_t passed_ms) {
    const uint32_t reacted_ms = ECHO_ms + world->reaction_ms;
    if (passed_ms == 0) {
        return ECHO_ms;
    }
    if (passed_ms > reacted_ms + PATIENCE_ms) {
        return passed_ms + LATER_ROUND_ms;
    }
    return passed_ms < reacted_ms && passed_ms + ROUND_ms > reacted_ms ? reacted_ms : passed_ms + ROUND_ms;
}

/** Time passes up to `passed_ms` into the tick; echoes in, setpoints out. */
static bool run_round(world_t *world, int64_t now_s, uint32_t passed_ms, bool whole) {
    const uint64_t now_ms = (uint64_t)now_s * 1000U + passed_ms;
    sim_account_pass(&world->account, (double)now_s + (double)passed_ms / 1000.0);
    set_time(world, now_ms);
    if (!repeat_reports(world, now_s, passed_ms, whole) || !poll(world, (uint32_t)now_ms)) {
        return false;
    }
    sim_fleet_hear(&world->fleet);
    sim_account_obey(&world->account);
    return true;
}

/**
 * What one connector gives up reaches another: echoes in, time passes until the vehicle is known to have followed,
 * setpoints out; until all have their targets, as their ramps and deadbands allow, or the tick ends.
 */
static bool hand_over(world_t *world, int64_t now_s) {
    const uint32_t end_ms = SETTLED_ms + world->reaction_ms;
    const uint32_t tick_ms = world->run->station->tick_ms;
    uint32_t passed_ms = next_round_ms(world, 0);
    bool sent = true;
    for (unsigned round = 1;
         sent && passed_ms <= end_ms && passed_ms < tick_ms && !world->link->state.is_settled; round++) {
        const bool whole = round % 2 == 0 || passed_ms > world->reaction_ms + PATIENCE_ms;
        sent = run_round(world, now_s, passed_ms, whole);
        passed_ms = next_round_ms(world, passed_ms);
    }
    if (sent && tick_ms > VALIDITY_ms + passed_ms) { // a real station repeats its setpoints all the time
        sent = run_round(world, now_s, tick_ms - ROUND_ms, true);
    }
    return sent;
}

/** Frames go to the gateway, or to their connectors. */
static void pass_on_frames(world_t *world) {
    taper_frame_t frame;
    while (world->port.receive(world->port.context, &frame)) {
        if (!sim_curve_take(&world->curve, &frame, world->curve_ms)) {
            sim_fleet_take(&world->fleet, &frame);
        }
    }
}

/**
 * The gateway tells the course of the limit, if it is due. For the station no time passes; the gateway takes a round for a
 * millisecond, and so keeps the gap between frames that the station asks for.
 * @return whether the station knows it now.
 */
static bool tell_curve(world_t *world, int64_t now_s, uint32_t now_ms) {
    taper_frame_t frame;
    for (unsigned round = 0; round < CURVE_ROUNDS && !sim_curve_is_settled(&world->curve, (double)now_s);
         round++) {
        world->curve_ms++;
        if (sim_curve_next(&world->curve, (double)now_s, world->curve_ms, &frame) &&
            world->port.send(world->port.context, &frame)) {
            sim_curve_sent(&world->curve, world->curve_ms);
            if (!poll(world, now_ms)) { // the station never speaks unless it is spoken to
                return false;
            }
            pass_on_frames(world);
        }
    }
    if (!sim_curve_is_settled(&world->curve, (double)now_s)) {
        fprintf(stderr, "taper-sim: internal error at %lld s: the station does not take a curve\n",
                (long long)now_s);
        return false;
    }
    return true;
}

/**
 * Vehicles leave, and others come. A connector that is left says so before the next vehicle is there, as it does on a bus:
 * what it was told for the one before is over then.
 */
static bool change_vehicles(world_t *world, int64_t now_s) {
    const sim_evse_t *evse = world->fleet.evse;
    bool left[TAPER_MAX_CONNECTORS];
    for (unsigned i = 0; i < world->run->station->connector_count; i++) {
        left[i] = evse[i].vehicle != NULL && evse[i].vehicle->departure_s <= (double)now_s;
    }
    sim_queue_leave(&world->queue, now_s);
    bool sent = true;
    for (unsigned i = 0; i < world->run->station->connector_count; i++) {
        sent = (!left[i] || sim_fleet_echo(&world->fleet, i, false)) && sent;
    }
    sim_queue_advance(&world->queue, now_s);
    return sent;
}

/** The tick is over: what was drawn in it, and why, as the station tells. */
static bool end_tick(world_t *world) {
    taper_outlook_t outlook[TAPER_MAX_CONNECTORS];
    bool wanted[TAPER_MAX_CONNECTORS] = {false};
    const bool records = world->results->connectors.stream != NULL;
    for (unsigned i = 0; i < world->run->station->connector_count; i++) {
        wanted[i] = world->fleet.evse[i].vehicle != NULL;
    }
    if (records && !world->link->calls->look(world->link, wanted, outlook)) {
        return false;
    }
    sim_account_end(&world->account, world->link->state.mode, records ? outlook : NULL);
    sim_tapers_note(&world->tapers, &world->fleet, world->link->station);
    return true;
}

static bool run_tick(world_t *world, int64_t now_s) {
    const uint64_t now_ms = (uint64_t)now_s * 1000U;
    set_time(world, now_ms);
    const bool reported = has_room(world, change_vehicles(world, now_s)) && send_reports(world, now_s);
    sim_fleet_begin(&world->fleet, now_s);
    if (!reported || !tell_curve(world, now_s, (uint32_t)now_ms) || !step(world, (uint32_t)now_ms) ||
        !note_solve(world)) {
        return false;
    }
    sim_fleet_hear(&world->fleet);
    sim_account_begin(&world->account, now_s, sim_gateway_limit_kw(&world->gateway, now_s));
    return hand_over(world, now_s) && end_tick(world);
}

static bool run_ticks(world_t *world) {
    const sim_sessions_t *sessions = world->run->sessions;
    double first_s = INFINITY;
    double end_s = 0.0;
    for (size_t i = 0; i < sessions->count; i++) {
        first_s = fmin(first_s, sessions->session[i].arrival_s);
        end_s = fmax(end_s, sessions->session[i].departure_s);
    }
    const int64_t start_s = sessions->count == 0 ? 0 : (int64_t)first_s / world->tick_s * world->tick_s;
    const int64_t duration_s = (int64_t)ceil(end_s) - start_s;
    sim_progress_t progress;
    sim_progress_init(&progress);
    bool good = true;
    for (int64_t now_s = start_s; good && (double)now_s < end_s; now_s += world->tick_s) {
        sim_progress_show(&progress, now_s - start_s, duration_s);
        good = run_tick(world, now_s);
    }
    sim_progress_end(&progress);
    return good;
}

static world_t *new_world(const sim_case_t *run, sim_results_t *results) {
    const taper_station_config_t *station = run->station;
    world_t *world = sim_allocate(1, sizeof *world);
    world->run = run;
    world->results = results;
    world->link = run->link;
    world->port = sim_frames_log_port(&world->log, &run->link->port, run->frames);
    world->tick_s = station->tick_ms / 1000;
    world->random = run->seed;
    for (unsigned i = 0; i <= station->connector_count; i++) {
        world->turn[i] = (uint8_t)i;
    }
    for (unsigned i = 0; i < station->connector_count; i++) {
        const uint32_t reaction_ms = station->connectors[i].reaction_ms;
        world->reaction_ms = reaction_ms > world->reaction_ms ? reaction_ms : world->reaction_ms;
    }
    sim_fleet_init(&world->fleet, station, &world->port, run->policy->tells_taper, run->seed);
    sim_fleet_set_errors(&world->fleet, run->errors);
    sim_tapers_init(&world->tapers, run->tapers);
    sim_gateway_init(&world->gateway, run->limits, &world->port, world->tick_s, run->seed);
    sim_curve_init(&world->curve, run->unannounced ? NULL : run->limits);
    sim_curve_set_prices(&world->curve, run->prices);
    sim_queue_init(&world->queue, run->sessions, world->fleet.evse, station->connector_count,
                   results->outcome);
    world->account = (sim_account_t){.fleet = &world->fleet, .prices = run->prices, .results = results};
    return world;
}

/** What the station has counted in the whole run, and what the hardware tells. */
static bool ask_at_the_end(sim_link_t *link, sim_results_t *results) {
    return link->calls->counter(link, TAPER_COUNTER_PLANS, &results->solves) &&
           link->calls->counter(link, TAPER_COUNTER_FALLBACK_TICKS, &results->fallback_ticks) &&
           link->calls->counter(link, TAPER_COUNTER_GUARD_VIOLATIONS, &results->guard_violations) &&
           link->calls->hardware(link, &results->hardware);
}

bool sim_world_run(const sim_case_t *run, sim_results_t *results) {
    world_t *world = new_world(run, results);
    bool good = start_station(world);
    if (good && run->problems != NULL) {
        sim_problems_begin(run->problems, world->link->station);
    }
    good = good && run_ticks(world) && ask_at_the_end(world->link, results);
    sim_queue_finish(&world->queue);
    sim_queue_free(&world->queue);
    free(world);
    return good;
}
