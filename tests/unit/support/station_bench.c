#include "station_bench.h"

#include <string.h>

#include "scene.h"
#include "taper/codec.h"
#include "taper/stations.h"
#include "unity.h"

station_bench_t bench;

unsigned bench_hub_index(void) {
    for (unsigned k = 0; k < taper_station_count; k++) {
        if (strcmp(taper_stations[k]->name, "hub") == 0) {
            return k;
        }
    }
    TEST_FAIL_MESSAGE("no station hub");
    return 0;
}

taper_station_options_t bench_options(void) {
    return (taper_station_options_t){.config = scene_free_moving(taper_stations[bench_hub_index()]),
                                     .port = &bench.port,
                                     .iterations_per_tick = 500};
}

void bench_start(const taper_station_options_t *options) {
    memset(bench.counters, 0, sizeof bench.counters);
    bench.now_ms = 1000;
    bench.deaf = false;
    bench.setpoints = 0;
    memset(bench.heard, 0, sizeof bench.heard);
    taper_membus_init(&bench.bus);
    bench.port = taper_membus_station_port(&bench.bus);
    TEST_ASSERT_EQUAL(TAPER_OK, taper_station_init(&bench.station, options));
}

void bench_send(const taper_message_t *message) {
    taper_frame_t frame;
    TEST_ASSERT_TRUE(taper_encode(message, &frame));
    taper_e2e_protect(&frame, bench.counters[frame.id]);
    bench.counters[frame.id] = (uint8_t)((bench.counters[frame.id] + 1) & 0x0F);
    taper_membus_set_time(&bench.bus, bench.now_ms);
    TEST_ASSERT_TRUE(taper_membus_world_send(&bench.bus, &frame));
}

void bench_send_limit(int32_t limit_W) {
    taper_message_t message = {.kind = TAPER_MESSAGE_SITE_LIMIT, .node = TAPER_NODE_GATEWAY};
    message.as.site_limit = (taper_site_limit_t){
        .active = true, .limit_W = limit_W, .failsafe_W = TAPER_ABSENT, .validity_s = TAPER_ABSENT};
    bench_send(&message);
}

void bench_send_clock(void) {
    taper_message_t message = {.kind = TAPER_MESSAGE_TIME_SYNC, .node = TAPER_NODE_GATEWAY};
    message.as.time_sync = (taper_time_sync_t){.unix_s = 600000 + bench.now_ms / 1000, .quality = 1};
    bench_send(&message);
}

void bench_send_status(uint8_t node, bool present) {
    taper_message_t message = {.kind = TAPER_MESSAGE_EVSE_STATUS, .node = node};
    message.as.evse_status = (taper_evse_status_t){.pilot = present ? TAPER_PILOT_C : TAPER_PILOT_A,
                                                   .ev_present = present,
                                                   .phases = 3,
                                                   .fallback_active = !bench.heard[node],
                                                   .setpoint_echo = bench.echo[node]};
    bench_send(&message);
}

void bench_send_vehicle(uint8_t node, uint8_t session, int32_t soc_permille) {
    taper_message_t message = {.node = node};
    message.kind = TAPER_MESSAGE_EV_PARAM_A;
    message.as.ev_param_a = (taper_ev_param_a_t){.revision = session,
                                                 .session = session,
                                                 .capacity_Wh = 60000,
                                                 .soc_target_permille = 800,
                                                 .soc_minimum_permille = TAPER_ABSENT,
                                                 .soc_plug_in_permille = soc_permille};
    bench_send(&message);
    message.kind = TAPER_MESSAGE_EV_PARAM_B;
    message.as.ev_param_b = (taper_ev_param_b_t){.revision = session,
                                                 .session = session,
                                                 .departure_min = 10000 + 120,
                                                 .peak_W = 11000,
                                                 .min_mA = TAPER_ABSENT};
    bench_send(&message);
    message.kind = TAPER_MESSAGE_EV_PARAM_C;
    message.as.ev_param_c = (taper_ev_param_c_t){
        .revision = session, .target_Wh = 20000, .maximum_Wh = TAPER_ABSENT, .minimum_Wh = TAPER_ABSENT};
    bench_send(&message);
    message.kind = TAPER_MESSAGE_EV_PARAM_D;
    message.as.ev_param_d = (taper_ev_param_d_t){.revision = session, .session = session, .taper_W = 6000};
    bench_send(&message);
    message.kind = TAPER_MESSAGE_EV_STATUS;
    message.as.ev_status =
        (taper_ev_status_t){.soc_permille = soc_permille, .soc_age_s = 0, .max_mA = 16000, .ready = true};
    bench_send(&message);
    message.kind = TAPER_MESSAGE_EVSE_ELEC;
    message.as.evse_elec = (taper_evse_elec_t){.voltage_mV = 230000, .power_W = 0, .energy_Wh = 0};
    bench_send(&message);
}

void bench_send_all(uint8_t vehicles, int32_t limit_W) {
    bench_send_clock();
    bench_send_limit(limit_W);
    for (uint8_t node = 1; node <= 8; node++) {
        bench_send_status(node, node <= vehicles);
        if (node <= vehicles) {
            bench_send_vehicle(node, 7, 500);
        }
    }
}

static void hear_setpoint(const taper_frame_t *frame) {
    taper_message_t message;
    bool bad_field = false;
    taper_e2e_receiver_t receiver = {0};
    const unsigned node = frame->id & 0x3Fu;
    TEST_ASSERT_EQUAL(TAPER_E2E_OK, taper_e2e_check(&receiver, frame));
    TEST_ASSERT_TRUE(taper_decode(frame, &message, &bad_field));
    bench.heard[node] = true;
    bench.setpoint[node] = message.as.setpoint;
    bench.echo[node] = receiver.counter;
    bench.setpoints++;
}

void bench_listen(void) {
    taper_frame_t frame;
    while (taper_membus_world_receive(&bench.bus, &frame)) {
        if (frame.id >> 6 == TAPER_MESSAGE_SETPOINT) {
            hear_setpoint(&frame);
        }
    }
}

static void after_call(uint32_t passes_ms) {
    if (!bench.deaf) {
        bench_listen();
    }
    bench.now_ms += passes_ms;
    taper_membus_set_time(&bench.bus, bench.now_ms);
}

void bench_step(void) {
    taper_station_step(&bench.station, bench.now_ms);
    after_call(1000);
}

void bench_poll(uint32_t passes_ms) {
    taper_station_poll(&bench.station, bench.now_ms);
    after_call(passes_ms);
}

taper_setpoint_t bench_setpoint_for(uint8_t node) {
    TEST_ASSERT_TRUE_MESSAGE(bench.heard[node], "no setpoint frame");
    return bench.setpoint[node];
}

unsigned bench_events(taper_event_code_t code) {
    const taper_event_log_t *log = taper_station_events(&bench.station);
    unsigned found = 0;
    for (uint32_t k = log->count > TAPER_EVENTS ? log->count - TAPER_EVENTS : 0; k < log->count; k++) {
        found += log->event[k % TAPER_EVENTS].code == code ? 1u : 0u;
    }
    return found;
}

void bench_assert_one_vehicle_in_the_snapshot(void) {
    const taper_session_t *session = &bench.station.sessions.session[0];
    TEST_ASSERT_TRUE(session->in_session);
    TEST_ASSERT_EQUAL_INT32(500, session->ev.soc_permille);

    const taper_demand_t *demand = &bench.station.snapshot.demand[0];
    TEST_ASSERT_TRUE(demand->active);
    TEST_ASSERT_EQUAL_INT32(30000, demand->stored_Wh);
    TEST_ASSERT_EQUAL_INT32(60000, demand->capacity_Wh);
    TEST_ASSERT_EQUAL_INT32(20000, demand->need_Wh);
    TEST_ASSERT_EQUAL_INT32(11000, demand->peak_W);
    TEST_ASSERT_EQUAL_INT32(6000, demand->taper_W);
    TEST_ASSERT_EQUAL_INT32(16000, demand->max_mA);
    TEST_ASSERT_EQUAL_INT32(690, demand->W_per_A);
    TEST_ASSERT_EQUAL_INT32(7199, demand->departs_in_s);
    TEST_ASSERT_EQUAL_INT32(50000, taper_station_site_limit_W(&bench.station));
}
