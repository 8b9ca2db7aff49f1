#include "problems.h"

#include "taper/rows.h"

void sim_problems_begin(FILE *file, const taper_station_t *station) {
    const taper_planning_t *planning = &station->options.config->planning;
    fprintf(file, "station %s\nplanning %u %ld %u %u\n", station->options.config->name,
            (unsigned)planning->objective, (long)planning->lambda_milli_per_kWh2,
            (unsigned)planning->outer_iterations, (unsigned)planning->horizon_steps);
}

/* The last field of a demand: the supply phases of a vehicle that uses not all of its connector's. */
static void write_phases(FILE *file, const taper_station_t *station, uint8_t i) {
    const taper_connector_config_t *connector = &station->options.config->connectors[i];
    const unsigned booked = station->snapshot.demand[i].booking.phases;
    if (connector->phases == 3 && booked != taper_booking_nominal(station->options.config, i).phases) {
        fprintf(file, " %u", booked);
    }
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
    for (uint8_t i = 0; i < snapshot->count; i++) {
        const taper_demand_t *d = &snapshot->demand[i];
        if (d->active) {
            fprintf(file, "demand %u %u %ld %ld %ld %ld %ld %ld %ld %ld", (unsigned)i, (unsigned)d->session,
                    (long)d->stored_Wh, (long)d->capacity_Wh, (long)d->need_Wh, (long)d->peak_W,
                    (long)d->taper_W, (long)d->max_mA, (long)d->W_per_A, (long)d->departs_in_s);
            write_phases(file, station, i);
            fprintf(file, "\n");
        }
    }
    fprintf(file, "solve\n");
}
