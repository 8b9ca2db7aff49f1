/*
 * What survives a restart (faults 29 and 30): sessions, the failsafe limit told, the number of starts. The body of the record
 * in the store's area TAPER_STORE_STATION, little endian:
 *
 *     CRC-32 of the station's name u32, wall clock u32 (0: not known), starts u32, failsafe limit i32, entries u8, 3 bytes 0
 *     entries: connector u8, flags u8, error u8, session u8, revision u8, 3 bytes 0, 15 numbers (put_session()), 3 of its turn
 *              (put_turn()), identifier
 *
 * Connectors without a session have no entry.
 */
#include <string.h>

#include "bytes.h"
#include "station_internal.h"
#include "stored.h"

/** Changes with the meaning of the bytes: a record of another layout is refused. */
#define LAYOUT      1u
#define BODY_FIXED  20u
#define ENTRIES_AT  16u
#define ENTRY_FIXED 8u
#define ENTRY       (ENTRY_FIXED + 15u * 4u + 3u * 4u + TAPER_IDENTIFIER_LENGTH)

_Static_assert(TAPER_STORED_ENVELOPE + BODY_FIXED + ENTRY * TAPER_MAX_CONNECTORS <= TAPER_STORE_RECORD_MAX,
               "ports have room for it");

#define HAS_SESSION 0x01u
#define COMPLETE    0x02u
#define PAUSED      0x04u
#define STOPPED     0x08u
#define LOCKED      0x10u
#define ON          0x20u
#define SWITCHED    0x40u
#define WAITS       0x80u

/** Memory that wears out is not written more often than this, whatever comes and goes on the bus. */
#define CHANGE_GAP_ms UINT32_C(10000)
/** Nor this often when nothing changed but time and energy. These come right by themselves where the bus tells the meter and
    the clock; where it does not, so much of a stay may be lost. */
#define ACCOUNT_GAP_ms UINT32_C(900000)

static taper_stored_area_t area_of(taper_station_t *station) {
    return (taper_stored_area_t){.port = station->options.port,
                                 .bytes = station->scratch.record,
                                 .capacity = sizeof station->scratch.record,
                                 .area = TAPER_STORE_STATION,
                                 .layout = LAYOUT,
                                 .next_copy = station->record.next_copy,
                                 .sequence = station->record.sequence};
}

/** Sessions of another station are not ours, though they may fit. */
static uint32_t name_crc(const taper_station_t *station) {
    const char *name = station->options.config->name;
    return name == NULL ? 0 : taper_crc32((const uint8_t *)name, (uint32_t)strlen(name));
}

/* ---- Out */

/** The turn as it was kept, as long as its session is awaited. */
static taper_turn_kept_t turn_of(const taper_station_t *station, uint8_t i, uint32_t now_ms) {
    if (!station->turn_awaits[i]) {
        return taper_allocator_keep(&station->allocator, i, taper_station_world_ms(station, now_ms));
    }
    const uint32_t later_s = taper_session_since_kept_s(&station->sessions, now_ms);
    taper_turn_kept_t turn = station->turn_kept[i];
    turn.since_s += later_s;
    turn.waiting_s += later_s;
    return turn;
}

static unsigned session_flags(const taper_session_kept_t *kept, const taper_turn_kept_t *turn) {
    return HAS_SESSION | (kept->complete ? COMPLETE : 0u) | (kept->pause_requested ? PAUSED : 0u) |
           (kept->stop_requested ? STOPPED : 0u) | (turn->on ? ON : 0u) | (turn->switched ? SWITCHED : 0u) |
           (turn->waits ? WAITS : 0u);
}

static void put_turn(taper_writer_t *to, const taper_turn_kept_t *turn) {
    taper_put_u32(to, turn->since_s);
    taper_put_u32(to, turn->waiting_s);
    taper_put_i32(to, turn->owed_Ws);
}

static void put_session(taper_writer_t *to, const taper_session_kept_t *kept) {
    const taper_ev_params_t *p = &kept->used;
    taper_put_i32(to, p->a.capacity_Wh);
    taper_put_i32(to, p->a.soc_target_permille);
    taper_put_i32(to, p->a.soc_minimum_permille);
    taper_put_i32(to, p->a.soc_plug_in_permille);
    taper_put_i32(to, p->b.departure_min);
    taper_put_i32(to, p->b.peak_W);
    taper_put_i32(to, p->b.min_mA);
    taper_put_i32(to, p->c.target_Wh);
    taper_put_i32(to, p->c.maximum_Wh);
    taper_put_i32(to, p->c.minimum_Wh);
    taper_put_i32(to, p->d.taper_W);
    taper_put_i32(to, kept->session_Wh);
    taper_put_i32(to, kept->stored_Wh);
    taper_put_i32(to, kept->anchor_Wh);
    taper_put_u32(to, kept->stay_s);
}

/** @return whether there is something to be kept of this connector. */
static bool put_entry(taper_station_t *station, uint8_t i, taper_writer_t *to, uint32_t now_ms) {
    taper_session_kept_t kept;
    memset(&kept, 0, sizeof kept);
    const bool has_session = taper_session_keep(&station->sessions, i, now_ms, &kept);
    const taper_turn_kept_t turn = turn_of(station, i, now_ms);
    const bool locked = station->draw[i].state == TAPER_DRAW_LOCKED;
    if (!has_session && !locked) {
        return false;
    }
    taper_put_u8(to, i);
    taper_put_u8(to, (uint8_t)((has_session ? session_flags(&kept, &turn) : 0u) | (locked ? LOCKED : 0u)));
    taper_put_u8(to, kept.error);
    taper_put_u8(to, kept.used.a.session);
    taper_put_u8(to, kept.used.a.revision);
    taper_put_u8(to, 0);
    taper_put_u16(to, 0);
    put_session(to, &kept);
    put_turn(to, &turn);
    const char *identifier = taper_transfers_identifier(&station->transfers, i);
    memset(to->at, 0, TAPER_IDENTIFIER_LENGTH);
    memcpy(to->at, identifier, strlen(identifier)); /* at most so long */
    to->at += TAPER_IDENTIFIER_LENGTH;
    return true;
}

static int32_t failsafe_told_W(const taper_station_t *station) {
    return station->limits.failsafe_told ? station->limits.failsafe_W : TAPER_ABSENT;
}

/** @return length of the body. */
static uint32_t put_body(taper_station_t *station, uint32_t now_ms) {
    uint8_t *body = station->scratch.record + TAPER_STORED_HEADER;
    taper_writer_t to = {body};
    uint8_t entries = 0;
    taper_put_u32(&to, name_crc(station));
    taper_put_u32(&to, taper_session_kept_unix_s(&station->sessions, now_ms));
    taper_put_u32(&to, station->record.starts);
    taper_put_i32(&to, failsafe_told_W(station));
    uint8_t *count = to.at;
    taper_put_u32(&to, 0);
    for (uint8_t i = 0; i < station->options.config->connector_count; i++) {
        entries = (uint8_t)(entries + (put_entry(station, i, &to, now_ms) ? 1 : 0));
    }
    *count = entries;
    return BODY_FIXED + entries * ENTRY;
}

/** What could not be written is not on record, and will be tried again. */
static void write_record(taper_station_t *station, uint32_t now_ms) {
    taper_stored_area_t area = area_of(station);
    if (taper_stored_write(&area, put_body(station, now_ms))) {
        station->record.sequence = area.sequence;
        station->record.next_copy = area.next_copy;
        station->record.failsafe_W = failsafe_told_W(station);
        station->record.changes = station->sessions.changes;
        station->record.switches = station->allocator.switches;
        station->record.has_sessions = station->scratch.record[TAPER_STORED_HEADER + ENTRIES_AT] > 0;
    } else {
        station->record.changes = station->sessions.changes - 1u;
    }
    station->record.written_ms = now_ms;
    station->record.is_due = false;
}

/* ---- In */

static void get_session(taper_reader_t *from, taper_session_kept_t *kept) {
    taper_ev_params_t *p = &kept->used;
    p->a.capacity_Wh = taper_get_i32(from);
    p->a.soc_target_permille = taper_get_i32(from);
    p->a.soc_minimum_permille = taper_get_i32(from);
    p->a.soc_plug_in_permille = taper_get_i32(from);
    p->b.departure_min = taper_get_i32(from);
    p->b.peak_W = taper_get_i32(from);
    p->b.min_mA = taper_get_i32(from);
    p->c.target_Wh = taper_get_i32(from);
    p->c.maximum_Wh = taper_get_i32(from);
    p->c.minimum_Wh = taper_get_i32(from);
    p->d.taper_W = taper_get_i32(from);
    kept->session_Wh = taper_get_i32(from);
    kept->stored_Wh = taper_get_i32(from);
    kept->anchor_Wh = taper_get_i32(from);
    kept->stay_s = taper_get_u32(from);
}

static taper_turn_kept_t get_turn(taper_reader_t *from, unsigned flags) {
    taper_turn_kept_t turn;
    turn.on = (flags & ON) != 0u;
    turn.switched = (flags & SWITCHED) != 0u;
    turn.waits = (flags & WAITS) != 0u;
    turn.since_s = taper_get_u32(from);
    turn.waiting_s = taper_get_u32(from);
    turn.owed_Ws = taper_get_i32(from);
    return turn;
}

static void get_entry(taper_station_t *station, taper_reader_t from) {
    taper_session_kept_t kept;
    memset(&kept, 0, sizeof kept);
    const uint8_t i = taper_get_u8(&from);
    const unsigned flags = taper_get_u8(&from);
    kept.error = taper_get_u8(&from);
    kept.used.a.session = taper_get_u8(&from);
    kept.used.a.revision = taper_get_u8(&from);
    kept.complete = (flags & COMPLETE) != 0u;
    kept.pause_requested = (flags & PAUSED) != 0u;
    kept.stop_requested = (flags & STOPPED) != 0u;
    from.at += 3;
    get_session(&from, &kept);
    const taper_turn_kept_t turn = get_turn(&from, flags);
    if (i >= station->options.config->connector_count) {
        return;
    }
    if ((flags & HAS_SESSION) != 0u && taper_session_restore(&station->sessions, i, &kept)) {
        memcpy(station->transfers.identifier[i], from.at, TAPER_IDENTIFIER_LENGTH);
        station->identifier_kept[i] = true;
        station->turn_kept[i] = turn;
        station->turn_awaits[i] = true;
    }
    if ((flags & LOCKED) != 0u) {
        station->draw[i].state = TAPER_DRAW_LOCKED;
    }
}

/** @return false: it is not this station's. */
static bool get_body(taper_station_t *station, uint32_t length) {
    const uint8_t *body = station->scratch.record + TAPER_STORED_HEADER;
    const uint32_t entries = body[ENTRIES_AT];
    taper_reader_t from = {body};
    if (length != BODY_FIXED + entries * ENTRY || taper_get_u32(&from) != name_crc(station)) {
        return false;
    }
    const uint32_t unix_s = taper_get_u32(&from);
    station->record.starts = taper_get_u32(&from);
    station->record.failsafe_W = taper_get_i32(&from);
    from.at = body + BODY_FIXED;
    for (uint32_t k = 0; k < entries; k++) {
        get_entry(station, from);
        from.at += ENTRY;
    }
    taper_session_start_clock(&station->sessions, unix_s, 0);
    return true;
}

/** Data of the events: the area, and 16 more for a record that is sound but not ours. */
static void note_found(taper_station_t *station, taper_stored_t found, taper_store_area_t area) {
    if (found == TAPER_STORED_OLD_COPY) {
        taper_event_note(&station->events, TAPER_EVENT_STORE_OLD_COPY, 0, 0, (int32_t)area);
    }
    if (found == TAPER_STORED_BAD || found == TAPER_STORED_OTHER) {
        taper_event_note(&station->events, TAPER_EVENT_STORE_RESET, 0, 0,
                         (int32_t)area + (found == TAPER_STORED_OTHER ? 16 : 0));
    }
}

static taper_stored_t read_record(taper_station_t *station) {
    taper_stored_area_t area = area_of(station);
    uint32_t length = 0;
    const taper_stored_t found = taper_stored_read(&area, &length);
    station->record.sequence = area.sequence;
    station->record.next_copy = area.next_copy;
    const bool good = found == TAPER_STORED_GOOD || found == TAPER_STORED_OLD_COPY;
    return good && !get_body(station, length) ? TAPER_STORED_OTHER : found;
}

void taper_record_load(taper_station_t *station) {
    const int32_t built_W = station->options.config->groups[0].limit_W;
    station->record.failsafe_W = TAPER_ABSENT;
    note_found(station, station->options.settings_found, TAPER_STORE_SETTINGS);
    if (!taper_stored_is_there(station->options.port)) {
        return;
    }
    note_found(station, read_record(station), TAPER_STORE_STATION);
    if (station->record.failsafe_W != TAPER_ABSENT) {
        station->limits.failsafe_W = taper_clamp_i32(station->record.failsafe_W, 0, built_W);
        station->limits.failsafe_told = true;
    }
    taper_count(&station->record.starts);
    write_record(station, 0);
}

void taper_record_start_clock(taper_station_t *station, uint32_t now_ms) {
    taper_session_start_clock(&station->sessions, station->sessions.kept_unix_s, now_ms);
    station->record.written_ms = now_ms;
}

/** What others may still draw by an earlier life leaves room for few at first. A turn is not over because of that, nor did it
    begin: until all of it is over, every allocation begins with the turns as they were. */
void taper_record_resume_turns(taper_station_t *station, uint32_t now_ms) {
    const bool is_starting =
        station->supervisor.mode == TAPER_MODE_INIT || taper_ledger_is_starting(&station->ledger);
    for (uint8_t i = 0; i < station->options.config->connector_count; i++) {
        if (!station->turn_awaits[i]) {
            continue;
        }
        const bool is_kept = taper_session_is_kept(&station->sessions, i);
        if (is_kept && station->snapshot.demand[i].active) {
            taper_allocator_restore(
                &station->allocator, i, station->snapshot.demand[i].session, &station->turn_kept[i],
                taper_session_since_kept_s(&station->sessions, now_ms), station->snapshot.now_ms);
            station->turn_awaits[i] = is_starting;
        } else {
            station->turn_awaits[i] = is_kept;
        }
    }
}

static bool is_due(const taper_station_t *station, uint32_t now_ms) {
    const taper_station_record_t *record = &station->record;
    const bool changed = record->failsafe_W != failsafe_told_W(station) ||
                         record->changes != station->sessions.changes ||
                         record->switches != station->allocator.switches;
    const uint32_t since_ms = taper_elapsed_ms(now_ms, record->written_ms);
    return changed ? since_ms >= CHANGE_GAP_ms : record->has_sessions && since_ms >= ACCOUNT_GAP_ms;
}

void taper_record_update(taper_station_t *station, bool in_tick, uint32_t now_ms) {
    if (!taper_stored_is_there(station->options.port)) {
        return;
    }
    if (station->record.is_due) {
        write_record(station, now_ms);
    } else {
        station->record.is_due = in_tick && is_due(station, now_ms);
    }
}
