/** Frames by hand for the accountant, to see him object. */
#ifndef HOSTILE_ACCOUNT_BENCH_H
#define HOSTILE_ACCOUNT_BENCH_H

#include "account.h"
#include "sites.h"

extern account_t account;

/** Begin with `sites[site]`: a vehicle on every connector, session 7, all conductors; a gateway with the site's own limit, no
    other load. */
void bench_start(unsigned site);

/** Time passes in steps of 250 ms; the gateway and every connector report each second, and all is checked. */
void bench_pass(int64_t ms);

/** The gateway says this from now on. */
void bench_limit(int32_t limit_W, int32_t failsafe_W);
void bench_other_load(int32_t each_phase_mA);
/** The connector reports a vehicle, or none, from now on. */
void bench_vehicle(unsigned connector, bool there);

/** The connector reports EV_PARAM_A (part 0), B or C once. */
void bench_param(unsigned connector, unsigned part, uint8_t revision, uint8_t session);

/** The station sends this, and it is delivered, each time that time passes by another second. */
void bench_setpoint(unsigned connector, int32_t current_mA, int32_t fallback_mA);
/** No more setpoints. */
void bench_deaf(unsigned connector);

/** A SETPOINT as the station ought to send it, for session 7; the counter is the next. */
taper_frame_t bench_frame(unsigned connector, int32_t current_mA, int32_t fallback_mA);
/** The same with other bits, sealed. */
taper_frame_t bench_frame_with(unsigned connector, int32_t current_mA, unsigned start, unsigned length,
                               uint32_t value);

/** All rules but `rule` held, and that one was broken. */
void bench_objects(rule_t rule);
/** It was broken, and perhaps others. */
void bench_objects_also(rule_t rule);
/** All rules held. */
void bench_content(void);

#endif
