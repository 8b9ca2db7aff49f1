#include "stats.h"

#include <stdlib.h>

#include "memory.h"

void sim_samples_add(sim_samples_t *samples, double value) {
    samples->value = sim_grow(samples->value, &samples->room, samples->count + 1, sizeof *samples->value);
    samples->value[samples->count++] = value;
}

static int compare(const void *a, const void *b) {
    const double left = *(const double *)a;
    const double right = *(const double *)b;
    return (left > right) - (left < right);
}

static double percentile(const sim_samples_t *samples, size_t percent) {
    const size_t rank = (samples->count * percent + 99) / 100;
    return samples->value[rank - 1];
}

sim_spread_t sim_samples_spread(sim_samples_t *samples) {
    if (samples->count == 0) {
        return (sim_spread_t){0};
    }
    qsort(samples->value, samples->count, sizeof *samples->value, compare);
    return (sim_spread_t){percentile(samples, 50), percentile(samples, 99), percentile(samples, 100)};
}

void sim_samples_free(sim_samples_t *samples) {
    free(samples->value);
    *samples = (sim_samples_t){0};
}
