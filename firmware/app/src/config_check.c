#include "taper/config_check.h"

#include "taper/rows.h"

/* The ranges that the use of each quantity was thought through for; codegen/station_model.py has the same or narrower. */
#define MOST_LIMIT_W               3276700  /* SITE_LIMIT: 15 bits of 100 W */
#define MOST_LIMIT_mA              20000000 /* sums of weights and currents stay far within 64 bits */
#define MOST_CURRENT_mA            409400   /* EVSE_STATUS: 12 bits of 0.1 A */
#define LEAST_AC_mA                6000     /* IEC 61851-1 */
#define MOST_VOLTAGE_mV            2000000
#define LEAST_SITE_mV              50000
#define MOST_TICK_ms               3600000u /* of the world: a second on the bus may be an hour */
#define MOST_SWITCH_ms             86400000u
#define MOST_CHANGE_ms             600000u
#define MOST_REACTION_ms           60000u
#define FULL_permille              1000
#define MOST_LAMBDA_milli_per_kWh2 10000000
#define MOST_SUPPLY_permille       100000 /* of a phase's current, for 1 A of setpoint */

static bool within(int32_t value, int32_t least, int32_t most) {
    return value >= least && value <= most;
}

static bool sizes_fit(const taper_station_config_t *config) {
    return within(config->connector_count, 1, TAPER_MAX_CONNECTORS) &&
           within(config->group_count, 1, TAPER_MAX_GROUPS) && within(config->steps, 2, TAPER_MAX_STEPS);
}

static bool times_are_sound(const taper_station_config_t *config) {
    return within(config->step_s, 60, 3600) && config->tick_ms >= 1 && config->tick_ms <= MOST_TICK_ms &&
           config->min_on_ms <= config->turn_ms && config->turn_ms <= MOST_SWITCH_ms &&
           config->min_off_ms <= MOST_SWITCH_ms && config->change_ms <= MOST_CHANGE_ms;
}

static bool movement_is_sound(const taper_station_config_t *config) {
    return within(config->ramp_mA_per_s, 0, MOST_CURRENT_mA) &&
           within(config->deadband_mA, 0, MOST_CURRENT_mA) &&
           within(config->price_weight_permille, 0, FULL_permille);
}

static bool planning_is_sound(const taper_station_config_t *config) {
    const taper_planning_t *planning = &config->planning;
    return planning->objective <= TAPER_OBJECTIVE_LOG_UTILITY && planning->horizon_steps != 1 &&
           planning->horizon_steps <= config->steps &&
           planning->outer_iterations <= TAPER_MAX_OUTER_ITERATIONS &&
           planning->taper_lines <= TAPER_MAX_TAPER_LINES &&
           within(planning->lambda_milli_per_kWh2, 0, MOST_LAMBDA_milli_per_kWh2);
}

static bool limits_are_sound(const taper_group_config_t *group) {
    return within(group->limit_W, 0, MOST_LIMIT_W) && within(group->limit_mA, 0, MOST_LIMIT_mA) &&
           within(group->delta_mA, 0, MOST_LIMIT_mA) && within(group->imbalance_mA, 0, MOST_LIMIT_mA) &&
           (group->limit_W > 0 || group->limit_mA > 0);
}

/** A parent before its children: one look at each parent shows that there is no cycle. */
static bool tree_is_sound(const taper_station_config_t *config) {
    for (uint8_t k = 0; k < config->group_count; k++) {
        const taper_group_config_t *group = &config->groups[k];
        const bool rooted = k == 0 ? group->parent == TAPER_NO_GROUP : group->parent < k;
        if (!rooted || !limits_are_sound(group)) {
            return false;
        }
    }
    return true;
}

/** Where a phase is limited, the part of other load on it must be known; on a delta side it never is. */
static bool other_load_is_sound(const taper_station_config_t *config) {
    const taper_group_config_t *site = &config->groups[0];
    const bool told = config->other_load_mA > 0 || site->limit_mA == 0;
    return within(config->other_load_W, 0, MOST_LIMIT_W) && within(config->other_load_mA, 0, MOST_LIMIT_mA) &&
           (config->other_load_W == 0 || (told && site->delta_mA == 0));
}

static bool site_is_sound(const taper_station_config_t *config) {
    const int32_t limit_W = config->groups[0].limit_W;
    return limit_W > 0 && within(config->failsafe_W, 0, limit_W) &&
           within(config->site_voltage_mV, LEAST_SITE_mV, MOST_VOLTAGE_mV) && other_load_is_sound(config);
}

static bool is_on_the_wire(int32_t current_mA) {
    return within(current_mA, 0, MOST_CURRENT_mA) && current_mA % TAPER_CURRENT_STEP_mA == 0;
}

static bool currents_are_sound(const taper_connector_config_t *connector) {
    const int32_t min_mA = connector->min_mA;
    const int32_t fallback_mA = connector->fallback_mA;
    return is_on_the_wire(min_mA) && is_on_the_wire(connector->max_mA) && is_on_the_wire(fallback_mA) &&
           connector->max_mA > 0 && min_mA <= connector->max_mA &&
           (connector->is_dc || min_mA == 0 || min_mA >= LEAST_AC_mA) &&
           (fallback_mA == 0 || within(fallback_mA, min_mA, connector->max_mA));
}

static bool wiring_is_sound(const taper_connector_config_t *connector) {
    const bool one_phase = connector->phases == 1;
    const int32_t efficiency_permille = connector->efficiency_permille;
    return within(connector->voltage_mV, 1, MOST_VOLTAGE_mV) &&
           within(connector->rotation, TAPER_ROTATION_123, TAPER_ROTATION_321) &&
           (one_phase || (connector->phases == 3 && !connector->is_dc)) &&
           (!connector->line_to_line || (one_phase && !connector->is_dc)) &&
           within(efficiency_permille, connector->is_dc ? 1 : FULL_permille, FULL_permille);
}

static bool place_is_sound(const taper_station_config_t *config, const taper_connector_config_t *connector) {
    return connector->group < config->group_count && connector->bus < TAPER_MAX_BUSES &&
           within(connector->node, 1, TAPER_NODES_PER_BUS);
}

static bool connector_is_sound(const taper_station_config_t *config, uint8_t i) {
    const taper_connector_config_t *connector = &config->connectors[i];
    return currents_are_sound(connector) && wiring_is_sound(connector) && place_is_sound(config, connector) &&
           connector->reaction_ms <= MOST_REACTION_ms &&
           taper_booking_nominal(config, i).permille <= MOST_SUPPLY_permille;
}

static bool address_is_unique(const taper_station_config_t *config, uint8_t i) {
    for (uint8_t other = 0; other < i; other++) {
        if (config->connectors[other].bus == config->connectors[i].bus &&
            config->connectors[other].node == config->connectors[i].node) {
            return false;
        }
    }
    return true;
}

static bool connectors_are_sound(const taper_station_config_t *config) {
    bool line_to_line = false;
    for (uint8_t i = 0; i < config->connector_count; i++) {
        if (!connector_is_sound(config, i) || !address_is_unique(config, i)) {
            return false;
        }
        line_to_line = line_to_line || config->connectors[i].line_to_line;
    }
    return line_to_line == config->line_to_line;
}

taper_status_t taper_config_check(const taper_station_config_t *config) {
    const bool sound = sizes_fit(config) && times_are_sound(config) && movement_is_sound(config) &&
                       planning_is_sound(config) && tree_is_sound(config) && site_is_sound(config) &&
                       connectors_are_sound(config);
    return sound ? TAPER_OK : TAPER_ERR_CONFIG;
}
