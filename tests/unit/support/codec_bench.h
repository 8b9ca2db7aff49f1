/** Messages over the wire and back, failing the running test where that is not possible. */
#ifndef TAPER_TEST_CODEC_BENCH_H
#define TAPER_TEST_CODEC_BENCH_H

#include <stdint.h>

#include "taper/codec.h"

#define CODEC_BENCH_KINDS 18
/** Every kind of message. */
extern const taper_message_kind_t codec_bench_kinds[CODEC_BENCH_KINDS];

/** A node that the kind allows: for connectors, the one below. */
uint8_t codec_bench_node_of(taper_message_kind_t kind);
#define CODEC_BENCH_CONNECTOR 33

/** All zero, but for kind and node. */
taper_message_t codec_bench_message_of(taper_message_kind_t kind);

taper_frame_t codec_bench_encode(const taper_message_t *message);

/** No field may be bad. */
taper_message_t codec_bench_decode(const taper_frame_t *frame);

/** Twelve kinds of connectors, five of one node, and EMCY of connectors, gateway and controller. */
#define CODEC_BENCH_IDS (12 * 60 + 5 + 62)
/** Every identifier that is decoded; fails the running test if there are not so many. */
void codec_bench_identifiers(uint16_t ids[CODEC_BENCH_IDS]);

/** The all-zero message as a frame. */
taper_frame_t codec_bench_frame_of(taper_message_kind_t kind);

#endif
