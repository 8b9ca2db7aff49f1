/** The simulated field alone on a bus in memory; the test is the station. Virtual time, a poll each 20 ms. */
#ifndef TAPER_TEST_FIELD_BENCH_H
#define TAPER_TEST_FIELD_BENCH_H

#include "field.h"
#include "taper/membus.h"
#include "taper/message.h"

#define POLL_ms       20u
#define WORLD_START_S 600000.0

/** Frames of one identifier. */
typedef struct {
    uint32_t count;
    uint32_t first_ms, last_ms;
    uint32_t longest_gap_ms, shortest_gap_ms;
    taper_message_t message; /**< the last one */
    uint8_t counter;         /**< end-to-end, of the last one */
} field_log_t;

typedef struct {
    sim_field_t field;
    taper_membus_t bus;
    taper_port_t station_port, world_port;
    sim_session_t session[16];
    sim_sessions_t sessions;
    sim_outcome_t outcome[16];
    taper_station_config_t station;
    uint32_t now_ms;
    uint32_t most_in_a_poll; /**< frames */
    field_log_t log[2048];   /**< by identifier */
    uint8_t counter[64];     /**< of the setpoints that the test sends */
} field_bench_t;

extern field_bench_t at;

/** 40 kWh, from 50 % to 100 %, 22 kW, no taper; comes at `WORLD_START_S + after_s` and stays for two hours. */
sim_session_t field_vehicle(double after_s);

/** Options for the hub. */
sim_field_options_t field_options(void);

/** A field at rest; `count` sessions are copied. */
void field_start(const sim_field_options_t *options, const sim_session_t *sessions, size_t count);
void field_end(void);

/** Let time pass, a multiple of POLL_ms. Every frame is checked and logged, but those of ISO-TP. */
void field_run_ms(uint32_t ms);

/** Forget what was logged. */
void field_forget(void);

/** The frames of a kind from a node (1.. or 62). */
const field_log_t *field_log(taper_message_kind_t kind, uint8_t node);

/** Send a SETPOINT; the field hears it at its next poll. */
void field_send(uint8_t node, const taper_setpoint_t *setpoint);

/** "Charge" with `current_mA`, valid for `validity_ms`, fallback 6 A. */
void field_charge(uint8_t node, uint8_t session, int32_t current_mA, int32_t validity_ms);

/** Connector by its node. */
const sim_evse_t *field_evse(uint8_t node);

#endif
