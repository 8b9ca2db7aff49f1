/* Break before make: an increase waits for the proof of the decreases that pay for it. */
#include "rooms.h"
#include "taper/ledger.h"

/** What is left when every connector draws what it may. A room can be negative: the limit fell. */
static void open_rooms_left(taper_rooms_t *rooms, const taper_ledger_t *ledger,
                            const taper_station_config_t *config, const taper_snapshot_t *snapshot,
                            const taper_supply_t *supply) {
    taper_rooms_open(rooms, config, supply);
    for (uint8_t i = 0; i < config->connector_count; i++) {
        const taper_booking_t booking = taper_booking_now(config, snapshot, i);
        taper_rooms_take(rooms, config, i, &booking, taper_ledger_may_mA(ledger, i));
    }
}

/** At least the minimum current, or nothing. */
static int32_t whole_or_none_mA(const taper_snapshot_t *snapshot, uint8_t i, int32_t current_mA) {
    return current_mA < snapshot->demand[i].min_mA ? 0 : current_mA - current_mA % TAPER_CURRENT_STEP_mA;
}

/** The most up to `target_mA` that fits; what it was told already if nothing does or too little for its minimum. */
static int32_t raised_mA(const taper_rooms_t *rooms, const taper_ledger_t *ledger,
                         const taper_station_config_t *config, const taper_snapshot_t *snapshot, uint8_t i,
                         int32_t target_mA) {
    const int32_t told_mA = taper_ledger_told_mA(ledger, i);
    const taper_booking_t booking = taper_booking_now(config, snapshot, i);
    const int32_t fits_mA = taper_rooms_left_mA(rooms, config, i, &booking);
    if (fits_mA < 0) {
        return told_mA;
    }
    const int64_t most_mA = (int64_t)taper_ledger_may_mA(ledger, i) + fits_mA;
    const int32_t current_mA =
        whole_or_none_mA(snapshot, i, taper_min_i32(target_mA, taper_saturate_i32(most_mA)));
    return taper_max_i32(current_mA, told_mA);
}

static void raise_one(taper_rooms_t *rooms, const taper_ledger_t *ledger,
                      const taper_station_config_t *config, const taper_snapshot_t *snapshot, uint8_t i,
                      int32_t target_mA, int32_t *granted_mA) {
    const int32_t more_mA = raised_mA(rooms, ledger, config, snapshot, i, target_mA);
    const int32_t taken_mA = taper_max_i32(more_mA - taper_ledger_may_mA(ledger, i), 0);
    const taper_booking_t booking = taper_booking_now(config, snapshot, i);
    taper_rooms_take(rooms, config, i, &booking, taken_mA);
    *granted_mA = whole_or_none_mA(snapshot, i, more_mA);
}

void taper_ledger_grant(const taper_ledger_t *ledger, const taper_station_config_t *config,
                        const taper_snapshot_t *snapshot, const uint8_t *rank, const taper_supply_t *supply,
                        const taper_setpoints_t *target, taper_setpoints_t *granted) {
    taper_rooms_t rooms;
    open_rooms_left(&rooms, ledger, config, snapshot, supply);
    for (uint8_t i = 0; i < config->connector_count; i++) {
        const int32_t told_mA = taper_ledger_told_mA(ledger, i);
        granted->current_mA[i] = whole_or_none_mA(snapshot, i, taper_min_i32(target->current_mA[i], told_mA));
    }
    for (uint8_t place = 0; place < config->connector_count; place++) {
        const uint8_t i = rank[place];
        /* A rank binds nobody: it may name a connector twice, or one that there is not. */
        if (i < config->connector_count && target->current_mA[i] > granted->current_mA[i]) {
            raise_one(&rooms, ledger, config, snapshot, i, target->current_mA[i], &granted->current_mA[i]);
        }
    }
}
