#include "slcan_world.h"

#include <stdio.h>
#include <string.h>

#include "unity.h"

void slcan_world_init(slcan_world_t *world, const taper_stream_t *stream, void (*turn)(void *context),
                      void *turn_context) {
    memset(world, 0, sizeof *world);
    world->stream = *stream;
    world->turn = turn;
    world->turn_context = turn_context;
}

/* ---- Hearing */

static bool is_frame(const slcan_world_t *world) {
    return world->line_length > 1 && strchr("tTrR", world->line[0]) != NULL;
}

static void hear_line(slcan_world_t *world) {
    taper_slcan_message_t message;
    if (!is_frame(world)) {
        world->answered++;
        return;
    }
    TEST_ASSERT_TRUE_MESSAGE(taper_slcan_decode(world->line, world->line_length, &message), world->line);
    TEST_ASSERT_TRUE_MESSAGE(world->head - world->tail < SLCAN_WORLD_HEARD,
                             "more heard than any adapter holds");
    world->heard[world->head % SLCAN_WORLD_HEARD] = message;
    world->head++;
}

static void hear_byte(slcan_world_t *world, char byte) {
    if (byte == '\a') {
        world->answered++;
        world->line_length = 0;
    } else if (byte == '\r') {
        world->line[world->line_length] = '\0';
        hear_line(world);
        world->line_length = 0;
    } else {
        TEST_ASSERT_TRUE_MESSAGE(world->line_length < sizeof world->line - 1, "a line too long");
        world->line[world->line_length++] = byte;
    }
}

/** @return whether something came. */
static bool hear_some(slcan_world_t *world) {
    uint8_t data[1024];
    const size_t count = world->stream.read(world->stream.context, data, sizeof data);
    for (size_t i = 0; i < count; i++) {
        hear_byte(world, (char)data[i]);
    }
    return count > 0;
}

/** One turn. @return false: nothing came, and the other side was given a millisecond. */
static bool take_turn(slcan_world_t *world) {
    const bool came = hear_some(world);
    if (!came) {
        world->turn(world->turn_context);
    }
    return came;
}

void slcan_world_settle(slcan_world_t *world) {
    for (uint32_t waited_ms = 0; world->answered < world->said;) {
        TEST_ASSERT_TRUE_MESSAGE(waited_ms < RIG_PATIENCE_ms, "a line that is not answered");
        waited_ms += take_turn(world) ? 0 : 1;
    }
}

bool slcan_world_hear(slcan_world_t *world, taper_slcan_message_t *message, uint32_t wait_ms) {
    for (uint32_t waited_ms = 0; world->head == world->tail && waited_ms <= wait_ms;) {
        waited_ms += take_turn(world) ? 0 : 1;
    }
    if (world->head == world->tail) {
        return false;
    }
    *message = world->heard[world->tail % SLCAN_WORLD_HEARD];
    world->tail++;
    return true;
}

bool slcan_world_hear_frame(slcan_world_t *world, taper_frame_t *frame, uint32_t wait_ms) {
    taper_slcan_message_t message;
    if (!slcan_world_hear(world, &message, wait_ms)) {
        return false;
    }
    TEST_ASSERT_FALSE_MESSAGE(message.is_extended || message.is_remote, "a frame that no station sends");
    *frame = (taper_frame_t){.id = (uint16_t)message.id, .length = message.length};
    memcpy(frame->data, message.data, sizeof frame->data);
    return true;
}

/* ---- Saying */

static void say_bytes(slcan_world_t *world, const char *bytes, size_t size) {
    for (uint32_t waited_ms = 0; size > 0;) {
        const size_t taken = world->stream.write(world->stream.context, (const uint8_t *)bytes, size);
        bytes += taken;
        size -= taken;
        if (taken == 0) { /* the other side may wait for somebody who hears its answers */
            TEST_ASSERT_TRUE_MESSAGE(waited_ms < RIG_PATIENCE_ms, "a line that is not taken");
            waited_ms += take_turn(world) ? 0 : 1;
        }
    }
}

void slcan_world_say(slcan_world_t *world, const char *line) {
    say_bytes(world, line, strlen(line));
    say_bytes(world, "\r", 1);
    world->said++;
}

void slcan_world_say_message(slcan_world_t *world, const taper_slcan_message_t *message) {
    char line[TAPER_SLCAN_LINE];
    const size_t length = taper_slcan_encode(message, line);
    say_bytes(world, line, length);
    world->said++;
}

void slcan_world_open(slcan_world_t *world) {
    slcan_world_say(world, "C");
    slcan_world_say(world, "S6");
    slcan_world_say(world, "O");
    slcan_world_settle(world);
}

void slcan_world_say_frame(slcan_world_t *world, const taper_frame_t *frame) {
    taper_slcan_message_t message = {.id = frame->id, .length = frame->length};
    memcpy(message.data, frame->data, sizeof message.data);
    slcan_world_say_message(world, &message);
}

void slcan_world_say_bad(slcan_world_t *world, rig_bad_t kind) {
    static const char *const line[RIG_BAD_KINDS] = {
        [RIG_REMOTE] = "r1238",
        [RIG_EXTENDED] = "T0000012380102030405060708",
        [RIG_EXTENDED_REMOTE] = "R000001238",
        [RIG_FD] = "d1239010203040506070809101112",
        [RIG_MALFORMED] = "t1238010203",
    };
    TEST_ASSERT_NOT_NULL(line[kind]);
    slcan_world_say(world, line[kind]);
}
