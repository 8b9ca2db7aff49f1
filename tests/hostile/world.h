/**
 * The hostile world: a real station (firmware/app) on the bus in memory, connectors and a gateway that do not mean it
 * well, a bus that breaks frames, and the accountant who watches. Virtual time; a seed makes all of it.
 */
#ifndef HOSTILE_WORLD_H
#define HOSTILE_WORLD_H

#include "account.h"
#include "gateway.h"
#include "node.h"
#include "random.h"

#include "taper/membus.h"
#include "taper/membus_faults.h"
#include "taper/station.h"

/** A tick is one step and three polls. */
#define WORLD_POLLS 4u

/** For some minutes the world is of one mind. */
typedef enum {
    ERA_CALM,   /**< a sound bus; vehicles may lie, and what they really draw is watched */
    ERA_NOISE,  /**< frames lost, repeated, late, corrupt, now and then */
    ERA_STORM,  /**< and often; out of order, too */
    ERA_SENDER, /**< the station's frames are refused, its bus goes off */
    ERA_FAIR,   /**< nothing is wrong, but minima do not all fit: turns */
    ERAS,
} era_t;

/** What a poisoned policy proposes. */
typedef enum {
    POLICY_EQUAL,
    POLICY_EXTREMES,
    POLICY_NEGATIVE,
    POLICY_NOISE,
    POLICY_NOTHING,
    POLICIES
} policy_t;

/** Faults by kind, since the start. */
typedef struct {
    uint64_t lost, repeated, delayed, reordered, flipped, refused, bus_offs, link_losses, reboots, restarts,
        lies, curves, vehicles, poisoned;
} injuries_t;

typedef struct {
    const taper_station_config_t *config;
    random_t random;
    uint64_t tick;
    int64_t now_ms;
    era_t era;
    uint64_t era_ends;  /**< first tick of the next */
    uint64_t fair_from; /**< first tick with turns to be watched */
    policy_t policy;

    taper_membus_t bus;
    taper_membus_injector_t to_station, to_world;
    taper_port_t membus_port, port;
    taper_policy_t station_policy;
    taper_station_options_t options;
    taper_station_t station;
    bool station_dead;
    uint64_t station_back; /**< tick */
    unsigned refuse_permille;
    uint64_t guard_violations; /**< 0, or a station's own guard had to step in: its allocator is wrong */
    uint64_t refused_before;   /**< frames that the bus had not taken, by the last tick */

    node_t node[TAPER_MAX_CONNECTORS];
    gateway_t gateway;
    account_t account;
    injuries_t injuries;
} world_t;

/** @return false: the station refuses its description. */
bool world_init(world_t *world, const taper_station_config_t *config, uint64_t seed);

/** One control tick. */
void world_tick(world_t *world);

/** chaos.c: what goes wrong from this tick on. */
void chaos_tick(world_t *world);
/** Begin with an era of its own choice. */
void chaos_init(world_t *world);
/** What the injectors have counted so far goes to `injuries`. */
void chaos_count(world_t *world);

/** policy.c: poisoned plans. */
void policy_propose(void *context, const taper_snapshot_t *snapshot, int32_t site_limit_W,
                    taper_proposal_t *proposal);

/** world.c: the station's frames are gone, and what was held back arrives. */
void world_flush(world_t *world);

#endif
