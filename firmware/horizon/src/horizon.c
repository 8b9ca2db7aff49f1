#include "taper/horizon.h"

#include <tgmath.h>

#include "sums.h"
#include "taper/battery.h"
#include "taper/battery_slope.h"
#include "taper/real_math.h"
#include "worth.h"

/** What one connector brings into the problem, per unit. */
typedef struct {
    taper_real_t rate;  /* limit of connector and vehicle */
    taper_real_t taper; /* limit at the present SOC */
    taper_real_t slope; /* a_i per step */
    taper_real_t need;  /* energy */
    int32_t departs_in_s;
} chain_t;

static taper_real_t discount_to(unsigned power) {
    taper_real_t value = 1;
    for (unsigned k = 0; k < power; k++) {
        value *= TAPER_DISCOUNT;
    }
    return value;
}

taper_real_t taper_horizon_hessian_diagonal(uint8_t steps, uint8_t t) {
    const taper_real_t own = discount_to((unsigned)t + 1);
    const taper_real_t next = t + 1 < steps ? own * TAPER_DISCOUNT : 0;
    return TAPER_CURVATURE * (own + next);
}

taper_real_t taper_horizon_hessian_neighbour(uint8_t t) {
    return -TAPER_CURVATURE * discount_to((unsigned)t + 1);
}

static taper_real_t strongest_connector_W(const taper_station_config_t *config) {
    int64_t strongest_mW = 1;
    for (uint8_t i = 0; i < config->connector_count; i++) {
        const taper_connector_config_t *connector = &config->connectors[i];
        const int64_t power_mW =
            (int64_t)connector->max_mA * connector->voltage_mV / 1000 * connector->phases;
        strongest_mW = power_mW > strongest_mW ? power_mW : strongest_mW;
    }
    return (taper_real_t)strongest_mW / 1000;
}

static chain_t chain_of(const taper_horizon_t *horizon, const taper_demand_t *demand) {
    const uint16_t step_s = horizon->config->step_s;
    const taper_real_t step_h = (taper_real_t)step_s / 3600;
    const taper_real_t slope = taper_battery_slope_per_h(demand) * step_h;
    return (chain_t){
        .rate = (taper_real_t)taper_demand_allowed_W(demand) / horizon->base_W,
        .taper = (taper_real_t)taper_battery_limit_W(demand) / horizon->base_W,
        .slope = slope < 1 ? slope
                           : 1, /* a battery that fills within one step: the taper row then bounds v(i,t) */
        .need = (taper_real_t)demand->need_Wh / (horizon->base_W * step_h),
        .departs_in_s = demand->departs_in_s,
    };
}

static void write_idle(taper_horizon_t *horizon, uint8_t i) {
    const uint8_t steps = horizon->config->steps;
    const size_t taper_row = taper_first_taper_row(horizon->config) + (size_t)i * (steps - 1U);
    for (uint8_t t = 0; t < steps; t++) {
        const size_t v = (size_t)i * steps + t;
        horizon->linear[v] = 0;
        horizon->lower[v] = 0;
        horizon->upper[v] = 0;
        if (t > 0) {
            horizon->lower[taper_row + t - 1] = -TAPER_REAL_UNBOUNDED;
            horizon->upper[taper_row + t - 1] = TAPER_REAL_UNBOUNDED;
        }
    }
    horizon->taper_keep[i] = 1;
}

static uint8_t planned_steps(const taper_station_config_t *config) {
    return config->planning.horizon_steps > 0 ? config->planning.horizon_steps : config->steps;
}

/** Share of step t in which the vehicle is there, as far as it is planned. */
static taper_real_t planned_presence(const taper_station_config_t *config, const chain_t *chain, uint8_t t) {
    return t < planned_steps(config) ? taper_presence(chain->departs_in_s, config->step_s, t) : 0;
}

/** With the log utility, what cannot be told from nothing is none: its logarithm would outweigh all others. */
static taper_real_t worth_planning(const chain_t *chain, taper_real_t rate) {
    const taper_real_t most = taper_real_min(rate, chain->taper);
    return most > TAPER_LEAST_POWER ? most : 0;
}

static void write_chain(taper_horizon_t *horizon, uint8_t i, const chain_t *chain,
                        const int32_t *site_limit_W) {
    const uint8_t steps = horizon->config->steps;
    const size_t taper_row = taper_first_taper_row(horizon->config) + (size_t)i * (steps - 1U);
    for (uint8_t t = 0; t < steps; t++) {
        const size_t v = (size_t)i * steps + t;
        const taper_real_t there = planned_presence(horizon->config, chain, t);
        horizon->lower[v] = 0;
        horizon->upper[v] =
            taper_real_min(chain->rate * there, (taper_real_t)site_limit_W[t] / horizon->base_W);
        if (horizon->log_utility) {
            horizon->upper[v] = worth_planning(chain, horizon->upper[v]);
        }
        if (t == 0) {
            horizon->upper[v] = taper_real_min(horizon->upper[v], chain->taper);
            continue;
        }
        const bool tapers = chain->slope > 0 || chain->taper < chain->rate;
        horizon->lower[taper_row + t - 1] = -TAPER_REAL_UNBOUNDED;
        horizon->upper[taper_row + t - 1] =
            tapers && there > 0 ? chain->taper * horizon->taper_scale : TAPER_REAL_UNBOUNDED;
    }
    horizon->taper_keep[i] = 1 - chain->slope;
}

static void write_connector(taper_horizon_t *horizon, uint8_t i, const taper_demand_t *demand,
                            const int32_t *site_limit_W) {
    const size_t target = taper_first_target_row(horizon->config) + i;
    horizon->lower[target] = -TAPER_REAL_UNBOUNDED;
    horizon->upper[target] = TAPER_REAL_UNBOUNDED;
    if (!demand->active) {
        write_idle(horizon, i);
        return;
    }
    chain_t chain = chain_of(horizon, demand);
    chain.rate = taper_real_min(chain.rate, taper_sums_most(horizon, i));
    write_chain(horizon, i, &chain, site_limit_W);
    horizon->upper[target] = chain.need * horizon->target_scale;
}

static void state_objective(taper_horizon_t *horizon) {
    const taper_planning_t *planning = &horizon->config->planning;
    const taper_real_t unit_kWh = horizon->base_W / 1000 * (taper_real_t)horizon->config->step_s / 3600;
    horizon->log_utility = planning->objective == TAPER_OBJECTIVE_LOG_UTILITY;
    horizon->taper_scale = horizon->log_utility ? TAPER_LOG_TAPER_SCALE : TAPER_TAPER_SCALE;
    horizon->target_scale = horizon->log_utility ? TAPER_LOG_TARGET_SCALE : TAPER_TARGET_SCALE;
    horizon->missing_weight = (taper_real_t)planning->lambda_milli_per_kWh2 / 1000 * unit_kWh * unit_kWh;
}

void taper_horizon_shape(taper_horizon_t *horizon, const taper_station_config_t *config) {
    horizon->config = config;
    horizon->base_W = strongest_connector_W(config);
    state_objective(horizon);
    taper_sums_list(horizon);
    for (uint8_t i = 0; i < config->connector_count; i++) {
        taper_sums_weigh(horizon, i, NULL);
        horizon->taper_keep[i] = 1;
        horizon->unit[i] = 1;
    }
}

void taper_horizon_build(taper_horizon_t *horizon, const taper_station_config_t *config,
                         const taper_snapshot_t *snapshot, const taper_course_t *course) {
    taper_horizon_shape(horizon, config);
    taper_sums_bound(horizon, course);
    const taper_worth_t worth = taper_worth_of_course(config, snapshot, course);
    for (uint8_t i = 0; i < config->connector_count; i++) {
        horizon->waits[i] = !horizon->log_utility && snapshot->demand[i].active &&
                            taper_worth_waits(&worth, &snapshot->demand[i]);
        if (snapshot->demand[i].active) {
            const taper_real_t weight = taper_worth_weight(&worth, &snapshot->demand[i]);
            taper_worth_write(&worth, weight, horizon->linear + (size_t)i * config->steps);
            taper_sums_weigh(horizon, i, snapshot);
        }
        write_connector(horizon, i, &snapshot->demand[i], course->limit_W);
    }
}
