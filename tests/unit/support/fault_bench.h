/**
 * The live bench with ears and faults: everything that the station and the field say is logged by identifier, frames can be
 * spoken in anybody's name, and the bus can be broken. Eight connectors of a hub, nodes 1..8, times of the live bench.
 */
#ifndef TAPER_TEST_FAULT_BENCH_H
#define TAPER_TEST_FAULT_BENCH_H

#include "live_bench.h"
#include "taper/codec.h"
#include "taper/membus_faults.h"
#include "taper/message.h"

/** EMCY frames of the station that are kept. */
#define FAULT_EMCYS 256u
/** A station that switches connectors off and on again soon, so that a recovery can be waited for [ms]. */
#define FAULT_SWITCH_ms 5000u

/** Frames of one identifier. */
typedef struct {
    uint32_t count;
    uint32_t last_ms;
    taper_frame_t frame; /**< the last one */
} fault_frames_t;

typedef struct {
    fault_frames_t told[2048]; /**< by the station */
    fault_frames_t said[2048]; /**< by the field, whether or not it arrived */
    taper_emcy_t emcy[FAULT_EMCYS];
    uint32_t emcy_ms[FAULT_EMCYS];
    unsigned emcys;
    taper_membus_injector_t injector;
    uint8_t counter[2048];               /**< of the frames that the test speaks */
    uint32_t began_ms;                   /**< of the fault: set by fault_begins() */
    void (*alter)(taper_frame_t *frame); /**< what the field says is said like this; NULL: as it is */
    bool (*send)(void *context, const taper_frame_t *frame); /**< of the bus */
    bool (*receive)(void *context, taper_frame_t *frame);
} fault_bench_t;

extern fault_bench_t fault;

/** `vehicles` are there from the start, under `limit_kw`; charging has settled after 20 s. */
void fault_start(unsigned vehicles, double limit_kw);

/** The same with options and vehicles of the test's own: no time has passed yet. */
void fault_open(const live_options_t *options, const sim_session_t *sessions, unsigned count);
/** Connectors may be switched after FAULT_SWITCH_ms. */
void fault_switch_soon(void);

/** For `fault.alter`: what a frame says, if it is no ISO-TP; have it say something else; make changed bytes sound. */
bool fault_read(const taper_frame_t *frame, taper_message_t *message);
void fault_rewrite(taper_frame_t *frame, const taper_message_t *message);
void fault_protect(taper_frame_t *frame);

/** The fault begins now: what is measured counts from here, and the EMCY log is empty. */
void fault_begins(void);
/** @return time since then [ms]. */
uint32_t fault_passed_ms(void);

/** Let time pass until there is such an event, at most `most_ms` after the fault began. @return when it came [ms]. */
uint32_t fault_wait_for(taper_event_code_t code, uint32_t most_ms);

/** Let time pass until this much is drawn, at most `most_ms`. @return how long it took [ms]; most_ms: it did not. */
uint32_t fault_wait_until_drawn(double kw, uint32_t most_ms);

/** Faults for the frames that reach the station from now on; NULL: none. */
void fault_inject(const taper_membus_faults_t *faults);

/** A frame in the name of `message->node`, protected, with a counter of the test's own. */
void fault_say(const taper_message_t *message);
/** A frame as it is. */
void fault_say_frame(const taper_frame_t *frame);

/** Events of a code since the start, of those still in the log. */
unsigned fault_events(taper_event_code_t code);
/** The last of them. */
const taper_event_t *fault_last_event(taper_event_code_t code);
/** One of the station's counters. */
uint32_t fault_count(taper_counter_t counter);

/** What the station last told on the bus. */
taper_setpoint_t fault_setpoint(uint8_t node);
taper_outlook_t fault_outlook(uint8_t node);
taper_reason_t fault_reason(uint8_t node);
taper_ctrl_status_t fault_status(void);

/** EMCY with `code` about `node`: three at 20 ms, then one a second, and with this reaction. */
void fault_assert_emcy(taper_event_code_t code, uint8_t node, uint8_t reaction);
void fault_assert_no_emcy(void);

/** No connector could draw more than the limits, and the guard found nothing. */
void fault_assert_limits_held(void);

/** Power of one connector, by its node [kW]. */
double fault_drawn_kw(uint8_t node);

#endif
