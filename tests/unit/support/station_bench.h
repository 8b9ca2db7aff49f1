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
    bool deaf; /**< nobody reads the bus; else it is read after every step and poll */
    bool heard[TAPER_NODES_PER_BUS + 1];                /**< a SETPOINT came since bench_start(), by node */
    taper_setpoint_t setpoint[TAPER_NODES_PER_BUS + 1]; /**< the last one */
    uint8_t echo[TAPER_NODES_PER_BUS + 1]; /**< its counter: what the connector's status echoes */
    uint32_t setpoints;                    /**< heard since bench_start() */
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
/** A connector that obeys: it echoes the last setpoint that it heard, and without any says that it fell back. */
void bench_send_status(uint8_t node, bool present);

/** Any message, protected. */
void bench_send(const taper_message_t *message);

/** A vehicle of 60 kWh at `soc_permille`, 11 kW at SOC 0 falling by 6 kW, that wants 20 kWh within two hours. */
void bench_send_vehicle(uint8_t node, uint8_t session, int32_t soc_permille);

/** Clock, limit, and all eight connectors; the first `vehicles` have a vehicle at half charge. */
void bench_send_all(uint8_t vehicles, int32_t limit_W);

/** One control tick, then a second passes. */
void bench_step(void);

/** What happens between ticks, `passes_ms` before the next call. */
void bench_poll(uint32_t passes_ms);

/** Connectors take what the station sent. */
void bench_listen(void);

/** The last SETPOINT for `node`, sent in the last step or poll. */
taper_setpoint_t bench_setpoint_for(uint8_t node);

/** Events of a code in the station's log. */
unsigned bench_events(taper_event_code_t code);

/** The hops that do not depend on who proposes: session, snapshot and limit after bench_send_all(1, 50000). */
void bench_assert_one_vehicle_in_the_snapshot(void);

#endif
