/** What the gateway knows in advance: the site limit over time [kW], constant or from a CSV file, and the price of energy. */
#ifndef SIM_LIMITS_CSV_H
#define SIM_LIMITS_CSV_H

#include <stdbool.h>

#include "course.h"

/**
 * The limits of a run: of `file`, `time_s,limit_kw`; without one (NULL) `limit_kw` always, and if that is negative
 * `station_kw`. None of them stays above `station_kw`, with a note on stderr if one was.
 * @return false, after one line on stderr. Else free with sim_course_free().
 */
bool sim_limits_choose(sim_course_t *limits, const char *file, double limit_kw, double station_kw);

/**
 * The price of energy over time, of `file`: `time_s,price_per_kwh`, in a currency in which none is beyond 32.767,
 * what the bus carries.
 * @return false, after one line on stderr. Else free with sim_course_free().
 */
bool sim_prices_load(sim_course_t *prices, const char *file);

/** No value stays above `most_kw`. @return whether one was. */
bool sim_limits_cap(sim_course_t *limits, double most_kw);

#endif
