#include "schedule.h"

void sim_slot_start(sim_slot_t *slot, const sim_cycle_t *cycle, int64_t first_ms, int64_t phase_ms) {
    *slot = (sim_slot_t){.phase_ms = phase_ms, .due_ms = first_ms, .sent_ms = first_ms - cycle->gap_ms};
}

bool sim_slot_is_due(const sim_slot_t *slot, const sim_cycle_t *cycle, int64_t now_ms, uint32_t key) {
    return (now_ms >= slot->due_ms || key != slot->key) && now_ms - slot->sent_ms >= cycle->gap_ms;
}

void sim_slot_sent(sim_slot_t *slot, const sim_cycle_t *cycle, int64_t now_ms, uint32_t key) {
    const int64_t into_ms = (now_ms + cycle->period_ms - slot->phase_ms) % cycle->period_ms;
    slot->due_ms = now_ms - into_ms + cycle->period_ms;
    slot->sent_ms = now_ms;
    slot->key = key;
}
