/** The station's clock in a recorded bus. */
#ifndef SIM_REPLAY_CLOCK_H
#define SIM_REPLAY_CLOCK_H

#include "replay_log.h"

/**
 * Find the station's time 0, and from it the station's time of every frame.
 *
 * The station is called on a grid: a tick each `tick_ms`, polls between. Of its own recording time 0 is known; sent frames
 * carry the exact time of their call, and received ones the time that the station saw. In any other log sent frames come a little after
 * their call; the earliest of their surroundings show where the grid lies, to less than a millisecond.
 *
 * @return false: no CTRL_STATUS was sent.
 */
bool sim_replay_set_clock(sim_replay_log_t *log, uint32_t tick_ms);

#endif
