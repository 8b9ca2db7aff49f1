#include "bench.h"

#include <string.h>

#include "unity.h"

taper_scheduler_t *scheduler;
taper_scheduler_current_t currents[MOST_CONNECTORS];

void setUp(void) {
    memset(currents, 0, sizeof currents);
}

void tearDown(void) {
    taper_scheduler_close(scheduler);
    scheduler = NULL;
}

void open_with(const char *station, int32_t policy) {
    taper_scheduler_options_t options;
    taper_scheduler_defaults(&options);
    options.policy = policy;
    TEST_ASSERT_EQUAL_INT32(TAPER_SCHEDULER_OK, taper_scheduler_open(&scheduler, station, &options));
}

/** The best policy that this library has. */
int32_t best_policy(void) {
    taper_scheduler_options_t options;
    taper_scheduler_defaults(&options);
    return options.policy;
}

/** A vehicle of 60 kWh at half charge, 22 kW, that falls to nothing from SOC 0.8 on. */
taper_scheduler_vehicle_t vehicle_that_wants(double need_kWh, double departs_s) {
    return (taper_scheduler_vehicle_t){
        .session = 7,
        .need_kWh = need_kWh,
        .departs_s = departs_s,
        .max_kW = 22,
        .capacity_kWh = 60,
        .stored_kWh = 30,
        .peak_kW = 110,
        .taper_kW = 110,
    };
}

void plug_in(int32_t connector, const taper_scheduler_vehicle_t *vehicle) {
    TEST_ASSERT_EQUAL_INT32(TAPER_SCHEDULER_OK, taper_scheduler_set_vehicle(scheduler, connector, vehicle));
}

void plan_at(double now_s) {
    TEST_ASSERT_EQUAL_INT32(TAPER_SCHEDULER_OK, taper_scheduler_plan(scheduler, now_s, currents));
}

double random_share(uint32_t *state) {
    *state = *state * 1664525u + 1013904223u;
    return (*state >> 8) / 16777216.0;
}

/** Vehicles of all kinds at most connectors. */
void plug_in_at_random(uint32_t *state, double now_s) {
    for (int32_t i = 0; i < taper_scheduler_connectors(scheduler); i++) {
        taper_scheduler_vehicle_t vehicle =
            vehicle_that_wants(0.05 + 30 * random_share(state), now_s + 4 * HOUR_s * random_share(state));
        vehicle.session = (uint64_t)(1000 * random_share(state));
        vehicle.stored_kWh = 60 * random_share(state);
        plug_in(i, random_share(state) < 0.9 ? &vehicle : NULL);
    }
}

double sum_A(void) {
    double sum = 0;
    for (int32_t i = 0; i < taper_scheduler_connectors(scheduler); i++) {
        sum += currents[i].current_A;
    }
    return sum;
}

/** The same hungry vehicle at every connector, leaving one minute after the other. */
void plug_in_everywhere(void) {
    for (int32_t i = 0; i < taper_scheduler_connectors(scheduler); i++) {
        const taper_scheduler_vehicle_t vehicle = vehicle_that_wants(20, 2 * HOUR_s + 60 * i);
        plug_in(i, &vehicle);
    }
}
