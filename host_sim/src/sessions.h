/** The charging sessions of a run, from a CSV file. */
#ifndef SIM_SESSIONS_H
#define SIM_SESSIONS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "charge_curve.h"

/**
 * One visit of one vehicle. It tells that it takes at most max_kw - taper_kw * SOC and, if it has a second line, at most
 * second_max_kw - second_taper_kw * SOC; never below 0. That is so unless it has a curve, which it then obeys instead.
 */
typedef struct {
    char *id;
    unsigned connector; /**< 1..connectors of the station; 0: the first free one */
    double arrival_s;
    double departure_s; /**< when it leaves */
    double told_s;      /**< departure that the driver tells; all that the station knows */
    double battery_kwh;
    double soc_arrival; /**< 0..1 */
    double soc_target;  /**< soc_arrival..1 */
    double max_kw;
    double taper_kw;        /**< 0..max_kw */
    double second_max_kw;   /**< 0: there is no second line */
    double second_taper_kw; /**< 0..second_max_kw */
    sim_charge_curve_t curve;
    uint8_t phases; /**< that its charger uses, 1 or 3; 0: all that the connector has */
} sim_session_t;

typedef struct {
    sim_session_t *session; /**< [count], in the order of the file */
    size_t count;
} sim_sessions_t;

/** Energy that a session asks for [kWh]. */
static inline double sim_session_request_kwh(const sim_session_t *session) {
    return (session->soc_target - session->soc_arrival) * session->battery_kwh;
}

/** Most that the vehicle takes at `soc`, >= 0 [kW]. */
double sim_session_takes_kw(const sim_session_t *session, double soc);

/** Most that it takes at any SOC: the flat limit that it tells (EV_STATUS) [kW]. */
double sim_session_most_kw(const sim_session_t *session);

/**
 * Read a sessions file for a station with `connectors` connectors.
 * @return false, after one line on stderr, at the first row that is not right. Else free with sim_sessions_free().
 */
bool sim_sessions_load(sim_sessions_t *sessions, const char *file, unsigned connectors);

void sim_sessions_free(sim_sessions_t *sessions);

#endif
