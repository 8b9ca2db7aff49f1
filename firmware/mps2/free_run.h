/** The station on the board's own clock, as a product runs. */
#ifndef MPS2_FREE_RUN_H
#define MPS2_FREE_RUN_H

#include "taper/station.h"

/** Bring the station up, and start the watchdog. A station that refuses its description stays silent. */
void mps2_free_run_start(taper_station_t *station, const taper_station_options_t *options);

/** What is due at `now_ms`: a step, or a poll. */
void mps2_free_run_call(taper_station_t *station, uint32_t now_ms);

#endif
