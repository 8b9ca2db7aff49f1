#include "account_bench.h"

#include <string.h>

#include "unity.h"

#define SESSION 7u

account_t account;

static struct {
    uint8_t setpoint_counter[TAPER_MAX_CONNECTORS], status_counter[TAPER_MAX_CONNECTORS];
    uint8_t param_counter[TAPER_MAX_CONNECTORS][ACCOUNT_PARAMS], limit_counter, meter_counter;
    int32_t current_mA[TAPER_MAX_CONNECTORS], fallback_mA[TAPER_MAX_CONNECTORS];
    bool deaf[TAPER_MAX_CONNECTORS], there[TAPER_MAX_CONNECTORS];
    int32_t limit_W, failsafe_W, other_mA;
} bench;

static void hear(taper_frame_t frame, uint8_t *counter) {
    wire_seal(&frame, *counter);
    (*counter)++;
    account_heard(&account, &frame, account.now_ms);
}

static void report_gateway(void) {
    taper_frame_t limit = wire_frame(WIRE_SITE_LIMIT, WIRE_GATEWAY);
    taper_frame_t meter = wire_frame(WIRE_SITE_METER, WIRE_GATEWAY);
    wire_put(&limit, 12, 1, 1);
    wire_put(&limit, 16, 16, (uint32_t)(bench.limit_W / 100));
    wire_put(&limit, 32, 16, (uint32_t)(bench.failsafe_W / 100));
    wire_put(&limit, 56, 8, 0xFF);
    for (unsigned phase = 0; phase < 3; phase++) {
        wire_put(&meter, 16 + 16 * phase, 16, (uint32_t)(bench.other_mA / 100));
    }
    hear(limit, &bench.limit_counter);
    hear(meter, &bench.meter_counter);
}

void bench_param(unsigned connector, unsigned part, uint8_t revision, uint8_t session) {
    taper_frame_t frame = wire_frame(WIRE_EV_PARAM_A + part, account.config->connectors[connector].node);
    wire_put(&frame, 12, 4, revision);
    wire_put(&frame, part == 0 ? 16 : 56, 8, session);
    hear(frame, &bench.param_counter[connector][part]);
}

static void report_connector(unsigned i) {
    taper_frame_t status = wire_frame(WIRE_EVSE_STATUS, account.config->connectors[i].node);
    wire_put(&status, 12, 4, bench.there[i] ? 2 : 0);
    wire_put(&status, 63, 1, bench.there[i]);
    hear(status, &bench.status_counter[i]);
    for (unsigned part = 0; part < ACCOUNT_PARAMS; part++) {
        bench_param(i, part, 0, SESSION);
    }
}

taper_frame_t bench_frame(unsigned connector, int32_t current_mA, int32_t fallback_mA) {
    const taper_connector_config_t *config = &account.config->connectors[connector];
    taper_frame_t frame = wire_frame(WIRE_SETPOINT, config->node);
    wire_put(&frame, 12, 4, current_mA > 0 ? WIRE_CHARGE : WIRE_PAUSE);
    wire_put(&frame, 16, 16, (uint32_t)(current_mA / 100));
    wire_put(&frame, 32, 8, 6);
    wire_put(&frame, 40, 8, (uint32_t)(fallback_mA / 500));
    wire_put(&frame, 48, 3, config->phases == 3 ? 7 : 1);
    wire_put(&frame, 56, 8, SESSION);
    wire_seal(&frame, bench.setpoint_counter[connector]);
    bench.setpoint_counter[connector]++;
    return frame;
}

taper_frame_t bench_frame_with(unsigned connector, int32_t current_mA, unsigned start, unsigned length,
                               uint32_t value) {
    taper_frame_t frame = bench_frame(connector, current_mA, 0);
    wire_put(&frame, start, length, value);
    wire_seal(&frame, wire_get(&frame, 8, 4));
    return frame;
}

static void send(unsigned i) {
    const taper_frame_t frame = bench_frame(i, bench.current_mA[i], bench.fallback_mA[i]);
    account_sent(&account, &frame);
    account_delivered(&account, &frame);
}

void bench_setpoint(unsigned connector, int32_t current_mA, int32_t fallback_mA) {
    bench.current_mA[connector] = current_mA;
    bench.fallback_mA[connector] = fallback_mA;
    bench.deaf[connector] = false;
    send(connector);
    account_check(&account);
}

void bench_deaf(unsigned connector) {
    bench.deaf[connector] = true;
}

void bench_limit(int32_t limit_W, int32_t failsafe_W) {
    bench.limit_W = limit_W;
    bench.failsafe_W = failsafe_W;
    report_gateway();
    account_check(&account);
}

void bench_other_load(int32_t each_phase_mA) {
    bench.other_mA = each_phase_mA;
    report_gateway();
    account_check(&account);
}

void bench_vehicle(unsigned connector, bool there) {
    bench.there[connector] = there;
    report_connector(connector);
}

void bench_pass(int64_t ms) {
    for (int64_t passed_ms = 250; passed_ms <= ms; passed_ms += 250) {
        account_time(&account, account.now_ms + 250);
        const bool second = account.now_ms % 1000 == 0;
        if (second) {
            report_gateway();
        }
        for (unsigned i = 0; second && i < account.config->connector_count; i++) {
            report_connector(i);
            if (!bench.deaf[i]) {
                send(i);
            }
        }
        account_check(&account);
    }
}

void bench_start(unsigned site) {
    memset(&bench, 0, sizeof bench);
    account_init(&account, &sites[site], 1000000);
    account_station_started(&account);
    bench.limit_W = sites[site].groups[0].limit_W;
    bench.failsafe_W = sites[site].failsafe_W;
    report_gateway();
    for (unsigned i = 0; i < sites[site].connector_count; i++) {
        bench.there[i] = true;
        account_plugged(&account, i, SESSION, sites[site].connectors[i].phases);
        report_connector(i);
        send(i);
    }
    account_check(&account);
    bench_content();
}

void bench_objects_also(rule_t rule) {
    TEST_ASSERT_GREATER_THAN_UINT64_MESSAGE(0, account.verdict.violations[rule], account_rule_name(rule));
}

void bench_objects(rule_t rule) {
    bench_objects_also(rule);
    TEST_ASSERT_EQUAL_UINT64_MESSAGE(account.verdict.violations[rule], account_violations(&account),
                                     account_rule_name(account.verdict.first));
}

void bench_content(void) {
    TEST_ASSERT_EQUAL_UINT64_MESSAGE(0, account_violations(&account),
                                     account_rule_name(account.verdict.first));
}
