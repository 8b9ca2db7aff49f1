/** A byte pipe in memory, both ways: the wire between an SLCAN adapter and who is attached to it. */
#ifndef TAPER_TEST_PIPE_BENCH_H
#define TAPER_TEST_PIPE_BENCH_H

#include "taper/slcan.h"

#define PIPE_BYTES 65536u

typedef struct {
    uint8_t byte[PIPE_BYTES];
    size_t head, tail;
} pipe_way_t;

typedef struct {
    pipe_way_t to_adapter, to_world;
    size_t write_room; /**< bytes that the adapter may still write; SIZE_MAX: any number */
    size_t chunk;      /**< most that one call of read or write moves */
} pipe_bench_t;

/** Empty, and as fast as memory. */
void pipe_bench_init(pipe_bench_t *pipe);

/** The adapter's end. */
taper_stream_t pipe_bench_stream(pipe_bench_t *pipe);

/** The attached side says `text`, as it stands. */
void pipe_bench_say(pipe_bench_t *pipe, const char *text);

/** All that the adapter has written and nobody has read yet, as text; good until the next call. */
const char *pipe_bench_heard(pipe_bench_t *pipe);

#endif
