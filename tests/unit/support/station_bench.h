/** A station of type hub on an in-memory bus, and a world that speaks to it in protected frames. */
#ifndef TAPER_TEST_STATION_BENCH_H
#define TAPER_TEST_STATION_BENCH_H

#include "taper/membus.h"
#include "taper/station.h"

typedef struct {
    taper_station_t station;
    taper_membus_t bus;
    taper_port_t port;
    uint8_t counters[2048]; /**< end-to-end counter of every id that the world sends */
    uint32_t now_ms;
} station_bench_t;

extern station_bench_t bench;

/** Place of the hub in taper_stations[] and taper_solvers[]. */
unsigned bench_hub_index(void);

/** Options for the hub without a solver, a whole solve in a tick. */
taper_station_options_t bench_options(void);

/** A fresh station with `options`, an empty bus, time 1 s. */
void bench_start(const taper_station_options_t *options);

/** What the world says, each as one frame or one set of frames. Clock: 600 000 s Unix and the bench's time. */
void bench_send_limit(int32_t limit_W);
void bench_send_clock(void);
void bench_send_status(uint8_t node, bool present);

/** A vehicle of 60 kWh at `soc_permille`, 11 kW at SOC 0 falling by 6 kW, that wants 20 kWh within two hours. */
void bench_send_vehicle(uint8_t node, uint8_t session, int32_t soc_permille);

/** Clock, limit, and all eight connectors; the first `vehicles` have a vehicle at half charge. */
void bench_send_all(uint8_t vehicles, int32_t limit_W);

/** One control tick, then a second passes. */
void bench_step(void);

/** The SETPOINT for `node` among the frames not yet read; all of them are thrown away. */
taper_setpoint_t bench_setpoint_for(uint8_t node);

/** The hops that do not depend on who proposes: session, snapshot and limit after bench_send_all(1, 50000). */
void bench_assert_one_vehicle_in_the_snapshot(void);

#endif
