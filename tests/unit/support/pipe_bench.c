#include "pipe_bench.h"

#include <string.h>

#include "unity.h"

static size_t least(size_t a, size_t b) {
    return a < b ? a : b;
}

static void put(pipe_way_t *way, const void *data, size_t size) {
    TEST_ASSERT_TRUE_MESSAGE(way->head + size <= PIPE_BYTES, "the pipe of the test is too short");
    memcpy(way->byte + way->head, data, size);
    way->head += size;
}

static size_t take(pipe_way_t *way, void *data, size_t size) {
    const size_t count = least(size, way->head - way->tail);
    memcpy(data, way->byte + way->tail, count);
    way->tail += count;
    if (way->tail == way->head) {
        way->tail = way->head = 0;
    }
    return count;
}

static size_t adapter_read(void *context, uint8_t *data, size_t size) {
    pipe_bench_t *pipe = context;
    return take(&pipe->to_adapter, data, least(size, pipe->chunk));
}

static size_t adapter_write(void *context, const uint8_t *data, size_t size) {
    pipe_bench_t *pipe = context;
    const size_t count = least(least(size, pipe->chunk), pipe->write_room);
    put(&pipe->to_world, data, count);
    pipe->write_room -= pipe->write_room == SIZE_MAX ? 0 : count;
    return count;
}

void pipe_bench_init(pipe_bench_t *pipe) {
    memset(pipe, 0, sizeof *pipe);
    pipe->write_room = SIZE_MAX;
    pipe->chunk = SIZE_MAX;
}

taper_stream_t pipe_bench_stream(pipe_bench_t *pipe) {
    const taper_stream_t stream = {.context = pipe, .read = adapter_read, .write = adapter_write};
    return stream;
}

void pipe_bench_say(pipe_bench_t *pipe, const char *text) {
    put(&pipe->to_adapter, text, strlen(text));
}

const char *pipe_bench_heard(pipe_bench_t *pipe) {
    static char text[PIPE_BYTES + 1];
    text[take(&pipe->to_world, text, PIPE_BYTES)] = '\0';
    return text;
}
