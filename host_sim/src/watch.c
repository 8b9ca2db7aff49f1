#include "watch.h"

#include "taper/codec.h"
#include "taper/planner.h"

static void take_setpoint(sim_watch_t *watch, const taper_frame_t *frame) {
    const unsigned node = frame->id & 0x3FU;
    if (frame->bus < SIM_WATCH_BUSES && node >= 1 && node <= TAPER_NODES_PER_BUS &&
        !watch->told[frame->bus][node]) {
        watch->told[frame->bus][node] = true;
        watch->connectors++;
    }
}

/** Decode a frame whose protection is good. */
static bool read(taper_e2e_receiver_t *check, const taper_frame_t *frame, taper_message_t *message) {
    bool bad_field = false;
    const taper_e2e_check_t result = taper_e2e_check(check, frame);
    return (result == TAPER_E2E_OK || result == TAPER_E2E_OK_SOME_LOST) &&
           taper_decode(frame, message, &bad_field);
}

static void take_status(sim_watch_t *watch, const taper_ctrl_status_t *status) {
    const uint8_t finished = (uint8_t)(status->plan_version - watch->plan_version);
    if (watch->version_known && finished != 0) {
        watch->plans += finished;
        if (status->verdict != TAPER_VERDICT_SOLVING) {
            sim_samples_add(&watch->iterations, status->iterations);
        }
    }
    watch->version_known = true;
    watch->plan_version = status->plan_version;
    watch->mode = (taper_mode_t)status->mode;
    const bool falls_back = watch->mode == TAPER_MODE_FALLBACK || watch->mode == TAPER_MODE_FAILSAFE;
    watch->fallback_reports += falls_back ? 1 : 0;
}

static void take_outlook(sim_watch_t *watch, const taper_frame_t *frame) {
    const unsigned node = frame->id & 0x3FU;
    taper_message_t message;
    if (frame->bus >= SIM_WATCH_BUSES || node < 1 || node > TAPER_NODES_PER_BUS) {
        return;
    }
    sim_watched_t *watched = &watch->node[frame->bus][node];
    if (read(&watched->check, frame, &message)) {
        watched->told = true;
        watched->outlook = message.as.outlook;
    }
}

const taper_outlook_t *sim_watch_outlook(const sim_watch_t *watch, unsigned bus, unsigned node) {
    const sim_watched_t *watched = &watch->node[bus][node];
    return watched->told ? &watched->outlook : NULL;
}

void sim_watch_take(sim_watch_t *watch, const taper_frame_t *frame) {
    taper_message_t message;
    switch (frame->id >> 6) {
    case TAPER_MESSAGE_SETPOINT: take_setpoint(watch, frame); break;
    case TAPER_MESSAGE_OUTLOOK: take_outlook(watch, frame); break;
    case TAPER_MESSAGE_CTRL_STATUS:
        if (frame->bus == 0 && read(&watch->status_check, frame, &message)) {
            take_status(watch, &message.as.ctrl_status);
        }
        break;
    case TAPER_MESSAGE_CTRL_DIAG:
        if (frame->bus == 0 && read(&watch->diag_check, frame, &message) &&
            message.as.ctrl_diag.index == TAPER_COUNTER_GUARD_VIOLATIONS) {
            watch->guard_violations = message.as.ctrl_diag.value;
        }
        break;
    default: break;
    }
}

void sim_watch_free(sim_watch_t *watch) {
    sim_samples_free(&watch->iterations);
    *watch = (sim_watch_t){0};
}
