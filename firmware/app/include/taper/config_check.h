/** Boot-time check of a station's description: tables may not lie, and this is where that is found out. */
#ifndef TAPER_CONFIG_CHECK_H
#define TAPER_CONFIG_CHECK_H

#include "taper/types.h"

/**
 * @return TAPER_OK, or TAPER_ERR_CONFIG if the description is larger than this image, a connector's limits or address
 *         are out of range or taken twice, or the feeder tree is not a tree with group 0 as its root.
 * Cost: O(connectors^2), once.
 */
taper_status_t taper_config_check(const taper_station_config_t *config);

#endif
