/* Reports into the table: who is there, and which parameters are in use. */
#include "taper/session.h"

#include <string.h>

#include "session_internal.h"

/* The clock is moved on before its anchor is half a wrap of the millisecond counter away. */
#define CLOCK_CARRY_ms (3600u * 1000u)

/* Nothing of a vehicle that left, or was replaced, may reach the next one. */
static void forget_vehicle(taper_session_t *session) {
    const taper_session_t blank = {
        .status_heard = session->status_heard,
        .status = session->status,
        .info = session->info,
        .info_known = session->info_known,
        .lost = session->lost,
        .session_Wh = TAPER_ABSENT,
        .stored_Wh = TAPER_ABSENT,
        .anchor_Wh = TAPER_ABSENT,
    };
    *session = blank;
}

void taper_session_init(taper_session_table_t *table, const taper_station_config_t *config) {
    memset(table, 0, sizeof *table);
    table->config = config;
    table->time_scale = 1;
    for (uint8_t i = 0; i < config->connector_count; i++) {
        forget_vehicle(&table->session[i]);
    }
}

int taper_session_connector(const taper_station_config_t *config, uint8_t bus, uint8_t node) {
    const int guess = bus * TAPER_NODES_PER_BUS + node - 1;
    if (guess >= 0 && guess < config->connector_count && config->connectors[guess].bus == bus &&
        config->connectors[guess].node == node) {
        return guess;
    }
    for (int i = 0; i < config->connector_count; i++) {
        if (config->connectors[i].bus == bus && config->connectors[i].node == node) {
            return i;
        }
    }
    return -1;
}

uint8_t taper_session_number(const taper_session_table_t *table, uint8_t connector) {
    if (connector >= table->config->connector_count) {
        return 0;
    }
    const taper_session_t *session = &table->session[connector];
    return session->in_session || session->awaited ? session->used.a.session : 0;
}

static void hear(taper_heard_t *heard, uint32_t now_ms) {
    heard->heard = true;
    heard->at_ms = now_ms;
}

void taper_session_note(const taper_session_table_t *table, const taper_session_t *session,
                        taper_event_code_t code, int32_t data) {
    const taper_connector_config_t *connector = &table->config->connectors[session - table->session];
    taper_event_note(table->log, code, connector->bus, connector->node, data);
}

static bool set_is_whole(const taper_session_t *session) {
    const taper_ev_params_t *p = &session->received;
    const unsigned needed = PARAM_A | PARAM_B | PARAM_C;
    return (session->param_seen & needed) == needed && p->a.revision == p->b.revision &&
           p->a.revision == p->c.revision && p->a.session == p->b.session;
}

/* Whether D or E, of this revision and session, belongs to the received set. */
static bool belongs(const taper_session_t *session, unsigned part, uint8_t revision, uint8_t number) {
    const taper_ev_param_a_t *a = &session->received.a;
    return (session->param_seen & part) != 0u && revision == a->revision && number == a->session;
}

/* The received set, with an absent taper where none belongs to it. */
static taper_ev_params_t whole_set(const taper_session_t *session) {
    taper_ev_params_t set = session->received;
    if (!belongs(session, PARAM_D, set.d.revision, set.d.session)) {
        set.d.taper_W = TAPER_ABSENT;
    }
    if (!belongs(session, PARAM_E, set.e.revision, set.e.session)) {
        set.e.peak_W = TAPER_ABSENT;
        set.e.taper_W = TAPER_ABSENT;
    }
    return set;
}

static bool tapers_differ(const taper_ev_params_t *a, const taper_ev_params_t *b) {
    return a->d.taper_W != b->d.taper_W || a->e.peak_W != b->e.peak_W || a->e.taper_W != b->e.taper_W;
}

/* A vehicle was plugged in, or replaced by another session number. What was reported before was not about it; only its
   parameters may have come ahead of the news. */
static void begin_stay(taper_session_t *session, uint32_t now_ms) {
    const taper_ev_params_t received = session->received;
    const uint8_t param_seen = session->param_seen;
    forget_vehicle(session);
    session->received = received;
    session->param_seen = param_seen;
    session->vehicle_there = true;
    session->plugged_in_ms = now_ms;
}

/* Whoever was there, or was awaited, is not any more. */
static void end_session(taper_session_table_t *table, const taper_session_t *session) {
    if (session->in_session || session->awaited) {
        table->revision++;
        table->changes++;
        taper_session_note(table, session, TAPER_EVENT_SESSION_ENDED, session->used.a.session);
    }
}

void taper_session_drop(taper_session_table_t *table, taper_session_t *session, uint32_t now_ms) {
    const bool there = session->vehicle_there;
    const bool unproved = session->unproved;
    end_session(table, session);
    begin_stay(session, now_ms);
    session->vehicle_there = there;
    if (unproved) {
        session->param_seen &= (uint8_t)~PARAM_D; /* it may be the one that was kept */
    }
}

/* minimum <= target <= maximum, where they were told. Planning moves the target; people should know why. */
static bool parameters_contradict(const taper_ev_params_t *p) {
    const int32_t target_Wh = p->c.target_Wh;
    const bool energy =
        target_Wh != TAPER_ABSENT &&
        (target_Wh < p->c.minimum_Wh || (p->c.maximum_Wh != TAPER_ABSENT && target_Wh > p->c.maximum_Wh));
    const bool bounds = p->c.maximum_Wh != TAPER_ABSENT && p->c.minimum_Wh > p->c.maximum_Wh;
    const bool soc = p->a.soc_target_permille != TAPER_ABSENT &&
                     p->a.soc_target_permille < p->a.soc_minimum_permille; /* absent is below any other */
    return energy || bounds || soc;
}

static void note_parameters(taper_session_table_t *table, const taper_session_t *session, bool begins) {
    if (begins) {
        taper_session_note(table, session, TAPER_EVENT_SESSION_BEGUN, session->used.a.session);
    }
    if (parameters_contradict(&session->used)) {
        taper_count(&table->repaired);
        taper_session_note(table, session, TAPER_EVENT_REPAIRED, session->used.a.session);
    }
}

/* What was received is another session than the one that is there, or awaited. */
static bool is_another(const taper_session_t *session) {
    const bool other_number = session->received.a.session != session->used.a.session;
    return (session->in_session && other_number) ||
           (session->unproved && (other_number || taper_session_kept_is_another(session)));
}

/* Put the received parameters into use if they are whole; that may begin a session. */
static void use_parameters(taper_session_table_t *table, taper_session_t *session, uint32_t now_ms) {
    const bool can_begin = session->vehicle_there && taper_session_pilot_charges(session->status.pilot);
    if (!set_is_whole(session) || !(session->in_session || can_begin)) {
        return;
    }
    if (is_another(session)) {
        taper_session_drop(table, session, now_ms);
    }
    taper_session_confirm(table, (uint8_t)(session - table->session));
    const taper_ev_params_t set = whole_set(session);
    const bool begins = !session->in_session;
    const bool is_new = begins || set.a.revision != session->used.a.revision;
    if (is_new || tapers_differ(&set, &session->used)) {
        table->revision++;
        table->changes++;
    }
    session->used = set;
    session->in_session = true;
    session->unproved = false;
    if (is_new) {
        note_parameters(table, session, begins);
    }
}

static void apply_status(taper_session_table_t *table, taper_session_t *session,
                         const taper_evse_status_t *status, uint32_t now_ms) {
    session->status = *status;
    hear(&session->status_heard, now_ms);
    if (session->lost) {
        session->lost = false;
        taper_session_note(table, session, TAPER_EVENT_CONNECTOR_BACK, 0);
    }
    if (!status->ev_present || status->pilot == TAPER_PILOT_A) {
        end_session(table, session);
        forget_vehicle(session);
        return;
    }
    if (!session->vehicle_there && !session->awaited) {
        begin_stay(session, now_ms);
    }
    session->vehicle_there = true;
    if (!session->in_session) {
        use_parameters(table, session, now_ms);
    }
}

/* What holds while the vehicle sleeps. */
static bool asks_otherwise(const taper_ev_status_t *a, const taper_ev_status_t *b) {
    return a->error != b->error || a->complete != b->complete || a->pause_requested != b->pause_requested ||
           a->stop_requested != b->stop_requested;
}

static void apply_ev(taper_session_table_t *table, taper_session_t *session, const taper_ev_status_t *ev,
                     uint32_t now_ms) {
    const bool is_kept = session->in_session || session->awaited;
    table->changes += is_kept && asks_otherwise(&session->ev, ev) ? 1u : 0u;
    session->ev = *ev;
    session->soc_is_new = true;
    hear(&session->ev_heard, now_ms);
}

static void apply_elec(taper_session_table_t *table, taper_session_t *session, const taper_evse_elec_t *elec,
                       uint32_t now_ms) {
    if (elec->energy_Wh != TAPER_ABSENT) {
        if (session->meter_open && elec->energy_Wh < session->session_Wh) {
            taper_session_drop(table, session, now_ms);
            use_parameters(table, session, now_ms);
        }
        session->meter_open = false;
        session->session_Wh = elec->energy_Wh;
    }
    session->elec = *elec;
    hear(&session->elec_heard, now_ms);
}

/* Note one of the frames. @return its bit of `param_seen`. */
static unsigned note_part(taper_ev_params_t *received, const taper_message_t *message) {
    switch (message->kind) {
    case TAPER_MESSAGE_EV_PARAM_A: received->a = message->as.ev_param_a; return PARAM_A;
    case TAPER_MESSAGE_EV_PARAM_B: received->b = message->as.ev_param_b; return PARAM_B;
    case TAPER_MESSAGE_EV_PARAM_C: received->c = message->as.ev_param_c; return PARAM_C;
    case TAPER_MESSAGE_EV_PARAM_D: received->d = message->as.ev_param_d; return PARAM_D;
    default: received->e = message->as.ev_param_e; return PARAM_E;
    }
}

/* Number of the session in one of the frames that have it: all but C. */
static uint8_t session_of(const taper_ev_params_t *received, unsigned part) {
    switch (part) {
    case PARAM_A: return received->a.session;
    case PARAM_B: return received->b.session;
    case PARAM_D: return received->d.session;
    default: return received->e.session;
    }
}

static void apply_parameters(taper_session_table_t *table, taper_session_t *session,
                             const taper_message_t *message, uint32_t now_ms) {
    const unsigned part = note_part(&session->received, message);
    session->param_seen = (uint8_t)(session->param_seen | part);
    if (session->awaited && part != PARAM_C &&
        session_of(&session->received, part) != session->used.a.session) {
        taper_session_drop(table, session, now_ms);
        session->param_seen =
            (uint8_t)(session->param_seen | part); /* this one is of the session that is there */
    }
    use_parameters(table, session, now_ms);
}

/* What a connector says of itself; news only when it changes. */
static void apply_info(taper_session_table_t *table, taper_session_t *session,
                       const taper_evse_info_t *info) {
    const bool first = !session->info_known;
    const taper_evse_info_t old = session->info;
    session->info = *info;
    session->info_known = true;
    if (info->protocol_version != TAPER_PROTOCOL_VERSION &&
        (first || old.protocol_version != info->protocol_version)) {
        taper_session_note(table, session, TAPER_EVENT_VERSION, info->protocol_version);
    }
    if (info->rotation == TAPER_ROTATION_UNKNOWN && (first || old.rotation != info->rotation)) {
        taper_session_note(table, session, TAPER_EVENT_ROTATION, 0);
    }
}

uint32_t taper_session_unix_s(const taper_session_table_t *table, uint32_t now_ms) {
    if (!table->clock_heard.heard) {
        return 0;
    }
    const uint64_t world_ms =
        (uint64_t)taper_elapsed_ms(now_ms, table->clock_heard.at_ms) * table->time_scale;
    return table->unix_s + (uint32_t)taper_quotient((int64_t)world_ms, 1000);
}

/* Control runs on the monotonic clock, so a jump of the wall clock moves nothing but the departures told by it. */
static void note_clock(taper_session_table_t *table, int32_t moved_s) {
    table->revision++;
    taper_event_note(table->log, TAPER_EVENT_CLOCK_SET, 0, 0, moved_s);
}

/* How far the wall clock moved against ours. Frames of one second that arrive unevenly may go back by a hair. */
static int64_t clock_moved_s(const taper_session_table_t *table, uint32_t unix_s, uint32_t at_ms) {
    const bool back = !taper_time_reached(at_ms, table->clock_heard.at_ms);
    const uint32_t ours_s = back ? table->unix_s : taper_session_unix_s(table, at_ms);
    return (int64_t)unix_s - ours_s;
}

static void apply_time(taper_session_table_t *table, const taper_time_sync_t *time, uint32_t now_ms) {
    if (time->quality == 0) {
        return; /* a gateway that lost its own clock does not take ours away */
    }
    const uint32_t at_ms = now_ms - time->ms / table->time_scale;
    if (!table->clock_heard.heard) {
        taper_session_end_restart(table, time->unix_s, at_ms);
        note_clock(table, 0);
    } else {
        const int64_t moved_s = clock_moved_s(table, time->unix_s, at_ms);
        const int64_t drift_s = (int64_t)TAPER_CLOCK_JUMP_s * table->time_scale;
        if (moved_s > drift_s || moved_s < -drift_s) {
            taper_count(&table->clock_jumps);
            note_clock(table, taper_saturate_i32(moved_s));
        }
    }
    table->unix_s = time->unix_s;
    hear(&table->clock_heard, at_ms);
}

bool taper_session_apply(taper_session_table_t *table, const taper_message_t *message, uint32_t now_ms) {
    if (message->kind == TAPER_MESSAGE_TIME_SYNC) {
        apply_time(table, &message->as.time_sync, now_ms);
        return true;
    }
    const int connector = taper_session_connector(table->config, message->bus, message->node);
    return connector >= 0 && taper_session_apply_to(table, (uint8_t)connector, message, now_ms);
}

bool taper_session_apply_to(taper_session_table_t *table, uint8_t connector, const taper_message_t *message,
                            uint32_t now_ms) {
    taper_session_t *session = &table->session[connector];
    switch (message->kind) {
    case TAPER_MESSAGE_EVSE_STATUS: apply_status(table, session, &message->as.evse_status, now_ms); break;
    case TAPER_MESSAGE_EV_STATUS: apply_ev(table, session, &message->as.ev_status, now_ms); break;
    case TAPER_MESSAGE_EVSE_ELEC: apply_elec(table, session, &message->as.evse_elec, now_ms); break;
    case TAPER_MESSAGE_EVSE_INFO: apply_info(table, session, &message->as.evse_info); break;
    case TAPER_MESSAGE_EV_PARAM_A:
    case TAPER_MESSAGE_EV_PARAM_B:
    case TAPER_MESSAGE_EV_PARAM_C:
    case TAPER_MESSAGE_EV_PARAM_D:
    case TAPER_MESSAGE_EV_PARAM_E: apply_parameters(table, session, message, now_ms); break;
    default: return false;
    }
    return true;
}

/* A vehicle that starts or stops to want energy is an event for the planner, whatever the cause. */
static void note_activity(taper_session_table_t *table, uint8_t connector, uint32_t now_ms) {
    const bool active = taper_session_idle_reason(table, connector, now_ms) == TAPER_REASON_PLANNED;
    if (active != table->session[connector].wants_energy) {
        table->session[connector].wants_energy = active;
        table->revision++;
    }
}

static void expire(taper_heard_t *heard, uint32_t now_ms, uint32_t timeout_ms) {
    heard->heard = taper_session_is_fresh(*heard, now_ms, timeout_ms);
}

static void note_loss(taper_session_table_t *table, taper_session_t *session, uint32_t now_ms) {
    const bool was_heard = session->status_heard.heard;
    expire(&session->status_heard, now_ms, TAPER_EVSE_STATUS_TIMEOUT_ms);
    if (was_heard && !session->status_heard.heard) {
        session->lost = true;
        taper_session_note(table, session, TAPER_EVENT_CONNECTOR_LOST, 0);
    }
}

static void carry_clock(taper_session_table_t *table, uint32_t now_ms) {
    const uint32_t elapsed_ms = taper_elapsed_ms(now_ms, table->clock_heard.at_ms);
    if (table->clock_heard.heard && elapsed_ms >= CLOCK_CARRY_ms) {
        table->unix_s += elapsed_ms / 1000u * table->time_scale;
        table->clock_heard.at_ms += elapsed_ms / 1000u * 1000u;
    }
}

void taper_session_update(taper_session_table_t *table, uint32_t now_ms) {
    carry_clock(table, now_ms);
    for (uint8_t i = 0; i < table->config->connector_count; i++) {
        taper_session_t *session = &table->session[i];
        note_loss(table, session, now_ms);
        expire(&session->ev_heard, now_ms, TAPER_EV_STATUS_TIMEOUT_ms);
        expire(&session->elec_heard, now_ms, TAPER_EVSE_ELEC_TIMEOUT_ms);
        if (taper_session_estimate(session, now_ms)) {
            taper_count(&table->soc_jumps);
            taper_session_note(table, session, TAPER_EVENT_SOC_JUMP, session->ev.soc_permille);
        }
        note_activity(table, i, now_ms);
    }
}
