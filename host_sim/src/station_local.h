/** The station within the program, on an in-memory bus. */
#ifndef SIM_STATION_LOCAL_H
#define SIM_STATION_LOCAL_H

#include "station_link.h"

/** A station that waits for start(); never NULL. It ends with close(). */
sim_link_t *sim_station_local(void);

#endif
