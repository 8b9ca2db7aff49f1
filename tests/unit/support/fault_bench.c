#include "fault_bench.h"

#include <string.h>

#include "unity.h"

fault_bench_t fault;

static void note(fault_frames_t *log, const taper_frame_t *frame) {
    fault_frames_t *frames = &log[frame->id & 0x7FFu];
    frames->count++;
    frames->last_ms = live.now_ms;
    frames->frame = *frame;
}

static void note_emcy(const taper_frame_t *frame) {
    taper_message_t message;
    bool bad_field = false;
    TEST_ASSERT_TRUE(taper_decode(frame, &message, &bad_field));
    if (fault.emcys < FAULT_EMCYS) {
        fault.emcy[fault.emcys] = message.as.emcy;
        fault.emcy_ms[fault.emcys] = live.now_ms;
        fault.emcys++;
    }
}

static bool listen(void *context, taper_frame_t *frame) {
    if (!fault.receive(context, frame)) {
        return false;
    }
    note(fault.told, frame);
    if (frame->id == taper_can_id(TAPER_MESSAGE_EMCY, TAPER_NODE_CONTROLLER)) {
        note_emcy(frame);
    }
    return true;
}

static bool speak(void *context, const taper_frame_t *frame) {
    taper_frame_t altered = *frame;
    if (fault.alter != NULL) {
        fault.alter(&altered);
    }
    note(fault.said, &altered);
    return fault.send(context, &altered);
}

void fault_open(const live_options_t *options, const sim_session_t *sessions, unsigned count) {
    live_bench_start(options, sessions, count);
    memset(&fault, 0, sizeof fault);
    fault.send = live.world_port.send;
    fault.receive = live.world_port.receive;
    live.world_port.send = speak;
    live.world_port.receive = listen;
    fault_begins();
}

void fault_switch_soon(void) {
    live.config.min_on_ms = FAULT_SWITCH_ms;
    live.config.min_off_ms = FAULT_SWITCH_ms;
}

void fault_start(unsigned vehicles, double limit_kw) {
    const live_options_t options = live_options(limit_kw);
    sim_session_t sessions[8];
    for (unsigned i = 0; i < vehicles; i++) {
        sessions[i] = live_vehicle(0.0);
    }
    fault_open(&options, sessions, vehicles);
    fault_switch_soon();
    live_bench_run_ms(20000);
    fault_begins();
}

bool fault_read(const taper_frame_t *frame, taper_message_t *message) {
    bool bad_field = false;
    return taper_decode(frame, message, &bad_field);
}

void fault_protect(taper_frame_t *frame) {
    taper_e2e_protect(frame, frame->data[1] & 0x0Fu);
}

void fault_rewrite(taper_frame_t *frame, const taper_message_t *message) {
    const uint8_t counter = frame->data[1] & 0x0Fu;
    TEST_ASSERT_TRUE(taper_encode(message, frame));
    taper_e2e_protect(frame, counter);
}

void fault_begins(void) {
    fault.began_ms = live.now_ms;
    fault.emcys = 0;
}

uint32_t fault_passed_ms(void) {
    return taper_elapsed_ms(live.now_ms, fault.began_ms);
}

uint32_t fault_wait_for(taper_event_code_t code, uint32_t most_ms) {
    const unsigned before = fault_events(code);
    while (fault_events(code) == before) {
        TEST_ASSERT_LESS_THAN_UINT32_MESSAGE(most_ms, fault_passed_ms(), "no such event in time");
        live_bench_run_ms(LIVE_POLL_ms);
    }
    return fault_passed_ms();
}

uint32_t fault_wait_until_drawn(double kw, uint32_t most_ms) {
    uint32_t waited_ms = 0;
    while (live.field.tracker.drawn_kw < kw && waited_ms < most_ms) {
        live_bench_run_ms(LIVE_POLL_ms);
        waited_ms += LIVE_POLL_ms;
    }
    return waited_ms;
}

void fault_inject(const taper_membus_faults_t *faults) {
    taper_membus_inject(&live.bus, &live.bus.to_station, &fault.injector, faults);
}

void fault_say_frame(const taper_frame_t *frame) {
    taper_membus_set_time(&live.bus, live.now_ms);
    (void)taper_membus_world_send(&live.bus, frame); /* a full queue has lost an older one */
}

void fault_say(const taper_message_t *message) {
    taper_frame_t frame;
    TEST_ASSERT_TRUE(taper_encode(message, &frame));
    taper_e2e_protect(&frame, fault.counter[frame.id]);
    fault.counter[frame.id] = (uint8_t)((fault.counter[frame.id] + 1) & 0x0F);
    fault_say_frame(&frame);
}

const taper_event_t *fault_last_event(taper_event_code_t code) {
    const taper_event_log_t *log = taper_station_events(&live.station);
    for (uint32_t back = 1; back <= log->count && back <= TAPER_EVENTS; back++) {
        const taper_event_t *event = &log->event[(log->count - back) % TAPER_EVENTS];
        if (event->code == code) {
            return event;
        }
    }
    TEST_FAIL_MESSAGE("no such event");
    return NULL;
}

unsigned fault_events(taper_event_code_t code) {
    const taper_event_log_t *log = taper_station_events(&live.station);
    unsigned found = 0;
    for (uint32_t back = 1; back <= log->count && back <= TAPER_EVENTS; back++) {
        found += log->event[(log->count - back) % TAPER_EVENTS].code == code ? 1u : 0u;
    }
    return found;
}

uint32_t fault_count(taper_counter_t counter) {
    return taper_station_counter(&live.station, counter);
}

static taper_message_t told(taper_message_kind_t kind, uint8_t node) {
    const fault_frames_t *frames = &fault.told[taper_can_id(kind, node)];
    taper_message_t message;
    bool bad_field = false;
    TEST_ASSERT_GREATER_THAN_UINT32_MESSAGE(0, frames->count, "the station never told it");
    TEST_ASSERT_TRUE(taper_decode(&frames->frame, &message, &bad_field));
    return message;
}

taper_setpoint_t fault_setpoint(uint8_t node) {
    return told(TAPER_MESSAGE_SETPOINT, node).as.setpoint;
}

taper_outlook_t fault_outlook(uint8_t node) {
    return told(TAPER_MESSAGE_OUTLOOK, node).as.outlook;
}

taper_reason_t fault_reason(uint8_t node) {
    return (taper_reason_t)fault_outlook(node).reason;
}

taper_ctrl_status_t fault_status(void) {
    return told(TAPER_MESSAGE_CTRL_STATUS, TAPER_NODE_CONTROLLER).as.ctrl_status;
}

void fault_assert_emcy(taper_event_code_t code, uint8_t node, uint8_t reaction) {
    static const uint32_t gaps_ms[] = {20, 20, 1000, 1000};
    uint32_t last_ms = 0;
    unsigned found = 0;
    for (unsigned k = 0; k < fault.emcys && found < 5; k++) {
        const taper_emcy_t *emcy = &fault.emcy[k];
        if (emcy->code != code || emcy->about != node) {
            continue;
        }
        TEST_ASSERT_EQUAL_UINT8(reaction, emcy->reaction);
        TEST_ASSERT_EQUAL_UINT8(reaction > 1 ? TAPER_SEVERITY_FAULT : TAPER_SEVERITY_WARNING, emcy->severity);
        if (found > 0) {
            TEST_ASSERT_EQUAL_UINT32(gaps_ms[found - 1], fault.emcy_ms[k] - last_ms);
        }
        last_ms = fault.emcy_ms[k];
        found++;
    }
    TEST_ASSERT_EQUAL_UINT(5, found);
}

void fault_assert_no_emcy(void) {
    TEST_ASSERT_EQUAL_UINT(0, fault.emcys);
}

void fault_assert_limits_held(void) {
    TEST_ASSERT_EQUAL_UINT32(0, live.field.tracker.may.times);
    TEST_ASSERT_EQUAL_UINT32(0, live.field.tracker.drawn.times);
    TEST_ASSERT_EQUAL_UINT32(0, fault_count(TAPER_COUNTER_GUARD_VIOLATIONS));
}

double fault_drawn_kw(uint8_t node) {
    return live.field.evse[node - 1].power_kw;
}
