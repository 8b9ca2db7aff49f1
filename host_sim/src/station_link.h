/**
 * The station that a run steps, with the bus between it and the world: within the program (station_local.h), or on a board
 * (station_board.h). Both answer the same to the same frames, to the bit.
 *
 * Time is the caller's. Frames that are sent to the station are received at the time set last; what the station sent in a
 * step or a poll waits in the port when that returns.
 */
#ifndef SIM_STATION_LINK_H
#define SIM_STATION_LINK_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "baselines.h"
#include "taper/message.h"
#include "taper/port.h"
#include "taper/station.h"

/** How the station is to be. Borrowed; must outlive the link. */
typedef struct {
    const taper_station_config_t *config;
    const taper_solver_t *solver; /**< NULL: none was built in */
    const sim_policy_t *policy;
    uint16_t iterations_per_tick;
} sim_station_setup_t;

/** As the last step or poll left it. */
typedef struct {
    bool is_settled; /**< taper_station_is_settled() */
    taper_mode_t mode;
    uint32_t plans;        /**< finished, ever */
    bool planned;          /**< the planner worked in this call */
    uint32_t instructions; /**< of this call; 0: not known */
} sim_station_state_t;

/** The last solve that finished. */
typedef struct {
    uint16_t iterations;
    double solve_ms; /**< wall time; negative: not known */
} sim_solve_t;

/** What the hardware tells when the run is over. */
typedef struct {
    bool known;
    uint32_t stack_used_B, stack_size_B; /**< size 0: not known */
    uint32_t frame_mean,
        frames_worst; /**< instructions to take in a frame, and all that came in a tick; 0: not known */
} sim_hardware_t;

typedef struct sim_link sim_link_t;

/** Every function that answers bool has put one line on stderr if it is false; the run is over then. */
typedef struct {
    /** Bring the station up. */
    bool (*start)(sim_link_t *link, const sim_station_setup_t *setup);
    void (*set_time)(sim_link_t *link, uint32_t now_ms);
    bool (*step)(sim_link_t *link, uint32_t now_ms);
    bool (*poll)(sim_link_t *link, uint32_t now_ms);
    /** Of the last solve that finished. */
    bool (*solve)(sim_link_t *link, sim_solve_t *solve);
    /** What the station tells about those connectors that are `wanted`; the others are left alone. */
    bool (*look)(sim_link_t *link, const bool wanted[TAPER_MAX_CONNECTORS],
                 taper_outlook_t outlook[TAPER_MAX_CONNECTORS]);
    bool (*counter)(sim_link_t *link, taper_counter_t which, uint32_t *value);
    bool (*hardware)(sim_link_t *link, sim_hardware_t *hardware);
    /** Whether frames for the station were lost, as far as this end knows. */
    bool (*is_overrun)(const sim_link_t *link);
    void (*close)(sim_link_t *link);
} sim_link_calls_t;

/** Head of both kinds. */
struct sim_link {
    const sim_link_calls_t *calls;
    taper_port_t port; /**< the world's end of the bus */
    sim_station_state_t state;
    const taper_station_t *station; /**< NULL: out of reach. For the planning problems. */
};

#endif
