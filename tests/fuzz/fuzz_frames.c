#include "fuzz_frames.h"

#include <stdlib.h>
#include <string.h>

#include "check.h"
#include "taper/codec.h"
#include "taper/membus.h"
#include "taper/stations.h"

#define BUSES                4u
#define IDS                  0x800u
#define START_BEFORE_WRAP_ms 20000u
#define LONGEST_CONTENT \
    64u /* records in one transfer: more than the longest curve that a buffer can hold is no news */

fuzz_stats_t fuzz_stats;

/** The station and its world, renewed with every input. */
static struct {
    taper_station_t station;
    taper_membus_t bus;
    taper_port_t port;
    uint32_t now_ms;
    uint8_t counter[BUSES][IDS];             /**< next end-to-end counter of every identifier */
    taper_e2e_receiver_t mirror[BUSES][IDS]; /**< our own account of what is sound */
} world;

static const taper_station_config_t *hub(void) {
    for (unsigned k = 0; k < taper_station_count; k++) {
        if (strcmp(taper_stations[k]->name, "hub") == 0) {
            return taper_stations[k];
        }
    }
    check_that(false, "images without the station hub", 1);
    return NULL;
}

static void start_station(void) {
    const taper_station_options_t options = {
        .config = hub(), .port = &world.port, .iterations_per_tick = TAPER_MIN_SLICE};
    const taper_status_t status = taper_station_init(&world.station, &options);
    check_that(status == TAPER_OK, "status of taper_station_init()", status);
}

static void begin(void) {
    memset(world.counter, 0, sizeof world.counter);
    memset(world.mirror, 0, sizeof world.mirror);
    taper_membus_init(&world.bus);
    world.port = taper_membus_station_port(&world.bus);
    world.now_ms = 0u - START_BEFORE_WRAP_ms;
    taper_membus_set_time(&world.bus, world.now_ms);
    start_station();
}

/** Sort a frame as a receiver should, and check what it decodes to. */
static void look_at(const taper_frame_t *frame) {
    const unsigned function = frame->id >> 6;
    taper_message_t message;
    bool bad_field = false;
    if (function == TAPER_MESSAGE_ISOTP_TO || function == TAPER_MESSAGE_ISOTP_FROM) {
        fuzz_stats.isotp_frames++;
    }
    /* Decoding comes first, whatever the CRC says: it must bear any bytes. */
    const bool decoded = taper_decode(frame, &message, &bad_field);
    if (decoded) {
        check_message(&message);
    }
    const taper_e2e_check_t check = taper_e2e_check(&world.mirror[frame->bus][frame->id], frame);
    if (check != TAPER_E2E_OK && check != TAPER_E2E_OK_SOME_LOST) {
        return;
    }
    fuzz_stats.sound++;
    if (decoded) {
        fuzz_stats.decoded[function]++;
        fuzz_stats.partly_absent += bad_field ? 1u : 0u;
    }
}

static void deliver(const taper_frame_t *frame) {
    fuzz_stats.frames++;
    look_at(frame);
    (void)taper_membus_world_send(&world.bus, frame);
}

/** What the station says must be sound, too. */
static void hear_answers(void) {
    taper_frame_t frame;
    while (taper_membus_world_receive(&world.bus, &frame)) {
        const unsigned function = frame.id >> 6;
        taper_message_t message;
        bool bad_field = false;
        fuzz_stats.answers++;
        if (function == TAPER_MESSAGE_ISOTP_TO) {
            continue;
        }
        taper_e2e_receiver_t receiver = {0};
        check_that(taper_e2e_check(&receiver, &frame) == TAPER_E2E_OK, "the CRC of what the station sent as",
                   frame.id);
        check_that(taper_decode(&frame, &message, &bad_field) && !bad_field, "out of range, sent as",
                   frame.id);
        check_message(&message);
        if (message.kind == TAPER_MESSAGE_SETPOINT) {
            check_setpoint(world.station.options.config, &message);
        }
    }
}

static void account_for_step(void) {
    fuzz_stats.steps++;
    for (uint8_t i = 0; i < world.station.snapshot.count; i++) {
        fuzz_stats.sessions += world.station.sessions.session[i].in_session ? 1u : 0u;
        fuzz_stats.demands += world.station.snapshot.demand[i].active ? 1u : 0u;
        fuzz_stats.currents += world.station.setpoints.current_mA[i] > 0 ? 1u : 0u;
    }
}

static void step(void) {
    taper_station_step(&world.station, world.now_ms);
    check_station(&world.station);
    hear_answers();
    account_for_step();
}

static void poll(void) {
    taper_station_poll(&world.station, world.now_ms);
    fuzz_stats.polls++;
    check_currents(&world.station);
    hear_answers();
}

static void pass_ms(uint32_t ms) {
    world.now_ms += ms;
    taper_membus_set_time(&world.bus, world.now_ms);
}

static void pass_time(uint8_t code) {
    static const uint32_t jump_min[256 - FUZZ_TIME_JUMP] = {10,          2 * 60,       24 * 60,
                                                            6 * 24 * 60, 23 * 24 * 60, 40 * 24 * 60};
    if (code >= FUZZ_TIME_JUMP) {
        pass_ms(jump_min[code - FUZZ_TIME_JUMP] * 60000u);
        step();
    } else if (code >= FUZZ_TIME_TICK) {
        pass_ms((uint32_t)(code - FUZZ_TIME_TICK + 1) * 1000u);
        step();
    } else if (code > FUZZ_TIME_STANDS) {
        pass_ms(code);
        poll();
    }
}

static taper_frame_t frame_of(const uint8_t *record) {
    const unsigned length = record[0] >> 4;
    const unsigned id = record[1] | (unsigned)record[2] << 8;
    taper_frame_t frame = {
        .id = (uint16_t)(id & (IDS - 1u)),
        .bus = (uint8_t)(id >> 11 & (BUSES - 1u)),
        .length = length == 0 || length > TAPER_FRAME_LENGTH ? TAPER_FRAME_LENGTH : (uint8_t)(length - 1u),
        .time_ms = world.now_ms,
    };
    memcpy(frame.data, record + 4, TAPER_FRAME_LENGTH);
    return frame;
}

static void feed_frame(const uint8_t *record) {
    taper_frame_t frame = frame_of(record);
    uint8_t *counter = &world.counter[frame.bus][frame.id];
    if ((record[0] & FUZZ_PROTECT) != 0) {
        const uint8_t given = frame.data[1] & 0x0F;
        const uint8_t used = (record[0] & FUZZ_COUNT) != 0 ? *counter : given;
        taper_e2e_protect(&frame, used);
        *counter = (uint8_t)((used + 1) & 0x0F);
    }
    deliver(&frame);
}

static uint32_t crc32(const uint8_t *data, size_t length) {
    uint32_t crc = UINT32_MAX;
    for (size_t i = 0; i < length; i++) {
        crc ^= data[i];
        for (unsigned bit = 0; bit < 8; bit++) {
            crc = crc >> 1 ^ ((crc & 1u) != 0 ? UINT32_C(0xEDB88320) : 0u);
        }
    }
    return ~crc;
}

/** Send `length` bytes (> 7) over ISO-TP, with the gaps and pauses that the station asks for. */
static void send_message(const taper_frame_t *like, const uint8_t *message, unsigned length) {
    taper_frame_t frame = *like;
    frame.length = TAPER_FRAME_LENGTH;
    frame.data[0] = (uint8_t)(0x10u | length >> 8);
    frame.data[1] = (uint8_t)length;
    memcpy(frame.data + 2, message, 6);
    deliver(&frame);
    pass_ms(2);
    poll();
    for (unsigned sent = 6, sequence = 1; sent < length; sent += 7, sequence++) {
        const unsigned part = length - sent < 7 ? length - sent : 7;
        frame.data[0] = (uint8_t)(0x20u | (sequence & 0x0Fu));
        memset(frame.data + 1, 0xCC, 7);
        memcpy(frame.data + 1, message + sent, part);
        frame.time_ms = world.now_ms;
        deliver(&frame);
        pass_ms(TAPER_TRANSFER_SEPARATION_ms);
        if (sequence % TAPER_TRANSFER_BLOCK_SIZE == 0) {
            poll();
        }
    }
    poll();
}

/** @return how many records behind this one were its content. */
static size_t feed_transfer(const uint8_t *record, size_t records_left) {
    static uint8_t message[4 + LONGEST_CONTENT * 8u + 4];
    const taper_frame_t like = frame_of(record);
    size_t count = like.data[1] < LONGEST_CONTENT ? like.data[1] : LONGEST_CONTENT;
    count = count < records_left ? count : records_left;
    unsigned length = 4;
    message[0] = 1;
    message[1] = like.data[0];
    message[2] = like.data[2];
    message[3] = like.data[3];
    for (size_t k = 1; k <= count; k++, length += 8) {
        memcpy(message + length, record + k * FUZZ_RECORD + 4, 8);
    }
    const uint32_t crc = crc32(message, length);
    for (unsigned byte = 0; byte < 4; byte++, length++) {
        message[length] = (uint8_t)(crc >> (8u * byte));
    }
    fuzz_stats.transfers++;
    send_message(&like, message, length);
    return count;
}

static void add_counters(void) {
    for (unsigned k = 0; k < TAPER_COUNTERS; k++) {
        fuzz_stats.station[k] += taper_station_counter(&world.station, (taper_counter_t)k);
    }
}

static void feed_event(const uint8_t *record) {
    const uint8_t detail = record[5];
    fuzz_stats.events++;
    switch (record[4] % FUZZ_EVENTS) {
    case FUZZ_BUS_OFF: taper_membus_bus_off(&world.bus, 0, detail); break;
    case FUZZ_BUS_ON: taper_membus_bus_on(&world.bus, 0); break;
    case FUZZ_POWER:
        add_counters();
        taper_membus_power_cycle(&world.bus);
        start_station();
        break;
    case FUZZ_TEAR_WRITE: taper_membus_tear_next_write(&world.bus, detail); break;
    default: taper_membus_rot(&world.bus, TAPER_STORE_STATION, record[6], 8u * record[7] + detail); break;
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    const size_t records = size / FUZZ_RECORD;
    begin();
    for (size_t k = 0; k < records; k++) {
        const uint8_t *record = data + k * FUZZ_RECORD;
        if ((record[0] & FUZZ_EVENT) != 0) {
            feed_event(record);
        } else if ((record[0] & FUZZ_TRANSFER) != 0) {
            k += feed_transfer(record, records - k - 1);
        } else {
            feed_frame(record);
        }
        pass_time(record[3]);
    }
    pass_time(FUZZ_TIME_TICK);
    fuzz_stats.inputs++;
    add_counters();
    return 0;
}
