/* Sizes of a station that no generated image has: a deep tree. For the tests and the benchmark of the allocator. */
#ifndef TAPER_SIZES_H
#define TAPER_SIZES_H
#define TAPER_MAX_CONNECTORS 60
#define TAPER_MAX_STEPS      24
#define TAPER_MAX_GROUPS     16
#define TAPER_REAL_IS_DOUBLE 1
#endif
