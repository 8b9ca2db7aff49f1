#include "taper/draw.h"

#include <string.h>

void taper_draw_init(taper_draw_t *draw) {
    memset(draw, 0, sizeof *draw);
    draw->cap_mA = TAPER_NO_LIMIT;
}

int32_t taper_draw_tolerated_mA(int32_t allowed_mA) {
    return taper_saturate_i32(taper_quotient(((int64_t)allowed_mA + 500) * 11, 10));
}

/** Note whether a condition holds now. @return whether it has held for `for_ms`. */
static bool has_held(taper_draw_since_t *since, bool holds, uint32_t for_ms, uint32_t now_ms) {
    if (holds && !since->holds) {
        since->since_ms = now_ms;
    }
    since->holds = holds;
    return holds && taper_elapsed_ms(now_ms, since->since_ms) >= for_ms;
}

/** Who leaves takes all with him; another session on the same plug all but the lock. */
static void begin_anew(taper_draw_t *draw, const taper_draw_report_t *report) {
    const bool stays_locked = report->plugged && draw->state == TAPER_DRAW_LOCKED;
    taper_draw_init(draw);
    draw->session = report->session;
    if (stays_locked) {
        draw->state = TAPER_DRAW_LOCKED;
    }
}

/** Faults 41 and 42. */
static void judge_excess(taper_draw_t *draw, const taper_draw_report_t *report, uint32_t now_ms) {
    const bool flows = report->measured_mA > TAPER_DRAW_FLOWS_mA;
    const bool exceeds = flows && report->measured_mA > taper_draw_tolerated_mA(report->allowed_mA);
    const bool normal = draw->state == TAPER_DRAW_NORMAL;
    const bool stop_ignored =
        has_held(&draw->ignoring, normal && flows && report->setpoint_mA == 0, TAPER_DRAW_IGNORES_ms, now_ms);
    if (has_held(&draw->over, normal && exceeds, TAPER_DRAW_OVER_ms, now_ms)) {
        draw->state = TAPER_DRAW_OVER;
    }
    if (stop_ignored && exceeds) {
        draw->state = TAPER_DRAW_LOCKED;
    }
    const bool over = draw->state == TAPER_DRAW_OVER;
    const bool calmed = has_held(&draw->calm, over && !flows, TAPER_DRAW_CALM_ms, now_ms);
    const bool flows_on = has_held(&draw->flowing, over && flows, TAPER_DRAW_OPEN_ms, now_ms);
    if (calmed) {
        draw->state = TAPER_DRAW_NORMAL;
    }
    if (flows_on) {
        draw->state = TAPER_DRAW_LOCKED;
    }
}

/** Fault 43. */
static void judge_use(taper_draw_t *draw, const taper_draw_report_t *report, uint32_t now_ms) {
    const int32_t measured_mA = report->measured_mA;
    const bool leaves = measured_mA < report->setpoint_mA - TAPER_DRAW_UNUSED_mA;
    draw->most_mA = draw->unused.holds ? taper_max_i32(draw->most_mA, measured_mA) : measured_mA;
    if (has_held(&draw->unused, leaves, TAPER_DRAW_UNUSED_ms, now_ms)) {
        draw->cap_mA = taper_max_i32(draw->most_mA + TAPER_DRAW_UNUSED_mA, report->min_mA);
        draw->unused.holds = false; /* the next minute begins */
    }
    if (draw->cap_mA != TAPER_NO_LIMIT && measured_mA >= draw->cap_mA - TAPER_DRAW_ASKS_mA) {
        draw->cap_mA = TAPER_NO_LIMIT;
    }
}

bool taper_draw_update(taper_draw_t *draw, const taper_draw_report_t *report, uint32_t now_ms) {
    const taper_draw_state_t state = draw->state;
    const int32_t cap_mA = draw->cap_mA;
    if (!report->plugged || report->session != draw->session) {
        begin_anew(draw, report);
    }
    if (report->plugged && report->measured_mA != TAPER_ABSENT) {
        judge_excess(draw, report, now_ms);
        judge_use(draw, report, now_ms);
    }
    return draw->state != state || draw->cap_mA != cap_mA;
}
