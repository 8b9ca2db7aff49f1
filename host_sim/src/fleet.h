/**
 * The simulated field in lockstep with the station: one connector controller (EVSE) per connector, and the vehicles that
 * come and go. field.h is the same in milliseconds.
 *
 * They talk to the station in frames only. The SOC at the start of a tick limits the vehicle's power in all of it. Between
 * two setpoints the power is constant, until the tick ends, the vehicle leaves, or it has what it wanted.
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
    bool
        tells_taper; /**< EV_PARAM_D and E are sent; without them the station plans as if there were no taper */
    double begin_s;                           /**< of the present tick */
    double takes_kw[TAPER_MAX_CONNECTORS];    /**< most that the vehicle takes in it */
    int32_t offered_mA[TAPER_MAX_CONNECTORS]; /**< what it draws by; negative: it has yet to begin */
    sim_evse_t evse[TAPER_MAX_CONNECTORS];
} sim_fleet_t;

/** All connectors free. `station` and `port`, the world's end of the bus, must outlive the fleet. The counters start
    from bits of `seed`. */
void sim_fleet_init(sim_fleet_t *fleet, const taper_station_config_t *station, const taper_port_t *port,
                    bool tells_taper, uint64_t seed);

/** What vehicles and meters get wrong from here on. `errors` must outlive the fleet. */
void sim_fleet_set_errors(sim_fleet_t *fleet, const sim_errors_t *errors);

/** A connector reports itself and its vehicle. @return false: the bus is full. */
bool sim_fleet_report(sim_fleet_t *fleet, unsigned connector);

/**
 * A connector reports again within a tick: itself, with the setpoint that it accepted last, and, if `whole`, what its vehicle
 * tells of state and energy. @return false: the bus is full.
 */
bool sim_fleet_echo(sim_fleet_t *fleet, unsigned connector, bool whole);

/** All have reported, the tick begins at `now_s`: setpoints of the last one do not count any more. */
void sim_fleet_begin(sim_fleet_t *fleet, int64_t now_s);

/** Take in a frame. A connector obeys its setpoint from the next sim_fleet_hear() on. */
void sim_fleet_take(sim_fleet_t *fleet, const taper_frame_t *frame);

/** Take what the station sent: every connector that has heard a valid setpoint in this tick obeys it, the others fall
    back. */
void sim_fleet_hear(sim_fleet_t *fleet);

/** From `now_s` on, a time in the present tick, a connector's vehicle draws by the setpoint that the connector obeys. It
    goes on as before if that offers no other current. @return whether it is another. */
bool sim_fleet_draw(sim_fleet_t *fleet, unsigned connector, double now_s);

/** The time from `from_s` to `to_s` passes, in the present tick: the battery gets its energy. @return that [kWh]. */
double sim_fleet_charge(sim_fleet_t *fleet, unsigned connector, double from_s, double to_s);

#endif
