/* What to tell the driver: what the vehicle will have when it leaves, and which limit it is short for. */
#include "station_internal.h"
#include "taper/battery.h"

/** Energy of `power_W` in `time_s`, >= 0. */
static int32_t energy_Wh(int64_t power_W, int64_t time_s) {
    return time_s <= 0 ? 0 : taper_saturate_i32(power_W * time_s / 3600);
}

/** Seconds since a plan was made, in the world's time. */
static int32_t age_s(const taper_station_t *station, const taper_prospect_t *prospect) {
    return (int32_t)(taper_elapsed_ms(station->snapshot.now_ms, prospect->made_ms) / 1000u);
}

/** By the plan: what it gives within the horizon, and then as much an hour as on the average of it. */
static int32_t planned_Wh(const taper_station_t *station, uint8_t i) {
    const taper_prospect_t *prospect = &station->prospect[i];
    const int32_t horizon_s = (int32_t)station->options.config->steps * station->options.config->step_s;
    const int32_t stay_s = station->snapshot.demand[i].departs_in_s + age_s(station, prospect);
    const int64_t beyond_s = taper_max_i32(stay_s - horizon_s, 0);
    const int32_t charged_Wh = taper_max_i32(prospect->need_Wh - station->snapshot.demand[i].need_Wh, 0);
    return taper_saturate_i32(prospect->planned_Wh + prospect->planned_Wh * beyond_s / horizon_s -
                              charged_Wh);
}

/** Without a plan: its present power for as long as it stays. */
static int32_t persisting_Wh(const taper_station_t *station, uint8_t i) {
    const taper_demand_t *demand = &station->snapshot.demand[i];
    const int64_t offered_W = (int64_t)station->target.current_mA[i] * demand->W_per_A / 1000;
    const int32_t power_W = taper_min_i32(taper_saturate_i32(offered_W), taper_battery_limit_W(demand));
    return energy_Wh(power_W, demand->departs_in_s);
}

/** What it still gets before it leaves. */
static int32_t prospect_Wh(const taper_station_t *station, uint8_t i) {
    const taper_demand_t *demand = &station->snapshot.demand[i];
    const bool planned = station->supervisor.mode == TAPER_MODE_PLAN && taper_station_has_plan(station) &&
                         station->plan_session[i] == demand->session;
    const int32_t gets_Wh = planned ? planned_Wh(station, i) : persisting_Wh(station, i);
    return taper_clamp_i32(gets_Wh, 0, demand->need_Wh);
}

/** The limit that it is short for: its own, if it could not be helped with all the power of the site. */
static taper_reason_t because(const taper_station_t *station, uint8_t i) {
    const taper_demand_t *demand = &station->snapshot.demand[i];
    const int32_t most_W = taper_min_i32(taper_demand_allowed_W(demand), taper_battery_limit_W(demand));
    if (energy_Wh(most_W, demand->departs_in_s) < demand->need_Wh) {
        return TAPER_REASON_DEPARTURE;
    }
    const taper_reason_t limit = taper_station_binding_limit(station, i);
    return limit == TAPER_REASON_PLANNED ? TAPER_REASON_SITE_LIMIT : limit; /* of a later step */
}

static void tell_prospect(const taper_station_t *station, uint8_t i, taper_outlook_t *outlook) {
    const taper_demand_t *demand = &station->snapshot.demand[i];
    const int32_t gets_Wh = prospect_Wh(station, i);
    outlook->short_Wh = demand->need_Wh - gets_Wh;
    outlook->because = outlook->short_Wh > 0 ? (uint8_t)because(station, i) : 0;
    if (demand->capacity_Wh > 0 && demand->stored_Wh > 0) {
        const int64_t stored_Wh = (int64_t)demand->stored_Wh + gets_Wh;
        outlook->soc_at_departure_permille =
            taper_min_i32((int32_t)(stored_Wh * 1000 / demand->capacity_Wh), 1000);
    }
}

taper_outlook_t taper_station_outlook(const taper_station_t *station, uint8_t connector) {
    const taper_demand_t *demand = &station->snapshot.demand[connector];
    const taper_waiting_t waiting = taper_allocator_waiting(&station->allocator, connector);
    taper_outlook_t outlook = {
        .reason = (uint8_t)taper_station_reason(station, connector),
        .waiting_place = waiting.place,
        .waiting_of = waiting.of,
        .soc_at_departure_permille = TAPER_ABSENT,
        .short_Wh = TAPER_ABSENT,
    };
    if (demand->active) {
        outlook.soc_estimated = demand->soc_estimated;
        outlook.by_energy = demand->capacity_Wh == 0 || demand->stored_Wh == 0;
        outlook.departure_passed = demand->departs_in_s <= 0;
        outlook.no_clock = !station->sessions.clock_heard.heard;
        tell_prospect(station, connector, &outlook);
    }
    return outlook;
}
