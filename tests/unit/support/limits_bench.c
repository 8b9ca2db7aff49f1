#include "limits_bench.h"

#include <string.h>

#include "scene.h"
#include "unity.h"

taper_limits_t limits;
taper_station_config_t config;
taper_event_log_t events;
taper_limit_curve_t curve;
taper_course_t course;

void bench_start(void) {
    config = *scene_four();
    memset(&events, 0, sizeof events);
    memset(&curve, 0, sizeof curve);
    taper_limits_init(&limits, &config);
    limits.log = &events;
}

void bench_say(bool active, int32_t limit_W, uint32_t now_ms) {
    const taper_site_limit_t message = {
        .active = active, .limit_W = limit_W, .failsafe_W = TAPER_ABSENT, .validity_s = TAPER_ABSENT};
    taper_limits_apply(&limits, &message, now_ms);
}

void bench_meter(int32_t l1_mA, int32_t l2_mA, int32_t l3_mA, uint32_t now_ms) {
    const taper_site_meter_t message = {{l1_mA, l2_mA, l3_mA}};
    taper_limits_apply_meter(&limits, &message, now_ms);
}

void bench_point(uint32_t time_ms, int32_t limit_W) {
    curve.point[curve.count] = (taper_limit_point_t){time_ms, limit_W};
    curve.count++;
}

void bench_set(taper_curve_owner_t owner) {
    TEST_ASSERT_EQUAL(TAPER_OK, taper_limits_set_curve(&limits, owner, &curve));
    curve.count = 0;
}

void bench_assert(int32_t site_W, taper_limit_source_t source, uint32_t now_ms) {
    const taper_limit_now_t now = taper_limits_now(&limits, now_ms);
    TEST_ASSERT_EQUAL_INT32(site_W, now.supply.site_W);
    TEST_ASSERT_EQUAL(source, now.source);
}

void bench_course(uint32_t now_ms) {
    taper_limits_course(&limits, now_ms, &course);
}

void bench_assert_step(unsigned t, int32_t limit_W, taper_limit_source_t source) {
    TEST_ASSERT_EQUAL_INT32(limit_W, course.limit_W[t]);
    TEST_ASSERT_EQUAL(source, course.source[t]);
}

unsigned bench_noted(taper_event_code_t code) {
    unsigned found = 0;
    for (uint32_t k = 0; k < events.count && k < TAPER_EVENTS; k++) {
        found += events.event[k].code == code ? 1u : 0u;
    }
    return found;
}
