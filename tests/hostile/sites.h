/** The stations of the hostile world. */
#ifndef HOSTILE_SITES_H
#define HOSTILE_SITES_H

#include "taper/types.h"

#define SITES 5u

/** hub, sockets, mixed, lines, tree. */
extern const taper_station_config_t sites[SITES];

#endif
