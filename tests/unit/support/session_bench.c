#include "session_bench.h"

#include <string.h>

static const taper_connector_config_t connectors[] = {
    {.min_mA = 6000, .max_mA = 32000, .voltage_mV = 230000, .phases = 3, .group = 0, .bus = 0, .node = 1},
    {.min_mA = 6000, .max_mA = 32000, .voltage_mV = 230000, .phases = 1, .group = 0, .bus = 0, .node = 2},
    {.min_mA = 0,
     .max_mA = 200000,
     .voltage_mV = 400000,
     .phases = 1,
     .efficiency_permille = 1000,
     .bus = 0,
     .node = 3,
     .is_dc = true},
};
static const taper_group_config_t groups[] = {{.limit_W = 100000, .parent = TAPER_NO_GROUP}};
static const taper_station_config_t station = {
    .name = "bench",
    .connectors = connectors,
    .groups = groups,
    .failsafe_W = 4200,
    .site_voltage_mV = 230000,
    .tick_ms = 1000,
    .step_s = 900,
    .steps = 4,
    .connector_count = 3,
    .group_count = 1,
};

void bench_start(session_bench_t *bench, uint8_t connector) {
    memset(bench, 0, sizeof *bench);
    bench->connector = connector;
    bench->now_ms = 123457;
    bench->status = (taper_evse_status_t){.pilot = TAPER_PILOT_C, .ev_present = true};
    bench->ev = (taper_ev_status_t){.soc_permille = 200, .soc_age_s = 1, .max_mA = 16000, .ready = true};
    bench->elec = (taper_evse_elec_t){.voltage_mV = 229000, .power_W = 0, .energy_Wh = 0};
    bench->a = (taper_ev_param_a_t){
        .revision = 1,
        .session = 7,
        .capacity_Wh = 60000,
        .soc_target_permille = TAPER_ABSENT,
        .soc_minimum_permille = TAPER_ABSENT,
        .soc_plug_in_permille = TAPER_ABSENT,
    };
    bench->b = (taper_ev_param_b_t){
        .revision = 1, .session = 7, .departure_min = TAPER_ABSENT, .peak_W = 11000, .min_mA = TAPER_ABSENT};
    bench->c = (taper_ev_param_c_t){
        .revision = 1, .target_Wh = 20000, .maximum_Wh = TAPER_ABSENT, .minimum_Wh = TAPER_ABSENT};
    bench->d = (taper_ev_param_d_t){.revision = 1, .session = 7, .taper_W = 4400};
    bench->e = (taper_ev_param_e_t){.revision = 1, .session = 7, .peak_W = 20000, .taper_W = 18000};
    taper_session_init(&bench->table, &station);
}

static taper_message_t message(const session_bench_t *bench, taper_message_kind_t kind) {
    taper_message_t m;
    memset(&m, 0, sizeof m);
    m.kind = kind;
    m.bus = connectors[bench->connector].bus;
    m.node = connectors[bench->connector].node;
    return m;
}

void bench_report_status(session_bench_t *bench) {
    taper_message_t m = message(bench, TAPER_MESSAGE_EVSE_STATUS);
    m.as.evse_status = bench->status;
    (void)taper_session_apply(&bench->table, &m, bench->now_ms);
}

void bench_report_ev(session_bench_t *bench) {
    taper_message_t m = message(bench, TAPER_MESSAGE_EV_STATUS);
    m.as.ev_status = bench->ev;
    (void)taper_session_apply(&bench->table, &m, bench->now_ms);
}

void bench_report_elec(session_bench_t *bench) {
    taper_message_t m = message(bench, TAPER_MESSAGE_EVSE_ELEC);
    m.as.evse_elec = bench->elec;
    (void)taper_session_apply(&bench->table, &m, bench->now_ms);
}

void bench_report_a(session_bench_t *bench) {
    taper_message_t m = message(bench, TAPER_MESSAGE_EV_PARAM_A);
    m.as.ev_param_a = bench->a;
    (void)taper_session_apply(&bench->table, &m, bench->now_ms);
}

void bench_report_b(session_bench_t *bench) {
    taper_message_t m = message(bench, TAPER_MESSAGE_EV_PARAM_B);
    m.as.ev_param_b = bench->b;
    (void)taper_session_apply(&bench->table, &m, bench->now_ms);
}

void bench_report_c(session_bench_t *bench) {
    taper_message_t m = message(bench, TAPER_MESSAGE_EV_PARAM_C);
    m.as.ev_param_c = bench->c;
    (void)taper_session_apply(&bench->table, &m, bench->now_ms);
}

void bench_report_d(session_bench_t *bench) {
    taper_message_t m = message(bench, TAPER_MESSAGE_EV_PARAM_D);
    m.as.ev_param_d = bench->d;
    (void)taper_session_apply(&bench->table, &m, bench->now_ms);
}

void bench_report_e(session_bench_t *bench) {
    taper_message_t m = message(bench, TAPER_MESSAGE_EV_PARAM_E);
    m.as.ev_param_e = bench->e;
    (void)taper_session_apply(&bench->table, &m, bench->now_ms);
}

void bench_report_parameters(session_bench_t *bench) {
    bench_report_a(bench);
    bench_report_b(bench);
    bench_report_c(bench);
    bench_report_d(bench);
}

void bench_plug_in(session_bench_t *bench) {
    bench_report_status(bench);
    bench_report_ev(bench);
    bench_report_elec(bench);
    bench_report_parameters(bench);
}

void bench_next_revision(session_bench_t *bench) {
    bench->a.revision = (uint8_t)((bench->a.revision + 1u) % 16u);
    bench->b.revision = bench->a.revision;
    bench->c.revision = bench->a.revision;
    bench->d.revision = bench->a.revision;
    bench->e.revision = bench->a.revision;
}

void bench_unplug(session_bench_t *bench) {
    const taper_evse_status_t plugged = bench->status;
    bench->status.pilot = TAPER_PILOT_A;
    bench->status.ev_present = false;
    bench_report_status(bench);
    bench->status = plugged;
}

void bench_report_time(session_bench_t *bench, uint32_t unix_s, uint16_t ms, uint8_t quality) {
    taper_message_t m;
    memset(&m, 0, sizeof m);
    m.kind = TAPER_MESSAGE_TIME_SYNC;
    m.node = TAPER_NODE_GATEWAY;
    m.as.time_sync = (taper_time_sync_t){.unix_s = unix_s, .ms = ms, .quality = quality};
    (void)taper_session_apply(&bench->table, &m, bench->now_ms);
}

void bench_tick(session_bench_t *bench) {
    taper_session_update(&bench->table, bench->now_ms);
}

void bench_live(session_bench_t *bench, uint32_t ms) {
    bench->now_ms += ms;
    bench_plug_in(bench);
}

const taper_demand_t *bench_demand(session_bench_t *bench) {
    bench_tick(bench);
    taper_session_snapshot(&bench->table, bench->now_ms, &bench->snapshot);
    return &bench->snapshot.demand[bench->connector];
}
