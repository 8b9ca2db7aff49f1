#include "problems.h"

void sim_problems_begin(FILE *file, const taper_station_t *station) {
    const taper_planning_t *planning = &station->options.config->planning;
    fprintf(file, "station %s\nplanning %u %ld %u %u\n", station->options.config->name,
            (unsigned)planning->objective, (long)planning->lambda_milli_per_kWh2,
            (unsigned)planning->outer_iterations, (unsigned)planning->horizon_steps);
}

void sim_problems_add(FILE *file, const taper_station_t *station) {
    const taper_snapshot_t *snapshot = &station->snapshot;
    taper_course_t course;
    taper_limits_course(&station->limits, snapshot->now_ms, &course);
    fprintf(file, "time %lu\nlimit", (unsigned long)snapshot->now_ms);
    for (unsigned t = 0; t < station->options.config->steps; t++) {
        fprintf(file, " %ld", (long)course.limit_W[t]);
    }
    fprintf(file, "\n");
    for (unsigned i = 0; i < snapshot->count; i++) {
        const taper_demand_t *d = &snapshot->demand[i];
        if (d->active) {
            fprintf(file, "demand %u %u %ld %ld %ld %ld %ld %ld %ld %ld\n", i, (unsigned)d->session,
                    (long)d->stored_Wh, (long)d->capacity_Wh, (long)d->need_Wh, (long)d->peak_W,
                    (long)d->taper_W, (long)d->max_mA, (long)d->W_per_A, (long)d->departs_in_s);
        }
        if (d->active && d->second_peak_W > 0) {
            fprintf(file, "second %u %ld %ld\n", i, (long)d->second_peak_W, (long)d->second_taper_W);
        }
    }
    fprintf(file, "solve\n");
}
