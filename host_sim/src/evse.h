/**
 * One connector controller (EVSE) and the vehicle on it: what it knows, what it says, what it hears, what it lets the
 * vehicle draw. It keeps no time: fleet.h moves it in control ticks, field.h in milliseconds.
 */
#ifndef SIM_EVSE_H
#define SIM_EVSE_H

#include <stdbool.h>
#include <stdint.h>

#include "errors.h"
#include "sessions.h"
#include "taper/e2e.h"
#include "taper/message.h"
#include "taper/types.h"

/** Frames that a connector sends. */
typedef enum {
    SIM_EVSE_STATUS, /**< the heartbeat; the only one but the last that is sent without a vehicle */
    SIM_EV_STATUS,
    SIM_EVSE_ELEC,
    SIM_EV_PARAM_A,
    SIM_EV_PARAM_B,
    SIM_EV_PARAM_C,
    SIM_EV_PARAM_D,
    SIM_EV_PARAM_E,
    SIM_EVSE_INFO,
    SIM_EVSE_FRAMES,
} sim_evse_frame_t;

typedef struct {
    const taper_connector_config_t *config;
    bool closed;                  /**< nobody is plugged in here: another process plays this connector */
    const sim_session_t *vehicle; /**< NULL: none */
    double energy_kwh;            /**< into the battery since plug-in */
    double counted_from_kwh;      /**< of this, before the controller began to count: it restarted since */
    double current_A;             /**< on each conductor in use, drawn now */
    double power_kw;              /**< of the vehicle: the losses of a DC converter do not count */
    bool conductors_seen;         /**< the vehicle has drawn: how many conductors it uses is known */
    int32_t setpoint_mA;          /**< per phase, what the vehicle may draw now: see sim_evse_obey() */
    int32_t told_mA;     /**< by the last accepted setpoint; it and the next two are 0 until there is one */
    int32_t fallback_mA; /**< by the same */
    int32_t validity_ms; /**< by the same */
    bool in_force;       /**< it has not expired; whoever keeps the time clears this */
    taper_e2e_receiver_t setpoint_check;
    uint8_t setpoint_echo;            /**< counter of the last accepted one */
    uint8_t session;                  /**< number on the wire, 1..255 */
    uint8_t revision;                 /**< of the EV_PARAM frames, 0..15 */
    uint8_t counter[SIM_EVSE_FRAMES]; /**< of the protected frames */
    const sim_errors_t *errors;       /**< what vehicles and meter get wrong; NULL: nothing */
    sim_vehicle_errors_t wrong;       /**< and the present vehicle */
} sim_evse_t;

/** No vehicle. `config` must outlive it; the end-to-end counters start from `first_counter` (+ 3 per frame). */
void sim_evse_init(sim_evse_t *evse, const taper_connector_config_t *config, unsigned first_counter);

/** A vehicle comes to a free connector; `session` must stay until sim_evse_unplug(). It gets nothing before a setpoint
    for this session was heard. */
void sim_evse_plug(sim_evse_t *evse, const sim_session_t *session);

/** The vehicle leaves. */
void sim_evse_unplug(sim_evse_t *evse);

/** The controller restarts: counters from 0, no setpoint, a new session for the vehicle that it finds. */
void sim_evse_restart(sim_evse_t *evse);

/** SOC of the vehicle on a connector, 0..1. */
double sim_evse_soc(const sim_evse_t *evse);

/** Energy that the vehicle on a connector still wants, >= 0 [kWh]. */
double sim_evse_missing_kwh(const sim_evse_t *evse);

/** Whether a vehicle is there that is still below its target. */
bool sim_evse_wants(const sim_evse_t *evse);

/** Conductors that the vehicle uses: those that it shares with the connector; without a vehicle all of the connector's. */
uint8_t sim_evse_conductors(const sim_evse_t *evse);

/** The same as the connector reports it: all of its own until the vehicle has drawn. */
uint8_t sim_evse_told_conductors(const sim_evse_t *evse);

/** Power of 1 A on every conductor in use [kW]. */
double sim_evse_kw_per_A(const sim_evse_t *evse);

/** Most that charger and battery of the vehicle take at the present SOC [kW]. */
double sim_evse_takes_kw(const sim_evse_t *evse);

/**
 * A connector hears a SETPOINT frame. It accepts one that passes the end-to-end check and is for its session (0 without
 * a vehicle). A command other than "charge" tells 0; after "stop" and "emergency" the fallback is 0 too. `phase_mask`
 * and `ramp` are not followed.
 * @return whether it was accepted: then told_mA, fallback_mA, validity_ms, setpoint_echo and in_force are set.
 */
bool sim_evse_hear(sim_evse_t *evse, const taper_frame_t *frame);

/** Set setpoint_mA: the one told while it is in force, else its fallback. */
void sim_evse_obey(sim_evse_t *evse);

/** Current per phase on offer at a setpoint: nothing below the connector's minimum, and no more than its maximum. */
int32_t sim_evse_offered_mA(const sim_evse_t *evse, int32_t setpoint_mA);

/** Draw what an offer allows, and at most `most_kw`: sets power and current. */
void sim_evse_draw(sim_evse_t *evse, int32_t offered_mA, double most_kw);

/** A frame with what it says now. All but SIM_EVSE_STATUS and SIM_EVSE_INFO need a vehicle, SIM_EV_PARAM_E one with two
    lines. */
taper_message_t sim_evse_message(const sim_evse_t *evse, sim_evse_frame_t frame);

/** The connector that a SETPOINT frame is for, or -1: another frame, or a node that the station does not have. */
int sim_setpoint_connector(const taper_station_config_t *station, const taper_frame_t *frame);

#endif
