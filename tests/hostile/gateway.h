/** The energy gateway of the hostile world: limits that jump, other load that does, a clock that is wrong, and silence. */
#ifndef HOSTILE_GATEWAY_H
#define HOSTILE_GATEWAY_H

#include "random.h"
#include "wire.h"

#include "taper/types.h"

typedef struct {
    const taper_station_config_t *config;
    random_t *random;
    bool steady; /**< limit and other load stay, and there is no silence */
    bool active, limit_absent, flaps;
    int32_t limit, failsafe; /**< x 100 W; the failsafe limit may be absent */
    uint8_t validity_s;
    int32_t other_dA[3];
    bool other_absent;
    uint32_t unix_s;
    uint8_t quality;
    int64_t silent_until_ms, meter_silent_until_ms, beats_until_ms;
    uint8_t counter[WIRE_FUNCTIONS];
    uint64_t sent, changes;
} gateway_t;

typedef void (*gateway_send_t)(void *context, const taper_frame_t *frame);

void gateway_init(gateway_t *gateway, const taper_station_config_t *config, random_t *random);

/** From now on the site may have `limit_W`, and draws nothing else. */
void gateway_hold(gateway_t *gateway, int32_t limit_W);

/** What happens once per control tick. */
void gateway_tick(gateway_t *gateway, int64_t now_ms);

/** Frames, by the poll within a tick. */
void gateway_report(gateway_t *gateway, unsigned poll, int64_t now_ms, gateway_send_t send, void *context);

#endif
