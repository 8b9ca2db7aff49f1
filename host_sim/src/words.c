#include "words.h"

#include <stddef.h>

const char *sim_mode_word(taper_mode_t mode) {
    switch (mode) {
    case TAPER_MODE_INIT: return "init";
    case TAPER_MODE_PLAN: return "plan";
    case TAPER_MODE_FALLBACK: return "fallback";
    case TAPER_MODE_FAILSAFE: return "failsafe";
    default: return "unknown";
    }
}

const char *sim_reason_word(uint8_t reason) {
    static const char *const words[] = {
        [TAPER_REASON_NO_VEHICLE] = "no_vehicle",
        [TAPER_REASON_PLANNED] = "planned",
        [TAPER_REASON_VEHICLE_LIMIT] = "vehicle_limit",
        [TAPER_REASON_CONNECTOR_LIMIT] = "connector_limit",
        [TAPER_REASON_SITE_LIMIT] = "site_limit",
        [TAPER_REASON_FEEDER_LIMIT] = "feeder_limit",
        [TAPER_REASON_WAITING] = "waiting",
        [TAPER_REASON_HAND_OVER] = "hand_over",
        [TAPER_REASON_COMPLETE] = "complete",
        [TAPER_REASON_VEHICLE_PAUSE] = "vehicle_pause",
        [TAPER_REASON_NO_PARAMETERS] = "no_parameters",
        [TAPER_REASON_OFFLINE] = "offline",
        [TAPER_REASON_FAULT] = "fault",
        [TAPER_REASON_VERSION] = "version",
        [TAPER_REASON_STATION] = "station",
        [TAPER_REASON_LOCKED_OUT] = "locked_out",
        [TAPER_REASON_PHASE_LIMIT] = "phase_limit",
        [TAPER_REASON_IMBALANCE_LIMIT] = "imbalance_limit",
        [TAPER_REASON_GRID_PAUSE] = "grid_pause",
        [TAPER_REASON_PLANNED_LATER] = "planned_later",
        [TAPER_REASON_RAMP] = "ramp",
        [TAPER_REASON_OVER_DRAW] = "over_draw",
        [TAPER_REASON_DEPARTURE] = "departure",
        [TAPER_REASON_FAILSAFE_LIMIT] = "failsafe_limit",
    };
    const char *word = reason < sizeof words / sizeof words[0] ? words[reason] : NULL;
    return word == NULL ? "unknown" : word;
}
