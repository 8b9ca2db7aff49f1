/**
 * The simulated field in lockstep with the station: one connector controller (EVSE) per connector, and the vehicles that
 * come and go. field.h is the same in milliseconds.
 *
 * They talk to the station in frames only. Within a tick everything stands still: the SOC at its start limits the
 * vehicle's power, and the power is constant until the tick ends, the vehicle leaves, or it has what it wanted.
 */
#ifndef SIM_FLEET_H
#define SIM_FLEET_H

#include <stdbool.h>
#include <stdint.h>

#include "evse.h"
#include "taper/port.h"
#include "taper/types.h"

typedef struct {
    const taper_station_config_t *station;
    const taper_port_t *port;
    double tick_s;
    bool tells_taper; /**< EV_PARAM_D is sent; without it the station plans as if there were no taper */
    sim_evse_t evse[TAPER_MAX_CONNECTORS];
} sim_fleet_t;

/** All connectors free. `station` and `port`, the world's end of the bus, must outlive the fleet. The counters start
    from bits of `seed`. */
void sim_fleet_init(sim_fleet_t *fleet, const taper_station_config_t *station, const taper_port_t *port,
                    bool tells_taper, uint64_t seed);

/** A connector reports itself and its vehicle. @return false: the bus is full. */
bool sim_fleet_report(sim_fleet_t *fleet, unsigned connector);

/** A connector reports itself alone, with the setpoint that it accepted last. @return false: the bus is full. */
bool sim_fleet_echo(sim_fleet_t *fleet, unsigned connector);

/** All have reported, a tick begins: setpoints of the last one do not count any more. */
void sim_fleet_begin(sim_fleet_t *fleet);

/** Take in a frame. A connector obeys its setpoint from the next sim_fleet_hear() on. */
void sim_fleet_take(sim_fleet_t *fleet, const taper_frame_t *frame);

/** Take what the station sent: every connector that has heard a valid setpoint in this tick obeys it, the others fall
    back. */
void sim_fleet_hear(sim_fleet_t *fleet);

/** Set the power of a connector's vehicle for the tick that begins at `now_s`. */
void sim_fleet_draw(sim_fleet_t *fleet, unsigned connector, double now_s);

/** The tick that began at `now_s` passes: the battery gets its energy. */
void sim_fleet_charge(sim_fleet_t *fleet, unsigned connector, double now_s);

#endif
