#include "taper/ledger.h"

#include <string.h>

#include "taper/draw.h"

/** A report tells nothing of setpoints that may have crossed it on the way: both may have waited as long [ms]. */
#define CROSSING_ms (2u * TAPER_LEDGER_LATE_ms)
/** taper_ledger_entry_t.first_echo: nothing of an earlier life can be echoed any more. */
#define ECHO_IS_OURS UINT8_MAX

/** In which a vehicle follows a lower setpoint, in the time of the bus. */
static uint32_t reaction_ms(const taper_ledger_t *ledger, uint8_t connector) {
    const uint32_t world_ms = ledger->config->connectors[connector].reaction_ms;
    return world_ms / ledger->time_scale + (world_ms % ledger->time_scale == 0 ? 0 : 1);
}

void taper_ledger_init(taper_ledger_t *ledger, const taper_station_config_t *config, uint32_t validity_ms,
                       uint32_t time_scale, uint32_t now_ms) {
    memset(ledger, 0, sizeof *ledger);
    ledger->config = config;
    ledger->validity_ms = validity_ms;
    ledger->time_scale = time_scale;
    for (uint8_t i = 0; i < config->connector_count; i++) {
        taper_ledger_entry_t *entry = &ledger->entry[i];
        entry->over_fallback_mA = config->connectors[i].fallback_mA;
        entry->unknown_mA = config->connectors[i].max_mA;
        /* its validity, and what its last report may wait */
        entry->unknown_until_ms = now_ms + validity_ms + TAPER_LEDGER_LATE_ms + reaction_ms(ledger, i);
    }
}

static bool has_bit(uint16_t set, unsigned counter) {
    return ((unsigned)set >> counter & 1u) != 0u;
}

static void clear_bit(uint16_t *set, unsigned counter) {
    *set = (uint16_t)(*set & ~(1u << counter));
}

static void set_bit(uint16_t *set, unsigned counter) {
    *set = (uint16_t)(*set | 1u << counter);
}

bool taper_ledger_can_send(const taper_ledger_t *ledger, uint8_t connector, uint8_t counter) {
    return !has_bit(ledger->entry[connector].echoed, counter);
}

/** After some were closed. */
static void note_open(taper_ledger_entry_t *entry) {
    int32_t most_dA = 0;
    int32_t most_fallback_dA = 0;
    unsigned c = 0;
    for (unsigned left = entry->open; left != 0; left >>= 1) {
        if ((left & 1u) != 0u) {
            most_dA = taper_max_i32(most_dA, entry->sent_dA[c]);
            most_fallback_dA = taper_max_i32(most_fallback_dA, entry->fallback_dA[c]);
        }
        c++;
    }
    entry->open_mA = most_dA * TAPER_CURRENT_STEP_mA;
    entry->open_fallback_mA = most_fallback_dA * TAPER_CURRENT_STEP_mA;
}

/** A counter that it echoes already proves nothing when it is used. */
static void note_unproven(taper_ledger_entry_t *entry, uint8_t counter) {
    const uint8_t name = (uint8_t)(counter + 1u);
    if (entry->reported == name) {
        entry->unproven = name;
    } else if (entry->unproven == name) {
        entry->unproven = 0;
    }
}

void taper_ledger_sent(taper_ledger_t *ledger, uint8_t connector, uint8_t counter, int32_t current_mA,
                       int32_t fallback_mA, uint32_t now_ms) {
    taper_ledger_entry_t *entry = &ledger->entry[connector];
    note_unproven(entry, counter);
    entry->sent_dA[counter] = (uint16_t)(current_mA / TAPER_CURRENT_STEP_mA);
    entry->fallback_dA[counter] = (uint16_t)(fallback_mA / TAPER_CURRENT_STEP_mA);
    entry->sent_ms[counter] = now_ms;
    entry->last_mA = current_mA;
    entry->last_fallback_mA = fallback_mA;
    set_bit(&entry->open, counter);
    set_bit(&entry->echoed, counter);
    entry->open_mA = taper_max_i32(entry->open_mA, current_mA);
    entry->open_fallback_mA = taper_max_i32(entry->open_fallback_mA, fallback_mA);
}

/** What the connector may let through by our setpoints. One in force is never below its own fallback current. */
static int32_t in_force_mA(const taper_ledger_entry_t *entry) {
    return taper_max_i32(entry->open_mA, entry->over_fallback_mA);
}

static unsigned count_fades(const taper_ledger_entry_t *entry) {
    unsigned count = 0;
    while (count < TAPER_LEDGER_FADES && entry->fade[count].mA != 0) {
        count++;
    }
    return count;
}

/** Book a level until a time that is not before any that is booked, or taken for the last of these. */
static void fade_from(taper_ledger_entry_t *entry, int32_t level_mA, uint32_t until_ms) {
    unsigned count = count_fades(entry);
    if (count > 0 && !taper_time_reached(until_ms, entry->fade[count - 1].until_ms)) {
        until_ms = entry->fade[count - 1].until_ms;
    }
    while (count > 0 && entry->fade[count - 1].mA <= level_mA) {
        entry->fade[--count].mA = 0; /* lasts no longer, and is no higher */
    }
    if (count == TAPER_LEDGER_FADES) {
        entry->fade[count - 1].until_ms = until_ms;
    } else {
        entry->fade[count] = (taper_ledger_fade_t){.mA = level_mA, .until_ms = until_ms};
    }
}

/** After some setpoints were closed at `time_ms`: the vehicle follows. */
static void follow_down(const taper_ledger_t *ledger, uint8_t connector, taper_ledger_entry_t *entry,
                        int32_t before_mA, uint32_t time_ms) {
    if (in_force_mA(entry) < before_mA) {
        fade_from(entry, before_mA, time_ms + reaction_ms(ledger, connector));
    }
}

static void drop_faded(taper_ledger_entry_t *entry, uint32_t time_ms) {
    while (entry->fade[0].mA != 0 && taper_time_reached(time_ms, entry->fade[0].until_ms)) {
        memmove(entry->fade, entry->fade + 1, (TAPER_LEDGER_FADES - 1u) * sizeof *entry->fade);
        entry->fade[TAPER_LEDGER_FADES - 1u].mA = 0;
    }
}

static void drop_unknown(taper_ledger_entry_t *entry, uint32_t time_ms) {
    if (taper_time_reached(time_ms, entry->unknown_until_ms)) {
        entry->unknown_mA = 0;
    }
}

/** Nothing of an earlier life is in force any more; the vehicle has followed by then. */
static void end_unknown(taper_ledger_entry_t *entry, uint32_t followed_ms) {
    if (!taper_time_reached(followed_ms, entry->unknown_until_ms)) {
        entry->unknown_until_ms = followed_ms;
    }
    entry->first_echo = ECHO_IS_OURS;
}

/** Over, but the fallback current told with it may be the last one that was accepted. */
static void close_unheard(taper_ledger_entry_t *entry, unsigned c) {
    clear_bit(&entry->open, c);
    entry->over_fallback_mA =
        taper_max_i32(entry->over_fallback_mA, entry->fallback_dA[c] * TAPER_CURRENT_STEP_mA);
    note_open(entry);
}

/** The connector fell back, so all that had arrived when it said so is over. */
static void hear_fallback(taper_ledger_entry_t *entry, uint32_t at_ms) {
    entry->reported = 0;
    for (unsigned c = 0; c < TAPER_LEDGER_SETPOINTS; c++) {
        if (has_bit(entry->open, c) && taper_time_reached(at_ms, entry->sent_ms[c] + CROSSING_ms)) {
            close_unheard(entry, c);
            clear_bit(&entry->echoed, c);
        }
    }
}

/** Whether setpoint `c` was sent before `other`. Within a millisecond the counter tells. */
static bool sent_before(const taper_ledger_entry_t *entry, unsigned c, unsigned other) {
    if (entry->sent_ms[c] != entry->sent_ms[other]) {
        return taper_time_reached(entry->sent_ms[other], entry->sent_ms[c]);
    }
    return ((other - c) & (TAPER_LEDGER_SETPOINTS - 1u)) < TAPER_LEDGER_SETPOINTS / 2u;
}

/** An echo proves the setpoint it names, so whatever was sent before that is over, and its fallback current too. */
static void hear_echo(taper_ledger_entry_t *entry, unsigned counter, uint32_t followed_ms) {
    entry->reported = (uint8_t)(counter + 1u);
    if (!has_bit(entry->open, counter)) {
        return; /* an echo of long ago */
    }
    if (entry->first_echo == 0 || entry->first_echo == counter + 1u) {
        entry->first_echo = (uint8_t)(counter + 1u);
        return; /* perhaps a setpoint of the controller before us, with the same counter */
    }
    if (entry->unproven == entry->reported) {
        return; /* perhaps one whose counter was corrupted */
    }
    end_unknown(entry, followed_ms);
    entry->accepts = true;
    entry->over_fallback_mA = 0; /* what is open is younger than what ran out */
    unsigned c = 0;
    for (unsigned left = entry->echoed; left != 0; left >>= 1) {
        if ((left & 1u) != 0u && c != counter && sent_before(entry, c, counter)) {
            clear_bit(&entry->open, c);
            clear_bit(&entry->echoed, c);
        }
        c++;
    }
    note_open(entry);
}

/** Fault 41. A report without a current tells nothing. */
static void hear_draw(const taper_ledger_t *ledger, uint8_t connector, taper_ledger_entry_t *entry,
                      const taper_evse_status_t *status, uint32_t at_ms) {
    const int32_t measured_mA =
        taper_max_i32(taper_max_i32(status->current_mA[0], status->current_mA[1]), status->current_mA[2]);
    if (measured_mA == TAPER_ABSENT) {
        return;
    }
    const bool over = measured_mA > taper_draw_tolerated_mA(taper_ledger_told_mA(ledger, connector));
    entry->drawn_mA = over ? measured_mA : 0;
    entry->drawn_until_ms = at_ms + ledger->validity_ms + reaction_ms(ledger, connector);
}

void taper_ledger_hear(taper_ledger_t *ledger, uint8_t connector, const taper_evse_status_t *status,
                       uint32_t at_ms) {
    taper_ledger_entry_t *entry = &ledger->entry[connector];
    if (!status->ev_present || status->pilot == TAPER_PILOT_A) {
        memset(entry, 0, sizeof *entry); /* a setpoint does not outlive its session */
        entry->first_echo = ECHO_IS_OURS;
        hear_draw(ledger, connector, entry, status, at_ms); /* a contactor that is welded */
        return;
    }
    const int32_t before_mA = in_force_mA(entry);
    const uint32_t followed_ms = at_ms + reaction_ms(ledger, connector);
    if (status->fallback_active) {
        hear_fallback(entry, at_ms);
        end_unknown(entry, followed_ms);
    } else {
        hear_echo(entry, status->setpoint_echo, followed_ms);
    }
    follow_down(ledger, connector, entry, before_mA, at_ms);
    drop_faded(entry, at_ms);
    drop_unknown(entry, at_ms);
    hear_draw(ledger, connector, entry, status, at_ms);
}

/** Setpoints expire. A report that names one may be on its way for a while more. */
static void close_expired(const taper_ledger_t *ledger, taper_ledger_entry_t *entry, uint32_t now_ms) {
    for (unsigned c = 0; (unsigned)entry->echoed >> c != 0; c++) {
        if (!has_bit(entry->echoed, c)) { /* nor is it open */
            continue;
        }
        const uint32_t end_ms = entry->sent_ms[c] + ledger->validity_ms + TAPER_LEDGER_LATE_ms;
        if (has_bit(entry->open, c) && taper_time_reached(now_ms, end_ms)) {
            close_unheard(entry, c);
        }
        if (taper_time_reached(now_ms, end_ms + TAPER_LEDGER_LATE_ms)) {
            clear_bit(&entry->echoed, c);
        }
    }
}

static void update_one(const taper_ledger_t *ledger, uint8_t connector, taper_ledger_entry_t *entry,
                       uint32_t now_ms) {
    const int32_t before_mA = in_force_mA(entry);
    close_expired(ledger, entry, now_ms);
    follow_down(ledger, connector, entry, before_mA, now_ms);
    drop_faded(entry, now_ms);
    if (taper_time_reached(now_ms + reaction_ms(ledger, connector), entry->unknown_until_ms)) {
        entry->first_echo = ECHO_IS_OURS;
    }
    drop_unknown(entry, now_ms);
    if (taper_time_reached(now_ms, entry->drawn_until_ms)) {
        entry->drawn_mA = 0;
    }
}

void taper_ledger_update(taper_ledger_t *ledger, uint32_t now_ms) {
    for (uint8_t i = 0; i < ledger->config->connector_count; i++) {
        update_one(ledger, i, &ledger->entry[i], now_ms);
    }
}

bool taper_ledger_is_accepted(const taper_ledger_t *ledger, uint8_t connector) {
    return ledger->entry[connector].accepts;
}

bool taper_ledger_is_starting(const taper_ledger_t *ledger) {
    int32_t unknown_mA = 0;
    for (uint8_t i = 0; i < ledger->config->connector_count; i++) {
        unknown_mA |= ledger->entry[i].unknown_mA;
    }
    return unknown_mA != 0;
}

int32_t taper_ledger_told_mA(const taper_ledger_t *ledger, uint8_t connector) {
    const taper_ledger_entry_t *entry = &ledger->entry[connector];
    const int32_t known_mA = taper_max_i32(in_force_mA(entry), entry->fade[0].mA);
    return taper_max_i32(known_mA, entry->unknown_mA);
}

int32_t taper_ledger_may_mA(const taper_ledger_t *ledger, uint8_t connector) {
    return taper_max_i32(taper_ledger_told_mA(ledger, connector), ledger->entry[connector].drawn_mA);
}

int32_t taper_ledger_fallback_mA(const taper_ledger_t *ledger, uint8_t connector) {
    const taper_ledger_entry_t *entry = &ledger->entry[connector];
    return taper_max_i32(entry->open_fallback_mA, entry->over_fallback_mA);
}

int32_t taper_ledger_unreached_mA(const taper_ledger_t *ledger, uint8_t connector) {
    return ledger->entry[connector].over_fallback_mA;
}
