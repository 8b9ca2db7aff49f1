/** The simulated energy gateway: the clock and the site limit. What the limit will be: curve.h. */
#ifndef SIM_GATEWAY_H
#define SIM_GATEWAY_H

#include <stdbool.h>
#include <stdint.h>

#include "limits_csv.h"
#include "taper/port.h"

typedef struct {
    const sim_course_t *limits; /**< NULL: it sets none */
    const taper_port_t *port;
    int64_t tick_s;
    uint8_t counter[2]; /**< TIME_SYNC, SITE_LIMIT */
} sim_gateway_t;

/**
 * `limits` and `port`, the world's end of the bus, must outlive the gateway. The counters start from bits of `seed`.
 * `tick_s` is for a gateway that reports once per control tick: the two functions below; 0 for another.
 */
void sim_gateway_init(sim_gateway_t *gateway, const sim_course_t *limits, const taper_port_t *port,
                      int64_t tick_s, uint64_t seed);

/** Send TIME_SYNC, and SITE_LIMIT with the limit of the tick that begins at `now_s`. @return false: the bus is full. */
bool sim_gateway_report(sim_gateway_t *gateway, int64_t now_s);

/** Say the same again at `passed_s` into that tick. @return false: the bus is full. */
bool sim_gateway_repeat(sim_gateway_t *gateway, int64_t now_s, double passed_s);

/** Limit of the tick that begins at `now_s`: the least that holds in it [kW]. */
double sim_gateway_limit_kw(const sim_gateway_t *gateway, int64_t now_s);

/** Send TIME_SYNC. @return false: the bus is full. */
bool sim_gateway_send_time(sim_gateway_t *gateway, double unix_s);

/** Send SITE_LIMIT; an infinite limit is none. The failsafe limit is absent. @return false: the bus is full. */
bool sim_gateway_send_limit(sim_gateway_t *gateway, double limit_kw, int32_t validity_s);

/** Limit at an instant [kW]; INFINITY: it sets none. */
double sim_gateway_limit_at_kw(const sim_gateway_t *gateway, double time_s);

#endif
