/* Why a connector has the current that it has: what people ask first. */
#include "station_internal.h"
#include "taper/battery.h"
#include "taper/rows.h"

/** Room below this is none: a step of the wire on three phases. */
static bool is_full(int64_t limit_mW, int64_t sum_mW, int32_t W_per_A) {
    return sum_mW + (int64_t)TAPER_CURRENT_STEP_mA * W_per_A > limit_mW;
}

/** What all connectors below a group have been given. */
static int64_t group_sum_mW(const taper_station_t *station, uint8_t group) {
    const taper_station_config_t *config = station->options.config;
    int64_t sum_mW = 0;
    for (uint8_t i = 0; i < config->connector_count; i++) {
        uint8_t k = config->connectors[i].group;
        while (k != group && k != TAPER_NO_GROUP) {
            k = config->groups[k].parent;
        }
        if (k == group && station->snapshot.demand[i].active) {
            sum_mW += (int64_t)station->target.current_mA[i] *
                      taper_booking_now(station->options.config, &station->snapshot, i).W_per_A;
        }
    }
    return sum_mW;
}

/** The limit that leaves no more for a connector, or PLANNED. */
static taper_reason_t binding_limit(const taper_station_t *station, uint8_t i) {
    const taper_station_config_t *config = station->options.config;
    const int32_t W_per_A = taper_booking_now(station->options.config, &station->snapshot, i).W_per_A;
    if (is_full((int64_t)station->limit_now.supply.site_W * 1000, group_sum_mW(station, 0), W_per_A)) {
        return TAPER_REASON_SITE_LIMIT;
    }
    for (uint8_t k = config->connectors[i].group; k != TAPER_NO_GROUP; k = config->groups[k].parent) {
        if (is_full((int64_t)config->groups[k].limit_W * 1000, group_sum_mW(station, k), W_per_A)) {
            return TAPER_REASON_FEEDER_LIMIT;
        }
    }
    return TAPER_REASON_PLANNED;
}

/** For a vehicle that wants energy. */
static taper_reason_t reason_of_current(const taper_station_t *station, uint8_t i) {
    const taper_demand_t *demand = &station->snapshot.demand[i];
    const int32_t target_mA = station->target.current_mA[i];
    const int32_t useful_W = taper_battery_useful_W(demand, station->options.config->tick_ms);
    if (station->setpoints.current_mA[i] < target_mA) {
        return TAPER_REASON_HAND_OVER;
    }
    if (target_mA + TAPER_CURRENT_STEP_mA > station->options.config->connectors[i].max_mA) {
        return TAPER_REASON_CONNECTOR_LIMIT;
    }
    if (target_mA > 0 &&
        (int64_t)(target_mA + TAPER_CURRENT_STEP_mA) * demand->W_per_A > (int64_t)useful_W * 1000) {
        return TAPER_REASON_VEHICLE_LIMIT;
    }
    const taper_reason_t limit = binding_limit(station, i);
    return target_mA == 0 && demand->min_mA > 0 && station->limit_now.supply.site_W > 0 ? TAPER_REASON_WAITING
                                                                                        : limit;
}

taper_reason_t taper_station_reason(const taper_station_t *station, uint8_t connector) {
    const taper_reason_t idle =
        taper_session_idle_reason(&station->sessions, connector, station->events.now_ms);
    if (idle != TAPER_REASON_PLANNED) {
        return idle;
    }
    const bool nobody = station->stopped || station->rival_heard ||
                        station->supervisor.mode == TAPER_MODE_INIT ||
                        station->bus[station->options.config->connectors[connector].bus].silent;
    if (nobody || !station->snapshot.demand[connector].active) {
        return TAPER_REASON_STATION;
    }
    return reason_of_current(station, connector);
}

taper_outlook_t taper_station_outlook(const taper_station_t *station, uint8_t connector) {
    return (taper_outlook_t){.reason = (uint8_t)taper_station_reason(station, connector),
                             .soc_at_departure_permille = TAPER_ABSENT,
                             .short_Wh = TAPER_ABSENT};
}
