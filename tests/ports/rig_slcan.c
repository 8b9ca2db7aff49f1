/* The SLCAN adapter and who is attached to it, in one program, over a pipe of bytes. Its time stands still unless it is set. */
#include <string.h>

#include "rig.h"
#include "slcan_world.h"
#include "taper/slcan.h"
#include "unity.h"

#define PIPE 4096u

typedef struct {
    uint8_t byte[PIPE];
    uint32_t head, tail; /**< free-running */
} pipe_t;

static pipe_t to_adapter, to_world;
static bool is_jammed;
static taper_slcan_t adapter;
static taper_port_t port;
static slcan_world_t world;
static uint32_t time_ms;

static size_t put(pipe_t *pipe, const uint8_t *data, size_t size) {
    size_t count = 0;
    while (count < size && pipe->head - pipe->tail < PIPE) {
        pipe->byte[pipe->head++ % PIPE] = data[count++];
    }
    return count;
}

static size_t take(pipe_t *pipe, uint8_t *data, size_t size) {
    size_t count = 0;
    while (count < size && pipe->head != pipe->tail) {
        data[count++] = pipe->byte[pipe->tail++ % PIPE];
    }
    return count;
}

static size_t adapter_read(void *context, uint8_t *data, size_t size) {
    (void)context;
    return take(&to_adapter, data, size);
}

static size_t adapter_write(void *context, const uint8_t *data, size_t size) {
    (void)context;
    return is_jammed ? 0 : put(&to_world, data, size);
}

static size_t world_read(void *context, uint8_t *data, size_t size) {
    (void)context;
    return take(&to_world, data, size);
}

static size_t world_write(void *context, const uint8_t *data, size_t size) {
    (void)context;
    return put(&to_adapter, data, size);
}

/** As the main of a board that nobody drives. */
static void pump(void *context) {
    taper_slcan_message_t forgotten;
    (void)context;
    do {
        taper_slcan_pump(&adapter, time_ms);
    } while (taper_slcan_take_extended(&adapter, &forgotten));
}

static void restart(void) {
    const taper_stream_t stream = {.read = adapter_read, .write = adapter_write};
    taper_slcan_init(&adapter, &stream);
    taper_slcan_open(&adapter);
    port = taper_slcan_port(&adapter);
}

static void start(uint32_t now_ms) {
    const taper_stream_t stream = {.read = world_read, .write = world_write};
    memset(&to_adapter, 0, sizeof to_adapter);
    memset(&to_world, 0, sizeof to_world);
    is_jammed = false;
    time_ms = now_ms;
    restart();
    slcan_world_init(&world, &stream, pump, NULL);
    slcan_world_open(&world);
}

static void stop(void) {}

static uint32_t now_ms(void) {
    return time_ms;
}

static void pass_ms(uint32_t ms) {
    time_ms += ms;
}

static void say(const taper_frame_t *frame) {
    slcan_world_say_frame(&world, frame);
}

static void say_bad(rig_bad_t kind) {
    slcan_world_say_bad(&world, kind);
}

static void settle(void) {
    slcan_world_settle(&world);
}

static bool hear(taper_frame_t *frame, uint32_t wait_ms) {
    return slcan_world_hear_frame(&world, frame, wait_ms);
}

static void jam(bool jammed) {
    is_jammed = jammed;
}

const rig_t rig = {
    .name = "slcan",
    .has = {.receive_overflows = true},
    .carries = SLCAN_WORLD_CARRIES,
    .port = &port,
    .start = start,
    .stop = stop,
    .now_ms = now_ms,
    .pass_ms = pass_ms,
    .say = say,
    .say_bad = say_bad,
    .settle = settle,
    .hear = hear,
    .jam = jam,
    .restart = restart,
};

void rig_arguments(int argc, char **argv) {
    (void)argc;
    (void)argv;
}
