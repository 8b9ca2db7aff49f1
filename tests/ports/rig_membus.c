/* The bus in memory. Its time stands still unless it is set. */
#include "rig.h"
#include "taper/membus.h"
#include "unity.h"

static taper_membus_t bus;
static taper_port_t port;

static void start(uint32_t now_ms) {
    taper_membus_init(&bus);
    taper_membus_set_time(&bus, now_ms);
    port = taper_membus_station_port(&bus);
}

static void nothing(void) {}

static uint32_t now_ms(void) {
    return bus.now_ms;
}

static void pass_ms(uint32_t ms) {
    taper_membus_set_time(&bus, bus.now_ms + ms);
}

static void say(const taper_frame_t *frame) {
    (void)taper_membus_world_send(&bus, frame);
}

static void say_bad(rig_bad_t kind) {
    (void)kind;
    TEST_FAIL_MESSAGE("this bus carries taper_frame_t only");
}

static bool hear(taper_frame_t *frame, uint32_t wait_ms) {
    (void)wait_ms;
    return taper_membus_world_receive(&bus, frame);
}

/** Nobody takes frames from the bus but who hears. */
static void jam(bool is_jammed) {
    (void)is_jammed;
}

static void bus_off(void) {
    taper_membus_bus_off(&bus, 0, 1);
}

static uint32_t record_max(void) {
    return TAPER_STORE_RECORD_MAX;
}

static void restart(void) {
    taper_membus_power_cycle(&bus);
}

static void tear_next_write(uint32_t bytes) {
    taper_membus_tear_next_write(&bus, bytes);
}

const rig_t rig = {
    .name = "membus",
    .has = {.bus_is_off = true, .receive_overflows = true, .store = true},
    .port = &port,
    .start = start,
    .stop = nothing,
    .now_ms = now_ms,
    .pass_ms = pass_ms,
    .say = say,
    .say_bad = say_bad,
    .settle = nothing,
    .hear = hear,
    .jam = jam,
    .bus_off = bus_off,
    .record_max = record_max,
    .restart = restart,
    .tear_next_write = tear_next_write,
};

void rig_arguments(int argc, char **argv) {
    (void)argc;
    (void)argv;
}
