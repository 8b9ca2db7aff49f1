/** The two ends of the pipeline: frames in, frames out. Private to the app layer. */
#ifndef TAPER_STATION_IO_H
#define TAPER_STATION_IO_H

#include "taper/station.h"

/** Drain the port's receive queue into session table and limits. At most TAPER_MAX_FRAMES_PER_STEP frames. */
void taper_station_receive(taper_station_t *station, uint32_t now_ms);

/** Send one SETPOINT to every connector and one CTRL_STATUS on every bus. */
void taper_station_send(taper_station_t *station);

#endif
