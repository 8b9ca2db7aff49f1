/* Why a connector has the current that it has: what people ask first. */
#include <string.h>

#include "station_internal.h"
#include "taper/battery.h"

static void add_connector(taper_station_t *station, uint8_t i) {
    const taper_station_config_t *config = station->options.config;
    const taper_rows_t *rows = &station->rows;
    for (uint8_t k = config->connectors[i].group; k != TAPER_NO_GROUP; k = config->groups[k].parent) {
        for (unsigned row = 0; row < rows->count; row++) {
            station->row_sum[k][row] += (int64_t)station->target.current_mA[i] * rows->weight[i][row];
        }
    }
}

void taper_station_sum_rows(taper_station_t *station) {
    memset(station->row_sum, 0, sizeof station->row_sum);
    for (uint8_t i = 0; i < station->options.config->connector_count; i++) {
        if (station->target.current_mA[i] > 0) {
            add_connector(station, i);
        }
    }
}

/** Whether a row leaves less than a step of the wire for a connector. */
static bool is_full(const taper_station_t *station, uint8_t k, unsigned row, uint8_t i) {
    const int32_t limit = station->rows.limit[k][row];
    const int32_t weight = station->rows.weight[i][row];
    const int64_t sum = station->row_sum[k][row];
    const int64_t step = (int64_t)TAPER_CURRENT_STEP_mA * weight;
    const int64_t load = row < station->rows.sums || weight > 0 ? sum + step : -(sum + step);
    return limit != TAPER_NO_LIMIT && weight != 0 && load > (int64_t)limit * 1000;
}

/** What a full row is called. */
static taper_reason_t name_of(const taper_station_t *station, uint8_t k, taper_row_kind_t kind) {
    if (kind >= TAPER_ROW_SUMS) {
        return TAPER_REASON_IMBALANCE_LIMIT;
    }
    if (kind != TAPER_ROW_POWER) {
        return TAPER_REASON_PHASE_LIMIT;
    }
    if (k != 0) {
        return TAPER_REASON_FEEDER_LIMIT;
    }
    return station->limit_now.source == TAPER_LIMIT_FAILSAFE ? TAPER_REASON_FAILSAFE_LIMIT
                                                             : TAPER_REASON_SITE_LIMIT;
}

taper_reason_t taper_station_binding_limit(const taper_station_t *station, uint8_t i) {
    const taper_station_config_t *config = station->options.config;
    if (station->limit_now.supply.site_W <= 0) {
        return station->limit_now.source == TAPER_LIMIT_FAILSAFE ? TAPER_REASON_FAILSAFE_LIMIT
                                                                 : TAPER_REASON_GRID_PAUSE;
    }
    taper_reason_t found = TAPER_REASON_PLANNED;
    for (uint8_t k = config->connectors[i].group; k != TAPER_NO_GROUP; k = config->groups[k].parent) {
        for (unsigned row = station->rows.count; row-- > 0;) { /* the site's power last: it is told first */
            if (is_full(station, k, row, i)) {
                found = name_of(station, k, (taper_row_kind_t)station->rows.kind[row]);
            }
        }
    }
    return found;
}

/** It has its target, and nothing of its own keeps it from more. */
static taper_reason_t reason_of_target(const taper_station_t *station, uint8_t i) {
    const taper_waiting_t waiting = taper_allocator_waiting(&station->allocator, i);
    const taper_reason_t limit = taper_station_binding_limit(station, i);
    if (limit == TAPER_REASON_GRID_PAUSE) {
        return limit;
    }
    if (station->target.current_mA[i] == 0 && waiting.place > 0) {
        return TAPER_REASON_WAITING;
    }
    const bool later = station->target.current_mA[i] == 0 && station->supervisor.mode == TAPER_MODE_PLAN &&
                       station->proposal.wish_W[i] <= 0;
    return later ? TAPER_REASON_PLANNED_LATER : limit;
}

/** For a vehicle that wants energy. */
static taper_reason_t reason_of_current(const taper_station_t *station, uint8_t i) {
    const taper_demand_t *demand = &station->snapshot.demand[i];
    const int32_t target_mA = station->target.current_mA[i];
    const int32_t useful_W = taper_battery_useful_W(demand, station->options.config->tick_ms);
    if (station->shaped.current_mA[i] < target_mA) {
        return TAPER_REASON_RAMP;
    }
    if (station->setpoints.current_mA[i] < target_mA) {
        return TAPER_REASON_HAND_OVER;
    }
    if (target_mA + TAPER_CURRENT_STEP_mA > station->options.config->connectors[i].max_mA) {
        return TAPER_REASON_CONNECTOR_LIMIT;
    }
    const bool all =
        (int64_t)(target_mA + TAPER_CURRENT_STEP_mA) * demand->W_per_A > (int64_t)useful_W * 1000 ||
        target_mA + TAPER_CURRENT_STEP_mA > demand->max_mA;
    return target_mA > 0 && all ? TAPER_REASON_VEHICLE_LIMIT : reason_of_target(station, i);
}

/** What its vehicle did to be given nothing, or PLANNED. */
static taper_reason_t reason_of_draw(const taper_station_t *station, uint8_t i) {
    switch (station->draw[i].state) {
    case TAPER_DRAW_OVER: return TAPER_REASON_OVER_DRAW;
    case TAPER_DRAW_LOCKED: return TAPER_REASON_LOCKED_OUT;
    case TAPER_DRAW_NORMAL:
    default: return TAPER_REASON_PLANNED;
    }
}

taper_reason_t taper_station_reason(const taper_station_t *station, uint8_t connector) {
    const taper_reason_t draw = reason_of_draw(station, connector);
    const taper_reason_t idle =
        taper_session_idle_reason(&station->sessions, connector, station->events.now_ms);
    if (idle != TAPER_REASON_PLANNED && (idle == TAPER_REASON_OFFLINE || draw == TAPER_REASON_PLANNED)) {
        return idle;
    }
    if (draw != TAPER_REASON_PLANNED) {
        return draw;
    }
    const bool nobody = station->stopped || station->rival_heard ||
                        station->supervisor.mode == TAPER_MODE_INIT ||
                        station->bus[station->options.config->connectors[connector].bus].silent;
    if (nobody || !station->snapshot.demand[connector].active) {
        return TAPER_REASON_STATION;
    }
    return reason_of_current(station, connector);
}
