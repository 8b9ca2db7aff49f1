/**
 * The simulated field: one connector controller (EVSE) per connector of the station, and the vehicles that come and go.
 *
 * They talk to the station in frames only. Within a tick everything stands still: the SOC at its start limits the
 * vehicle's power, and the power is constant until the tick ends, the vehicle leaves, or it has what it wanted.
 */
#ifndef SIM_FLEET_H
#define SIM_FLEET_H

#include <stdbool.h>
#include <stdint.h>

#include "sessions.h"
#include "taper/e2e.h"
#include "taper/membus.h"
#include "taper/station.h"

/** One connector controller and the vehicle on it. */
typedef struct {
    const taper_connector_config_t *config;
    const sim_session_t *vehicle; /**< NULL: none */
    double energy_kwh;            /**< into the battery since plug-in */
    double current_A;             /**< per phase, drawn in this tick */
    double power_kw;
    int32_t setpoint_mA; /**< per phase, what the vehicle may draw in this tick */
    int32_t fallback_mA; /**< told by the last setpoint */
    taper_e2e_receiver_t setpoint_check;
    bool setpoint_heard;                         /**< a valid one, in this tick */
    uint8_t setpoint_echo;                       /**< counter of the last valid one */
    uint8_t session;                             /**< number on the wire, 1..255 */
    uint8_t revision;                            /**< of the EV_PARAM frames, 0..15 */
    uint8_t counter[TAPER_FRAMES_PER_CONNECTOR]; /**< of the protected frames */
} sim_evse_t;

typedef struct {
    const taper_station_config_t *station;
    taper_membus_t *bus;
    double tick_s;
    bool tells_taper; /**< EV_PARAM_D is sent; without it the station plans as if there were no taper */
    sim_evse_t evse[TAPER_MAX_CONNECTORS];
    uint8_t at[TAPER_MAX_BUSES][TAPER_NODES_PER_BUS + 1]; /**< connector + 1 at a bus and node; 0: none */
} sim_fleet_t;

/** All connectors free. `station` and `bus` must outlive the fleet. The counters start from bits of `seed`. */
void sim_fleet_init(sim_fleet_t *fleet, const taper_station_config_t *station, taper_membus_t *bus,
                    bool tells_taper, uint64_t seed);

/** A vehicle comes to a free connector; `session` must stay until sim_fleet_unplug(). */
void sim_fleet_plug(sim_fleet_t *fleet, unsigned connector, const sim_session_t *session);

/** The vehicle leaves. */
void sim_fleet_unplug(sim_fleet_t *fleet, unsigned connector);

/** A connector reports itself and its vehicle. @return false: the bus is full. */
bool sim_fleet_report(sim_fleet_t *fleet, unsigned connector);

/** Take what the station sent: every connector that hears a valid setpoint obeys it, the others fall back. */
void sim_fleet_listen(sim_fleet_t *fleet);

/** Set the power of a connector's vehicle for the tick that begins at `now_s`. */
void sim_fleet_draw(sim_fleet_t *fleet, unsigned connector, double now_s);

/** The tick that began at `now_s` passes: the battery gets its energy. */
void sim_fleet_charge(sim_fleet_t *fleet, unsigned connector, double now_s);

/** SOC of the vehicle on a connector, 0..1. */
double sim_evse_soc(const sim_evse_t *evse);

/** Whether a vehicle is there that is still below its target. */
bool sim_evse_wants(const sim_evse_t *evse);

#endif
