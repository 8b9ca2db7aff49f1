#include "taper/battery.h"

#include "taper/battery_slope.h"
#include "taper/real_math.h"

static int64_t divide_up(int64_t numerator, int64_t denominator) {
    return (numerator + denominator - 1) / denominator;
}

int32_t taper_battery_limit_W(const taper_demand_t *demand) {
    if (demand->capacity_Wh <= 0) {
        return demand->peak_W;
    }
    const int64_t fall_W = taper_quotient((int64_t)demand->taper_W * demand->stored_Wh, demand->capacity_Wh);
    return taper_saturate_i32(fall_W >= demand->peak_W ? 0 : demand->peak_W - fall_W);
}

int32_t taper_battery_useful_W(const taper_demand_t *demand, uint32_t tick_ms) {
    if (!demand->active || tick_ms == 0) {
        return 0;
    }
    const int32_t most_W = taper_min_i32(taper_demand_allowed_W(demand), taper_battery_limit_W(demand));
    const int64_t need_mWs = (int64_t)demand->need_Wh * 3600 * 1000;
    if ((int64_t)most_W * tick_ms <= need_mWs) {
        return most_W; /* it is not complete by then; 64 bits are divided slowly */
    }
    return taper_saturate_i32(divide_up(need_mWs, tick_ms));
}

taper_real_t taper_battery_slope_per_h(const taper_demand_t *demand) {
    if (demand->capacity_Wh <= 0) {
        return 0;
    }
    return (taper_real_t)demand->taper_W / (taper_real_t)demand->capacity_Wh;
}

taper_real_t taper_battery_limit_now_W(const taper_demand_t *demand) {
    const taper_real_t fall_W = taper_battery_slope_per_h(demand) * (taper_real_t)demand->stored_Wh;
    return taper_real_max((taper_real_t)demand->peak_W - fall_W, 0);
}
