/* Break before make: an increase waits for the proof of the decreases that pay for it. */
#include "rooms.h"
#include "taper/allocator.h"
#include "taper/ledger.h"

/** What one hand-over works with. */
typedef struct {
    const taper_ledger_t *ledger;
    const taper_station_config_t *config;
    const taper_snapshot_t *snapshot;
    const taper_rows_t *rows;
} grant_t;

/**
 * The current of a delta line is bounded by two rows together, and a connector may be in one of them only. What the other one
 * is overdrawn by leaves it no room either: the current would rise, though no row did.
 */
static void share_excess(taper_rooms_t *rooms, const taper_rows_t *rows, uint8_t group_count) {
    for (unsigned row = 0; row + 3u < rows->sums; row++) { /* the second ones are the last three */
        const bool has_two = rows->kind[row] >= TAPER_ROW_DELTA_L1;
        for (uint8_t k = 0; has_two && k < group_count; k++) {
            int64_t *left = rooms->left[k];
            const int64_t least = left[row] < left[row + 3u] ? left[row] : left[row + 3u];
            if (least < 0) {
                left[row] = left[row + 3u] = least;
            }
        }
    }
}

/** What is left when every connector draws what it may. A room can be negative: the limit fell. */
static void open_rooms_left(const grant_t *grant, taper_rooms_t *rooms) {
    taper_rooms_open(rooms, grant->config, grant->rows);
    for (uint8_t i = 0; i < grant->config->connector_count; i++) {
        taper_rooms_draw(rooms, grant->config, grant->rows, i, taper_ledger_may_mA(grant->ledger, i));
    }
    share_excess(rooms, grant->rows, grant->config->group_count);
}

/** At least the minimum current, or nothing. */
static int32_t whole_or_none_mA(const taper_snapshot_t *snapshot, uint8_t i, int32_t current_mA) {
    return current_mA < snapshot->demand[i].min_mA ? 0 : current_mA - current_mA % TAPER_CURRENT_STEP_mA;
}

/**
 * What needs no room, whatever others draw: no more than it was told last, and may still draw by that. Whose setpoints ran out
 * may have heard none of these, and draw nothing: what he is told then is an increase.
 */
static int32_t kept_mA(const grant_t *grant, uint8_t i, int32_t target_mA) {
    const int32_t last_mA =
        taper_min_i32(grant->ledger->entry[i].last_mA, taper_ledger_told_mA(grant->ledger, i));
    const bool is_heard = taper_ledger_unreached_mA(grant->ledger, i) == 0;
    return is_heard ? whole_or_none_mA(grant->snapshot, i, taper_min_i32(target_mA, last_mA)) : 0;
}

/** The most up to `target_mA` that fits. Nothing does below a row that is overdrawn. */
static void raise_one(const grant_t *grant, taper_rooms_t *rooms, uint8_t i, int32_t target_mA,
                      int32_t *granted_mA) {
    const int32_t may_mA = taper_ledger_may_mA(grant->ledger, i);
    const int32_t fits_mA = taper_rooms_fit_mA(rooms, grant->config, grant->rows, i, INT32_MAX);
    const int32_t most_mA = taper_saturate_i32((int64_t)may_mA + fits_mA);
    const int32_t raised_mA = whole_or_none_mA(grant->snapshot, i, taper_min_i32(target_mA, most_mA));
    if (fits_mA >= 0 && raised_mA > *granted_mA) {
        taper_rooms_draw(rooms, grant->config, grant->rows, i, taper_max_i32(raised_mA - may_mA, 0));
        *granted_mA = raised_mA;
    }
}

void taper_ledger_grant(const taper_ledger_t *ledger, const taper_station_config_t *config,
                        const taper_snapshot_t *snapshot, const uint8_t *rank, const taper_rows_t *rows,
                        const taper_setpoints_t *target, taper_setpoints_t *granted) {
    const grant_t grant = {ledger, config, snapshot, rows};
    taper_rooms_t rooms;
    open_rooms_left(&grant, &rooms);
    for (uint8_t i = 0; i < config->connector_count; i++) {
        granted->current_mA[i] = kept_mA(&grant, i, target->current_mA[i]);
    }
    for (uint8_t place = 0; place < config->connector_count; place++) {
        const uint8_t i = rank[place];
        /* A rank binds nobody: it may name a connector twice, or one that there is not. */
        if (i < config->connector_count && target->current_mA[i] > granted->current_mA[i]) {
            raise_one(&grant, &rooms, i, target->current_mA[i], &granted->current_mA[i]);
        }
    }
    taper_balance(config, snapshot, rows, rank, granted);
}
