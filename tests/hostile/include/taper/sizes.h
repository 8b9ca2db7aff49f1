/**
 * Sizes of the image that the hostile world runs: the firmware's sources are built once more with these, so that its
 * stations may have a deeper feeder tree than those of codegen/stations, and small tables.
 */
#ifndef TAPER_SIZES_H
#define TAPER_SIZES_H

#define TAPER_MAX_CONNECTORS 12
#define TAPER_MAX_STEPS      4
#define TAPER_MAX_GROUPS     12
/** Rows of the planner, which is not built here. */
#define TAPER_MAX_PLAN_ROWS   1
#define TAPER_MAX_TAPER_LINES 1

#define TAPER_REAL_IS_DOUBLE 1

#endif
