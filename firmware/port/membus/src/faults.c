#include "taper/membus_faults.h"

#include <stddef.h>
#include <string.h>

#include "membus_internal.h"

#define ID_BITS 11u

/** SplitMix64 (Steele, Lea, Flood 2014): every seed is a good one, 0 too. */
static uint64_t next_random(taper_membus_injector_t *injector) {
    injector->random += UINT64_C(0x9E3779B97F4A7C15);
    uint64_t z = injector->random;
    z = (z ^ (z >> 30)) * UINT64_C(0xBF58476D1CE4E5B9);
    z = (z ^ (z >> 27)) * UINT64_C(0x94D049BB133111EB);
    return z ^ (z >> 31);
}

static uint32_t below(taper_membus_injector_t *injector, uint32_t bound) {
    return (uint32_t)(((next_random(injector) >> 32) * bound) >> 32);
}

static bool strikes(taper_membus_injector_t *injector, uint16_t permille) {
    return permille > 0 && below(injector, 1000) < permille;
}

/** `bits` different ones of the lowest `width` bits (<= 64). */
static uint64_t random_mask(taper_membus_injector_t *injector, unsigned bits, unsigned width) {
    uint64_t mask = 0;
    for (unsigned left = bits < width ? bits : width; left > 0;) {
        const uint64_t bit = UINT64_C(1) << below(injector, width);
        left -= (mask & bit) == 0 ? 1u : 0u;
        mask |= bit;
    }
    return mask;
}

static void flip_data(taper_membus_injector_t *injector, taper_frame_t *frame) {
    const uint64_t mask = random_mask(injector, injector->faults.bits, frame->length * 8u);
    for (unsigned i = 0; i < frame->length; i++) {
        frame->data[i] ^= (uint8_t)(mask >> (8u * i));
    }
    taper_count(&injector->counts.flipped);
}

static void masquerade(taper_membus_injector_t *injector, taper_frame_t *frame) {
    frame->id ^= (uint16_t)random_mask(injector, injector->faults.bits, ID_BITS);
    taper_count(&injector->counts.masqueraded);
}

/** Take the held frame `k` out and deliver it, received as much later as it was held. */
static void release(taper_membus_queue_t *queue, uint32_t k) {
    taper_membus_injector_t *injector = queue->injector;
    taper_membus_held_t held = injector->held[k];
    injector->held_count--;
    memmove(&injector->held[k], &injector->held[k + 1],
            (injector->held_count - k) * sizeof injector->held[0]);
    if (held.is_swap) {
        injector->swap_is_open = false;
    }
    held.frame.time_ms += taper_elapsed_ms(injector->now_ms, held.since_ms);
    (void)taper_membus_put(queue, &held.frame);
}

/** A matching frame overtook those that are held for a number of frames. */
static void release_overtaken(taper_membus_queue_t *queue, uint32_t held_before) {
    taper_membus_injector_t *injector = queue->injector;
    uint32_t k = 0;
    for (uint32_t seen = 0; seen < held_before; seen++) {
        taper_membus_held_t *held = &injector->held[k];
        const bool is_last = held->wait_frames == 1;
        held->wait_frames -= held->wait_frames > 0 ? 1 : 0;
        if (is_last) {
            release(queue, k);
        } else {
            k++;
        }
    }
}

static void release_due(taper_membus_queue_t *queue) {
    taper_membus_injector_t *injector = queue->injector;
    for (uint32_t k = 0; k < injector->held_count;) {
        const taper_membus_held_t *held = &injector->held[k];
        if (held->wait_frames == 0 && taper_elapsed_ms(injector->now_ms, held->since_ms) >= held->wait_ms) {
            release(queue, k);
        } else {
            k++;
        }
    }
}

static void hold(taper_membus_injector_t *injector, const taper_frame_t *frame, uint32_t wait_ms,
                 uint32_t wait_frames) {
    injector->held[injector->held_count] = (taper_membus_held_t){
        .frame = *frame, .since_ms = injector->now_ms, .wait_ms = wait_ms, .wait_frames = wait_frames};
    injector->held_count++;
}

/** @return whether the frame is held back, by a delay or to change places with the next. */
static bool hold_back(taper_membus_injector_t *injector, const taper_frame_t *frame) {
    const taper_membus_faults_t *faults = &injector->faults;
    if (injector->held_count == TAPER_MEMBUS_HELD) {
        return false;
    }
    if (strikes(injector, faults->delay_permille)) {
        const uint32_t frames = faults->delay_frames > 0 ? faults->delay_frames : 1;
        hold(injector, frame, faults->delay_ms, faults->delay_ms > 0 ? 0 : frames);
        taper_count(&injector->counts.delayed);
        return true;
    }
    /* The frame that another waits to change places with must pass, or both would only be late. */
    if (!injector->swap_is_open && strikes(injector, faults->reorder_permille)) {
        hold(injector, frame, 0, 1);
        injector->held[injector->held_count - 1].is_swap = true;
        injector->swap_is_open = true;
        taper_count(&injector->counts.reordered);
        return true;
    }
    return false;
}

static bool deliver(taper_membus_queue_t *queue, const taper_frame_t *frame) {
    taper_membus_injector_t *injector = queue->injector;
    bool taken = taper_membus_put(queue, frame);
    if (strikes(injector, injector->faults.repeat_permille)) {
        taken = taper_membus_put(queue, frame) && taken;
        taper_count(&injector->counts.repeated);
    }
    return taken;
}

/** What the faults make of a matching frame. */
static bool pass(taper_membus_queue_t *queue, const taper_frame_t *frame) {
    taper_membus_injector_t *injector = queue->injector;
    const taper_membus_faults_t *faults = &injector->faults;
    taper_frame_t changed = *frame;
    if (strikes(injector, faults->drop_permille)) {
        taper_count(&injector->counts.dropped);
        return true;
    }
    if (strikes(injector, faults->flip_permille)) {
        flip_data(injector, &changed);
    }
    if (strikes(injector, faults->masquerade_permille)) {
        masquerade(injector, &changed);
    }
    return hold_back(injector, &changed) || deliver(queue, &changed);
}

bool taper_membus_put_faulty(taper_membus_queue_t *queue, const taper_frame_t *frame) {
    taper_membus_injector_t *injector = queue->injector;
    const uint16_t mask = injector->faults.mask;
    if ((frame->id & mask) != (injector->faults.id & mask)) {
        return taper_membus_put(queue, frame);
    }
    const uint32_t held_before = injector->held_count;
    taper_count(&injector->counts.matched);
    const bool taken = pass(queue, frame);
    release_overtaken(queue, held_before);
    return taken;
}

void taper_membus_faults_set_time(taper_membus_queue_t *queue, uint32_t now_ms) {
    queue->injector->now_ms = now_ms;
    release_due(queue);
}

void taper_membus_inject(taper_membus_t *bus, taper_membus_queue_t *queue, taper_membus_injector_t *injector,
                         const taper_membus_faults_t *faults) {
    if (queue->injector != NULL) {
        while (queue->injector->held_count > 0) {
            release(queue, 0);
        }
    }
    queue->injector = faults == NULL ? NULL : injector;
    if (faults != NULL) {
        memset(injector, 0, sizeof *injector);
        injector->faults = *faults;
        injector->random = faults->seed;
        injector->now_ms = bus->now_ms;
    }
}

void taper_membus_flood(taper_membus_t *bus, const taper_frame_t *frame, uint32_t per_ms, bool is_garbage) {
    taper_membus_injector_t *injector = bus->to_station.injector;
    if (injector != NULL) {
        injector->flood = (taper_membus_flood_t){
            .frame = *frame, .per_ms = per_ms, .is_garbage = is_garbage, .since_ms = bus->now_ms};
    }
}

bool taper_membus_next_of_flood(taper_membus_injector_t *injector, taper_frame_t *frame) {
    taper_membus_flood_t *flood = &injector->flood;
    const uint64_t due = (uint64_t)taper_elapsed_ms(injector->now_ms, flood->since_ms) * flood->per_ms;
    if (flood->sent >= (due < TAPER_MEMBUS_DEPTH ? due : TAPER_MEMBUS_DEPTH)) {
        flood->since_ms = injector->now_ms;
        flood->sent = 0;
        return false;
    }
    flood->sent++;
    *frame = flood->frame;
    frame->time_ms = injector->now_ms;
    if (flood->is_garbage) {
        const uint64_t data = next_random(injector);
        for (unsigned i = 0; i < TAPER_FRAME_LENGTH; i++) {
            frame->data[i] = (uint8_t)(data >> (8u * i));
        }
    }
    taper_count(&injector->counts.flooded);
    return true;
}
