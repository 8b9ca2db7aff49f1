#include "taper/supervisor.h"

void taper_supervisor_init(taper_supervisor_t *supervisor) {
    *supervisor = (taper_supervisor_t){.mode = TAPER_MODE_INIT};
}

taper_mode_t taper_supervisor_update(taper_supervisor_t *supervisor, const taper_situation_t *situation,
                                     uint32_t now_ms) {
    if (!supervisor->started) {
        supervisor->started = true;
        supervisor->started_ms = now_ms;
    }
    const bool booting = supervisor->mode == TAPER_MODE_INIT && !situation->gateway_heard &&
                         taper_elapsed_ms(now_ms, supervisor->started_ms) < TAPER_INIT_ms;
    if (booting) {
        supervisor->mode = TAPER_MODE_INIT;
    } else if (!situation->gateway_alive) {
        supervisor->mode = TAPER_MODE_FAILSAFE;
    } else {
        supervisor->mode = situation->proposal_ready ? TAPER_MODE_PLAN : TAPER_MODE_FALLBACK;
    }
    return supervisor->mode;
}
