/* What goes wrong, and when. */
#include "world.h"

#include <string.h>

/* Longest that a frame is held back: with the time to the next poll, 290 ms at most, within what the ledger allows for. */
#define DELAY_ms 150u
/* The hub: the only station whose site limit alone says how many minima fit. */
#define FAIR_PLACES 2
/* Setpoints of before the turns are over, and connectors that were switched off may be on again. */
#define FAIR_SETTLES 60u
#define FAIR_PLUGGED 50u /* that long before */
#define FAIR_TICKS   900u
/* From one connector to the next: its vehicle's reaction, the hand-over, ticks. */
#define HAND_OVER_ms 15000

void chaos_count(world_t *world) {
    const taper_membus_injector_t *ends[] = {&world->to_station, &world->to_world};
    for (unsigned k = 0; k < 2; k++) {
        const taper_membus_fault_counts_t *counts = &ends[k]->counts;
        world->injuries.lost += counts->dropped;
        world->injuries.repeated += counts->repeated;
        world->injuries.delayed += counts->delayed;
        world->injuries.reordered += counts->reordered;
        world->injuries.flipped += counts->flipped;
    }
    memset(&world->to_station.counts, 0, sizeof world->to_station.counts);
    memset(&world->to_world.counts, 0, sizeof world->to_world.counts);
}

static taper_membus_faults_t faults_of(world_t *world, bool storm) {
    const uint16_t often = storm ? (uint16_t)random_in(&world->random, 5, 20) : 1;
    return (taper_membus_faults_t){.seed = random_bits(&world->random),
                                   .drop_permille = (uint16_t)(10u * often),
                                   .repeat_permille = (uint16_t)(5u * often),
                                   .delay_permille = (uint16_t)(10u * often),
                                   .delay_ms = DELAY_ms,
                                   .reorder_permille = storm ? 50 : 0,
                                   .flip_permille = (uint16_t)(2u * often),
                                   .bits = 1};
}

/** Faults of the present era, from now on. Nothing is held back where the sender may fall silent: it would be too late. */
static void inject(world_t *world) {
    world_flush(world);
    if (world->era == ERA_CALM || world->era == ERA_FAIR) {
        return;
    }
    taper_membus_faults_t in = faults_of(world, world->era == ERA_STORM);
    taper_membus_faults_t out = faults_of(world, world->era == ERA_STORM);
    if (world->era == ERA_SENDER) {
        out.delay_permille = 0;
    }
    taper_membus_inject(&world->bus, &world->bus.to_station, &world->to_station, &in);
    taper_membus_inject(&world->bus, &world->bus.to_world, &world->to_world, &out);
}

static void restart_station(world_t *world) {
    world_flush(world);
    taper_membus_power_cycle(&world->bus);
    world->station_dead = true;
    world->station_back = world->tick + 1u + random_below(&world->random, 12);
    world->injuries.restarts++;
    inject(world);
}

static bool liar_is_there(const world_t *world) {
    for (unsigned i = 0; i < world->config->connector_count; i++) {
        if (world->node[i].lie != LIE_NONE) {
            return true;
        }
    }
    return false;
}

static void plug(world_t *world, unsigned i) {
    node_t *node = &world->node[i];
    const bool lies = random_once_in(&world->random, world->era == ERA_CALM ? 3 : 6) &&
                      (world->era != ERA_CALM || !liar_is_there(world));
    node_plug(node, lies ? (lie_t)random_in(&world->random, 1, LIES - 1) : LIE_NONE);
    world->injuries.vehicles++;
    world->injuries.lies += node->lie != LIE_NONE ? 1u : 0u;
    account_plugged(&world->account, i, node->session, node->claimed);
}

static void unplug(world_t *world, unsigned i) {
    node_unplug(&world->node[i]);
    account_unplugged(&world->account, i);
}

static void come_and_go(world_t *world, unsigned i) {
    node_t *node = &world->node[i];
    random_t *random = &world->random;
    if (world->now_ms < node->plug_ms) {
        return;
    }
    if (node->plugged) {
        unplug(world, i);
        node->plug_ms = world->now_ms + random_in(random, 0, random_once_in(random, 4) ? 3000 : 90000);
    } else {
        plug(world, i);
        node->plug_ms = world->now_ms + random_in(random, 20000, random_once_in(random, 4) ? 60000 : 600000);
    }
}

static void reboot(world_t *world, unsigned i) {
    node_t *node = &world->node[i];
    node_reboot(node);
    world->injuries.reboots++;
    account_rebooted(&world->account, i);
    if (node->plugged) {
        account_plugged(&world->account, i, node->session, node->claimed);
    }
}

static void cut_links(world_t *world, unsigned i) {
    node_t *node = &world->node[i];
    random_t *random = &world->random;
    const bool sound = world->era == ERA_CALM || world->era == ERA_FAIR;
    if (!sound && random_once_in(random, 400)) {
        const int64_t until_ms =
            world->now_ms + random_in(random, 500, random_once_in(random, 6) ? 200000 : 15000);
        const unsigned which = random_below(random, 3);
        node->in_dead_until_ms = which != 1 ? until_ms : 0;
        node->out_dead_until_ms = which != 2 ? until_ms : 0;
        world->injuries.link_losses++;
    }
    node->link_in = sound || world->now_ms >= node->in_dead_until_ms;
    node->link_out = sound || world->now_ms >= node->out_dead_until_ms;
    if (!sound && random_once_in(random, 1500)) {
        reboot(world, i);
    }
}

/** A course of the site limit; some are none, and have to be refused. */
static void set_curve(world_t *world) {
    random_t *random = &world->random;
    taper_limit_curve_t curve = {.count = (uint16_t)random_below(random, 9)};
    uint32_t time_ms = (uint32_t)world->now_ms - (uint32_t)random_below(random, 100000);
    for (unsigned k = 0; k < curve.count; k++) {
        const bool wrong = random_once_in(random, 40);
        curve.point[k].time_ms = time_ms;
        curve.point[k].limit_W = wrong ? -1 : random_in(random, 0, world->config->groups[0].limit_W);
        time_ms += (uint32_t)random_in(random, wrong ? -1000 : 1, 300000);
    }
    if (taper_station_set_limit_curve(&world->station, &curve) == TAPER_OK) {
        account_curve(&world->account, &curve);
        world->injuries.curves++;
    }
}

/** A course of the price: it may change who is charged when, and no limit. */
static void set_price(world_t *world) {
    random_t *random = &world->random;
    taper_price_curve_t price = {.count = (uint16_t)random_below(random, 9)};
    uint32_t time_ms = (uint32_t)world->now_ms - (uint32_t)random_below(random, 100000);
    for (unsigned k = 0; k < price.count; k++) {
        price.point[k].time_ms = time_ms;
        price.point[k].milli_per_kWh =
            random_once_in(random, 20) ? (int32_t)random_bits(random) : random_in(random, -500, 1000);
        time_ms += (uint32_t)random_in(random, random_once_in(random, 40) ? -1000 : 1, 900000);
    }
    world->injuries.curves += taper_station_set_price_curve(&world->station, &price) == TAPER_OK ? 1u : 0u;
}

static void no_curve(world_t *world) {
    const taper_limit_curve_t none = {.count = 0};
    (void)taper_station_set_limit_curve(&world->station, &none);
    account_curve(&world->account, &none);
}

static void trouble_sender(world_t *world) {
    random_t *random = &world->random;
    if (random_once_in(random, 15)) {
        static const unsigned permille[] = {0, 0, 100, 500, 1000};
        world->refuse_permille = permille[random_below(random, 5)];
    }
    if (random_once_in(random, 120)) {
        taper_membus_bus_off(&world->bus, 0, (uint32_t)random_in(random, 1, 2));
        world->injuries.bus_offs++;
    }
}

static int64_t fair_bound_ms(const world_t *world) {
    const taper_station_config_t *config = world->config;
    const int64_t turns = (config->connector_count + FAIR_PLACES - 1) / FAIR_PLACES;
    return turns * ((int64_t)config->turn_ms + HAND_OVER_ms) + config->min_off_ms;
}

/** A vehicle that wants as much as it can have. */
static void plug_hungry(world_t *world, unsigned i) {
    node_t *node = &world->node[i];
    node_plug(node, LIE_NONE);
    node->absurd = false;
    node->pauses = false;
    node->info_odd = false;
    node->own_mA = node->config->max_mA;
    node->min_mA = node->config->min_mA;
    node->wanted_Wh = 6e5;
    node->capacity_Wh = 100000.0;
    node->conductors = node->claimed = node->config->phases;
    node->voltage_mV = (uint32_t)node->config->voltage_mV;
    node->plug_ms = world->now_ms + (int64_t)(FAIR_TICKS + FAIR_SETTLES) * world->config->tick_ms;
    account_plugged(&world->account, i, node->session, node->claimed);
}

/** The minima of FAIR_PLACES fit. Everybody leaves first, so that nothing is held against anybody. */
static void begin_fair(world_t *world) {
    const taper_connector_config_t *connector = &world->config->connectors[0];
    const int32_t least_W = connector->min_mA / 1000 * (connector->voltage_mV / 1000) * 3;
    gateway_hold(&world->gateway, least_W * FAIR_PLACES + 200);
    no_curve(world);
    for (unsigned i = 0; i < world->config->connector_count; i++) {
        unplug(world, i);
        world->node[i].plug_ms = INT64_MAX;
    }
    world->policy = POLICY_EQUAL;
    world->fair_from = world->tick + FAIR_SETTLES;
    world->era_ends = world->fair_from + FAIR_TICKS;
}

static void be_fair(world_t *world) {
    for (unsigned i = 0; i < world->config->connector_count && world->tick == world->fair_from - FAIR_PLUGGED;
         i++) {
        plug_hungry(world, i);
    }
    if (world->tick == world->fair_from) {
        account_fair(&world->account, fair_bound_ms(world));
    }
}

/** No more than one liar at a time: their over-draws would follow one another. */
static void begin_calm(world_t *world) {
    for (unsigned i = 0; i < world->config->connector_count; i++) {
        if (world->node[i].lie != LIE_NONE) {
            unplug(world, i);
            world->node[i].plug_ms = world->now_ms + random_in(&world->random, 5000, 30000);
        }
    }
}

static void begin_era(world_t *world) {
    const bool turns = world->config->other_load_W > 0 && world->config->groups[0].imbalance_mA == 0 &&
                       world->config->group_count == 3 && !world->config->connectors[0].is_dc;
    account_fair(&world->account, 0);
    world->gateway.steady = false;
    world->refuse_permille = 0;
    taper_membus_bus_on(&world->bus, 0);
    world->era = (era_t)random_below(&world->random, turns ? ERAS : ERA_FAIR);
    world->era_ends = world->tick + 100u + random_below(&world->random, 500);
    if (world->era == ERA_CALM) {
        begin_calm(world);
    } else if (world->era == ERA_FAIR) {
        begin_fair(world);
    }
    inject(world);
}

static void change_policy(world_t *world) {
    if (world->era != ERA_FAIR && random_once_in(&world->random, 100)) {
        world->policy = random_once_in(&world->random, 2) ? POLICY_EQUAL
                                                          : (policy_t)random_below(&world->random, POLICIES);
    }
}

/** Connectors that say something odd about themselves. */
static void be_odd(world_t *world, node_t *node) {
    if (world->era != ERA_FAIR && random_once_in(&world->random, 3000)) {
        node->info_odd = !node->info_odd;
    }
}

void chaos_init(world_t *world) {
    world->era_ends = 0;
}

void chaos_tick(world_t *world) {
    if (world->tick >= world->era_ends && !world->station_dead) {
        begin_era(world);
    }
    gateway_tick(&world->gateway, world->now_ms);
    change_policy(world);
    for (unsigned i = 0; i < world->config->connector_count; i++) {
        come_and_go(world, i);
        cut_links(world, i);
        be_odd(world, &world->node[i]);
    }
    if (world->era == ERA_SENDER) {
        trouble_sender(world);
    }
    const bool may_restart = world->era != ERA_CALM && world->era != ERA_FAIR && !world->station_dead;
    if (may_restart && random_once_in(&world->random, 700)) {
        restart_station(world);
    }
    if (!world->station_dead && world->era != ERA_FAIR && random_once_in(&world->random, 300)) {
        set_curve(world);
        set_price(world);
    }
    world->account.watches_physical = world->era == ERA_CALM;
    if (world->era == ERA_FAIR) {
        be_fair(world);
    }
}
