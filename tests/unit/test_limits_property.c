/* Limits and courses of random sites against a second-by-second evaluation that knows nothing of their code. */
#include <string.h>

#include "limits_bench.h"
#include "scene.h"
#include "unity.h"

#define SITES    40
#define INSTANTS 25 /* of each: 1000 in all */
#define SECOND   1000u

typedef struct {
    uint32_t time_s; /* since the origin */
    int32_t limit_W;
} known_t;

static uint32_t seed, origin_ms;
static known_t known[TAPER_CURVE_OWNERS][40];
static unsigned known_count[TAPER_CURVE_OWNERS];

void setUp(void) {
    seed = 20240607;
}
void tearDown(void) {}

static uint32_t below(uint32_t end) {
    return scene_random(&seed) % end;
}

/** A curve of up to 40 points in the next six hours or so, on whole seconds. */
static void make_curve(unsigned owner) {
    uint32_t time_s = below(3000);
    known_count[owner] = below(40);
    for (unsigned k = 0; k < known_count[owner]; k++) {
        known[owner][k] = (known_t){time_s, (int32_t)below(30000)};
        bench_point(origin_ms + time_s * SECOND, known[owner][k].limit_W);
        time_s += 1 + below(below(2) ? 100 : 3000);
    }
    bench_set((taper_curve_owner_t)owner);
}

/** The same by going through all points. */
static int32_t known_W(uint32_t time_s) {
    int32_t least_W = 25000;
    for (unsigned owner = 0; owner < TAPER_CURVE_OWNERS; owner++) {
        int32_t in_force_W = INT32_MAX;
        for (unsigned k = 0; k < known_count[owner]; k++) {
            if (known[owner][k].time_s <= time_s) {
                in_force_W = known[owner][k].limit_W;
            }
        }
        least_W = in_force_W < least_W ? in_force_W : least_W;
    }
    return least_W;
}

static int32_t left_W(int32_t limit_W, int32_t other_W) {
    return limit_W > other_W ? limit_W - other_W : 0;
}

static void make_site(void) {
    bench_start();
    origin_ms = below(2) ? UINT32_MAX - below(20000000) : scene_random(&seed); /* half of them wrap */
    for (unsigned owner = 0; owner < TAPER_CURVE_OWNERS; owner++) {
        make_curve(owner);
    }
}

/** Whoever is named has just this limit. */
static void assert_named(const taper_limit_now_t *now, uint32_t time_s, int32_t gateway_W, int32_t limit_W) {
    int32_t named_W = now->source == TAPER_LIMIT_STATION ? 25000 : gateway_W;
    if (now->source == TAPER_LIMIT_CURVE || now->source == TAPER_LIMIT_FILE) {
        const unsigned owner =
            now->source == TAPER_LIMIT_CURVE ? TAPER_CURVE_OF_GATEWAY : TAPER_CURVE_OF_FILE;
        for (unsigned k = 0; k < known_count[owner] && known[owner][k].time_s <= time_s; k++) {
            named_W = known[owner][k].limit_W;
        }
    }
    TEST_ASSERT_EQUAL_INT32(limit_W, named_W);
}

static void assert_course(uint32_t time_s, int32_t present_W, int32_t other_W) {
    const bool explained = present_W > known_W(time_s) - 100;
    TEST_ASSERT_EQUAL_INT32(left_W(present_W, other_W), course.limit_W[0]);
    for (uint32_t t = 1; t < config.steps; t++) {
        int64_t sum = 0;
        for (uint32_t s = 0; s < config.step_s; s++) {
            const int32_t then_W = known_W(time_s + t * config.step_s + s);
            sum += left_W(explained || then_W < present_W ? then_W : present_W, other_W);
        }
        TEST_ASSERT_EQUAL_INT32(sum / config.step_s, course.limit_W[t]);
        TEST_ASSERT_LESS_OR_EQUAL_INT32(25000, course.limit_W[t]);
    }
}

/** At `time_s`: the gateway says something, or nothing; so does the meter. */
static void look_at(uint32_t time_s) {
    const uint32_t now_ms = origin_ms + time_s * SECOND;
    const int32_t gateway_W = below(3) == 0 ? known_W(time_s) : (int32_t)below(30000);
    const int32_t other_mA = below(2) ? (int32_t)below(40000) : 0;
    limits.flap = (taper_flap_t){0}; /* not what this is about */
    bench_say(true, gateway_W, now_ms);
    bench_meter(other_mA, 0, 0, now_ms);
    const int32_t other_W = (int32_t)((int64_t)other_mA * 230 / 1000);
    const int32_t limit_W = gateway_W < known_W(time_s) ? gateway_W : known_W(time_s);
    const taper_limit_now_t now = taper_limits_now(&limits, now_ms);
    TEST_ASSERT_EQUAL_INT32(left_W(limit_W, other_W), now.supply.site_W);
    TEST_ASSERT_EQUAL_INT32(other_W, now.other_W);
    assert_named(&now, time_s, gateway_W, limit_W);
    bench_course(now_ms);
    TEST_ASSERT_EQUAL(now.source, course.source[0]);
    assert_course(time_s, limit_W, other_W);
}

static void test_limit_and_course_are_those_of_every_second(void) {
    for (unsigned site = 0; site < SITES; site++) {
        make_site();
        uint32_t time_s = 0;
        for (unsigned k = 0; k < INSTANTS; k++) {
            look_at(time_s);
            time_s += 10 + below(1500);
            if (below(2)) { /* ticks or none: it makes no difference */
                taper_limits_update(&limits, origin_ms + time_s * SECOND);
            }
        }
    }
}

/** A limit said ten times a second, and what it was in all of them. */
#define SAYS 20000u
static int32_t said_W[SAYS];

/** The least of the last 30 s, from say `first` on. */
static int32_t least_W(uint32_t first, uint32_t k) {
    int32_t least = said_W[k];
    for (uint32_t j = k < first + 300 ? first : k - 300; j < k; j++) {
        least = said_W[j] < least ? said_W[j] : least;
    }
    return least;
}

static void test_a_limit_that_flaps_is_the_least_of_its_last_30_seconds_and_any_other_is_as_said(void) {
    bench_start();
    uint32_t changed = 0, first = 0; /* the last change, and the first one of its row */
    bool flaps = false;
    for (uint32_t k = 0; k < SAYS; k++) {
        const bool change = k == 0 || below(k / 500 % 2 == 0 ? 20 : 150) == 0;
        said_W[k] = change ? (int32_t)below(TAPER_FLAP_LIMITS) * 1000 : said_W[k - 1];
        flaps = flaps && k - changed < 300;
        if (k > 0 && said_W[k] != said_W[k - 1]) {
            const bool again = changed > 0 && k - changed < 50;
            first = again || flaps ? first : k;
            flaps = flaps || again;
            changed = k;
        }
        bench_say(true, said_W[k], k * 100);
        if (k % 10 == 0) {
            taper_limits_update(&limits, k * 100);
        }
        const int32_t expected_W = flaps ? least_W(first, k) : said_W[k];
        bench_assert(expected_W, expected_W < said_W[k] ? TAPER_LIMIT_HELD : TAPER_LIMIT_GATEWAY, k * 100);
    }
    TEST_ASSERT_GREATER_THAN_UINT32(5, limits.flaps);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_limit_and_course_are_those_of_every_second);
    RUN_TEST(test_a_limit_that_flaps_is_the_least_of_its_last_30_seconds_and_any_other_is_as_said);
    return UNITY_END();
}
