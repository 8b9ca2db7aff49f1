/** Private to the layer: the sum rows, one for every planned limit of the feeder tree and step. */
#ifndef TAPER_SUMS_H
#define TAPER_SUMS_H

#include "taper/horizon.h"

/** List the sums of `horizon->config`. */
void taper_sums_list(taper_horizon_t *horizon);

/** Set the weights of connector `i`: by the snapshot if its demand is active there, else (or NULL) by the description. */
void taper_sums_weigh(taper_horizon_t *horizon, uint8_t i, const taper_snapshot_t *snapshot);

/** Set the bounds of all sum rows. */
void taper_sums_bound(taper_horizon_t *horizon, const taper_course_t *course);

/** Most power of connector `i` that the currents of the site's lines have room for, were it alone. Needs the bounds. */
taper_real_t taper_sums_most(const taper_horizon_t *horizon, uint8_t i);

#endif
