/** What was set for the station and is kept in the store (taper/settings.h). */
#ifndef MPS2_SITE_H
#define MPS2_SITE_H

#include "taper/drive.h"
#include "taper/settings.h"
#include "taper/station.h"

/**
 * Options of the image's station as it was set up; as it is described where nothing was set. `port` and `site` must outlive
 * the station.
 */
taper_station_options_t mps2_site_options(const taper_port_t *port, taper_site_t *site);

/** Keep a simulation's settings. @return whether they were written. */
bool mps2_site_keep(const taper_port_t *port, const taper_drive_setup_t *setup);

/** A simulation's settings that were kept. @return false: there are none. */
bool mps2_site_kept(const taper_port_t *port, taper_drive_setup_t *setup);

#endif
