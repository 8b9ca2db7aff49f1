/** One vehicle at one connector of a small station, to be reported to a session table and asked for its demand. */
#ifndef TAPER_TEST_SESSION_BENCH_H
#define TAPER_TEST_SESSION_BENCH_H

#include <stdbool.h>
#include <stdint.h>

#include "taper/session.h"

/** Connectors of the bench's station: 0 is AC with 3 phases, 1 AC with 1 phase, 2 DC with continuous currents. */
#define BENCH_AC3 0
#define BENCH_AC1 1
#define BENCH_DC  2

/** Session table and clock; the reports below are what the next bench_report_...() sends. */
typedef struct {
    taper_session_table_t table;
    uint32_t now_ms;
    uint8_t connector;
    taper_evse_status_t status;
    taper_ev_status_t ev;
    taper_evse_elec_t elec;
    taper_ev_param_a_t a;
    taper_ev_param_b_t b;
    taper_ev_param_c_t c;
    taper_ev_param_d_t d;
    taper_ev_param_e_t e;      /**< sent by bench_report_e() alone */
    taper_snapshot_t snapshot; /**< of the last bench_demand() */
} session_bench_t;

/**
 * An empty table at an odd time, and a sound vehicle ready to be reported: 60 kWh at 20 %, wants 20 kWh, 11 kW falling
 * by 4.4 kW, 16 A, departure unknown, session 7, revision 1.
 */
void bench_start(session_bench_t *bench, uint8_t connector);

void bench_report_status(session_bench_t *bench);
void bench_report_ev(session_bench_t *bench);
void bench_report_elec(session_bench_t *bench);
void bench_report_a(session_bench_t *bench);
void bench_report_b(session_bench_t *bench);
void bench_report_c(session_bench_t *bench);
void bench_report_d(session_bench_t *bench);
void bench_report_e(session_bench_t *bench);
/** A, B, C and D. */
void bench_report_parameters(session_bench_t *bench);
/** Everything, in the order of the bus. */
void bench_plug_in(session_bench_t *bench);
/** A new revision in A..D; not reported yet. */
void bench_next_revision(session_bench_t *bench);
void bench_unplug(session_bench_t *bench);
void bench_report_time(session_bench_t *bench, uint32_t unix_s, uint16_t ms, uint8_t quality);

/** The control tick: taper_session_update() now. */
void bench_tick(session_bench_t *bench);

/** Time goes on, and every report comes again at its end, unchanged. */
void bench_live(session_bench_t *bench, uint32_t ms);

/** A tick, and the demand of the bench's connector after it. Valid until the next call. */
const taper_demand_t *bench_demand(session_bench_t *bench);

#endif
