/** A station's transfers, and its peers: gateway, tool and connectors, each with a link of its own. */
#ifndef TAPER_TEST_TRANSFERS_BENCH_H
#define TAPER_TEST_TRANSFERS_BENCH_H

#include "taper/transfers.h"

#define BENCH_NOW_ms 5000u
#define BENCH_UNIX_s 1700000000u

/** The station's end; everything that is a peer's is in its link. */
extern taper_transfers_t transfers;
extern taper_transfer_scene_t scene;     /**< now_ms is the time of the bench */
extern taper_transfer_content_t content; /**< of the last result CURVE, PRICE or IDENTIFIER */

/** A peer and what it got. */
typedef struct {
    taper_isotp_t link;
    uint8_t buffer[TAPER_ISOTP_LONGEST];
} bench_peer_t;

extern bench_peer_t gateway, tool;

/** Everything anew, for scene_four(), at BENCH_NOW_ms = BENCH_UNIX_s. */
void bench_start(void);

/** A peer at `node` of `bus`. */
void bench_open_peer(bench_peer_t *peer, uint8_t bus, uint8_t node);

/** The envelope around `items`. @return the length; [bytes + 8] of `message`. */
uint16_t bench_seal(uint8_t *message, uint8_t type, uint16_t count, const void *items, uint16_t bytes);

/** `message` = a curve of `count` points at unix_s[], limits_100W[]. @return its length. */
uint16_t bench_curve(uint8_t *message, uint16_t count, const uint32_t *unix_s, const uint16_t *limits_100W);

/** The peer begins to send, in place of what it was sending; its buffer is free again. */
void bench_send(bench_peer_t *peer, const uint8_t *message, uint16_t length);

/** One frame from the peer to the station, if it has one. */
bool bench_from_peer(bench_peer_t *peer, taper_transfer_result_t *result);

/** One frame from the station, to whoever of gateway, tool and `peer` it is for. */
bool bench_to_peer(bench_peer_t *peer);

/** Move frames until all is quiet; a curve of limits or prices is answered with ACCEPTED. @return the last result other than NONE. */
taper_transfer_result_t bench_settle(bench_peer_t *peer);

/** Send a whole message and settle. */
taper_transfer_result_t bench_transfer(bench_peer_t *peer, const uint8_t *message, uint16_t length);

/** The peer got this answer; its buffer is released. */
void bench_answered(bench_peer_t *peer, taper_transfer_answer_t answer);

/** The peer got nothing. */
void bench_not_answered(const bench_peer_t *peer);

#endif
