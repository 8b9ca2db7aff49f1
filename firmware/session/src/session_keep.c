/* Sessions over a restart of the controller. */
#include "session_internal.h"

/** A longer stay is as good as this, and keeps the millisecond clock far from half its wrap [s]. */
#define STAY_MOST_s (20u * 86400u)

/** Ranges of taper/message.h: what the store holds passed them once, but it is not for the estimate to find out. */
#define CAPACITY_MOST_Wh   6553400
#define FULL_permille      1000
#define DEPARTURE_MOST_min 65534
#define POWER_MOST_W       655340
#define CURRENT_MOST_mA    127000
#define ENERGY_MOST_Wh     655340

bool taper_session_keep(const taper_session_table_t *table, uint8_t connector, uint32_t now_ms,
                        taper_session_kept_t *kept) {
    const taper_session_t *session = &table->session[connector];
    if (!session->in_session && !session->awaited) {
        return false;
    }
    const uint64_t stay_ms = (uint64_t)taper_elapsed_ms(now_ms, session->plugged_in_ms) * table->time_scale;
    *kept = (taper_session_kept_t){
        .used = session->used,
        .error = session->ev.error,
        .complete = session->ev.complete,
        .pause_requested = session->ev.pause_requested,
        .stop_requested = session->ev.stop_requested,
        .session_Wh = session->session_Wh,
        .stored_Wh = session->stored_Wh,
        .anchor_Wh = session->anchor_Wh,
        .stay_s = stay_ms / 1000u > STAY_MOST_s ? STAY_MOST_s : (uint32_t)(stay_ms / 1000u),
    };
    return true;
}

static bool is_told_within(int32_t value, int32_t least, int32_t most) {
    return value == TAPER_ABSENT || (value >= least && value <= most);
}

static bool wishes_are_sound(const taper_ev_params_t *p) {
    return is_told_within(p->a.capacity_Wh, 0, CAPACITY_MOST_Wh) &&
           is_told_within(p->a.soc_target_permille, 0, FULL_permille) &&
           is_told_within(p->a.soc_minimum_permille, 0, FULL_permille) &&
           is_told_within(p->a.soc_plug_in_permille, 0, FULL_permille) &&
           is_told_within(p->b.departure_min, 0, DEPARTURE_MOST_min) &&
           is_told_within(p->b.peak_W, 0, POWER_MOST_W) && is_told_within(p->b.min_mA, 0, CURRENT_MOST_mA) &&
           is_told_within(p->c.target_Wh, -ENERGY_MOST_Wh, ENERGY_MOST_Wh) &&
           is_told_within(p->c.maximum_Wh, -ENERGY_MOST_Wh, ENERGY_MOST_Wh) &&
           is_told_within(p->c.minimum_Wh, -ENERGY_MOST_Wh, ENERGY_MOST_Wh) &&
           is_told_within(p->d.taper_W, 0, POWER_MOST_W);
}

static bool account_is_sound(const taper_session_kept_t *kept) {
    return is_told_within(kept->session_Wh, 0, ENERGY_MOST_Wh) &&
           is_told_within(kept->stored_Wh, 0, TAPER_CAPACITY_MAX_Wh) &&
           is_told_within(kept->anchor_Wh, 0, ENERGY_MOST_Wh) && kept->stay_s <= STAY_MOST_s;
}

/** One session number and one revision for all; no second line of the taper. */
static taper_ev_params_t agreeing(taper_ev_params_t p) {
    p.b.session = p.a.session;
    p.d.session = p.a.session;
    p.b.revision = p.a.revision;
    p.c.revision = p.a.revision;
    p.d.revision = p.a.revision;
    p.e = (taper_ev_param_e_t){
        .revision = p.a.revision, .session = p.a.session, .peak_W = TAPER_ABSENT, .taper_W = TAPER_ABSENT};
    return p;
}

bool taper_session_restore(taper_session_table_t *table, uint8_t connector,
                           const taper_session_kept_t *kept) {
    if (connector >= table->config->connector_count || !wishes_are_sound(&kept->used) ||
        !account_is_sound(kept)) {
        return false;
    }
    taper_session_t *session = &table->session[connector];
    session->used = agreeing(kept->used);
    session->received.d = session->used.d; /* it comes after A, B and C, and is told in the same breath */
    session->param_seen = PARAM_D;
    session->ev.error = kept->error;
    session->ev.complete = kept->complete;
    session->ev.pause_requested = kept->pause_requested;
    session->ev.stop_requested = kept->stop_requested;
    session->ev.soc_permille = TAPER_ABSENT;
    session->ev.soc_age_s = TAPER_ABSENT;
    session->ev.max_mA = TAPER_ABSENT;
    session->session_Wh = kept->session_Wh;
    session->stored_of_Wh = taper_session_sound_capacity_Wh(kept->used.a.capacity_Wh);
    session->stored_Wh = taper_min_i32(kept->stored_Wh, session->stored_of_Wh);
    session->anchor_Wh = kept->anchor_Wh;
    session->plugged_in_ms = 0u - kept->stay_s / table->time_scale * 1000u;
    session->kept = true;
    session->awaited = true;
    session->unproved = true;
    session->meter_open = kept->session_Wh != TAPER_ABSENT;
    session->stay_open = true;
    return true;
}

void taper_session_start_clock(taper_session_table_t *table, uint32_t unix_s, uint32_t now_ms) {
    table->kept_unix_s = unix_s;
    table->kept_at_ms = now_ms;
    for (uint8_t i = 0; i < table->config->connector_count; i++) {
        if (table->session[i].stay_open) {
            table->session[i].plugged_in_ms += now_ms;
        }
    }
}

uint32_t taper_session_since_kept_s(const taper_session_table_t *table, uint32_t now_ms) {
    const uint32_t unix_s = taper_session_unix_s(table, now_ms);
    const uint64_t world_ms = (uint64_t)taper_elapsed_ms(now_ms, table->kept_at_ms) * table->time_scale;
    const bool known = table->kept_unix_s != 0 && unix_s > table->kept_unix_s;
    return known ? unix_s - table->kept_unix_s : (uint32_t)(world_ms / 1000u);
}

uint32_t taper_session_kept_unix_s(const taper_session_table_t *table, uint32_t now_ms) {
    if (table->clock_heard.heard || table->kept_unix_s == 0) {
        return taper_session_unix_s(table, now_ms);
    }
    const uint64_t world_ms = (uint64_t)taper_elapsed_ms(now_ms, table->kept_at_ms) * table->time_scale;
    return table->kept_unix_s + (uint32_t)(world_ms / 1000u);
}

/** So long has a vehicle been there for longer. */
static void lengthen_stay(const taper_session_table_t *table, taper_session_t *session, uint32_t by_s,
                          uint32_t now_ms) {
    const uint64_t world_ms = (uint64_t)taper_elapsed_ms(now_ms, session->plugged_in_ms) * table->time_scale;
    const uint32_t stay_s = (uint32_t)(world_ms / 1000u);
    const uint32_t room_s = stay_s < STAY_MOST_s ? STAY_MOST_s - stay_s : 0;
    session->plugged_in_ms -= (by_s < room_s ? by_s : room_s) / table->time_scale * 1000u;
}

void taper_session_end_restart(taper_session_table_t *table, uint32_t unix_s, uint32_t at_ms) {
    const bool backwards = !taper_time_reached(at_ms, table->kept_at_ms);
    const uint32_t since_ms = backwards ? table->kept_at_ms : at_ms;
    const uint32_t ours_s = taper_session_kept_unix_s(table, since_ms);
    const bool took_time = ours_s != 0 && unix_s > ours_s; /* a clock that went back tells nothing */
    for (uint8_t i = 0; i < table->config->connector_count; i++) {
        taper_session_t *session = &table->session[i];
        if (session->stay_open && took_time) {
            lengthen_stay(table, session, unix_s - ours_s, since_ms);
        }
        session->stay_open = false;
    }
}

static bool differ(int32_t kept, int32_t told) {
    return kept != TAPER_ABSENT && told != TAPER_ABSENT && kept != told;
}

bool taper_session_kept_is_another(const taper_session_t *session) {
    const taper_ev_param_a_t *kept = &session->used.a;
    const taper_ev_param_a_t *told = &session->received.a;
    return differ(kept->capacity_Wh, told->capacity_Wh) ||
           differ(kept->soc_plug_in_permille, told->soc_plug_in_permille);
}

void taper_session_confirm(taper_session_table_t *table, uint8_t connector) {
    taper_session_t *session = &table->session[connector];
    if (!session->awaited || !session->vehicle_there || !taper_session_pilot_charges(session->status.pilot)) {
        return;
    }
    session->awaited = false;
    session->in_session = true;
    table->revision++;
    taper_session_note(table, session, TAPER_EVENT_SESSION_RESUMED, session->used.a.session);
}

bool taper_session_is_kept(const taper_session_table_t *table, uint8_t connector) {
    return table->session[connector].kept;
}

bool taper_session_may_be_there(const taper_session_table_t *table, uint8_t connector) {
    const taper_session_t *session = &table->session[connector];
    const bool never_heard = !session->status_heard.heard && !session->lost;
    return session->vehicle_there || session->awaited || never_heard;
}
