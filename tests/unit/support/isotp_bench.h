/** Frames of ISO-TP by hand, and a wire between two links. */
#ifndef TAPER_TEST_ISOTP_BENCH_H
#define TAPER_TEST_ISOTP_BENCH_H

#include "taper/isotp.h"

#define BENCH_SEND_ID    0x63Eu
#define BENCH_RECEIVE_ID 0x67Eu
#define BENCH_TIMEOUT_ms 1000u

/** The options of a link with the ids above, a buffer of `capacity` bytes, no blocks and no separation. */
taper_isotp_options_t bench_options(uint8_t *buffer, uint16_t capacity);

/** The options of its peer. */
taper_isotp_options_t bench_peer_options(uint8_t *buffer, uint16_t capacity);

/** A frame from the peer: bytes in hexadecimal with blanks between them, as many as there are. */
taper_frame_t bench_frame(const char *bytes);

/** Hand bench_frame(bytes) to the link. */
void bench_take(taper_isotp_t *link, const char *bytes, uint32_t now_ms);

/** The link gives this frame, 8 bytes in hexadecimal, and is told that it is out. */
void bench_gives(taper_isotp_t *link, const char *bytes, uint32_t now_ms);

/** The link gives no frame. */
void bench_gives_nothing(taper_isotp_t *link, uint32_t now_ms);

/** A message's bytes, different for every `seed`. */
void bench_fill(uint8_t *data, uint16_t length, uint32_t seed);

/** Move what both links want to send, once each. @return whether anything moved. */
bool bench_exchange(taper_isotp_t *a, taper_isotp_t *b, uint32_t now_ms);

/** Move frames, a millisecond a round, until both links are no longer busy. @return the time then. */
uint32_t bench_run(taper_isotp_t *a, taper_isotp_t *b, uint32_t now_ms);

/** The message in the link's buffer is this one. */
void bench_holds(const taper_isotp_t *link, const uint8_t *data, uint16_t length);

/** State of reception. */
taper_isotp_state_t bench_received(const taper_isotp_t *link);

#endif
