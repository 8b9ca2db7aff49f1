/** Boot-time check of a station's description: tables may not lie, and this is where that is found out. */
#ifndef TAPER_CONFIG_CHECK_H
#define TAPER_CONFIG_CHECK_H

#include "taper/types.h"

/**
 * @return TAPER_OK, or TAPER_ERR_CONFIG if
 *         - the description is larger than this image;
 *         - the feeder tree is not a tree with group 0 as its root, group 0 has no limit in W, or another group has a limit
 *           neither in W nor in mA;
 *         - the failsafe limit is above the site's; other load has a part of the phases' limits that is not told;
 *         - turns are shorter than the least time on;
 *         - a connector's currents, wiring, efficiency, reaction time or address are out of range, contradict each
 *           other or are taken twice; its rotation is unknown; `line_to_line` is not said where it is so;
 *         - any other quantity is out of its range.
 *
 * What makes a connector useless, but nothing unsafe, passes: limits may have been lowered below its least current on
 * purpose. codegen refuses it in a station file.
 * Cost: O(connectors^2), once.
 */
taper_status_t taper_config_check(const taper_station_config_t *config);

#endif
