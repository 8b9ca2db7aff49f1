#include "taper/drive.h"

#define KIND_SHIFT 8u
#define DRIVE_MASK 0x1FFF0000u

/** Fields of an outlook, from the lowest bit; all ones of these two: absent. */
#define SOC_BITS   11u
#define SHORT_BITS 21u

static uint64_t ones(unsigned bits) {
    return (UINT64_C(1) << bits) - 1u;
}

/** Append the low `bits` of `value`. */
static void put(uint64_t *word, unsigned *at, uint64_t value, unsigned bits) {
    *word |= (value & ones(bits)) << *at;
    *at += bits;
}

static uint64_t get(uint64_t word, unsigned *at, unsigned bits) {
    const uint64_t value = word >> *at & ones(bits);
    *at += bits;
    return value;
}

static uint64_t data_of(const taper_slcan_message_t *message) {
    uint64_t word = 0;
    for (unsigned i = 0; i < message->length && i < TAPER_FRAME_LENGTH; i++) {
        word |= (uint64_t)message->data[i] << (8u * i);
    }
    return word;
}

static taper_slcan_message_t make(taper_drive_kind_t kind, uint8_t index, uint64_t word, uint8_t length) {
    taper_slcan_message_t message = {
        .id = TAPER_DRIVE_ID | (uint32_t)kind << KIND_SHIFT | index, .is_extended = true, .length = length};
    for (unsigned i = 0; i < length; i++) {
        message.data[i] = (uint8_t)(word >> (8u * i));
    }
    return message;
}

bool taper_drive_split(const taper_slcan_message_t *message, uint8_t *kind, uint8_t *index) {
    *kind = (uint8_t)(message->id >> KIND_SHIFT);
    *index = (uint8_t)message->id;
    return message->is_extended && !message->is_remote && (message->id & DRIVE_MASK) == TAPER_DRIVE_ID;
}

taper_slcan_message_t taper_drive_u32(taper_drive_kind_t kind, uint8_t index, uint32_t value) {
    return make(kind, index, value, 4);
}

taper_slcan_message_t taper_drive_plain(taper_drive_kind_t kind, uint8_t index) {
    return make(kind, index, 0, 0);
}

uint32_t taper_drive_get_u32(const taper_slcan_message_t *message) {
    return message->length < 4 ? 0 : (uint32_t)data_of(message);
}

taper_slcan_message_t taper_drive_setup(const taper_drive_setup_t *setup, unsigned part) {
    uint64_t word = 0;
    unsigned at = 0;
    if (part == 0) {
        put(&word, &at, setup->tick_ms, 32);
        put(&word, &at, setup->iterations_per_tick, 16);
        put(&word, &at, setup->policy, 8);
    } else {
        put(&word, &at, (uint32_t)setup->min_mA, 32);
        put(&word, &at, (uint32_t)setup->price_weight_permille, 32);
    }
    return make(TAPER_DRIVE_SETUP, (uint8_t)part, word, 8);
}

bool taper_drive_get_setup(const taper_slcan_message_t *message, taper_drive_setup_t *setup) {
    const uint64_t word = data_of(message);
    unsigned at = 0;
    if (message->length < 8) {
        return false;
    }
    if ((uint8_t)message->id == 0) {
        setup->tick_ms = (uint32_t)get(word, &at, 32);
        setup->iterations_per_tick = (uint16_t)get(word, &at, 16);
        setup->policy = (uint8_t)get(word, &at, 8);
    } else {
        setup->min_mA = (int32_t)(uint32_t)get(word, &at, 32);
        setup->price_weight_permille = (int32_t)(uint32_t)get(word, &at, 32);
    }
    return true;
}

taper_slcan_message_t taper_drive_done(taper_drive_kind_t of, const taper_drive_done_t *done) {
    uint64_t word = 0;
    unsigned at = 0;
    put(&word, &at, done->instructions, 32);
    put(&word, &at, done->plans, 16);
    put(&word, &at, done->mode, 8);
    put(&word, &at, done->ok, 1);
    put(&word, &at, done->hands_over, 1);
    put(&word, &at, done->is_settled, 1);
    put(&word, &at, done->watchdog_kicked, 1);
    put(&word, &at, done->planned, 1);
    return make(TAPER_DRIVE_DONE, (uint8_t)of, word, 8);
}

bool taper_drive_get_done(const taper_slcan_message_t *message, taper_drive_done_t *done) {
    const uint64_t word = data_of(message);
    unsigned at = 0;
    if (message->length < 8) {
        return false;
    }
    done->instructions = (uint32_t)get(word, &at, 32);
    done->plans = (uint16_t)get(word, &at, 16);
    done->mode = (uint8_t)get(word, &at, 8);
    done->ok = get(word, &at, 1) != 0;
    done->hands_over = get(word, &at, 1) != 0;
    done->is_settled = get(word, &at, 1) != 0;
    done->watchdog_kicked = get(word, &at, 1) != 0;
    done->planned = get(word, &at, 1) != 0;
    return true;
}

taper_slcan_message_t taper_drive_looked(uint8_t connector, const taper_outlook_t *outlook) {
    uint64_t word = 0;
    unsigned at = 0;
    const int32_t soc = outlook->soc_at_departure_permille;
    const int32_t missing_Wh = outlook->short_Wh;
    put(&word, &at, soc == TAPER_ABSENT ? ones(SOC_BITS) : (uint64_t)soc, SOC_BITS);
    put(&word, &at, missing_Wh == TAPER_ABSENT ? ones(SHORT_BITS) : (uint64_t)missing_Wh, SHORT_BITS);
    put(&word, &at, outlook->reason, 6);
    put(&word, &at, outlook->because, 6);
    put(&word, &at, outlook->waiting_place, 4);
    put(&word, &at, outlook->waiting_of, 4);
    put(&word, &at, outlook->soc_estimated, 1);
    put(&word, &at, outlook->by_energy, 1);
    put(&word, &at, outlook->departure_passed, 1);
    put(&word, &at, outlook->no_clock, 1);
    return make(TAPER_DRIVE_LOOKED, connector, word, 8);
}

bool taper_drive_get_looked(const taper_slcan_message_t *message, taper_outlook_t *outlook) {
    const uint64_t word = data_of(message);
    unsigned at = 0;
    if (message->length < 8) {
        return false;
    }
    const uint64_t soc = get(word, &at, SOC_BITS);
    const uint64_t missing_Wh = get(word, &at, SHORT_BITS);
    outlook->soc_at_departure_permille = soc == ones(SOC_BITS) ? TAPER_ABSENT : (int32_t)soc;
    outlook->short_Wh = missing_Wh == ones(SHORT_BITS) ? TAPER_ABSENT : (int32_t)missing_Wh;
    outlook->reason = (uint8_t)get(word, &at, 6);
    outlook->because = (uint8_t)get(word, &at, 6);
    outlook->waiting_place = (uint8_t)get(word, &at, 4);
    outlook->waiting_of = (uint8_t)get(word, &at, 4);
    outlook->soc_estimated = get(word, &at, 1) != 0;
    outlook->by_energy = get(word, &at, 1) != 0;
    outlook->departure_passed = get(word, &at, 1) != 0;
    outlook->no_clock = get(word, &at, 1) != 0;
    return true;
}
