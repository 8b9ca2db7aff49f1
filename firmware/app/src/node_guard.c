/* A node that babbles: more than three times its nominal rate for a second (docs/protocol.md, fault 16). */
#include "station_internal.h"

#define TOKEN     1000u /* tokens are counted in thousandths */
#define SECOND_ms 1000u
/* So far back is out of order; what is further back is a clock that wrapped. */
#define OUT_OF_ORDER_ms 60000u

uint32_t taper_node_guard_time(const taper_node_guard_t *guard, uint32_t at_ms, uint32_t now_ms) {
    const uint32_t back_ms = taper_elapsed_ms(guard->refilled_ms, at_ms);
    const bool out_of_order = back_ms <= OUT_OF_ORDER_ms && taper_time_reached(now_ms, guard->refilled_ms);
    return guard->known && out_of_order ? guard->refilled_ms : at_ms;
}

static void refill(taper_node_guard_t *guard, uint32_t per_second, uint32_t at_ms) {
    const uint32_t full = per_second * TOKEN;
    const uint32_t passed_ms = taper_elapsed_ms(at_ms, guard->refilled_ms);
    if (!guard->known || passed_ms >= SECOND_ms) {
        guard->tokens_x1000 = full;
    } else {
        const uint32_t tokens = guard->tokens_x1000 + passed_ms * per_second;
        guard->tokens_x1000 = tokens < full ? tokens : full;
    }
    guard->known = true;
    guard->refilled_ms = at_ms;
}

static void note_excess(taper_station_t *station, taper_node_guard_t *guard, const taper_frame_t *frame) {
    const uint32_t at_ms = frame->time_ms;
    const uint8_t node = (uint8_t)(frame->id & 0x3Fu);
    if (!guard->in_excess) {
        guard->in_excess = true;
        guard->excess_since_ms = at_ms;
    }
    guard->excess_ms = at_ms;
    if (!guard->babbling && taper_elapsed_ms(at_ms, guard->excess_since_ms) >= SECOND_ms) {
        guard->babbling = true;
        taper_event_note(&station->events, TAPER_EVENT_BABBLING, frame->bus, node, 0);
    }
    if (guard->babbling) {
        taper_alarm_raise(station, TAPER_EVENT_BABBLING, frame->bus, node, station->events.now_ms);
    }
}

bool taper_node_guard_passes(taper_station_t *station, taper_node_guard_t *guard, uint32_t per_second,
                             const taper_frame_t *frame) {
    const uint32_t at_ms = frame->time_ms;
    refill(guard, per_second, at_ms);
    if (guard->in_excess && taper_elapsed_ms(at_ms, guard->excess_ms) >= SECOND_ms) {
        guard->in_excess = false;
        guard->babbling = false;
    }
    const bool within = guard->tokens_x1000 >= TOKEN;
    if (within) {
        guard->tokens_x1000 -= TOKEN;
    } else {
        note_excess(station, guard, frame);
    }
    if (!within || guard->babbling) {
        taper_station_count(station, TAPER_COUNTER_FRAMES_BABBLED);
        return false;
    }
    return true;
}
