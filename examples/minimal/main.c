/* A firmware around Taper: one station, its clock, its port. */
#include "board.h"
#include "taper/solvers.h"
#include "taper/station.h"
#include "taper/stations.h"

#define POLL_ms    20u
#define STOP_CALLS 3

static taper_station_t station; /* large: not on the stack */

static void run(void) {
    uint32_t tick_ms = board_now_ms(); /* when the next step is due */
    while (board_is_up()) {
        const uint32_t now_ms = board_now_ms();
        if (taper_time_reached(now_ms, tick_ms)) {
            taper_station_step(&station, now_ms);
            tick_ms += taper_station_hub.tick_ms;
        } else {
            taper_station_poll(&station, now_ms);
        }
        board_wait_ms(POLL_ms);
    }
}

/* Every connector is told its fallback current, more than once: a frame may be lost. */
static void stop(void) {
    for (int call = 0; call < STOP_CALLS; call++) {
        taper_station_stop(&station, board_now_ms());
        board_wait_ms(POLL_ms);
    }
}

int main(void) {
    const taper_port_t port = board_start();
    const taper_station_options_t options = {
        .config = &taper_station_hub,
        .port = &port,
        .solver = &taper_solver_hub, /* NULL: no planner, earliest deadline first */
        .iterations_per_tick = TAPER_MIN_SLICE,
    };
    if (taper_station_init(&station, &options) != TAPER_OK) {
        return 1; /* never step it: the description does not fit this image */
    }
    run();
    stop();
    return 0;
}
