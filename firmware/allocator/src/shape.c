#include "taper/shape.h"

#include <string.h>

void taper_shape_init(taper_shape_t *shape) {
    memset(shape, 0, sizeof *shape);
}

void taper_shape_sent(taper_shape_t *shape, uint8_t connector, int32_t current_mA, bool new_session,
                      uint32_t now_ms) {
    if (new_session) {
        shape->changed[connector] = false;
        shape->sent_mA[connector] = 0;
    }
    if (current_mA != shape->sent_mA[connector]) {
        shape->changed[connector] = true;
        shape->changed_ms[connector] = now_ms;
        shape->sent_mA[connector] = current_mA;
    }
}

/** Since the last change; UINT32_MAX: there was none. */
static uint32_t still_ms(const taper_shape_t *shape, uint8_t i, uint32_t now_ms) {
    return shape->changed[i] ? taper_elapsed_ms(now_ms, shape->changed_ms[i]) : UINT32_MAX;
}

/** Whether an increase from `sent_mA` has to wait altogether. */
static bool waits(const taper_station_config_t *config, uint8_t i, int32_t sent_mA, int32_t target_mA,
                  uint32_t elapsed_ms) {
    const bool too_soon = !config->connectors[i].is_dc && elapsed_ms < config->change_ms;
    const bool too_small =
        sent_mA != 0 && target_mA - sent_mA < config->deadband_mA && elapsed_ms < TAPER_SHAPE_SETTLE_ms;
    return too_soon || too_small;
}

/** Whole ramp of `time_ms`. */
static int32_t gained_mA(const taper_station_config_t *config, uint32_t time_ms) {
    return taper_saturate_i32(taper_quotient((int64_t)time_ms * config->ramp_mA_per_s, 1000));
}

/** What the ramp adds in `elapsed_ms`. Longer rests count no more, but always for one step of the wire. */
static int32_t ramp_mA(const taper_station_config_t *config, uint32_t elapsed_ms) {
    if (config->ramp_mA_per_s == 0) {
        return TAPER_NO_LIMIT;
    }
    const int32_t most_mA =
        taper_max_i32(gained_mA(config, config->change_ms), gained_mA(config, config->tick_ms));
    return taper_min_i32(gained_mA(config, elapsed_ms), taper_max_i32(most_mA, TAPER_CURRENT_STEP_mA));
}

/** What may be sent now for a target above what was sent. */
static int32_t raised_mA(const taper_shape_t *shape, const taper_station_config_t *config, uint8_t i,
                         int32_t target_mA, int32_t min_mA, uint32_t now_ms) {
    const int32_t sent_mA = shape->sent_mA[i];
    const uint32_t elapsed_ms = still_ms(shape, i, now_ms);
    if (waits(config, i, sent_mA, target_mA, elapsed_ms)) {
        return sent_mA;
    }
    const int32_t most_mA = taper_saturate_i32((int64_t)sent_mA + ramp_mA(config, elapsed_ms));
    return taper_min_i32(target_mA, taper_max_i32(most_mA, min_mA));
}

void taper_shape_bound(const taper_shape_t *shape, const taper_station_config_t *config,
                       const taper_snapshot_t *snapshot, const taper_setpoints_t *target, uint32_t now_ms,
                       taper_setpoints_t *shaped) {
    for (uint8_t i = 0; i < config->connector_count; i++) {
        const int32_t target_mA = target->current_mA[i];
        const int32_t min_mA = snapshot->demand[i].min_mA;
        const int32_t current_mA = target_mA > shape->sent_mA[i]
                                       ? raised_mA(shape, config, i, target_mA, min_mA, now_ms)
                                       : target_mA;
        shaped->current_mA[i] = current_mA < min_mA ? 0 : current_mA - current_mA % TAPER_CURRENT_STEP_mA;
    }
}
