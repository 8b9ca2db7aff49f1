#include "field_bench.h"

#include <string.h>

#include "taper/codec.h"
#include "taper/stations.h"
#include "unity.h"

field_bench_t at;

sim_session_t field_vehicle(double after_s) {
    const double arrival_s = WORLD_START_S + after_s;
    return (sim_session_t){.id = "vehicle",
                           .arrival_s = arrival_s,
                           .departure_s = arrival_s + 7200.0,
                           .told_s = arrival_s + 7200.0,
                           .battery_kwh = 40.0,
                           .soc_arrival = 0.5,
                           .soc_target = 1.0,
                           .max_kw = 22.0,
                           .taper_kw = 0.0};
}

sim_field_options_t field_options(void) {
    return (sim_field_options_t){.world_start_s = WORLD_START_S, .time_scale = 1, .tells_taper = true};
}

static const taper_station_config_t *hub(void) {
    unsigned k = 0;
    while (k < taper_station_count && strcmp(taper_stations[k]->name, "hub") != 0) {
        k++;
    }
    TEST_ASSERT_LESS_THAN_UINT32(taper_station_count, k);
    return taper_stations[k];
}

void field_start(const sim_field_options_t *options, const sim_session_t *sessions, size_t count) {
    field_end();
    memset(&at, 0, sizeof at);
    at.now_ms = UINT32_MAX - 5000; /* the clock wraps in every test */
    at.station = *hub();
    memcpy(at.session, sessions, count * sizeof sessions[0]);
    at.sessions = (sim_sessions_t){.session = at.session, .count = count};
    taper_membus_init(&at.bus);
    at.station_port = taper_membus_station_port(&at.bus);
    at.world_port = taper_membus_world_port(&at.bus);
    sim_field_options_t own = *options;
    own.station = &at.station;
    own.port = &at.world_port;
    own.sessions = &at.sessions;
    own.outcome = at.outcome;
    sim_field_init(&at.field, &own, at.now_ms);
    field_forget();
}

void field_end(void) {
    sim_field_free(&at.field);
}

void field_forget(void) {
    memset(at.log, 0, sizeof at.log);
    at.most_in_a_poll = 0;
}

static void note(const taper_frame_t *frame) {
    field_log_t *log = &at.log[frame->id];
    bool bad_field = false;
    taper_e2e_receiver_t receiver = {0};
    TEST_ASSERT_EQUAL(TAPER_E2E_OK, taper_e2e_check(&receiver, frame));
    TEST_ASSERT_TRUE(taper_decode(frame, &log->message, &bad_field));
    TEST_ASSERT_FALSE(bad_field);
    const uint8_t next = (uint8_t)((log->counter + 1) % 16);
    if (log->count > 0) {
        const uint32_t gap_ms = at.now_ms - log->last_ms;
        TEST_ASSERT_EQUAL_UINT8(next, receiver.counter);
        log->longest_gap_ms = gap_ms > log->longest_gap_ms ? gap_ms : log->longest_gap_ms;
        log->shortest_gap_ms =
            log->count == 1 || gap_ms < log->shortest_gap_ms ? gap_ms : log->shortest_gap_ms;
    } else {
        log->first_ms = at.now_ms;
    }
    log->counter = receiver.counter;
    log->last_ms = at.now_ms;
    log->count++;
}

void field_run_ms(uint32_t ms) {
    for (uint32_t passed = 0; passed < ms; passed += POLL_ms) {
        at.now_ms += POLL_ms;
        sim_field_poll(&at.field, at.now_ms);
        taper_frame_t frame;
        uint32_t frames = 0;
        while (at.station_port.receive(at.station_port.context, &frame)) {
            if (frame.id >> 6 != TAPER_MESSAGE_ISOTP_FROM) { /* its frames are not protected one by one */
                note(&frame);
                frames++;
            }
        }
        at.most_in_a_poll = frames > at.most_in_a_poll ? frames : at.most_in_a_poll;
    }
}

const field_log_t *field_log(taper_message_kind_t kind, uint8_t node) {
    return &at.log[taper_can_id(kind, node)];
}

void field_send(uint8_t node, const taper_setpoint_t *setpoint) {
    const taper_message_t message = {.kind = TAPER_MESSAGE_SETPOINT, .node = node, .as.setpoint = *setpoint};
    taper_frame_t frame;
    TEST_ASSERT_TRUE(taper_encode(&message, &frame));
    taper_e2e_protect(&frame, at.counter[node]);
    at.counter[node] = (uint8_t)((at.counter[node] + 1) % 16);
    TEST_ASSERT_TRUE(at.station_port.send(at.station_port.context, &frame));
}

void field_charge(uint8_t node, uint8_t session, int32_t current_mA, int32_t validity_ms) {
    const taper_setpoint_t setpoint = {.command = TAPER_COMMAND_CHARGE,
                                       .current_mA = current_mA,
                                       .validity_ms = validity_ms,
                                       .fallback_mA = 6000,
                                       .phase_mask = 7,
                                       .session = session};
    field_send(node, &setpoint);
}

const sim_evse_t *field_evse(uint8_t node) {
    return &at.field.evse[node - 1];
}
