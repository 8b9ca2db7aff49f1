#include "taper/fallback.h"

#include "taper/battery.h"

/** Fill `rank` with the connectors in ascending order of `key`, ties by index: an insertion sort, stable. */
static void rank_ascending(const int32_t *key, uint8_t count, uint8_t *rank) {
    for (uint8_t next = 0; next < count; next++) {
        uint8_t place = next;
        while (place > 0 && key[rank[place - 1]] > key[next]) {
            rank[place] = rank[place - 1];
            place--;
        }
        rank[place] = next;
    }
}

static void wish_all_that_is_useful(const taper_snapshot_t *snapshot, uint32_t tick_ms,
                                    taper_proposal_t *proposal) {
    for (uint8_t i = 0; i < snapshot->count; i++) {
        const int32_t useful_W = taper_battery_useful_W(&snapshot->demand[i], tick_ms);
        proposal->wish_W[i] = useful_W;
        proposal->ceiling_W[i] = useful_W;
    }
}

static int32_t laxity_s(const taper_demand_t *demand) {
    const int32_t power_W = taper_min_i32(taper_demand_allowed_W(demand), taper_battery_limit_W(demand));
    if (power_W <= 0) {
        return INT32_MAX; /* cannot charge: nobody is helped by putting it first */
    }
    const int64_t charging_s = (int64_t)demand->need_Wh * 3600 / power_W;
    return taper_saturate_i32(demand->departs_in_s - charging_s);
}

void taper_propose_edf(const taper_snapshot_t *snapshot, uint32_t tick_ms, taper_proposal_t *proposal) {
    int32_t deadline_s[TAPER_MAX_CONNECTORS];
    for (uint8_t i = 0; i < snapshot->count; i++) {
        deadline_s[i] = snapshot->demand[i].active ? snapshot->demand[i].departs_in_s : INT32_MAX;
    }
    rank_ascending(deadline_s, snapshot->count, proposal->rank);
    wish_all_that_is_useful(snapshot, tick_ms, proposal);
}

void taper_propose_llf(const taper_snapshot_t *snapshot, uint32_t tick_ms, taper_proposal_t *proposal) {
    int32_t key_s[TAPER_MAX_CONNECTORS];
    for (uint8_t i = 0; i < snapshot->count; i++) {
        key_s[i] = snapshot->demand[i].active ? laxity_s(&snapshot->demand[i]) : INT32_MAX;
    }
    rank_ascending(key_s, snapshot->count, proposal->rank);
    wish_all_that_is_useful(snapshot, tick_ms, proposal);
}
