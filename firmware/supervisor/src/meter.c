/* What the site draws besides charging. */
#include "limits_internal.h"

void taper_limits_apply_meter(taper_limits_t *limits, const taper_site_meter_t *message, uint32_t at_ms) {
    const taper_station_config_t *config = limits->config;
    int64_t sum_W = 0;
    for (unsigned phase = 0; phase < 3; phase++) {
        const int32_t current_mA = message->other_mA[phase];
        const bool absent = current_mA == TAPER_ABSENT;
        sum_W += absent ? config->other_load_W / 3 : (int64_t)current_mA * config->site_voltage_mV / 1000000;
        limits->metered_mA[phase] = absent ? config->other_load_mA : taper_max_i32(current_mA, 0);
    }
    if (limits->meter_heard && !limits->meter_alive) {
        taper_event_note(limits->log, TAPER_EVENT_METER_BACK, 0, TAPER_NODE_GATEWAY, 0);
    }
    limits->meter_heard = true;
    limits->meter_alive = true;
    limits->meter_ms = at_ms;
    limits->metered_W = taper_max_i32(taper_saturate_i32(sum_W), 0); /* what is fed in is not ours to draw */
}

static bool meter_speaks(const taper_limits_t *limits, uint32_t now_ms) {
    return limits->meter_alive && taper_elapsed_ms(now_ms, limits->meter_ms) <= TAPER_SITE_METER_TIMEOUT_ms;
}

int32_t taper_limits_other_W(const taper_limits_t *limits, uint32_t now_ms) {
    return meter_speaks(limits, now_ms) ? limits->metered_W
                                        : taper_max_i32(limits->metered_W, limits->config->other_load_W);
}

int32_t taper_limits_other_mA(const taper_limits_t *limits, unsigned phase, uint32_t now_ms) {
    const int32_t metered_mA = limits->metered_mA[phase];
    return meter_speaks(limits, now_ms) ? metered_mA
                                        : taper_max_i32(metered_mA, limits->config->other_load_mA);
}

void taper_meter_expire(taper_limits_t *limits, uint32_t now_ms) {
    const bool was_alive = limits->meter_alive;
    limits->meter_alive = meter_speaks(limits, now_ms);
    if (was_alive && !limits->meter_alive) {
        taper_event_note(limits->log, TAPER_EVENT_METER_LOST, 0, TAPER_NODE_GATEWAY,
                         limits->config->other_load_W);
    }
}

void taper_meter_supply(const taper_limits_t *limits, uint32_t now_ms, int32_t phase_mA[3]) {
    const int32_t limit_mA = limits->config->groups[0].limit_mA;
    for (unsigned phase = 0; phase < 3; phase++) {
        phase_mA[phase] = limit_mA == 0
                              ? TAPER_NO_LIMIT
                              : taper_max_i32(limit_mA - taper_limits_other_mA(limits, phase, now_ms), 0);
    }
}
