/* What survives a restart: two copies, written in turn, each with a sequence number and a CRC-32 (faults 29 and 30). */
#include <string.h>

#include "station_internal.h"

/** Memory that wears out is not written more often than this. */
#define WRITE_GAP_ms UINT32_C(10000)

/** Bytes under the CRC: all before it. The record has no padding, so its bytes are its value. */
#define COVERED offsetof(taper_station_record_t, crc32)

_Static_assert(sizeof(taper_station_record_t) == 16, "a record without padding");

static bool read_copy(const taper_port_t *port, unsigned copy, taper_station_record_t *record,
                      bool *present) {
    if (!port->store_read(port->context, TAPER_STORE_STATION, copy, record, sizeof *record)) {
        return false;
    }
    *present = true;
    return record->crc32 == taper_crc32((const uint8_t *)record, COVERED);
}

/** Newest good copy into the station. @return good copies; `*present`: copies that were ever written. */
static unsigned find_newest(taper_station_t *station, unsigned *present) {
    const taper_port_t *port = station->options.port;
    unsigned good = 0;
    for (unsigned copy = 0; copy < TAPER_STORE_COPIES; copy++) {
        taper_station_record_t record;
        bool there = false;
        const bool is_good = read_copy(port, copy, &record, &there);
        *present += there ? 1u : 0u;
        if (is_good && (good == 0 || taper_time_reached(record.sequence, station->record.sequence))) {
            station->record = record;
            station->record_copy = (uint8_t)((copy + 1u) % TAPER_STORE_COPIES);
        }
        good += is_good ? 1u : 0u;
    }
    return good;
}

static int32_t failsafe_told_W(const taper_station_t *station) {
    return station->limits.failsafe_told ? station->limits.failsafe_W : TAPER_ABSENT;
}

/** What could not be written is not on record, and will be tried again. */
static void write_record(taper_station_t *station) {
    const taper_port_t *port = station->options.port;
    taper_station_record_t record = station->record;
    record.sequence++;
    record.failsafe_W = failsafe_told_W(station);
    record.crc32 = taper_crc32((const uint8_t *)&record, COVERED);
    if (port->store_write(port->context, TAPER_STORE_STATION, station->record_copy, &record, sizeof record)) {
        station->record = record;
        station->record_copy = (uint8_t)((station->record_copy + 1u) % TAPER_STORE_COPIES);
    }
}

static bool has_store(const taper_station_t *station) {
    return station->options.port->store_read != NULL && station->options.port->store_write != NULL;
}

void taper_record_load(taper_station_t *station) {
    const int32_t built_W = station->options.config->groups[0].limit_W;
    station->record.failsafe_W = TAPER_ABSENT;
    if (!has_store(station)) {
        return;
    }
    unsigned present = 0;
    const unsigned good = find_newest(station, &present);
    if (good == 0 && present > 0) {
        taper_event_note(&station->events, TAPER_EVENT_STORE_RESET, 0, 0, 0);
    } else if (good < present) {
        taper_event_note(&station->events, TAPER_EVENT_STORE_OLD_COPY, 0, 0, 0);
    }
    if (station->record.failsafe_W != TAPER_ABSENT) {
        station->limits.failsafe_W = taper_clamp_i32(station->record.failsafe_W, 0, built_W);
        station->limits.failsafe_told = true;
    }
    if (station->record.starts != UINT32_MAX) {
        station->record.starts++;
    }
    write_record(station);
}

void taper_record_update(taper_station_t *station, uint32_t now_ms) {
    const bool changed = station->record.failsafe_W != failsafe_told_W(station);
    if (has_store(station) && changed && taper_elapsed_ms(now_ms, station->record_ms) >= WRITE_GAP_ms) {
        station->record_ms = now_ms;
        write_record(station);
    }
}
