#include "free_run.h"

#include "watchdog.h"

#define POLL_ms UINT32_C(20)
/** Ticks without a kick until the watchdog's NMI: connectors keep their setpoints for three. */
#define PATIENCE_TICKS 2u

static uint32_t step_ms, poll_ms; // when they are due

void mps2_free_run_start(mps2_board_t *board) {
    if (mps2_board_make_station(board)) {
        mps2_watchdog_start(PATIENCE_TICKS * board->config.tick_ms);
    }
}

/** A step that is due for more than a tick is late, and others are left out. */
static void step(mps2_board_t *board, uint32_t now_ms) {
    const uint32_t tick_ms = board->config.tick_ms;
    taper_station_step(&board->station, now_ms);
    step_ms += tick_ms;
    if (taper_time_reached(now_ms, step_ms)) {
        step_ms = now_ms + tick_ms;
    }
}

void mps2_free_run_call(mps2_board_t *board, uint32_t now_ms) {
    if (!board->has_station) {
        return;
    }
    if (taper_time_reached(now_ms, step_ms)) {
        step(board, now_ms);
        poll_ms = now_ms + POLL_ms;
    } else if (taper_time_reached(now_ms, poll_ms)) {
        taper_station_poll(&board->station, now_ms);
        poll_ms = now_ms + POLL_ms;
    }
}
