/** The watchdog: its first end is an NMI, which reports and resets; should that hang, its second end resets. */
#ifndef MPS2_WATCHDOG_H
#define MPS2_WATCHDOG_H

#include <stdint.h>

/** Start it, or start it anew: its first end comes after `ms`, or 171 s if that is less. */
void mps2_watchdog_start(uint32_t ms);

/** Only when the station says so (kick_watchdog of its port). */
void mps2_watchdog_kick(void);

/** It stands still: nobody is to be watched. */
void mps2_watchdog_stop(void);

#endif
