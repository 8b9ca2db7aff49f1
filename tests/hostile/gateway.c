#include "gateway.h"

#include <string.h>

#define ABSENT16 0x8000u

void gateway_init(gateway_t *gateway, const taper_station_config_t *config, random_t *random) {
    memset(gateway, 0, sizeof *gateway);
    gateway->config = config;
    gateway->random = random;
    gateway->active = true;
    gateway->limit = config->groups[0].limit_W / 100;
    gateway->failsafe = config->failsafe_W / 100;
    gateway->validity_s = 0xFF;
    gateway->unix_s = 1800000000u;
    gateway->quality = 1;
}

void gateway_hold(gateway_t *gateway, int32_t limit_W) {
    gateway->steady = true;
    gateway->active = true;
    gateway->limit_absent = false;
    gateway->flaps = false;
    gateway->limit = limit_W / 100;
    gateway->validity_s = 0xFF;
    gateway->silent_until_ms = 0;
    gateway->meter_silent_until_ms = 0;
    gateway->beats_until_ms = 0;
    gateway->other_absent = false;
    memset(gateway->other_dA, 0, sizeof gateway->other_dA);
}

/** Anything from far below nothing to far above what the site has; often what matters. */
static int32_t some_limit(gateway_t *gateway) {
    const int32_t built = gateway->config->groups[0].limit_W / 100;
    switch (random_below(gateway->random, 14)) {
    case 0: return 0;
    case 1: return random_in(gateway->random, -32767, -1);
    case 2: return random_in(gateway->random, 1, 30);
    case 3: return random_in(gateway->random, built, 32767);
    case 4:
    case 5:
    case 6: return random_in(gateway->random, 20, built / 3);
    default: return random_in(gateway->random, built / 3, built);
    }
}

static void change_limit(gateway_t *gateway) {
    random_t *random = gateway->random;
    gateway->limit = some_limit(gateway);
    gateway->active = !random_once_in(random, 12);
    gateway->limit_absent = random_once_in(random, 25);
    gateway->flaps = random_once_in(random, 12);
    gateway->validity_s = random_once_in(random, 10) ? (uint8_t)random_in(random, 0, 8) : 0xFF;
    gateway->changes++;
}

static void change_other_load(gateway_t *gateway) {
    random_t *random = gateway->random;
    gateway->other_absent = random_once_in(random, 20);
    for (unsigned phase = 0; phase < 3; phase++) {
        gateway->other_dA[phase] =
            random_once_in(random, 10) ? random_in(random, -2000, 2000) : random_in(random, -50, 150);
    }
}

static void change_clock(gateway_t *gateway) {
    random_t *random = gateway->random;
    gateway->unix_s = random_once_in(random, 3)
                          ? (uint32_t)random_bits(random)
                          : gateway->unix_s + (uint32_t)random_in(random, -90000, 90000);
    gateway->quality = random_once_in(random, 3) ? 0 : 1;
}

static void fall_silent(gateway_t *gateway, int64_t now_ms) {
    random_t *random = gateway->random;
    if (random_once_in(random, 250)) {
        gateway->silent_until_ms =
            now_ms + random_in(random, 1000, random_once_in(random, 5) ? 150000 : 20000);
    }
    if (random_once_in(random, 200)) {
        gateway->meter_silent_until_ms = now_ms + random_in(random, 1000, 30000);
    }
    if (random_once_in(random, 2000)) {
        gateway->beats_until_ms = now_ms + random_in(random, 60000, 200000);
    }
}

void gateway_tick(gateway_t *gateway, int64_t now_ms) {
    random_t *random = gateway->random;
    gateway->unix_s++;
    if (random_once_in(random, 400)) {
        change_clock(gateway);
    }
    if (gateway->steady) {
        return;
    }
    if (random_once_in(random, 20)) {
        change_limit(gateway);
    }
    if (random_once_in(random, 40)) {
        change_other_load(gateway);
    }
    if (random_once_in(random, 60)) {
        const int32_t most = gateway->config->groups[0].limit_W / 100;
        gateway->failsafe = random_once_in(random, 4) ? INT16_MIN : random_in(random, -50, most / 2);
    }
    fall_silent(gateway, now_ms);
}

static void seal_and_send(gateway_t *gateway, taper_frame_t *frame, gateway_send_t send, void *context) {
    const unsigned function = wire_function(frame);
    wire_seal(frame, gateway->counter[function]);
    gateway->counter[function] = (uint8_t)((gateway->counter[function] + 1u) & 0x0Fu);
    gateway->sent++;
    send(context, frame);
}

static void send_limit(gateway_t *gateway, int64_t now_ms, gateway_send_t send, void *context) {
    taper_frame_t frame = wire_frame(WIRE_SITE_LIMIT, WIRE_GATEWAY);
    const bool beats_only = gateway->limit_absent || now_ms < gateway->beats_until_ms;
    wire_put(&frame, 12, 1, gateway->active || beats_only);
    wire_put(&frame, 16, 16, beats_only ? ABSENT16 : (uint32_t)gateway->limit);
    wire_put(&frame, 32, 16, (uint32_t)gateway->failsafe);
    wire_put(&frame, 48, 8, 0xFF);
    wire_put(&frame, 56, 8, gateway->validity_s);
    seal_and_send(gateway, &frame, send, context);
}

static void send_meter(gateway_t *gateway, gateway_send_t send, void *context) {
    taper_frame_t frame = wire_frame(WIRE_SITE_METER, WIRE_GATEWAY);
    for (unsigned phase = 0; phase < 3; phase++) {
        const bool absent = gateway->other_absent && phase == 1;
        wire_put(&frame, 16 + 16 * phase, 16, absent ? ABSENT16 : (uint32_t)gateway->other_dA[phase]);
    }
    seal_and_send(gateway, &frame, send, context);
}

static void send_time(gateway_t *gateway, gateway_send_t send, void *context) {
    taper_frame_t frame = wire_frame(WIRE_TIME_SYNC, WIRE_GATEWAY);
    wire_put(&frame, 16, 32, gateway->unix_s);
    wire_put(&frame, 48, 10, random_below(gateway->random, 1000));
    wire_put(&frame, 58, 6, gateway->quality);
    seal_and_send(gateway, &frame, send, context);
}

void gateway_report(gateway_t *gateway, unsigned poll, int64_t now_ms, gateway_send_t send, void *context) {
    if (now_ms < gateway->silent_until_ms) {
        return;
    }
    if (poll == 1 || gateway->flaps) {
        gateway->limit = gateway->flaps ? some_limit(gateway) : gateway->limit;
        send_limit(gateway, now_ms, send, context);
    }
    if (poll == 2 && now_ms >= gateway->meter_silent_until_ms) {
        send_meter(gateway, send, context);
    }
    if (poll == 3) {
        send_time(gateway, send, context);
    }
}
