/* Two cars at the hub, one nearly full: an hour in periods of 20 minutes. */
#include <stdio.h>

#include "taper_scheduler.h"

/** Energy in a car, and still wanted. */
static double stored_kWh[] = {20, 54};
static double need_kWh[] = {20, 5};

static void tell_about(taper_scheduler_t *scheduler, int car) {
    const taper_scheduler_vehicle_t vehicle = {
        .session = (uint64_t)car + 1,
        .need_kWh = need_kWh[car],
        .departs_s = 7200,
        .max_kW = 22,
        .capacity_kWh = 60,
        .stored_kWh = stored_kWh[car],
        .peak_kW = 110, /* 22 kW up to SOC 0.8, then down to nothing */
        .taper_kW = 110,
    };
    taper_scheduler_set_vehicle(scheduler, car, need_kWh[car] > 0 ? &vehicle : NULL);
}

/** The simulator's part: what the cars take of their currents in a period. */
static void charge(int car, double current_A, double hours) {
    const double offered_kW = current_A * 3 * 230 / 1000;
    const double line_kW = 110 - 110 * stored_kWh[car] / 60;
    const double taken_kW = offered_kW < line_kW ? offered_kW : line_kW;
    stored_kWh[car] += taken_kW * hours;
    need_kWh[car] -= taken_kW * hours;
}

int main(void) {
    taper_scheduler_t *scheduler;
    taper_scheduler_options_t options;
    taper_scheduler_current_t currents[8];
    taper_scheduler_defaults(&options);
    options.period_s = 1200;
    const int32_t status = taper_scheduler_open(&scheduler, "hub", &options);
    if (status != TAPER_SCHEDULER_OK) {
        fprintf(stderr, "hub: %s\n", taper_scheduler_status_text(status));
        return 1;
    }
    taper_scheduler_set_limit(scheduler, 30); /* kW, for both */
    for (int minute = 0; minute < 60; minute += 20) {
        tell_about(scheduler, 0);
        tell_about(scheduler, 1);
        taper_scheduler_plan(scheduler, 60.0 * minute, currents);
        printf("%2d min: %4.1f A %4.1f A\n", minute, currents[0].current_A, currents[1].current_A);
        charge(0, currents[0].current_A, 1 / 3.0);
        charge(1, currents[1].current_A, 1 / 3.0);
    }
    taper_scheduler_close(scheduler);
    return 0;
}
