#include "gateway.h"

#include <math.h>
#include <stddef.h>

#include "taper/codec.h"
#include "taper/types.h"
#include "wire.h"

#define MOST_W             2e9
#define LONGEST_VALIDITY_S 254

void sim_gateway_init(sim_gateway_t *gateway, const sim_course_t *limits, const taper_port_t *port,
                      int64_t tick_s, uint64_t seed) {
    *gateway = (sim_gateway_t){.limits = limits, .port = port, .tick_s = tick_s};
    gateway->counter[0] = (uint8_t)((seed >> 4) % 16);
    gateway->counter[1] = (uint8_t)((seed >> 8) % 16);
}

double sim_gateway_limit_kw(const sim_gateway_t *gateway, int64_t now_s) {
    return sim_course_least(gateway->limits, (double)now_s, (double)(now_s + gateway->tick_s));
}

double sim_gateway_limit_at_kw(const sim_gateway_t *gateway, double time_s) {
    const sim_course_t *limits = gateway->limits;
    return limits == NULL ? (double)INFINITY : limits->value[sim_course_point(limits, time_s)];
}

/** Whole watts, down; the hair is what a decimal fraction of a kilowatt lacks in binary. */
static int32_t watts(double kw) {
    return (int32_t)fmin(floor(kw * 1000.0 + 1e-6), MOST_W);
}

bool sim_gateway_send_time(sim_gateway_t *gateway, double unix_s) {
    const double whole_s = floor(unix_s);
    const taper_message_t message = {.kind = TAPER_MESSAGE_TIME_SYNC,
                                     .node = TAPER_NODE_GATEWAY,
                                     .as.time_sync = {.unix_s = (uint32_t)whole_s,
                                                      .ms = (uint16_t)((unix_s - whole_s) * 1000.0),
                                                      .quality = 1}};
    return sim_wire_send(gateway->port, &message, &gateway->counter[0]);
}

bool sim_gateway_send_limit(sim_gateway_t *gateway, double limit_kw, int32_t validity_s) {
    const bool active = isfinite(limit_kw);
    const taper_message_t message = {.kind = TAPER_MESSAGE_SITE_LIMIT,
                                     .node = TAPER_NODE_GATEWAY,
                                     .as.site_limit = {.active = active,
                                                       .limit_W = active ? watts(limit_kw) : TAPER_ABSENT,
                                                       .failsafe_W = TAPER_ABSENT,
                                                       .validity_s = validity_s}};
    return sim_wire_send(gateway->port, &message, &gateway->counter[1]);
}

bool sim_gateway_repeat(sim_gateway_t *gateway, int64_t now_s, double passed_s) {
    const int32_t validity_s = taper_clamp_i32((int32_t)gateway->tick_s * 2, 5, LONGEST_VALIDITY_S);
    const bool clock_sent = sim_gateway_send_time(gateway, (double)now_s + passed_s);
    return sim_gateway_send_limit(gateway, sim_gateway_limit_kw(gateway, now_s), validity_s) && clock_sent;
}

bool sim_gateway_report(sim_gateway_t *gateway, int64_t now_s) {
    return sim_gateway_repeat(gateway, now_s, 0.0);
}
