#include "stored.h"

#include "bytes.h"
#include "taper/crc32.h"

#define MAGIC_0 0x54u
#define MAGIC_1 0x50u

/** What one copy turned out to be. */
typedef enum {
    COPY_NEVER, /**< nothing was ever written there */
    COPY_BAD,
    COPY_OTHER, /**< sound, of another area or layout */
    COPY_GOOD,
} copy_kind_t;

/** And what it says of itself. */
typedef struct {
    copy_kind_t kind;
    uint32_t length; /**< of its body */
    uint32_t sequence;
} copy_t;

bool taper_stored_is_there(const taper_port_t *port) {
    return port->store_read != NULL && port->store_write != NULL;
}

static uint32_t crc_at(const uint8_t *bytes, uint32_t offset) {
    taper_reader_t from = {bytes + offset};
    return taper_get_u32(&from);
}

/** The rest of a copy whose header is in `bytes`: sound or not, ours or not. */
static copy_kind_t judge_body(const taper_stored_area_t *area, unsigned copy, uint32_t length) {
    if (length > area->capacity - TAPER_STORED_ENVELOPE) {
        return COPY_BAD; /* no record of ours is so long: rotten, or of a larger image */
    }
    const uint32_t covered = TAPER_STORED_HEADER + length;
    if (!area->port->store_read(area->port->context, area->area, copy, area->bytes,
                                TAPER_STORED_ENVELOPE + length) ||
        crc_at(area->bytes, covered) != taper_crc32(area->bytes, covered)) {
        return COPY_BAD;
    }
    return area->bytes[2] == area->area && area->bytes[3] == area->layout ? COPY_GOOD : COPY_OTHER;
}

/** Read a copy into `bytes` and judge it. */
static copy_t judge(const taper_stored_area_t *area, unsigned copy) {
    if (!area->port->store_read(area->port->context, area->area, copy, area->bytes, TAPER_STORED_HEADER)) {
        return (copy_t){.kind = COPY_NEVER};
    }
    if (area->bytes[0] != MAGIC_0 || area->bytes[1] != MAGIC_1) {
        return (copy_t){.kind = COPY_BAD};
    }
    taper_reader_t from = {area->bytes + 4};
    copy_t found = {.length = taper_get_u32(&from)};
    found.sequence = taper_get_u32(&from);
    found.kind = judge_body(area, copy, found.length);
    return found;
}

static bool is_newer(const copy_t *copy, const copy_t *than) {
    return copy->kind == COPY_GOOD &&
           (than->kind != COPY_GOOD || than->sequence - copy->sequence > INT32_MAX);
}

static taper_stored_t verdict(const copy_t *newest, const copy_t *other) {
    if (newest->kind == COPY_GOOD) {
        return other->kind == COPY_BAD ? TAPER_STORED_OLD_COPY : TAPER_STORED_GOOD;
    }
    if (newest->kind == COPY_OTHER || other->kind == COPY_OTHER) {
        return TAPER_STORED_OTHER;
    }
    return newest->kind == COPY_BAD || other->kind == COPY_BAD ? TAPER_STORED_BAD : TAPER_STORED_NONE;
}

taper_stored_t taper_stored_read(taper_stored_area_t *area, uint32_t *length) {
    *length = 0;
    area->next_copy = 0;
    area->sequence = 0;
    area->copies_agree = false;
    if (!taper_stored_is_there(area->port)) {
        return TAPER_STORED_NONE;
    }
    copy_t copies[TAPER_STORE_COPIES];
    for (unsigned copy = 0; copy < TAPER_STORE_COPIES; copy++) {
        copies[copy] = judge(area, copy);
    }
    const unsigned newest = is_newer(&copies[1], &copies[0]) ? 1 : 0;
    if (newest == 0 && copies[0].kind == COPY_GOOD) {
        copies[0] = judge(area, 0); /* the other one is in `bytes` */
    }
    if (copies[newest].kind == COPY_GOOD) {
        *length = copies[newest].length;
        area->next_copy = (uint8_t)(1u - newest);
        area->sequence = copies[newest].sequence;
        area->copies_agree =
            copies[1u - newest].kind == COPY_GOOD && copies[1u - newest].sequence == area->sequence;
    }
    return verdict(&copies[newest], &copies[1u - newest]);
}

static bool put_out(const taper_stored_area_t *area, unsigned copy, uint32_t sequence, uint32_t length) {
    taper_writer_t to = {area->bytes};
    taper_put_u8(&to, MAGIC_0);
    taper_put_u8(&to, MAGIC_1);
    taper_put_u8(&to, area->area);
    taper_put_u8(&to, area->layout);
    taper_put_u32(&to, length);
    taper_put_u32(&to, sequence);
    to.at += length;
    taper_put_u32(&to, taper_crc32(area->bytes, TAPER_STORED_HEADER + length));
    return area->port->store_write(area->port->context, area->area, copy, area->bytes,
                                   TAPER_STORED_ENVELOPE + length);
}

bool taper_stored_write(taper_stored_area_t *area, uint32_t length) {
    if (!put_out(area, area->next_copy, area->sequence + 1, length)) {
        return false;
    }
    area->sequence++;
    area->next_copy = (uint8_t)(1u - area->next_copy);
    area->copies_agree = false;
    return true;
}

bool taper_stored_write_twin(taper_stored_area_t *area, uint32_t length) {
    area->copies_agree = put_out(area, area->next_copy, area->sequence, length);
    return area->copies_agree;
}
