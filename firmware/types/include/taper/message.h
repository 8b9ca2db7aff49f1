/**
 * The station bus after decoding: one struct per frame of `codegen/bus.toml`, in integers with units.
 *
 * A field that its sender left out, or that was outside the range of the DBC, is TAPER_ABSENT. Everything else is in
 * the range given here: this is the trust boundary, the layers above check no range again.
 */
#ifndef TAPER_MESSAGE_H
#define TAPER_MESSAGE_H

#include <stdbool.h>
#include <stdint.h>

#include "taper/bus.h"

/** SITE_LIMIT, gateway to controller, 1 s; the gateway's heartbeat. */
typedef struct {
    bool active;        /**< the limit below is in force */
    int32_t limit_W;    /**< -3 276 700..3 276 700, or absent */
    int32_t failsafe_W; /**< likewise */
    int32_t validity_s; /**< 0..254, or absent */
} taper_site_limit_t;

/** SETPOINT, controller to connector, every control tick. */
typedef struct {
    taper_command_t command;
    int32_t current_mA;  /**< 0..6 553 400 */
    int32_t validity_ms; /**< 0..127 000; afterwards the connector falls back by itself */
    int32_t fallback_mA; /**< 0..127 000 */
    uint8_t phase_mask;  /**< bit 0: L1 .. bit 2: L3 */
    uint8_t session;
} taper_setpoint_t;

/** EVSE_STATUS, connector to controller, 200 ms; the connector's heartbeat. */
typedef struct {
    taper_pilot_t pilot;
    int32_t current_mA[3]; /**< 0..409 400 per phase, or absent */
    bool contactor_closed;
    bool locked;
    bool fault;
    bool derated;
    bool fallback_active;
    bool ev_present;
    uint8_t setpoint_echo; /**< counter of the last accepted SETPOINT, 0..15 */
    uint8_t phases;        /**< phases in use, 0..3 */
} taper_evse_status_t;

/** EV_STATUS, connector to controller, 500 ms. */
typedef struct {
    uint8_t error;        /**< 0: none */
    int32_t soc_permille; /**< 0..1000 in steps of 5, or absent */
    int32_t soc_age_s;    /**< 0..254, or absent */
    int32_t max_mA;       /**< 0..6 553 400, the vehicle's own limit, or absent */
    bool complete;        /**< the vehicle has what it wanted */
    bool ready;
    bool pause_requested;
    bool stop_requested;
} taper_ev_status_t;

/** EVSE_ELEC, connector to controller, 1 s. */
typedef struct {
    int32_t voltage_mV; /**< 0..6 553 400, or absent */
    int32_t power_W;    /**< 0..655 340, or absent */
    int32_t energy_Wh;  /**< 0..655 340 since the session began, or absent */
} taper_evse_elec_t;

/** TIME_SYNC, gateway to all, 1 s. */
typedef struct {
    uint32_t unix_s;
    uint16_t ms;
    uint8_t quality; /**< 0: the clock was never set */
} taper_time_sync_t;

/** CTRL_STATUS, controller to all, 1 s. */
typedef struct {
    uint8_t mode;         /**< taper_mode_t */
    uint8_t verdict;      /**< taper_verdict_t of the last plan, or of the one in work */
    uint8_t limit_source; /**< taper_limit_source_t of the limit in force */
    uint8_t solve_ticks;  /**< control ticks that it took so far */
    uint16_t iterations;  /**< of it so far, 0..510 in steps of 2 */
    uint8_t active;       /**< vehicles that want energy */
    uint8_t waiting;      /**< of these, without current */
    uint8_t plan_version; /**< counts plans */
} taper_ctrl_status_t;

/** EV_PARAM_A, connector to controller, 2 s and on change. */
typedef struct {
    uint8_t revision; /**< 0..15, changes with any of A..E and with every new session */
    uint8_t session;
    int32_t capacity_Wh;          /**< 100..6 553 400, or absent */
    int32_t soc_target_permille;  /**< 0..1000, or absent */
    int32_t soc_minimum_permille; /**< 0..1000, or absent */
    int32_t soc_plug_in_permille; /**< 0..1000, or absent */
} taper_ev_param_a_t;

typedef struct {
    uint8_t revision;
    uint8_t session;
    int32_t departure_min; /**< 0..65534: Unix minutes modulo 65535, or absent */
    int32_t peak_W;        /**< 0..655 340: of the taper's line, at SOC 0, or absent */
    int32_t min_mA;        /**< 0..127 000, or absent */
} taper_ev_param_b_t;

typedef struct {
    uint8_t revision;
    int32_t target_Wh;  /**< -655 340..655 340: energy wanted since plug-in, or absent */
    int32_t maximum_Wh; /**< likewise */
    int32_t minimum_Wh; /**< likewise */
} taper_ev_param_c_t;

/** EV_PARAM_D: the taper. ISO 15118 does not carry it; a connector that knows the vehicle's curve tells it here. */
typedef struct {
    uint8_t revision;
    uint8_t session;
    int32_t taper_W; /**< 0..655 340: fall of the maximum power from SOC 0 to SOC 1, or absent: unknown */
} taper_ev_param_d_t;

/** EV_PARAM_E: a second line of the taper; the vehicle takes no more than the lower one. */
typedef struct {
    uint8_t revision;
    uint8_t session;
    int32_t peak_W;  /**< 0..655 340: at SOC 0, or absent; 0 or absent: there is no second line */
    int32_t taper_W; /**< 0..655 340: fall from SOC 0 to SOC 1, or absent: none */
} taper_ev_param_e_t;

/** EMCY, any node, event: 3 x at 20 ms, then every second while it lasts. */
typedef struct {
    uint8_t severity; /**< taper_severity_t */
    uint16_t code;    /**< taper_event_code_t of the station; other nodes may use their own */
    uint8_t
        reaction; /**< of the sender: 0 none, 1 its frames are dropped, 2 no current for `about`, 3 for nobody */
    uint8_t session; /**< 0: none */
    uint8_t about;   /**< node that it is about; 0: the sender or the station */
    uint8_t data;    /**< depends on the code */
} taper_emcy_t;

/** SITE_METER, gateway to controller, 1 s: what else the site draws; negative: it feeds in. */
typedef struct {
    int32_t other_mA[3]; /**< -3 276 700..3 276 700 per phase, or absent */
} taper_site_meter_t;

/** EVSE_INFO, connector to controller, at boot and every 5 s. */
typedef struct {
    uint8_t protocol_version; /**< 0..15; TAPER_PROTOCOL_VERSION is ours */
    int32_t max_mA;           /**< 0..6 553 400, hardware, or absent */
    int32_t min_mA;           /**< 0..127 000, or absent */
    uint8_t kind;             /**< taper_kind_t */
    uint8_t rotation;         /**< taper_rotation_t */
    uint16_t firmware;        /**< version of the connector's firmware, major << 8 | minor */
} taper_evse_info_t;

/** PLAN, controller to all, each connector every few seconds: for display and for the vehicle's schedule, not control. */
typedef struct {
    int32_t power_W[3]; /**< 0..655 340, planned for this step and the next two, or absent */
} taper_plan_t;

/** OUTLOOK, controller to all, each connector every few seconds: what to tell the driver. */
typedef struct {
    bool soc_estimated, by_energy, departure_passed, no_clock;
    uint8_t reason;                    /**< taper_reason_t: why the connector has the current that it has */
    uint8_t waiting_place;             /**< 0..15 */
    uint8_t waiting_of;                /**< 0..15 */
    int32_t soc_at_departure_permille; /**< 0..1000, or absent */
    int32_t short_Wh;                  /**< 0..655 340 missing at departure, or absent */
    uint8_t because;                   /**< taper_reason_t: for which limit */
} taper_outlook_t;

/** CTRL_DIAG, controller to all, 1 s, one counter after the other. */
typedef struct {
    uint8_t index;     /**< taper_counter_t */
    uint8_t auxiliary; /**< depends on the counter; 0 so far */
    uint32_t value;
} taper_ctrl_diag_t;

/** One decoded frame. */
typedef struct {
    taper_message_kind_t kind;
    uint8_t bus;
    uint8_t node;
    union {
        taper_emcy_t emcy;
        taper_site_meter_t site_meter;
        taper_evse_info_t evse_info;
        taper_plan_t plan;
        taper_outlook_t outlook;
        taper_ctrl_diag_t ctrl_diag;
        taper_site_limit_t site_limit;
        taper_setpoint_t setpoint;
        taper_evse_status_t evse_status;
        taper_ev_status_t ev_status;
        taper_evse_elec_t evse_elec;
        taper_time_sync_t time_sync;
        taper_ctrl_status_t ctrl_status;
        taper_ev_param_a_t ev_param_a;
        taper_ev_param_b_t ev_param_b;
        taper_ev_param_c_t ev_param_c;
        taper_ev_param_d_t ev_param_d;
        taper_ev_param_e_t ev_param_e;
    } as;
} taper_message_t;

#endif
