#include "watchdog.h"

#include "registers.h"

#define CYCLES_PER_ms (MPS2_CLOCK_Hz / 1000u)

static void set(uint32_t control) {
    MPS2_WATCHDOG->lock = MPS2_WATCHDOG_UNLOCK;
    MPS2_WATCHDOG->control = control;
    MPS2_WATCHDOG->lock = 0;
}

void mps2_watchdog_start(uint32_t ms) {
    MPS2_WATCHDOG->lock = MPS2_WATCHDOG_UNLOCK;
    MPS2_WATCHDOG->load = ms < UINT32_MAX / CYCLES_PER_ms ? ms * CYCLES_PER_ms : UINT32_MAX;
    MPS2_WATCHDOG->clear = 1; // it also ran while it was off, and an expiry then would count now
    set(MPS2_WATCHDOG_NMI | MPS2_WATCHDOG_RESET);
}

void mps2_watchdog_kick(void) {
    MPS2_WATCHDOG->lock = MPS2_WATCHDOG_UNLOCK;
    MPS2_WATCHDOG->clear = 1;
    MPS2_WATCHDOG->lock = 0;
}

void mps2_watchdog_stop(void) {
    set(0);
}
