#include "tracker.h"

#include <math.h>
#include <string.h>

void sim_tracker_init(sim_tracker_t *tracker, const taper_station_config_t *station, uint32_t grace_ms) {
    *tracker = (sim_tracker_t){.station = station, .grace_ms = grace_ms};
}

static void forget_oldest(sim_tracker_t *tracker) {
    tracker->falls--;
    memmove(tracker->fall, tracker->fall + 1, tracker->falls * sizeof tracker->fall[0]);
}

/** The highest limit that was in force within the time of grace. */
static void update_limit(sim_tracker_t *tracker, uint64_t now_ms, double limit_kw) {
    while (tracker->falls > 0 && tracker->fall[0].until_ms <= now_ms) {
        forget_oldest(tracker);
    }
    if (tracker->started && limit_kw < tracker->told_kw) {
        if (tracker->falls == SIM_FALLS_KEPT) {
            forget_oldest(tracker);
        }
        tracker->fall[tracker->falls].until_ms = now_ms + tracker->grace_ms;
        tracker->fall[tracker->falls].kw = tracker->told_kw;
        tracker->falls++;
    }
    while (tracker->falls > 0 && tracker->fall[tracker->falls - 1].kw <= limit_kw) {
        tracker->falls--;
    }
    tracker->told_kw = limit_kw;
    tracker->limit_kw = tracker->falls > 0 ? tracker->fall[0].kw : limit_kw;
}

static void note(sim_excess_t *excess, uint64_t now_ms, uint64_t passed_ms, double by_kw) {
    excess->ms += excess->now ? passed_ms : 0;
    if (by_kw > 0.0 && !excess->now) {
        excess->first_ms = excess->times == 0 ? now_ms : excess->first_ms;
        excess->times++;
    }
    excess->now = by_kw > 0.0;
    excess->worst_kw = fmax(excess->worst_kw, by_kw);
}

void sim_tracker_look(sim_tracker_t *tracker, uint64_t now_ms, double limit_kw, const sim_load_t *drawn,
                      const sim_load_t *may) {
    sim_load_t group[TAPER_MAX_GROUPS];
    const uint64_t passed_ms = tracker->started ? now_ms - tracker->last_ms : 0;
    update_limit(tracker, now_ms, limit_kw);
    note(&tracker->drawn, now_ms, passed_ms,
         sim_loads_check(tracker->station, drawn, tracker->limit_kw, group).by_kw);
    tracker->drawn_kw = group[0].kw;
    note(&tracker->may, now_ms, passed_ms,
         sim_loads_check(tracker->station, may, tracker->limit_kw, group).by_kw);
    tracker->may_kw = group[0].kw;
    tracker->last_ms = now_ms;
    tracker->started = true;
}
