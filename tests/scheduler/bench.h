/** An open station, vehicles and a period, for the tests of the library. Each test has what it opens closed. */
#ifndef TAPER_SCHEDULER_BENCH_H
#define TAPER_SCHEDULER_BENCH_H

#include "taper_scheduler.h"

#define MOST_CONNECTORS 240
#define HOUR_s          3600.0

extern taper_scheduler_t *scheduler;
extern taper_scheduler_current_t currents[MOST_CONNECTORS]; /**< of the last plan */

/** Open `station` with a policy, in periods of 300 s. */
void open_with(const char *station, int32_t policy);

/** The best policy that this library has. */
int32_t best_policy(void);

/** A vehicle of 60 kWh at half charge, 22 kW, that falls to nothing from SOC 0.8 on. */
taper_scheduler_vehicle_t vehicle_that_wants(double need_kWh, double departs_s);

/** Put it at a connector; NULL: nobody. */
void plug_in(int32_t connector, const taper_scheduler_vehicle_t *vehicle);

/** The same hungry vehicle at every connector, leaving one minute after the other. */
void plug_in_everywhere(void);

/** Vehicles of all kinds at most connectors. */
void plug_in_at_random(uint32_t *state, double now_s);

/** A draw from [0, 1). */
double random_share(uint32_t *state);

/** Currents of the period from `now_s` on. */
void plan_at(double now_s);

/** Sum of all of them. */
double sum_A(void);

#endif
