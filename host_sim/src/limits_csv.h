/** The course of the site limit over a run: a step function, constant or from a CSV file. */
#ifndef SIM_LIMITS_CSV_H
#define SIM_LIMITS_CSV_H

#include <stdbool.h>
#include <stddef.h>

/** From each `time_s` on `limit_kw` holds, until the next; the first value holds before its time too. */
typedef struct {
    double *time_s; /**< [count], ascending */
    double *limit_kw;
    size_t count; /**< at least 1 */
} sim_limits_t;

/** The same limit always. Free with sim_limits_free(). */
void sim_limits_constant(sim_limits_t *limits, double limit_kw);

/**
 * Read a limit file, `time_s,limit_kw` with times strictly ascending.
 * @return false, after one line on stderr, at the first row that is not right. Else free with sim_limits_free().
 */
bool sim_limits_load(sim_limits_t *limits, const char *file);

/**
 * The limits of a run: of `file`; without one (NULL) `limit_kw` always, and if that is negative `station_kw`. None of them
 * stays above `station_kw`, with a note on stderr if one was.
 * @return false, after one line on stderr. Else free with sim_limits_free().
 */
bool sim_limits_choose(sim_limits_t *limits, const char *file, double limit_kw, double station_kw);

/** No value stays above `most_kw`. @return whether one was. */
bool sim_limits_cap(sim_limits_t *limits, double most_kw);

/** The point in force at a time. Cost: O(log count). */
size_t sim_limits_point(const sim_limits_t *limits, double time_s);

/** The least limit in [from_s, to_s) [kW]: power that is constant meanwhile must not be above it. */
double sim_limits_least_kw(const sim_limits_t *limits, double from_s, double to_s);

void sim_limits_free(sim_limits_t *limits);

#endif
