/**
 * What a run delivered, and its files.
 *
 * Numbers are written with a fixed count of decimals, so that equal runs give equal bytes; the one exception is
 * solve_ms in summary.json, which is wall time. On a board nobody knows that: it is null, and `board` tells what was measured.
 */
#ifndef SIM_RESULTS_H
#define SIM_RESULTS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#include "evse.h"
#include "sessions.h"
#include "station_link.h"
#include "stats.h"
#include "taper/bus.h"
#include "taper/message.h"
#include "work.h"

/** What became of one session. */
typedef struct {
    unsigned connector; /**< 1..; 0: it never found a free one */
    double energy_kwh;
    double queued_s; /**< from arrival until plugged in, or until it gave up; 0 if served at its first tick */
    bool told;       /**< the station told an outlook for it; the next two are of the last one */
    uint8_t reason;  /**< taper_reason_t */
    uint8_t because; /**< taper_reason_t, meaningful if it was to leave short of energy */
    bool leaves_short;
} sim_outcome_t;

/** A text file that is being made in memory. */
typedef struct {
    FILE *stream; /**< NULL: not wanted */
    char *text;
    size_t size;
} sim_text_t;

typedef struct {
    const char *policy; /**< borrowed, like the next */
    const char *station;
    const sim_sessions_t *sessions;
    sim_outcome_t *outcome; /**< [sessions->count] */
    sim_text_t steps, connectors;
    sim_samples_t iterations, solve_ms;
    double peak_kw;
    bool priced;                /**< `cost` means something */
    double cost;                /**< of the energy drawn from the grid, in the currency of the prices */
    double price_weight;        /**< negative: the station's own */
    bool learns;                /**< the station learns tapers */
    const sim_errors_t *errors; /**< of vehicles and meters; NULL: none of these were asked for. Borrowed */
    bool unannounced;           /**< one of these: the course of the limit was not told ahead */
    int64_t tick_s;
    uint64_t seed;
    double min_current_A; /**< negative: the station's own */
    uint32_t violation_ticks;
    uint32_t fallback_ticks;
    uint32_t solves;
    uint32_t guard_violations;
    sim_hardware_t hardware; /**< not known: the station was part of this program */
    sim_work_t work;
} sim_results_t;

/** Begin. With `records`, what sim_results_write() needs of every tick is kept. End with sim_results_free(). */
void sim_results_init(sim_results_t *results, const sim_sessions_t *sessions, bool records);

/** One tick of the site. */
void sim_results_step(sim_results_t *results, int64_t time_s, double limit_kw, double power_kw,
                      unsigned active, taper_mode_t mode);

/** One tick of an occupied connector. */
typedef struct {
    int64_t time_s;
    unsigned connector;             /**< from 0 */
    const sim_evse_t *evse;         /**< its vehicle is one of the sessions of the results */
    double soc;                     /**< at the beginning */
    double current_A;               /**< the mean */
    const taper_outlook_t *outlook; /**< NULL: none was told */
} sim_connector_row_t;

void sim_results_connector(sim_results_t *results, const sim_connector_row_t *row);

/**
 * Write summary.json, sessions.csv, steps.csv and connectors.csv to a directory, which is made if it does not exist.
 * They are written to a directory beside it first and then renamed, so nothing half-written is ever in it.
 * @return false, after one line on stderr.
 */
bool sim_results_write(sim_results_t *results, const char *directory);

/** Print what a person wants to know, in a few lines. */
void sim_results_print(sim_results_t *results, FILE *stream);

void sim_results_free(sim_results_t *results);

#endif
