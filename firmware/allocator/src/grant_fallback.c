/* The fallback currents: what all connectors draw together if this controller dies now. */
#include "taper/ledger.h"

/** What one pass over the connectors works with. */
typedef struct {
    const taper_ledger_t *ledger;
    const taper_station_config_t *config;
    const taper_snapshot_t *snapshot;
    const taper_rows_t *rows;
    const taper_setpoints_t *granted;
    taper_setpoints_t *fallback;
} choice_t;

static int32_t weight_W_per_A(const choice_t *choice, uint8_t i) {
    return choice->rows->booking[i].W_per_A;
}

/** Up to `current_mA`, in steps of the wire: at least the minimum current, or nothing. */
static int32_t whole_or_none_mA(const choice_t *choice, uint8_t i, int32_t current_mA) {
    const int32_t least_mA =
        taper_max_i32(choice->config->connectors[i].min_mA, choice->snapshot->demand[i].min_mA);
    const int32_t whole_mA = current_mA - current_mA % TAPER_FALLBACK_STEP_mA;
    return whole_mA < least_mA ? 0 : whole_mA;
}

static int32_t wanted_mA(const choice_t *choice, uint8_t i) {
    const int32_t most_mA = taper_min_i32(choice->granted->current_mA[i], TAPER_FALLBACK_MOST_mA);
    return whole_or_none_mA(choice, i, taper_min_i32(choice->config->connectors[i].fallback_mA, most_mA));
}

/** Most current that `room_mW` holds. */
static int32_t held_mA(int64_t room_mW, int32_t W_per_A) {
    return W_per_A == 0 ? INT32_MAX : taper_saturate_i32(taper_quotient(room_mW, W_per_A));
}

static int32_t booked_mA(const choice_t *choice, uint8_t i) {
    return taper_max_i32(taper_ledger_fallback_mA(choice->ledger, i), choice->fallback->current_mA[i]);
}

/** Up to what it may have been told it takes no room: nobody loses what he has to a higher rank. */
static void raise_one(const choice_t *choice, uint8_t i, int64_t *room_mW) {
    const int32_t W_per_A = weight_W_per_A(choice, i);
    const int32_t before_mA = booked_mA(choice, i);
    const int32_t most_mA = taper_saturate_i32((int64_t)before_mA + held_mA(*room_mW, W_per_A));
    const int32_t raised_mA = whole_or_none_mA(choice, i, taper_min_i32(wanted_mA(choice, i), most_mA));
    if (raised_mA > choice->fallback->current_mA[i]) {
        choice->fallback->current_mA[i] = raised_mA;
        *room_mW -= (int64_t)W_per_A * (booked_mA(choice, i) - before_mA);
    }
}

void taper_ledger_grant_fallback(const taper_ledger_t *ledger, const taper_station_config_t *config,
                                 const taper_snapshot_t *snapshot, const taper_rows_t *rows,
                                 const uint8_t *rank, int32_t failsafe_W, const taper_setpoints_t *granted,
                                 taper_setpoints_t *fallback) {
    const choice_t choice = {ledger, config, snapshot, rows, granted, fallback};
    int64_t room_mW = (int64_t)taper_max_i32(failsafe_W, 0) * 1000;
    for (uint8_t i = 0; i < config->connector_count; i++) {
        room_mW -= (int64_t)weight_W_per_A(&choice, i) * taper_ledger_fallback_mA(ledger, i);
        fallback->current_mA[i] = 0;
    }
    /* A rank binds nobody: it may name a connector twice, or one that there is not. */
    for (uint8_t place = 0; place < config->connector_count && room_mW >= 0; place++) {
        if (rank[place] < config->connector_count) {
            raise_one(&choice, rank[place], &room_mW);
        }
    }
}
