#include "watchdog.h"

#include "registers.h"

static void set(uint32_t control) {
    MPS2_WATCHDOG->lock = MPS2_WATCHDOG_UNLOCK;
    MPS2_WATCHDOG->control = control;
    MPS2_WATCHDOG->lock = 0;
}

/* It goes on counting while it is stopped, and what has run out then would strike at once. */
void mps2_watchdog_start(uint32_t ms) {
    MPS2_WATCHDOG->lock = MPS2_WATCHDOG_UNLOCK;
    MPS2_WATCHDOG->load = ms * (MPS2_CLOCK_Hz / 1000u);
    MPS2_WATCHDOG->clear = 1;
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
