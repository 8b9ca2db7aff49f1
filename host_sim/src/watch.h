/** What can be learned about a controller from its frames alone. */
#ifndef SIM_WATCH_H
#define SIM_WATCH_H

#include <stdbool.h>
#include <stdint.h>

#include "stats.h"
#include "taper/e2e.h"
#include "taper/frame.h"
#include "taper/message.h"
#include "taper/types.h"

/** CAN buses that can be watched. */
#define SIM_WATCH_BUSES 4

/** What a controller told about one connector. */
typedef struct {
    taper_e2e_receiver_t check;
    bool told;
    taper_outlook_t outlook; /**< the last one */
} sim_watched_t;

typedef struct {
    sim_watched_t node[SIM_WATCH_BUSES][TAPER_NODES_PER_BUS + 1];
    bool told[SIM_WATCH_BUSES][TAPER_NODES_PER_BUS + 1]; /**< nodes that SETPOINT was sent to */
    unsigned connectors;                                 /**< how many they are */
    taper_e2e_receiver_t status_check, diag_check;
    taper_mode_t mode;         /**< by the last CTRL_STATUS; INIT before the first */
    uint32_t fallback_reports; /**< CTRL_STATUS in mode FALLBACK or FAILSAFE: about one a second */
    uint32_t plans;            /**< finished since the first CTRL_STATUS */
    uint8_t plan_version;
    bool version_known;
    uint32_t guard_violations; /**< by CTRL_DIAG */
    sim_samples_t iterations;  /**< of the plans; what CTRL_STATUS did not come in time for is missing */
} sim_watch_t;

/** Take in a frame from the bus. What is not a controller's is ignored. */
void sim_watch_take(sim_watch_t *watch, const taper_frame_t *frame);

/** The last OUTLOOK for a node 1.., or NULL: there was none. */
const taper_outlook_t *sim_watch_outlook(const sim_watch_t *watch, unsigned bus, unsigned node);

void sim_watch_free(sim_watch_t *watch);

#endif
