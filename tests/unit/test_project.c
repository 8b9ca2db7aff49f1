/* Whatever the solver hands over, what becomes of it keeps every row. */
#include <math.h>
#include <string.h>

#include "project.h"
#include "residual.h"
#include "scene.h"
#include "unity.h"

#define STEPS 6
#define COUNT 8

/** Rounding of sums of some ten numbers of order 1. */
#define ROUNDING (TAPER_REAL_IS_DOUBLE ? 1e-12 : 2e-6)

static const taper_group_config_t groups[] = {
    {.limit_W = 30000, .limit_mA = 60000, .parent = TAPER_NO_GROUP},
    {.limit_mA = 45000, .imbalance_mA = 10000, .parent = 0},
};

#define SINGLE(turn, owner) \
    {.max_mA = 32000, .voltage_mV = 230000, .phases = 1, .rotation = (turn), .group = (owner)}
#define PAIR(turn, owner)  \
    {.max_mA = 20000,      \
     .voltage_mV = 400000, \
     .phases = 1,          \
     .rotation = (turn),   \
     .line_to_line = true, \
     .group = (owner)}

static const taper_connector_config_t connectors[COUNT] = {
    SINGLE(TAPER_ROTATION_123, 1),
    SINGLE(TAPER_ROTATION_231, 1),
    SINGLE(TAPER_ROTATION_312, 0),
    PAIR(TAPER_ROTATION_123, 1),
    PAIR(TAPER_ROTATION_231, 1),
    PAIR(TAPER_ROTATION_312, 0),
    {.max_mA = 16000, .voltage_mV = 230000, .phases = 3, .rotation = TAPER_ROTATION_123, .group = 1},
    {.max_mA = 25000,
     .voltage_mV = 400000,
     .phases = 1,
     .group = 0,
     .is_dc = true,
     .efficiency_permille = 950},
};
static const taper_station_config_t station = {
    .name = "project",
    .connectors = connectors,
    .groups = groups,
    .site_voltage_mV = 230000,
    .line_to_line = true,
    .step_s = 900,
    .steps = STEPS,
    .connector_count = COUNT,
    .group_count = 2,
};

static taper_horizon_t horizon;
static taper_snapshot_t snapshot;
static taper_course_t course;
static OSQPFloat x[COUNT * STEPS];

void setUp(void) {
    memset(&snapshot, 0, sizeof snapshot);
    snapshot.count = COUNT;
    for (uint8_t i = 0; i < COUNT; i++) {
        snapshot.demand[i] = scene_demand();
        snapshot.demand[i].max_mA = connectors[i].max_mA;
        snapshot.demand[i].W_per_A = connectors[i].voltage_mV / 1000 * connectors[i].phases;
        snapshot.demand[i].peak_W = 11000;
    }
    for (int t = 0; t < STEPS; t++) {
        course.limit_W[t] = 30000;
    }
    for (int line = 0; line < 3; line++) {
        course.phase_mA[line] = TAPER_NO_LIMIT;
    }
}
void tearDown(void) {}

static void build(void) {
    taper_horizon_build(&horizon, &station, &snapshot, &course);
    TEST_ASSERT_EQUAL_UINT16(13, horizon.sum_count); /* 7 of the site, 6 of the group */
}

/** Every connector's power [W], the same in all steps. */
static void ask(const double *power_W) {
    for (int i = 0; i < COUNT; i++) {
        for (int t = 0; t < STEPS; t++) {
            x[i * STEPS + t] = (OSQPFloat)(power_W[i] * (t + 1)) / horizon.base_W;
        }
    }
}

static double got_W(int i, int t) {
    const OSQPFloat before = t > 0 ? x[i * STEPS + t - 1] : 0;
    return (double)((x[i * STEPS + t] - before) * horizon.base_W);
}

static double random_share(uint32_t *state) {
    return (scene_random(state) % 1001) / 1000.0;
}

static void test_anything_finite_becomes_feasible_in_every_row(void) {
    uint32_t state = 0xBEEF;
    for (int n = 0; n < 3000; n++) {
        setUp();
        for (int i = 0; i < COUNT; i++) {
            snapshot.demand[i].active = scene_random(&state) % 4 != 0;
            snapshot.demand[i].taper_W = (int32_t)(scene_random(&state) % 11000);
            snapshot.demand[i].need_Wh = (int32_t)(scene_random(&state) % 20000) + 1;
            snapshot.demand[i].departs_in_s = (int32_t)(scene_random(&state) % 8000);
        }
        course.phase_mA[n % 3] = (int32_t)(scene_random(&state) % 60000);
        build();
        for (int v = 0; v < COUNT * STEPS; v++) {
            x[v] = (OSQPFloat)(6 * random_share(&state) - 1);
        }
        taper_project(&horizon, x);
        TEST_ASSERT_TRUE((double)taper_residual(&horizon, x).worst <= ROUNDING);
    }
}

static void test_what_keeps_every_row_stays_as_it_is(void) {
    build();
    const double power_W[COUNT] = {1000, 1500, 1000, 500, 400, 300, 3000, 2000};
    ask(power_W);
    taper_project(&horizon, x);
    for (int i = 0; i < COUNT; i++) {
        TEST_ASSERT_TRUE(fabs(got_W(i, 3) - power_W[i]) < 0.01);
    }
}

static void test_on_the_stronger_phase_those_on_one_phase_are_lowered_first(void) {
    build();
    /* L1: 20 A alone and 5 A from L1-L2. L2: the 5 A. L3: nothing. 10 A is what phases of the group may differ by. */
    ask((double[COUNT]){4600, 0, 0, 2000});
    taper_project(&horizon, x);
    TEST_ASSERT_TRUE(fabs(got_W(0, 0) - 5 * 230) < 0.5);
    TEST_ASSERT_TRUE(fabs(got_W(3, 0) - 2000) < 0.5);
}

static void test_where_only_pairs_are_left_they_are_lowered(void) {
    build();
    ask((double[COUNT]){0, 0, 0, 6000}); /* 15 A on L1 and L2, 10 A more than L3 may lag behind */
    taper_project(&horizon, x);
    TEST_ASSERT_TRUE(fabs(got_W(3, 0) - 4000) < 0.5);
}

static void test_a_weak_phase_is_not_lowered(void) {
    build();
    ask((double[COUNT]){6900, 460, 0, 0, 0, 0, 3450}); /* 30 A, 2 A, none; three phases count on all alike */
    taper_project(&horizon, x);
    TEST_ASSERT_TRUE(fabs(got_W(0, 0) - 10 * 230) < 0.5);
    TEST_ASSERT_TRUE(fabs(got_W(1, 0) - 460) < 0.5);
    TEST_ASSERT_TRUE(fabs(got_W(6, 0) - 3450) < 0.5);
}

static void test_a_line_above_its_limit_shrinks_all_who_draw_from_it(void) {
    course.phase_mA[1] = 10000;
    build();
    ask((double[COUNT]){460, 1150, 0, 0, 0, 0, 6900}); /* L2: 5 A and 10 A */
    taper_project(&horizon, x);
    TEST_ASSERT_TRUE(fabs(got_W(0, 0) - 460) < 0.5);
    TEST_ASSERT_TRUE(fabs(got_W(1, 0) - 1150 / 1.5) < 0.5);
    TEST_ASSERT_TRUE(fabs(got_W(6, 0) - 6900 / 1.5) < 0.5);
}

static void test_a_converter_counts_with_its_losses(void) {
    for (int t = 0; t < STEPS; t++) {
        course.limit_W[t] = 5000;
    }
    build();
    ask((double[COUNT]){0, 0, 0, 0, 0, 0, 0, 9000});
    taper_project(&horizon, x);
    TEST_ASSERT_TRUE(fabs(got_W(7, 0) - 5000 * 400.0 / 422) < 0.5); /* 400 V / 0.95: 422 W for 400 W */
}

static void test_what_was_cut_off_is_made_up_for_later(void) {
    course.limit_W[0] = 2000;
    build();
    ask((double[COUNT]){0, 0, 0, 0, 0, 0, 4000});
    taper_project(&horizon, x);
    TEST_ASSERT_TRUE(fabs(got_W(6, 0) - 2000) < 0.5);
    TEST_ASSERT_TRUE(fabs(got_W(6, 1) - 6000) < 0.5);
    TEST_ASSERT_TRUE(fabs(got_W(6, 2) - 4000) < 0.5);
}

static void test_the_residual_is_the_worst_row_and_not_fooled_by_what_is_not_a_number(void) {
    build();
    ask((double[COUNT]){0});
    TEST_ASSERT_TRUE(taper_residual(&horizon, x).worst <= 0);
    x[2 * STEPS] =
        (OSQPFloat)-0.25; /* a power below zero now, and one above its limit in the next step at most */
    TEST_ASSERT_TRUE(fabs((double)taper_residual(&horizon, x).worst - 0.25) < 1e-6);
    x[STEPS] = (OSQPFloat)NAN;
    TEST_ASSERT_TRUE(isnan(taper_residual(&horizon, x).worst));
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_anything_finite_becomes_feasible_in_every_row);
    RUN_TEST(test_what_keeps_every_row_stays_as_it_is);
    RUN_TEST(test_on_the_stronger_phase_those_on_one_phase_are_lowered_first);
    RUN_TEST(test_where_only_pairs_are_left_they_are_lowered);
    RUN_TEST(test_a_weak_phase_is_not_lowered);
    RUN_TEST(test_a_line_above_its_limit_shrinks_all_who_draw_from_it);
    RUN_TEST(test_a_converter_counts_with_its_losses);
    RUN_TEST(test_what_was_cut_off_is_made_up_for_later);
    RUN_TEST(test_the_residual_is_the_worst_row_and_not_fooled_by_what_is_not_a_number);
    return UNITY_END();
}
