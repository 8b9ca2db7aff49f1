/**
 * What is drawn within a tick of taper-sim: energy, cost, and what is above a limit. A tick is a sequence of times at which
 * setpoints came; between two of them power is constant.
 */
#ifndef SIM_ACCOUNT_H
#define SIM_ACCOUNT_H

#include <stdbool.h>
#include <stdint.h>

#include "fleet.h"
#include "limits_csv.h"
#include "loads.h"
#include "results.h"
#include "taper/message.h"

/** All pointers are borrowed. */
typedef struct {
    sim_fleet_t *fleet;
    const sim_course_t *prices; /**< NULL: energy has no price */
    sim_results_t *results;
    int64_t begin_s;                    /**< of the present tick */
    double limit_kw;                    /**< in it */
    double at_s;                        /**< accounted for up to here */
    unsigned active;                    /**< vehicles that want energy, at its start */
    double site_kwh;                    /**< that the site would draw in it if nobody left before its end */
    double soc[TAPER_MAX_CONNECTORS];   /**< at its start */
    double A_s[TAPER_MAX_CONNECTORS];   /**< charge in it, like site_kwh */
    uint8_t told[TAPER_MAX_CONNECTORS]; /**< conductors in use, as reported at its start */
    sim_breach_t worst;
} sim_account_t;

/** A tick begins, in which the site has `limit_kw`; the connectors have heard their setpoints. */
void sim_account_begin(sim_account_t *account, int64_t now_s, double limit_kw);

/** Time passes until `now_s`. */
void sim_account_pass(sim_account_t *account, double now_s);

/** The connectors obey other setpoints from now on. */
void sim_account_obey(sim_account_t *account);

/** The rest of the tick passes, and all of it is written down. `outlook` of every connector with a vehicle tells why;
    NULL: not known. */
void sim_account_end(sim_account_t *account, taper_mode_t mode, const taper_outlook_t *outlook);

#endif
