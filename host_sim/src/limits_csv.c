#define _GNU_SOURCE // program_invocation_short_name

#include "limits_csv.h"

#include <errno.h>
#include <math.h>
#include <stdio.h>

/** The bus carries 16 bits of thousandths, less the one that means absent. */
#define MOST_PER_KWH 32.767

bool sim_limits_cap(sim_course_t *limits, double most_kw) {
    bool any = false;
    for (size_t i = 0; i < limits->count; i++) {
        any = any || limits->value[i] > most_kw;
        limits->value[i] = fmin(limits->value[i], most_kw);
    }
    return any;
}

bool sim_prices_load(sim_course_t *prices, const char *file) {
    return sim_course_load(prices, file, "price_per_kwh", -MOST_PER_KWH, MOST_PER_KWH);
}

bool sim_limits_choose(sim_course_t *limits, const char *file, double limit_kw, double station_kw) {
    if (file == NULL) {
        sim_course_constant(limits, limit_kw >= 0.0 ? limit_kw : station_kw);
    } else if (!sim_course_load(limits, file, "limit_kw", 0.0, (double)INFINITY)) {
        return false;
    }
    if (sim_limits_cap(limits, station_kw)) {
        fprintf(stderr, "%s: note: the limit is above the station's own, %g kW, which holds\n",
                program_invocation_short_name, station_kw);
    }
    return true;
}
