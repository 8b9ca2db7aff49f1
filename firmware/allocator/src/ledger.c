#include "taper/ledger.h"

#include <string.h>

/** A report tells nothing of setpoints that may have crossed it on the way: both may have waited as long [ms]. */
#define CROSSING_ms (2u * TAPER_LEDGER_LATE_ms)

void taper_ledger_init(taper_ledger_t *ledger, const taper_station_config_t *config, uint32_t validity_ms,
                       uint32_t time_scale, uint32_t now_ms) {
    memset(ledger, 0, sizeof *ledger);
    ledger->config = config;
    ledger->validity_ms = validity_ms;
    ledger->time_scale = time_scale;
    for (uint8_t i = 0; i < config->connector_count; i++) {
        ledger->entry[i].unknown_mA = config->connectors[i].max_mA;
        ledger->entry[i].unknown_until_ms = now_ms + validity_ms;
    }
}

static bool is_open(const taper_ledger_entry_t *entry, unsigned counter) {
    return ((unsigned)entry->open >> counter & 1u) != 0u;
}

static void close_one(taper_ledger_entry_t *entry, unsigned counter) {
    entry->open = (uint16_t)(entry->open & ~(1u << counter));
}

bool taper_ledger_can_send(const taper_ledger_t *ledger, uint8_t connector, uint8_t counter) {
    return !is_open(&ledger->entry[connector], counter);
}

void taper_ledger_sent(taper_ledger_t *ledger, uint8_t connector, uint8_t counter, int32_t current_mA,
                       int32_t fallback_mA, uint32_t now_ms) {
    taper_ledger_entry_t *entry = &ledger->entry[connector];
    entry->sent_dA[counter] = (uint16_t)(current_mA / TAPER_CURRENT_STEP_mA);
    entry->fallback_dA[counter] = (uint16_t)(fallback_mA / TAPER_CURRENT_STEP_mA);
    entry->sent_ms[counter] = now_ms;
    entry->open = (uint16_t)(entry->open | 1u << counter);
}

/** Close all that was sent at least `margin_ms` before `time_ms`. */
static void close_older(taper_ledger_entry_t *entry, uint32_t time_ms, uint32_t margin_ms) {
    for (unsigned c = 0; c < TAPER_LEDGER_SETPOINTS; c++) {
        if (is_open(entry, c) && taper_time_reached(time_ms, entry->sent_ms[c] + margin_ms)) {
            close_one(entry, c);
        }
    }
}

static void close_all(taper_ledger_entry_t *entry) {
    entry->open = 0;
    entry->unknown_mA = 0;
}

/** Whether setpoint `c` was sent before `other`. Within a millisecond the counter tells. */
static bool sent_before(const taper_ledger_entry_t *entry, unsigned c, unsigned other) {
    if (entry->sent_ms[c] != entry->sent_ms[other]) {
        return taper_time_reached(entry->sent_ms[other], entry->sent_ms[c]);
    }
    return ((other - c) & (TAPER_LEDGER_SETPOINTS - 1u)) < TAPER_LEDGER_SETPOINTS / 2u;
}

/** An echo proves the setpoint it names, so whatever was sent before that is over. */
static void hear_echo(taper_ledger_entry_t *entry, unsigned counter) {
    if (!is_open(entry, counter)) {
        return; /* an echo of long ago */
    }
    if (entry->unknown_mA != 0) {
        if (entry->first_echo == 0 || entry->first_echo == counter + 1u) {
            entry->first_echo = (uint8_t)(counter + 1u);
            return; /* perhaps a setpoint of the controller before us, with the same counter */
        }
        entry->unknown_mA = 0;
    }
    for (unsigned c = 0; c < TAPER_LEDGER_SETPOINTS; c++) {
        if (c != counter && is_open(entry, c) && sent_before(entry, c, counter)) {
            close_one(entry, c);
        }
    }
}

void taper_ledger_hear(taper_ledger_t *ledger, uint8_t connector, const taper_evse_status_t *status,
                       uint32_t at_ms) {
    taper_ledger_entry_t *entry = &ledger->entry[connector];
    if (!status->ev_present || status->pilot == TAPER_PILOT_A) {
        close_all(entry); /* a setpoint does not outlive its session */
    } else if (status->fallback_active) {
        close_older(entry, at_ms, CROSSING_ms);
        entry->unknown_mA = 0;
    } else {
        hear_echo(entry, status->setpoint_echo);
    }
}

void taper_ledger_update(taper_ledger_t *ledger, uint32_t now_ms) {
    for (uint8_t i = 0; i < ledger->config->connector_count; i++) {
        taper_ledger_entry_t *entry = &ledger->entry[i];
        close_older(entry, now_ms, ledger->validity_ms + TAPER_LEDGER_LATE_ms);
        if (entry->unknown_mA != 0 && taper_time_reached(now_ms, entry->unknown_until_ms)) {
            entry->unknown_mA = 0;
        }
    }
}

int32_t taper_ledger_told_mA(const taper_ledger_t *ledger, uint8_t connector) {
    const taper_ledger_entry_t *entry = &ledger->entry[connector];
    int32_t most_dA = 0;
    for (unsigned c = 0; c < TAPER_LEDGER_SETPOINTS; c++) {
        if (is_open(entry, c)) {
            most_dA = taper_max_i32(most_dA, entry->sent_dA[c]);
        }
    }
    return most_dA * TAPER_CURRENT_STEP_mA;
}

int32_t taper_ledger_may_mA(const taper_ledger_t *ledger, uint8_t connector) {
    return taper_max_i32(taper_ledger_told_mA(ledger, connector), ledger->entry[connector].unknown_mA);
}
