/** Every frame that the station sends in a run, in the form of `candump -l`, with the virtual time of the call that sent it. */
#ifndef SIM_FRAMES_LOG_H
#define SIM_FRAMES_LOG_H

#include <stdint.h>
#include <stdio.h>

#include "taper/port.h"

typedef struct {
    FILE *file; /**< NULL: nowhere */
    taper_port_t inner;
    uint64_t time_ms; /**< set by the owner */
} sim_frames_log_t;

/** The world's end of the bus, `inner`, with whatever is received from it written to `file`. `log` must outlive it. */
taper_port_t sim_frames_log_port(sim_frames_log_t *log, const taper_port_t *inner, FILE *file);

#endif
