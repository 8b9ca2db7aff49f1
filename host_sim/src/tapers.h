/**
 * How well the station has learned the tapers of a run: for every session, at the end of the tick in which it has got a tenth, a
 * quarter and a half of its charge, the line of the station next to the vehicle's own, as CSV.
 */
#ifndef SIM_TAPERS_H
#define SIM_TAPERS_H

#include <stdio.h>

#include "fleet.h"
#include "taper/station.h"

typedef struct {
    FILE *stream; /**< NULL: nowhere */
    const sim_session_t *vehicle[TAPER_MAX_CONNECTORS];
    unsigned next[TAPER_MAX_CONNECTORS]; /**< of the shares */
} sim_tapers_t;

/** Begin. `stream` must outlive it. */
void sim_tapers_init(sim_tapers_t *tapers, FILE *stream);

/** A tick is over. */
void sim_tapers_note(sim_tapers_t *tapers, const sim_fleet_t *fleet, const taper_station_t *station);

#endif
