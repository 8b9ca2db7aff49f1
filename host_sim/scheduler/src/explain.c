/* Why a connector has its current: the first that people ask. */
#include "scheduler_internal.h"
#include "taper/battery.h"

/** Whether `i` could not have the next higher current that it is able to give. */
static bool is_at_a_limit(const taper_scheduler_t *scheduler, uint8_t i, int32_t next_mA) {
    taper_setpoints_t more = scheduler->setpoints;
    more.current_mA[i] = next_mA;
    return !scheduler_guard_passes(scheduler, &more);
}

taper_scheduler_why_t scheduler_why(const taper_scheduler_t *scheduler, uint8_t i) {
    const taper_demand_t *demand = &scheduler->snapshot.demand[i];
    const int32_t current_mA = scheduler->setpoints.current_mA[i];
    const int32_t next_mA = scheduler_next_mA(scheduler, i, current_mA);
    if (!demand->active) {
        return TAPER_SCHEDULER_NO_VEHICLE;
    }
    if (next_mA == 0) {
        return TAPER_SCHEDULER_CONNECTOR_LIMIT;
    }
    const int64_t useful_W = taper_battery_useful_W(demand, scheduler->period_ms);
    if (next_mA > demand->max_mA || (int64_t)next_mA * demand->W_per_A > useful_W * 1000) {
        return TAPER_SCHEDULER_VEHICLE_LIMIT;
    }
    if (current_mA == 0 && taper_allocator_waiting(&scheduler->allocator, i).place > 0) {
        return TAPER_SCHEDULER_WAITING;
    }
    return is_at_a_limit(scheduler, i, next_mA) ? TAPER_SCHEDULER_LIMIT : TAPER_SCHEDULER_PLANNED;
}
