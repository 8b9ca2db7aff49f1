/* State of charge between and beyond reports. */
#include "session_internal.h"

/* `soc_permille` of `capacity_Wh`, in Wh. */
static int32_t energy_at(int32_t soc_permille, int32_t capacity_Wh) {
    return (int32_t)taper_quotient((int64_t)soc_permille * capacity_Wh, 1000);
}

int32_t taper_session_capacity_Wh(const taper_session_t *session) {
    return session->in_session ? taper_session_sound_capacity_Wh(session->used.a.capacity_Wh) : 0;
}

bool taper_session_soc_is_fresh(const taper_session_t *session, uint32_t now_ms) {
    const taper_ev_status_t *ev = &session->ev;
    if (!taper_session_is_fresh(session->ev_heard, now_ms, TAPER_EV_STATUS_TIMEOUT_ms)) {
        return false;
    }
    if (ev->soc_permille == TAPER_ABSENT || ev->soc_age_s == TAPER_ABSENT) {
        return false;
    }
    const uint32_t since_ms = taper_elapsed_ms(now_ms, session->ev_heard.at_ms);
    return (uint32_t)ev->soc_age_s * 1000u + since_ms <= TAPER_SOC_STALE_s * 1000u;
}

/* Move the estimate by what has flowed since it was last right. */
static void follow_energy(taper_session_t *session, int32_t capacity_Wh) {
    const int32_t energy_Wh = session->session_Wh;
    if (session->stored_Wh == TAPER_ABSENT || energy_Wh == TAPER_ABSENT) {
        return;
    }
    /* A meter that went back was reset: what flowed in between is unknown, what flows from here on counts. */
    if (session->anchor_Wh != TAPER_ABSENT && energy_Wh > session->anchor_Wh) {
        session->stored_Wh =
            taper_min_i32(session->stored_Wh + (energy_Wh - session->anchor_Wh), capacity_Wh);
    }
    session->anchor_Wh = energy_Wh;
}

/* First estimate of a session, or none yet. A SOC of now stands for now; one at plug-in is followed by all the energy
   that was measured since. */
static void begin(taper_session_t *session, int32_t capacity_Wh, uint32_t now_ms) {
    session->jump_count = 0;
    if (taper_session_soc_is_fresh(session, now_ms)) {
        session->stored_Wh = energy_at(session->ev.soc_permille, capacity_Wh);
        session->anchor_Wh = session->session_Wh;
    } else if (session->used.a.soc_plug_in_permille != TAPER_ABSENT) {
        session->stored_Wh = energy_at(session->used.a.soc_plug_in_permille, capacity_Wh);
        session->anchor_Wh = 0;
    }
}

/* What has flowed since the vehicle measured its SOC: the estimate may be ahead of the report by that. */
static int32_t energy_since_report_Wh(const taper_session_t *session) {
    if (!session->elec_heard.heard || session->elec.power_W == TAPER_ABSENT) {
        return 0;
    }
    return session->elec.power_W * session->ev.soc_age_s / 3600; /* 655 kW for a minute fits */
}

/* @return whether a SOC far from the estimate is to be believed by now. */
static bool jump_is_believed(taper_session_t *session) {
    const int32_t soc_permille = session->ev.soc_permille;
    const int32_t moved_permille = soc_permille - session->jump_permille;
    const bool consistent =
        moved_permille >= -TAPER_SOC_JUMP_permille && moved_permille <= TAPER_SOC_JUMP_permille;
    session->jump_count = session->jump_count > 0 && consistent ? (uint8_t)(session->jump_count + 1u) : 1u;
    session->jump_permille = soc_permille;
    return session->jump_count >= TAPER_SOC_JUMP_REPORTS;
}

/* Bring the estimate into the range that a reported SOC stands for, unless it lies too far off to be believed.
   @return whether this report is the first of a jump. */
static bool correct_by_soc(taper_session_t *session, int32_t capacity_Wh) {
    const int32_t reported_Wh = energy_at(session->ev.soc_permille, capacity_Wh);
    const int32_t quantum_Wh =
        (int32_t)taper_quotient((int64_t)capacity_Wh * TAPER_SOC_QUANTUM_tenth_permille, 10000);
    const int32_t low_Wh = reported_Wh - quantum_Wh;
    const int32_t high_Wh = reported_Wh + quantum_Wh + energy_since_report_Wh(session);
    const int32_t jump_Wh = energy_at(TAPER_SOC_JUMP_permille, capacity_Wh);

    if (session->stored_Wh < low_Wh - jump_Wh || session->stored_Wh > high_Wh + jump_Wh) {
        if (jump_is_believed(session)) {
            session->stored_Wh = reported_Wh;
            session->jump_count = 0;
        }
        return session->jump_count == 1;
    }
    session->jump_count = 0;
    session->stored_Wh = taper_clamp_i32(session->stored_Wh, low_Wh, high_Wh);
    return false;
}

/* The same SOC of a battery that turned out to have another size. */
static void rescale(taper_session_t *session, int32_t capacity_Wh) {
    if (session->stored_Wh != TAPER_ABSENT && session->stored_of_Wh > 0) {
        session->stored_Wh = (int32_t)((int64_t)session->stored_Wh * capacity_Wh / session->stored_of_Wh);
    }
    session->stored_of_Wh = capacity_Wh;
}

bool taper_session_estimate(taper_session_t *session, uint32_t now_ms) {
    const int32_t capacity_Wh = taper_session_capacity_Wh(session);
    const bool soc_is_new = session->soc_is_new && taper_session_soc_is_fresh(session, now_ms);
    session->soc_is_new = false;
    if (session->awaited) {
        return false; /* it stays as it was kept */
    }
    if (capacity_Wh == 0) {
        session->stored_Wh = TAPER_ABSENT;
        return false;
    }
    if (capacity_Wh != session->stored_of_Wh) {
        rescale(session, capacity_Wh);
    }
    if (session->stored_Wh == TAPER_ABSENT) {
        begin(session, capacity_Wh, now_ms);
    }
    follow_energy(session, capacity_Wh);
    return soc_is_new && session->stored_Wh != TAPER_ABSENT && correct_by_soc(session, capacity_Wh);
}
