#include "watchdog.h"

#include "registers.h"

#define CYCLES_PER_ms (MPS2_CLOCK_Hz / 1000u)

/** It counts down all the time: expiries while it is off are kept, and the second one would reset when it is switched on. */
static void set(uint32_t control, uint32_t load) {
    MPS2_WATCHDOG->lock = MPS2_WATCHDOG_UNLOCK;
    MPS2_WATCHDOG->load = load;
    MPS2_WATCHDOG->clear = 1;
    MPS2_WATCHDOG->control = control;
    MPS2_WATCHDOG->lock = 0;
}

void mps2_watchdog_start(uint32_t ms) {
    set(MPS2_WATCHDOG_NMI | MPS2_WATCHDOG_RESET,
        ms < UINT32_MAX / CYCLES_PER_ms ? ms * CYCLES_PER_ms : UINT32_MAX);
}

void mps2_watchdog_kick(void) {
    MPS2_WATCHDOG->lock = MPS2_WATCHDOG_UNLOCK;
    MPS2_WATCHDOG->clear = 1;
    MPS2_WATCHDOG->lock = 0;
}

void mps2_watchdog_stop(void) {
    set(0, UINT32_MAX);
}
