/* What a simulator knows of a vehicle -> what the firmware's layers look at. */
#include <math.h>

#include "scheduler_internal.h"
#include "taper/battery.h"

#define MOST_AWAY_s 1e9

static bool vehicle_is_sound(const taper_scheduler_vehicle_t *vehicle) {
    return is_within(vehicle->need_kWh, 0, 1000) && is_within(vehicle->departs_s, -1e12, 1e12) &&
           is_within(vehicle->max_kW, 0, 2000) && is_within(vehicle->max_A, 0, 409.4) &&
           is_within(vehicle->capacity_kWh, 0, 2000) &&
           is_within(vehicle->stored_kWh, 0, vehicle->capacity_kWh) &&
           is_within(vehicle->peak_kW, 0, 20000) && is_within(vehicle->taper_kW, 0, vehicle->peak_kW);
}

int32_t taper_scheduler_set_vehicle(taper_scheduler_t *scheduler, int32_t connector,
                                    const taper_scheduler_vehicle_t *vehicle) {
    if (connector < 0 || connector >= scheduler->config.connector_count ||
        (vehicle != NULL && !vehicle_is_sound(vehicle))) {
        return TAPER_SCHEDULER_ERR_ARGUMENT;
    }
    const bool is_new = vehicle != NULL && (!scheduler->has_vehicle[connector] ||
                                            vehicle->session != scheduler->vehicle[connector].session);
    if (is_new) { /* 1..255, then from 1 again */
        scheduler->number[connector] = (uint8_t)(scheduler->number[connector] % UINT8_MAX + 1);
    }
    scheduler->has_vehicle[connector] = vehicle != NULL;
    if (vehicle != NULL) {
        scheduler->vehicle[connector] = *vehicle;
    }
    return TAPER_SCHEDULER_OK;
}

static int32_t up(double value) {
    return (int32_t)ceil(value - 1e-6);
}

/** Power of 1 A of setpoint, at the vehicle. */
static int32_t W_per_A(const taper_connector_config_t *connector) {
    return connector->voltage_mV / 1000 * connector->phases;
}

/** The least current of connector `i` that is at least `wanted_mA`, or its greatest. */
static int32_t rate_above_mA(const taper_scheduler_t *scheduler, uint8_t i, int32_t wanted_mA) {
    const taper_connector_config_t *connector = &scheduler->connector[i];
    if (scheduler->rates[i].count == 0) {
        return taper_clamp_i32(wanted_mA, connector->min_mA, connector->max_mA);
    }
    const int32_t rate_mA = scheduler_next_mA(scheduler, i, wanted_mA - 1);
    return rate_mA > 0 ? rate_mA : connector->max_mA;
}

/** Most current that is of use, rounded up to one that can be given: a vehicle takes what it can, whatever it is offered. */
static int32_t most_mA(const taper_scheduler_t *scheduler, uint8_t i) {
    const taper_connector_config_t *connector = &scheduler->connector[i];
    const taper_scheduler_vehicle_t *vehicle = &scheduler->vehicle[i];
    double most_A = connector->max_mA / 1000.0;
    if (vehicle->max_A > 0) {
        most_A = fmin(most_A, vehicle->max_A);
    }
    if (vehicle->max_kW > 0) {
        most_A = fmin(most_A, vehicle->max_kW * 1000 / W_per_A(connector));
    }
    return rate_above_mA(scheduler, i, up(most_A * 1000 / TAPER_CURRENT_STEP_mA) * TAPER_CURRENT_STEP_mA);
}

static int32_t departs_in_s(const taper_scheduler_vehicle_t *vehicle, double now_s) {
    return (int32_t)fmax(fmin(floor(vehicle->departs_s - now_s), MOST_AWAY_s), -MOST_AWAY_s);
}

/** It would get more than it wants, because it has to be given the least current for a whole period. */
static bool least_is_too_much(const taper_scheduler_t *scheduler, const taper_demand_t *demand) {
    const int64_t least_mW = (int64_t)demand->min_mA * demand->W_per_A;
    const int64_t takes_mW = (int64_t)taper_battery_limit_W(demand) * 1000;
    const int64_t drawn_mW = takes_mW < least_mW ? takes_mW : least_mW;
    return demand->min_mA > 0 && drawn_mW * scheduler->options.period_s > (int64_t)demand->need_Wh * 3600000;
}

/** The part of its demand that is the same with and without a battery that is known. */
static taper_demand_t demand_of(const taper_scheduler_t *scheduler, uint8_t i, double now_s) {
    const taper_connector_config_t *connector = &scheduler->connector[i];
    const taper_scheduler_vehicle_t *vehicle = &scheduler->vehicle[i];
    taper_demand_t demand = {
        .active = vehicle->need_kWh > 0,
        .session = scheduler->number[i],
        .conductors = connector->phases,
        .need_Wh = up(vehicle->need_kWh * 1000),
        .max_mA = most_mA(scheduler, i),
        .min_mA = connector->min_mA,
        .W_per_A = W_per_A(connector),
        .departs_in_s = departs_in_s(vehicle, now_s),
        .booking = taper_booking_nominal(&scheduler->config, i),
    };
    demand.peak_W = taper_demand_allowed_W(&demand);
    if (vehicle->max_kW > 0) {
        demand.peak_W = taper_min_i32(demand.peak_W, up(vehicle->max_kW * 1000));
    }
    return demand;
}

static void add_taper(const taper_scheduler_vehicle_t *vehicle, taper_demand_t *demand) {
    if (vehicle->capacity_kWh > 0 && vehicle->peak_kW > 0) {
        demand->capacity_Wh = up(vehicle->capacity_kWh * 1000);
        demand->stored_Wh = (int32_t)floor(vehicle->stored_kWh * 1000);
        demand->peak_W = up(vehicle->peak_kW * 1000);
        demand->taper_W = taper_min_i32(up(vehicle->taper_kW * 1000), demand->peak_W);
    }
}

void scheduler_take_snapshot(taper_scheduler_t *scheduler, double now_s) {
    scheduler->snapshot.now_ms = scheduler_ms(now_s);
    scheduler->snapshot.count = scheduler->config.connector_count;
    for (uint8_t i = 0; i < scheduler->snapshot.count; i++) {
        taper_demand_t *demand = &scheduler->snapshot.demand[i];
        *demand = (taper_demand_t){.booking = taper_booking_nominal(&scheduler->config, i)};
        if (scheduler->has_vehicle[i]) {
            *demand = demand_of(scheduler, i, now_s);
            add_taper(&scheduler->vehicle[i], demand);
            demand->active = demand->active && !least_is_too_much(scheduler, demand);
        }
    }
}
