#include "world.h"

#include <string.h>

/* The clock of the station wraps some minutes after the start. */
#define START_ms (INT64_C(0x100000000) - 600000)

static void count_lost(world_t *world) {
    world->injuries.lost++;
}

/** The time of a frame of the station's clock, near to now. */
static int64_t at_ms(const world_t *world, uint32_t time_ms) {
    return world->now_ms - (int64_t)(uint32_t)((uint32_t)world->now_ms - time_ms);
}

static bool port_receive(void *context, taper_frame_t *frame) {
    world_t *world = context;
    if (!world->membus_port.receive(world->membus_port.context, frame)) {
        return false;
    }
    account_heard(&world->account, frame, at_ms(world, frame->time_ms));
    return true;
}

static bool port_send(void *context, const taper_frame_t *frame) {
    world_t *world = context;
    const bool refused = random_below(&world->random, 1000) < world->refuse_permille ||
                         !world->membus_port.send(world->membus_port.context, frame);
    if (refused) {
        world->injuries.refused++;
    } else {
        account_sent(&world->account, frame);
    }
    return !refused;
}

static bool port_is_off(void *context, uint8_t bus) {
    const world_t *world = context;
    return world->membus_port.bus_is_off(world->membus_port.context, bus);
}

static void port_restart(void *context, uint8_t bus) {
    const world_t *world = context;
    world->membus_port.restart_bus(world->membus_port.context, bus);
}

static bool port_store_read(void *context, unsigned area, unsigned copy, void *data, uint32_t length) {
    const world_t *world = context;
    return world->membus_port.store_read(world->membus_port.context, area, copy, data, length);
}

static bool port_store_write(void *context, unsigned area, unsigned copy, const void *data, uint32_t length) {
    const world_t *world = context;
    return world->membus_port.store_write(world->membus_port.context, area, copy, data, length);
}

static bool start_station(world_t *world) {
    world->station_dead = false;
    account_station_started(&world->account);
    return taper_station_init(&world->station, &world->options) == TAPER_OK;
}

bool world_init(world_t *world, const taper_station_config_t *config, uint64_t seed) {
    memset(world, 0, sizeof *world);
    world->config = config;
    world->random.state = seed;
    world->now_ms = START_ms;
    taper_membus_init(&world->bus);
    taper_membus_set_time(&world->bus, (uint32_t)world->now_ms);
    world->membus_port = taper_membus_station_port(&world->bus);
    world->port = (taper_port_t){.context = world,
                                 .receive = port_receive,
                                 .send = port_send,
                                 .bus_is_off = port_is_off,
                                 .restart_bus = port_restart,
                                 .store_read = port_store_read,
                                 .store_write = port_store_write};
    world->station_policy = (taper_policy_t){.propose = policy_propose, .context = world};
    world->options = (taper_station_options_t){.config = config,
                                               .port = &world->port,
                                               .policy = &world->station_policy,
                                               .iterations_per_tick = TAPER_MIN_SLICE};
    for (unsigned i = 0; i < config->connector_count; i++) {
        node_init(&world->node[i], &config->connectors[i], &world->random);
    }
    gateway_init(&world->gateway, config, &world->random);
    account_init(&world->account, config, world->now_ms);
    chaos_init(world);
    return start_station(world);
}

void world_flush(world_t *world) {
    chaos_count(world);
    taper_membus_inject(&world->bus, &world->bus.to_station, &world->to_station, NULL);
    taper_membus_inject(&world->bus, &world->bus.to_world, &world->to_world, NULL);
}

static void send_of_node(void *context, node_t *node, const taper_frame_t *frame) {
    world_t *world = context;
    if (node->link_out) {
        (void)taper_membus_world_send(&world->bus, frame);
    } else {
        count_lost(world);
    }
}

static void send_of_gateway(void *context, const taper_frame_t *frame) {
    world_t *world = context;
    (void)taper_membus_world_send(&world->bus, frame);
}

static void deliver(world_t *world) {
    taper_frame_t frame;
    while (taper_membus_world_receive(&world->bus, &frame)) {
        const int i = account_connector_of(&world->account, wire_node(&frame));
        if (i < 0 || wire_function(&frame) != WIRE_SETPOINT) {
            continue;
        }
        if (world->node[i].link_in) {
            account_delivered(&world->account, &frame);
            node_hear(&world->node[i], &frame, world->now_ms);
        } else {
            count_lost(world);
        }
    }
}

/** Frames to a station that is not there reach nobody. */
static void drop_frames(world_t *world) {
    taper_frame_t frame;
    while (world->membus_port.receive(world->membus_port.context, &frame)) {
        count_lost(world);
    }
}

static void run_station(world_t *world, unsigned poll) {
    if (world->station_dead) {
        drop_frames(world);
    } else if (poll == 0) {
        taper_station_step(&world->station, (uint32_t)world->now_ms);
        account_tick(&world->account, world->injuries.refused == world->refused_before);
        world->refused_before = world->injuries.refused;
    } else {
        taper_station_poll(&world->station, (uint32_t)world->now_ms);
    }
}

static void run_poll(world_t *world, unsigned poll, int64_t passed_ms) {
    taper_membus_set_time(&world->bus, (uint32_t)world->now_ms);
    account_time(&world->account, world->now_ms);
    run_station(world, poll);
    deliver(world);
    for (unsigned i = 0; i < world->config->connector_count; i++) {
        node_t *node = &world->node[i];
        node_run(node, world->now_ms, passed_ms);
        account_drawn(&world->account, i, node->drawn_mA, node->lie != LIE_MEASURES);
        account_wants(&world->account, i, node_wants(node));
        node_report(node, world->tick, poll, send_of_node, world);
    }
    gateway_report(&world->gateway, poll, world->now_ms, send_of_gateway, world);
    account_check(&world->account);
}

void world_tick(world_t *world) {
    const int64_t begin_ms = world->now_ms;
    int64_t last_ms = begin_ms - 250;
    chaos_tick(world);
    if (world->station_dead && world->tick >= world->station_back) {
        (void)start_station(world);
    }
    for (unsigned poll = 0; poll < WORLD_POLLS; poll++) {
        const int32_t jitter_ms = poll == 0 ? 0 : random_in(&world->random, -40, 40);
        world->now_ms = begin_ms + 250 * (int64_t)poll + jitter_ms;
        run_poll(world, poll, world->now_ms - last_ms);
        last_ms = world->now_ms;
    }
    world->guard_violations +=
        world->station_dead ? 0 : taper_station_counter(&world->station, TAPER_COUNTER_GUARD_VIOLATIONS);
    world->now_ms = begin_ms + world->config->tick_ms;
    world->tick++;
}
