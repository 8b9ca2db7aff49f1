#include "drive_hooks.h"

#include "clock.h"
#include "emulator.h"
#include "fault.h"
#include "stack.h"
#include "store.h"
#include "watchdog.h"

/** A whole solve of the largest station takes a quarter of it. */
#define LONGEST_CALL_ms 2000u

static uint32_t figure(void *context, taper_drive_figure_t figure) {
    (void)context;
    switch (figure) {
    case TAPER_DRIVE_STACK_USED_B: return mps2_stack_used_B();
    case TAPER_DRIVE_STACK_SIZE_B: return mps2_stack_size_B();
    case TAPER_DRIVE_STORE_WRITES: return mps2_store_writes();
    default: return 0;
    }
}

static uint32_t instructions(void *context) {
    (void)context;
    return mps2_clock_cycles() * MPS2_INSTRUCTIONS_PER_CYCLE;
}

static void watch(void *context, bool is_in_call) {
    (void)context;
    if (is_in_call) {
        mps2_watchdog_start(LONGEST_CALL_ms);
    } else {
        mps2_watchdog_stop();
    }
}

static void forget(void *context) {
    (void)context;
    mps2_store_erase();
}

static uint32_t kicks(void *context) {
    return *(const uint32_t *)context;
}

static void reset(void *context) {
    (void)context;
    mps2_reset();
}

static void exit_emulator(void *context, uint8_t status) {
    (void)context;
    mps2_emulator_exit(status);
}

taper_driven_board_t mps2_drive_hooks(uint32_t *kick_count) {
    return (taper_driven_board_t){.context = kick_count,
                                  .figure = figure,
                                  .instructions = instructions,
                                  .watch = watch,
                                  .set_up = forget,
                                  .kicks = kicks,
                                  .reset = reset,
                                  .exit = exit_emulator};
}
