/**
 * Faults for the frames of one direction of the in-memory bus: lost, repeated, late, out of order, corrupt, masqueraded,
 * and floods. What is hit follows from the seed alone, so a failing run can be run again. Memory is fixed and the caller's.
 *
 *     static taper_membus_injector_t injector;
 *     const taper_membus_faults_t faults = {.seed = 1, .drop_permille = 100};
 *     taper_membus_inject(&bus, &bus.to_station, &injector, &faults);
 */
#ifndef TAPER_MEMBUS_FAULTS_H
#define TAPER_MEMBUS_FAULTS_H

#include <stdbool.h>
#include <stdint.h>

#include "taper/frame.h"
#include "taper/membus.h"

/** Frames held back at the same time; further ones are not delayed. */
#define TAPER_MEMBUS_HELD 64u

/** Identifier masks for the filter: one function of all nodes, one node in all its functions, one identifier. */
#define TAPER_MEMBUS_MASK_FUNCTION 0x7C0u
#define TAPER_MEMBUS_MASK_NODE     0x03Fu
#define TAPER_MEMBUS_MASK_ID       0x7FFu

/**
 * What to inject. Probabilities are in 1/1000 of the frames that match; 0: never, 1000: always. One frame can be hit by
 * several; a lost one by nothing else.
 */
typedef struct {
    uint64_t seed;
    uint16_t id, mask; /**< frames with `(frame.id & mask) == (id & mask)`; mask 0: all */
    uint16_t drop_permille;
    uint16_t repeat_permille;     /**< arrives twice in a row */
    uint16_t delay_permille;      /**< held back by `delay_ms`, or if that is 0, by `delay_frames` */
    uint32_t delay_ms;            /**< by taper_membus_set_time() */
    uint32_t delay_frames;        /**< matching frames that overtake it, >= 1 */
    uint16_t reorder_permille;    /**< changes places with the next matching frame */
    uint16_t flip_permille;       /**< `bits` different bits of the data flip, 1..8 * length */
    uint16_t masquerade_permille; /**< `bits` different bits of the identifier flip, 1..11 */
    uint8_t bits;
} taper_membus_faults_t;

/** What was injected. Saturating. */
typedef struct {
    uint32_t matched; /**< frames that the filter let the faults see */
    uint32_t dropped, repeated, delayed, reordered, flipped, masqueraded, flooded;
} taper_membus_fault_counts_t;

/** A frame that is held back. */
typedef struct {
    taper_frame_t frame;
    uint32_t since_ms;
    uint32_t wait_ms;     /**< until then, if `wait_frames` is 0 */
    uint32_t wait_frames; /**< matching frames still to overtake it */
    bool is_swap;         /**< held for a reordering */
} taper_membus_held_t;

/** A babbling node. */
typedef struct {
    taper_frame_t frame;
    uint32_t per_ms; /**< 0: silent */
    uint32_t since_ms;
    uint32_t sent; /**< since then */
    bool is_garbage;
} taper_membus_flood_t;

/** The memory of one direction's faults. Private to the bus but for `counts`. */
struct taper_membus_injector {
    taper_membus_faults_t faults;
    taper_membus_fault_counts_t counts;
    uint64_t random;
    uint32_t now_ms;
    taper_membus_held_t held[TAPER_MEMBUS_HELD]; /**< in the order in which they were sent */
    uint32_t held_count;
    bool swap_is_open; /**< one of `held` waits to change places */
    taper_membus_flood_t flood;
};

/**
 * Inject `faults` into a direction of `bus` (`&bus->to_station` or `&bus->to_world`) from now on, with `injector` as its
 * memory, which must live as long as it is used. Counts start from 0; a flood and what was held back before end, the
 * latter by arriving. NULL for `faults` ends all faults; the counts can still be read.
 */
void taper_membus_inject(taper_membus_t *bus, taper_membus_queue_t *queue, taper_membus_injector_t *injector,
                         const taper_membus_faults_t *faults);

/**
 * From now on `per_ms` copies of `frame` arrive at the station in every millisecond that taper_membus_set_time() moves the
 * clock by; 0 ends it. With `is_garbage`, the bytes of each are random. One call of taper_membus_set_time() makes
 * TAPER_MEMBUS_DEPTH of them at most, since more would only push one another out. The flood is not hit by the faults.
 * It needs an injector in `bus->to_station`, else nothing happens.
 */
void taper_membus_flood(taper_membus_t *bus, const taper_frame_t *frame, uint32_t per_ms, bool is_garbage);

#endif
