#include "free_run.h"

#include "watchdog.h"

#define POLL_ms UINT32_C(20)
/** Ticks without a kick until the watchdog's NMI: connectors keep their setpoints for three. */
#define PATIENCE_TICKS 2u

static bool is_running;
static uint32_t tick_ms;
static uint32_t step_ms, poll_ms; // when they are due

void mps2_free_run_start(taper_station_t *station, const taper_station_options_t *options) {
    is_running = taper_station_init(station, options) == TAPER_OK;
    tick_ms = options->config->tick_ms;
    if (is_running) {
        mps2_watchdog_start(PATIENCE_TICKS * tick_ms);
    }
}

/** What is late by a tick is left out. */
static void step(taper_station_t *station, uint32_t now_ms) {
    taper_station_step(station, now_ms);
    step_ms += tick_ms;
    if (taper_time_reached(now_ms, step_ms)) {
        step_ms = now_ms + tick_ms;
    }
}

void mps2_free_run_call(taper_station_t *station, uint32_t now_ms) {
    if (!is_running || !taper_time_reached(now_ms, poll_ms)) {
        return;
    }
    if (taper_time_reached(now_ms, step_ms)) {
        step(station, now_ms);
    } else {
        taper_station_poll(station, now_ms);
    }
    const uint32_t next_ms = now_ms + POLL_ms;
    poll_ms = taper_time_reached(next_ms, step_ms) ? step_ms : next_ms;
}
