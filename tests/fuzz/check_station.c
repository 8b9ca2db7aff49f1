/* What the station may hold after a tick, found from its headers and from nothing that it computes itself. */
#include "check.h"

/** Departures: told ones lie up to half of 65535 minutes away; a stay that was assumed ends when it began long ago, at most
    the turn of the clock (49.7 days). */
#define LATEST_DEPARTURE_s   (65535 / 2 * 60)
#define EARLIEST_DEPARTURE_s (-(int32_t)(UINT32_MAX / 1000u))

static void check_as(taper_message_kind_t kind, const taper_message_t *message) {
    taper_message_t copy = *message;
    copy.kind = kind;
    check_message(&copy);
}

/** `seen`: bit 0 for A .. bit 4 for E. What was not received yet is zero, and zero is no capacity. */
static void check_params(const taper_ev_params_t *params, unsigned seen) {
    taper_message_t message;
    if ((seen & 0x1u) != 0) {
        message.as.ev_param_a = params->a;
        check_as(TAPER_MESSAGE_EV_PARAM_A, &message);
    }
    if ((seen & 0x2u) != 0) {
        message.as.ev_param_b = params->b;
        check_as(TAPER_MESSAGE_EV_PARAM_B, &message);
    }
    if ((seen & 0x4u) != 0) {
        message.as.ev_param_c = params->c;
        check_as(TAPER_MESSAGE_EV_PARAM_C, &message);
    }
    if ((seen & 0x8u) != 0) {
        message.as.ev_param_d = params->d;
        check_as(TAPER_MESSAGE_EV_PARAM_D, &message);
    }
    if ((seen & 0x10u) != 0) {
        message.as.ev_param_e = params->e;
        check_as(TAPER_MESSAGE_EV_PARAM_E, &message);
    }
}

static void check_session(const taper_session_t *session) {
    taper_message_t message;
    message.as.evse_status = session->status;
    check_as(TAPER_MESSAGE_EVSE_STATUS, &message);
    message.as.ev_status = session->ev;
    check_as(TAPER_MESSAGE_EV_STATUS, &message);
    message.as.evse_elec = session->elec;
    check_as(TAPER_MESSAGE_EVSE_ELEC, &message);
    message.as.evse_info = session->info;
    check_as(TAPER_MESSAGE_EVSE_INFO, &message);
    check_params(&session->received, session->param_seen);
    check_that(!session->in_session || session->vehicle_there, "session without a vehicle", 1);
    if (session->in_session) {
        check_params(&session->used, 0x1Fu);
    }
    check_that(session->session_Wh == TAPER_ABSENT ||
                   (session->session_Wh >= 0 && session->session_Wh <= 655340),
               "session_Wh", session->session_Wh);
    check_that(session->stored_Wh == TAPER_ABSENT ||
                   (session->stored_Wh >= 0 && session->stored_Wh <= session->stored_of_Wh),
               "stored_Wh", session->stored_Wh);
    check_that(session->stored_of_Wh >= 0 && session->stored_of_Wh <= TAPER_CAPACITY_MAX_Wh, "stored_of_Wh",
               session->stored_of_Wh);
    check_that(session->anchor_Wh == TAPER_ABSENT ||
                   (session->anchor_Wh >= 0 && session->anchor_Wh <= 655340),
               "anchor_Wh", session->anchor_Wh);
    check_that(session->jump_permille >= 0 && session->jump_permille <= 1000, "jump_permille",
               session->jump_permille);
    check_that(session->jump_count <= TAPER_SOC_JUMP_REPORTS, "jump_count", session->jump_count);
}

static void check_curve(const taper_limit_curve_t *curve) {
    check_that(curve->count <= TAPER_MAX_LIMIT_POINTS, "curve.count", curve->count);
    for (uint16_t k = 0; k < curve->count; k++) {
        check_that(curve->point[k].limit_W >= 0, "curve.limit_W", curve->point[k].limit_W);
        check_that(k == 0 || !taper_time_reached(curve->point[k - 1].time_ms, curve->point[k].time_ms),
                   "curve out of order at", k);
    }
}

static void check_price(const taper_price_curve_t *price) {
    check_that(price->count <= TAPER_MAX_PRICE_POINTS, "price.count", price->count);
    for (uint16_t k = 0; k < price->count; k++) {
        check_that(price->point[k].milli_per_kWh >= -32767 && price->point[k].milli_per_kWh <= 32767,
                   "price.milli_per_kWh", price->point[k].milli_per_kWh);
        check_that(k == 0 || !taper_time_reached(price->point[k - 1].time_ms, price->point[k].time_ms),
                   "price out of order at", k);
    }
}

static void check_limits(const taper_station_t *station) {
    const taper_limits_t *limits = &station->limits;
    const int32_t site_W = station->options.config->groups[0].limit_W;
    check_that(limits->gateway_W >= 0, "gateway_W", limits->gateway_W);
    check_that(limits->failsafe_W >= 0 && limits->failsafe_W <= site_W, "failsafe_W", limits->failsafe_W);
    for (unsigned k = 0; k < TAPER_CURVE_OWNERS; k++) {
        check_curve(&limits->curve[k]);
    }
    check_price(&limits->price);
    check_that(limits->flap.count <= TAPER_FLAP_LIMITS, "flap.count", limits->flap.count);
    check_that(limits->metered_W >= 0, "metered_W", limits->metered_W);
    for (unsigned phase = 0; phase < 3; phase++) {
        const int32_t phase_mA = station->limit_now.supply.phase_mA[phase];
        check_that(limits->metered_mA[phase] >= 0, "metered_mA", limits->metered_mA[phase]);
        check_that(phase_mA >= 0, "limit_now.supply.phase_mA", phase_mA);
    }
    check_that(station->limit_now.other_W >= 0, "limit_now.other_W", station->limit_now.other_W);
    check_that(station->limit_now.supply.site_W >= 0 && station->limit_now.supply.site_W <= site_W,
               "limit_now.supply.site_W", station->limit_now.supply.site_W);
}

static void check_no_demand(const taper_demand_t *demand) {
    check_that(demand->stored_Wh == 0 && demand->capacity_Wh == 0 && demand->need_Wh == 0 &&
                   demand->peak_W == 0 && demand->taper_W == 0 && demand->max_mA == 0 &&
                   demand->min_mA == 0 && demand->W_per_A == 0 && demand->booking.W_per_A > 0 &&
                   demand->booking.W_per_A <= 3 * 6554 && demand->departs_in_s == 0,
               "a demand that is not active, yet not zero or not booked", 1);
}

static void check_demand(const taper_connector_config_t *connector, const taper_demand_t *demand) {
    const bool capacity_is_sound =
        demand->capacity_Wh >= TAPER_CAPACITY_MIN_Wh && demand->capacity_Wh <= TAPER_CAPACITY_MAX_Wh;
    check_that(demand->capacity_Wh == 0 || capacity_is_sound, "demand.capacity_Wh", demand->capacity_Wh);
    check_that(demand->stored_Wh >= 0 && demand->stored_Wh <= demand->capacity_Wh, "demand.stored_Wh",
               demand->stored_Wh);
    check_that(demand->need_Wh > 0 && demand->need_Wh <= TAPER_CAPACITY_MAX_Wh, "demand.need_Wh",
               demand->need_Wh);
    check_that(demand->peak_W >= 0, "demand.peak_W", demand->peak_W);
    check_that(demand->taper_W >= 0 && demand->taper_W <= demand->peak_W, "demand.taper_W", demand->taper_W);
    check_that(demand->max_mA >= 0 && demand->max_mA <= connector->max_mA, "demand.max_mA", demand->max_mA);
    check_that(demand->min_mA >= connector->min_mA && demand->min_mA <= 127000, "demand.min_mA",
               demand->min_mA);
    check_that(demand->W_per_A > 0 && demand->W_per_A <= 3 * 6554, "demand.W_per_A", demand->W_per_A);
    check_that(demand->booking.W_per_A >= demand->W_per_A && demand->booking.W_per_A <= 3 * 6554,
               "demand.booking.W_per_A", demand->booking.W_per_A);
    check_that(demand->departs_in_s >= EARLIEST_DEPARTURE_s && demand->departs_in_s <= LATEST_DEPARTURE_s,
               "demand.departs_in_s", demand->departs_in_s);
}

static void check_current(const taper_connector_config_t *connector, const taper_demand_t *demand,
                          int32_t current_mA) {
    if (current_mA == 0) {
        return;
    }
    check_that(demand->active, "current for nobody", current_mA);
    check_that(current_mA >= connector->min_mA && current_mA >= demand->min_mA, "current below the minimum",
               current_mA);
    check_that(current_mA <= connector->max_mA && current_mA <= demand->max_mA, "current above the maximum",
               current_mA);
    check_that(current_mA % TAPER_CURRENT_STEP_mA == 0, "current between two steps", current_mA);
}

/** Sums over every connector below a group, by climbing from each of them. */
static void check_groups(const taper_station_t *station, const taper_setpoints_t *setpoints) {
    const taper_station_config_t *config = station->options.config;
    int64_t sum_mW[TAPER_MAX_GROUPS] = {0};
    for (uint8_t i = 0; i < config->connector_count; i++) {
        const int64_t draw_mW =
            (int64_t)setpoints->current_mA[i] * station->snapshot.demand[i].booking.W_per_A;
        for (uint8_t k = config->connectors[i].group; k != TAPER_NO_GROUP; k = config->groups[k].parent) {
            sum_mW[k] += draw_mW;
        }
    }
    for (uint8_t k = 0; k < config->group_count; k++) {
        check_that(sum_mW[k] <= (int64_t)config->groups[k].limit_W * 1000, "power of a group [mW]",
                   sum_mW[k]);
    }
    check_that(sum_mW[0] <= (int64_t)station->limit_now.supply.site_W * 1000, "power of the site [mW]",
               sum_mW[0]);
}

/** What a connector draws without a controller: no more than with one. */
static void check_fallback(const taper_connector_config_t *connector, int32_t fallback_mA,
                           int32_t current_mA) {
    check_that(fallback_mA >= 0 && fallback_mA <= current_mA, "fallback above the setpoint", fallback_mA);
    check_that(fallback_mA <= connector->fallback_mA, "fallback above the described one", fallback_mA);
    check_that(fallback_mA % TAPER_FALLBACK_STEP_mA == 0, "fallback between two steps", fallback_mA);
    check_that(fallback_mA == 0 || fallback_mA >= connector->min_mA, "fallback below the minimum",
               fallback_mA);
}

/** Setpoints and fallback currents are beside their inverses as they were decided. */
static void check_seals(const taper_station_t *station) {
    for (uint8_t i = 0; i < station->options.config->connector_count; i++) {
        check_that(station->inverse.current_mA[i] == ~station->setpoints.current_mA[i], "seal of a setpoint",
                   station->inverse.current_mA[i]);
        check_that(station->fallback_inverse.current_mA[i] == ~station->fallback.current_mA[i],
                   "seal of a fallback current", station->fallback_inverse.current_mA[i]);
    }
}

/** The sum of fallback currents, by which connectors go on if this controller dies [mW]. */
static int64_t fallback_mW(const taper_station_t *station) {
    int64_t sum_mW = 0;
    for (uint8_t i = 0; i < station->options.config->connector_count; i++) {
        sum_mW += (int64_t)station->fallback.current_mA[i] * station->snapshot.demand[i].booking.W_per_A;
    }
    return sum_mW;
}

void check_currents(const taper_station_t *station) {
    const taper_station_config_t *config = station->options.config;
    for (uint8_t i = 0; i < config->connector_count; i++) {
        const taper_demand_t *demand = &station->snapshot.demand[i];
        const int32_t current_mA = station->setpoints.current_mA[i];
        check_current(&config->connectors[i], demand, current_mA);
        check_that(current_mA <= station->shaped.current_mA[i], "current above what may be told", current_mA);
        check_that(station->shaped.current_mA[i] <= station->target.current_mA[i], "current above the target",
                   station->shaped.current_mA[i]);
        check_fallback(&config->connectors[i], station->fallback.current_mA[i], current_mA);
        check_that(taper_ledger_told_mA(&station->ledger, i) <= config->connectors[i].max_mA,
                   "what a connector was told", taper_ledger_told_mA(&station->ledger, i));
    }
    check_seals(station);
    check_groups(station, &station->target);
    check_groups(station, &station->setpoints);
    check_that(taper_station_counter(station, TAPER_COUNTER_GUARD_VIOLATIONS) == 0, "guard violations",
               taper_station_counter(station, TAPER_COUNTER_GUARD_VIOLATIONS));
}

static void check_identifier(const char *identifier) {
    size_t length = 0;
    for (; identifier[length] != '\0'; length++) {
        check_that(length < TAPER_IDENTIFIER_LENGTH, "length of an identifier", (long long)length);
        check_that(identifier[length] >= ' ' && identifier[length] <= '~', "character of an identifier",
                   identifier[length]);
    }
}

void check_station(const taper_station_t *station) {
    const taper_station_config_t *config = station->options.config;
    check_limits(station);
    check_that(station->snapshot.count == config->connector_count, "snapshot.count", station->snapshot.count);
    for (uint8_t i = 0; i < config->connector_count; i++) {
        const taper_demand_t *demand = &station->snapshot.demand[i];
        check_session(&station->sessions.session[i]);
        check_identifier(taper_transfers_identifier(&station->transfers, i));
        if (demand->active) {
            check_demand(&config->connectors[i], demand);
        } else {
            check_no_demand(demand);
        }
    }
    check_that(fallback_mW(station) <= (int64_t)station->limits.failsafe_W * 1000,
               "power without a controller [mW]", fallback_mW(station));
    check_currents(station);
}

void check_setpoint(const taper_station_config_t *config, const taper_message_t *message) {
    const int connector = taper_session_connector(config, message->bus, message->node);
    const taper_setpoint_t *setpoint = &message->as.setpoint;
    if (connector < 0) { /* one that there is no place for (fault 31) */
        check_that(setpoint->command == TAPER_COMMAND_PAUSE && setpoint->current_mA == 0 &&
                       setpoint->fallback_mA == 0,
                   "current for a stranger", message->node);
        return;
    }
    const taper_connector_config_t *of = &config->connectors[connector];
    check_that(setpoint->current_mA <= of->max_mA, "setpoint above the connector's maximum",
               setpoint->current_mA);
    check_fallback(of, setpoint->fallback_mA, setpoint->current_mA);
    check_that(setpoint->command == TAPER_COMMAND_CHARGE || setpoint->current_mA == 0,
               "current without the command to charge", setpoint->current_mA);
}
