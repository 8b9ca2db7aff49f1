#include "drive_hooks.h"

#include "boot.h"
#include "clock.h"
#include "emulator.h"
#include "fault.h"
#include "site.h"
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

/** From now on, over resets, the board's own clock stands still. */
static void let_go(void) {
    mps2_watchdog_stop();
    mps2_clock_stop();
    mps2_boot()->is_driven = true;
}

static void set_up(void *context, const taper_drive_setup_t *setup) {
    const mps2_board_t *board = context;
    let_go();
    mps2_store_erase();
    (void)mps2_site_keep(&board->port, setup);
}

static bool resume(void *context, taper_drive_setup_t *setup) {
    const mps2_board_t *board = context;
    let_go();
    return mps2_site_kept(&board->port, setup);
}

static void begin_call(void *context) {
    mps2_board_t *board = context;
    mps2_watchdog_start(LONGEST_CALL_ms);
    board->call_began = mps2_clock_cycles();
}

/** Between calls the clock waits for the simulation, and nobody is to be watched. */
static uint32_t end_call(void *context) {
    const mps2_board_t *board = context;
    const uint32_t cycles = mps2_clock_cycles() - board->call_began;
    mps2_watchdog_stop();
    return cycles * MPS2_INSTRUCTIONS_PER_CYCLE;
}

static uint32_t kicks(void *context) {
    return ((const mps2_board_t *)context)->kicks;
}

static void reset(void *context) {
    (void)context;
    mps2_reset();
}

static void exit_emulator(void *context, uint8_t status) {
    (void)context;
    mps2_emulator_exit(status);
}

taper_driven_board_t mps2_drive_hooks(mps2_board_t *board) {
    return (taper_driven_board_t){.context = board,
                                  .figure = figure,
                                  .set_up = set_up,
                                  .resume = resume,
                                  .call_begins = begin_call,
                                  .call_ends = end_call,
                                  .kicks = kicks,
                                  .reset = reset,
                                  .exit = exit_emulator};
}
