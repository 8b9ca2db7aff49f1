/** A growing set of numbers and its percentiles. */
#ifndef SIM_STATS_H
#define SIM_STATS_H

#include <stddef.h>

typedef struct {
    double *value;
    size_t count, room;
} sim_samples_t;

typedef struct {
    double p50, p99, max; /**< all 0 without samples */
} sim_spread_t;

void sim_samples_add(sim_samples_t *samples, double value);

/** Percentiles by nearest rank: the least sample that at least p % of all do not exceed. Sorts the samples. */
sim_spread_t sim_samples_spread(sim_samples_t *samples);

void sim_samples_free(sim_samples_t *samples);

#endif
