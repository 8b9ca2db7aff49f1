/*
 * Vehicles that use fewer or more phases than before. The ledger keeps currents, not phases: what an older setpoint allowed on
 * a phase is booked until it is over, and a phase is allowed only when others have had the time to leave it.
 */
#include "station_internal.h"

/** After so long, a setpoint that was sent last at the beginning of it is over, and a vehicle has followed. */
static uint32_t over_ms(const taper_station_t *station, uint32_t reaction_ms) {
    const uint32_t scale = station->options.time_scale;
    return station->ledger.validity_ms + TAPER_LEDGER_LATE_ms + (reaction_ms + scale - 1u) / scale;
}

static uint32_t longest_reaction_ms(const taper_station_config_t *config) {
    uint32_t longest_ms = 0;
    for (uint8_t i = 0; i < config->connector_count; i++) {
        const uint32_t reaction_ms = config->connectors[i].reaction_ms;
        longest_ms = reaction_ms > longest_ms ? reaction_ms : longest_ms;
    }
    return longest_ms;
}

/** Forget what setpoints allowed that are over. */
static void forget_what_is_over(taper_station_t *station, uint8_t i, uint32_t now_ms) {
    taper_conductors_t *conductors = &station->conductors[i];
    const uint32_t reaction_ms = station->options.config->connectors[i].reaction_ms;
    const bool over = taper_elapsed_ms(now_ms, conductors->most_ms) >= over_ms(station, reaction_ms) &&
                      taper_ledger_unreached_mA(&station->ledger, i) == 0;
    if (over) {
        conductors->most = 0;
    }
}

/** More than the last setpoint allowed, while current flows: others have to leave them first. */
static void allow(taper_station_t *station, uint8_t i, uint32_t now_ms) {
    const uint8_t wanted = station->snapshot.demand[i].conductors;
    taper_conductors_t *conductors = &station->conductors[i];
    const bool more = conductors->allowed != 0 && wanted > conductors->allowed &&
                      taper_ledger_told_mA(&station->ledger, i) > 0;
    if (more && !conductors->waits) {
        conductors->waits_ms = now_ms;
    }
    conductors->waits = more && taper_elapsed_ms(now_ms, conductors->waits_ms) <
                                    over_ms(station, longest_reaction_ms(station->options.config));
    if (!conductors->waits) {
        conductors->allowed = wanted;
    }
}

/** Setpoints in force, or a vehicle that is about to, may use more phases than the next setpoint allows: all of these are booked. */
static void book(taper_station_t *station, uint8_t i, uint32_t now_ms) {
    taper_demand_t *demand = &station->snapshot.demand[i];
    const taper_conductors_t *conductors = &station->conductors[i];
    const uint8_t most = (uint8_t)taper_max_i32(conductors->most, demand->conductors);
    if (most > conductors->allowed) {
        demand->booking = taper_session_booking(&station->sessions, i, now_ms, conductors->allowed, most);
    }
}

void taper_phases_update(taper_station_t *station, uint8_t i, uint32_t now_ms) {
    if (!station->sessions.session[i].vehicle_there) {
        station->conductors[i] = (taper_conductors_t){0};
    }
    if (station->snapshot.demand[i].active) { /* others are booked on all they have, and told nothing */
        forget_what_is_over(station, i, now_ms);
        allow(station, i, now_ms);
        book(station, i, now_ms);
    }
}

uint8_t taper_phases_allowed(const taper_station_t *station, uint8_t i) {
    return station->snapshot.demand[i].active ? station->conductors[i].allowed
                                              : station->options.config->connectors[i].phases;
}

void taper_phases_sent(taper_station_t *station, uint8_t i, uint32_t now_ms) {
    taper_conductors_t *conductors = &station->conductors[i];
    const uint8_t allowed = taper_phases_allowed(station, i);
    if (station->setpoints.current_mA[i] > 0 && allowed >= conductors->most) {
        conductors->most = allowed;
        conductors->most_ms = now_ms;
    }
}
