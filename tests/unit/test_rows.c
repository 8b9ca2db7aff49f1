/* What every connector counts in every row, written out by hand, and that no row falls short of the phasors. */
#include <math.h>
#include <string.h>

#include "scene.h"
#include "taper/rows.h"
#include "unity.h"

#define L1 1u
#define L2 2u
#define L3 4u

static taper_snapshot_t snapshot;

void setUp(void) {
    memset(&snapshot, 0, sizeof snapshot);
}
void tearDown(void) {}

/* ---- Weights, by hand ---- */

/** One booking and what 1 A of it adds: W, then permille in the order of taper_row_kind_t. */
typedef struct {
    taper_booking_t booking;
    int32_t weight[TAPER_ROW_KINDS];
} golden_t;

#define WIRED(W, mask)            {.W_per_A = (W), .permille = 1000, .phases = (mask)}
#define BETWEEN(W, mask)          {.W_per_A = (W), .permille = 1000, .phases = (mask), .line_to_line = true}
#define CONVERTER(W, thousandths) {.W_per_A = (W), .permille = (thousandths), .phases = L1 | L2 | L3}

static const golden_t golden[] = {
    {WIRED(230, L1), {230, 1000, 0, 0, 1000, 0, 0, 1000, 1000, 0, 1000, 1000, 0, 1000, 0, -1000}},
    {WIRED(230, L2), {230, 0, 1000, 0, 0, 1000, 0, 0, 1000, 1000, 0, 1000, 1000, -1000, 1000, 0}},
    {WIRED(230, L3), {230, 0, 0, 1000, 0, 0, 1000, 1000, 0, 1000, 1000, 0, 1000, 0, -1000, 1000}},
    {WIRED(690, L1 | L2 | L3),
     {690, 1000, 1000, 1000, 1000, 1000, 1000, 1733, 1733, 1733, 1733, 1733, 1733, 0, 0, 0}},
    {WIRED(460, L1 | L2),
     {460, 1000, 1000, 0, 1000, 1000, 0, 1000, 1733, 1000, 1000, 1733, 1000, 0, 1000, -1000}},
    {BETWEEN(208, L1 | L2), {208, 1000, 733, 0, 733, 1000, 0, 1000, 2000, 0, 0, 2000, 1000, 0, 1000, -1000}},
    {BETWEEN(208, L2 | L3), {208, 0, 1000, 733, 0, 733, 1000, 0, 1000, 2000, 1000, 0, 2000, -1000, 0, 1000}},
    {BETWEEN(208, L3 | L1), {208, 733, 0, 1000, 1000, 0, 733, 2000, 0, 1000, 2000, 1000, 0, 1000, -1000, 0}},
    /* Between two lines, but nobody knows which. */
    {BETWEEN(208, L1 | L2 | L3),
     {208, 1000, 1000, 1000, 1000, 1000, 1000, 2000, 2000, 2000, 2000, 2000, 2000, 0, 0, 0}},
    /* 421.06 W draw 0.6103 A from each phase: sqrt(3) of it is rounded up. */
    {CONVERTER(422, 611), {422, 611, 611, 611, 611, 611, 611, 1059, 1059, 1059, 1059, 1059, 1059, 0, 0, 0}},
};

static void test_every_wiring_counts_as_written_down(void) {
    for (unsigned k = 0; k < sizeof golden / sizeof golden[0]; k++) {
        for (int kind = 0; kind < TAPER_ROW_KINDS; kind++) {
            const int32_t weight = taper_row_weight(&golden[k].booking, (taper_row_kind_t)kind);
            TEST_ASSERT_EQUAL_INT32_MESSAGE(golden[k].weight[kind], weight, "a weight");
        }
    }
}

static void test_only_differences_take_away(void) {
    for (uint8_t mask = 1; mask < 8; mask++) {
        for (int between = 0; between < 2; between++) {
            const taper_booking_t booking = {
                .W_per_A = 230, .permille = 1000, .phases = mask, .line_to_line = between != 0};
            for (int kind = 0; kind < TAPER_ROW_SUMS; kind++) {
                TEST_ASSERT_GREATER_OR_EQUAL_INT32(0, taper_row_weight(&booking, (taper_row_kind_t)kind));
            }
        }
    }
}

static void test_a_rotation_says_which_supply_phases_the_conductors_have(void) {
    TEST_ASSERT_EQUAL_UINT8(L1, taper_rotation_phases(TAPER_ROTATION_123, 1));
    TEST_ASSERT_EQUAL_UINT8(L2, taper_rotation_phases(TAPER_ROTATION_231, 1));
    TEST_ASSERT_EQUAL_UINT8(L3, taper_rotation_phases(TAPER_ROTATION_312, 1));
    TEST_ASSERT_EQUAL_UINT8(L1 | L3, taper_rotation_phases(TAPER_ROTATION_132, 2));
    TEST_ASSERT_EQUAL_UINT8(L2 | L1, taper_rotation_phases(TAPER_ROTATION_213, 2));
    TEST_ASSERT_EQUAL_UINT8(L3 | L2, taper_rotation_phases(TAPER_ROTATION_321, 2));
    TEST_ASSERT_EQUAL_UINT8(L1 | L2 | L3, taper_rotation_phases(TAPER_ROTATION_321, 3));
    TEST_ASSERT_EQUAL_UINT8(L1, taper_rotation_phases(TAPER_ROTATION_UNKNOWN, 1));
    TEST_ASSERT_EQUAL_UINT8(L1 | L2, taper_rotation_phases((taper_rotation_t)99, 2));
}

/* ---- Against phasors ---- */

/** Currents of the pairs L1-L2, L2-L3, L3-L1, of the phases to neutral, and of balanced loads [mA]. */
typedef struct {
    double pair[3], phase[3], balanced;
} load_t;

static const taper_booking_t between[3] = {BETWEEN(208, L1 | L2), BETWEEN(208, L2 | L3),
                                           BETWEEN(208, L3 | L1)};
static const taper_booking_t to_neutral[3] = {WIRED(120, L1), WIRED(120, L2), WIRED(120, L3)};
static const taper_booking_t three_phase = WIRED(360, L1 | L2 | L3);

static double row_sum(const load_t *load, taper_row_kind_t kind) {
    double sum = load->balanced * taper_row_weight(&three_phase, kind);
    for (unsigned p = 0; p < 3; p++) {
        sum += load->pair[p] * taper_row_weight(&between[p], kind) +
               load->phase[p] * taper_row_weight(&to_neutral[p], kind);
    }
    return sum / 1000;
}

/** A vector in the plane: unit phasors are 120 degrees apart, by phase. */
typedef struct {
    double re, im;
} phasor_t;

static phasor_t turned(double length, double degrees) {
    const double angle = degrees * 3.14159265358979323846 / 180;
    return (phasor_t){length * cos(angle), length * sin(angle)};
}

static phasor_t minus(phasor_t a, phasor_t b) {
    return (phasor_t){a.re - b.re, a.im - b.im};
}

static phasor_t plus(phasor_t a, phasor_t b) {
    return (phasor_t){a.re + b.re, a.im + b.im};
}

/** Current in line `line` of the supply, or of the delta side of the transformer before it: the star's two lines there. */
static phasor_t line_current(const load_t *load, unsigned line) {
    const unsigned before = (line + 2) % 3;
    const phasor_t out = turned(load->pair[line], 30.0 - 120.0 * line);
    const phasor_t in = turned(load->pair[before], 30.0 - 120.0 * before);
    return plus(minus(out, in), turned(load->phase[line] + load->balanced, -120.0 * line));
}

static double line_length(const load_t *load, unsigned line) {
    const phasor_t current = line_current(load, line);
    return hypot(current.re, current.im);
}

static double delta_length(const load_t *load, unsigned line) {
    const phasor_t current = minus(line_current(load, line), line_current(load, (line + 2) % 3));
    return hypot(current.re, current.im);
}

static double bound(const load_t *load, unsigned first, unsigned line) {
    const double one = row_sum(load, (taper_row_kind_t)(first + line));
    const double other = row_sum(load, (taper_row_kind_t)(first + 3 + line));
    return one > other ? one : other;
}

static double random_mA(uint32_t *state) {
    const uint32_t drawn = scene_random(state);
    return drawn % 4 == 0 ? 0 : (double)(drawn >> 8 & 0xFFFFu);
}

static void test_no_row_falls_short_of_the_phasors(void) {
    uint32_t state = 0xC0FFEE;
    for (int n = 0; n < 200000; n++) {
        load_t load = {.balanced = n % 2 == 0 ? 0 : random_mA(&state)};
        for (unsigned p = 0; p < 3; p++) {
            load.pair[p] = random_mA(&state);
            load.phase[p] = n % 3 == 0 ? random_mA(&state) : 0;
        }
        for (unsigned line = 0; line < 3; line++) {
            TEST_ASSERT_TRUE(line_length(&load, line) <= bound(&load, TAPER_ROW_L1, line) + 1e-6);
            TEST_ASSERT_TRUE(delta_length(&load, line) <= bound(&load, TAPER_ROW_DELTA_L1, line) + 1e-6);
        }
    }
}

/** The bound may be higher by what rounding up to a permille makes of sqrt(3): 0.027 %, or 0.068 % of the second part. */
static void assert_exact(double length, double bounded) {
    TEST_ASSERT_TRUE(bounded >= length - 1e-6);
    TEST_ASSERT_TRUE(bounded <= length * 1.0006);
}

static void test_line_rows_are_exact_for_each_pair_alone_and_for_two_alike(void) {
    for (unsigned line = 0; line < 3; line++) {
        for (unsigned pairs = 1; pairs < 8; pairs++) {
            load_t load = {.balanced = 0};
            for (unsigned p = 0; p < 3; p++) {
                load.pair[p] = (pairs >> p & 1u) != 0 ? 16000 : 0;
            }
            assert_exact(line_length(&load, line), bound(&load, TAPER_ROW_L1, line));
        }
        const load_t star = {.phase = {5000, 7000, 9000}, .balanced = 3000};
        assert_exact(line_length(&star, line), bound(&star, TAPER_ROW_L1, line));
    }
}

static void test_delta_rows_are_exact_on_their_rays(void) {
    static const load_t rays[] = {
        {.pair = {16000, 0, 0}},         {.pair = {0, 16000, 0}},  {.pair = {0, 0, 16000}},
        {.pair = {16000, 16000, 16000}}, {.phase = {16000, 0, 0}}, {.phase = {0, 16000, 0}},
        {.phase = {0, 0, 16000}},        {.balanced = 16000},
    };
    for (unsigned line = 0; line < 3; line++) {
        for (unsigned k = 0; k < sizeof rays / sizeof rays[0]; k++) {
            assert_exact(delta_length(&rays[k], line), bound(&rays[k], TAPER_ROW_DELTA_L1, line));
        }
        load_t alike = {.pair = {16000, 16000, 16000}};
        alike.pair[(line + 2) % 3] = 4000; /* the pair between, in both of its windings */
        assert_exact(delta_length(&alike, line), bound(&alike, TAPER_ROW_DELTA_L1, line));
    }
}

/* ---- Limits and planned rows of a station ---- */

enum { SOCKET, AB, BC, FAST, PLAIN };

static const taper_group_config_t groups[] = {
    {.limit_W = 50000, .limit_mA = 200000, .parent = TAPER_NO_GROUP},
    {.delta_mA = 90000, .imbalance_mA = 20000, .parent = 0},
    {.limit_mA = 63000, .parent = 0},
};
static const taper_connector_config_t connectors[] = {
    [SOCKET] =
        {.max_mA = 32000, .voltage_mV = 230000, .phases = 3, .rotation = TAPER_ROTATION_231, .group = 0},
    [AB] = {.max_mA = 32000,
            .voltage_mV = 208000,
            .phases = 1,
            .rotation = TAPER_ROTATION_123,
            .line_to_line = true,
            .group = 1},
    [BC] = {.max_mA = 32000,
            .voltage_mV = 208000,
            .phases = 1,
            .rotation = TAPER_ROTATION_231,
            .line_to_line = true,
            .group = 1},
    [FAST] = {.max_mA = 125000,
              .voltage_mV = 400000,
              .efficiency_permille = 950,
              .phases = 1,
              .group = 0,
              .is_dc = true},
    [PLAIN] =
        {.max_mA = 32000, .voltage_mV = 230500, .phases = 1, .rotation = TAPER_ROTATION_312, .group = 2},
};
static taper_station_config_t station = {
    .name = "rows",
    .connectors = connectors,
    .groups = groups,
    .site_voltage_mV = 230000,
    .line_to_line = true,
    .steps = 24,
    .connector_count = 5,
    .group_count = 3,
};

static void test_limits_come_from_the_description(void) {
    TEST_ASSERT_EQUAL_INT32(50000, taper_row_limit(&station, 0, TAPER_ROW_POWER));
    TEST_ASSERT_EQUAL_INT32(200000, taper_row_limit(&station, 0, TAPER_ROW_L2));
    TEST_ASSERT_EQUAL_INT32(200000, taper_row_limit(&station, 0, TAPER_ROW_L3_B));
    TEST_ASSERT_EQUAL_INT32(90000, taper_row_limit(&station, 1, TAPER_ROW_DELTA_L3));
    TEST_ASSERT_EQUAL_INT32(90000, taper_row_limit(&station, 1, TAPER_ROW_DELTA_L1_B));
    TEST_ASSERT_EQUAL_INT32(20000, taper_row_limit(&station, 1, TAPER_ROW_L3_L1));
    TEST_ASSERT_EQUAL_INT32(TAPER_NO_LIMIT, taper_row_limit(&station, 0, TAPER_ROW_DELTA_L1));
    TEST_ASSERT_EQUAL_INT32(TAPER_NO_LIMIT, taper_row_limit(&station, 0, TAPER_ROW_L1_L2));
    TEST_ASSERT_EQUAL_INT32(TAPER_NO_LIMIT, taper_row_limit(&station, 2, TAPER_ROW_POWER));
}

static void test_without_connectors_between_lines_there_is_no_second_row(void) {
    station.line_to_line = false;
    TEST_ASSERT_EQUAL_INT32(TAPER_NO_LIMIT, taper_row_limit(&station, 0, TAPER_ROW_L1_B));
    TEST_ASSERT_EQUAL_INT32(TAPER_NO_LIMIT, taper_row_limit(&station, 1, TAPER_ROW_DELTA_L3_B));
    TEST_ASSERT_EQUAL_INT32(90000, taper_row_limit(&station, 1, TAPER_ROW_DELTA_L3));
    station.line_to_line = true;
}

static void test_the_supply_bounds_what_the_site_has_limits_for(void) {
    const taper_supply_t supply = {.site_W = 40000, .phase_mA = {150000, -5, TAPER_NO_LIMIT}};
    TEST_ASSERT_EQUAL_INT32(40000, taper_row_limit_now(&station, &supply, 0, TAPER_ROW_POWER));
    TEST_ASSERT_EQUAL_INT32(150000, taper_row_limit_now(&station, &supply, 0, TAPER_ROW_L1));
    TEST_ASSERT_EQUAL_INT32(150000, taper_row_limit_now(&station, &supply, 0, TAPER_ROW_L1_B));
    TEST_ASSERT_EQUAL_INT32(0, taper_row_limit_now(&station, &supply, 0, TAPER_ROW_L2));
    TEST_ASSERT_EQUAL_INT32(200000, taper_row_limit_now(&station, &supply, 0, TAPER_ROW_L3));
    TEST_ASSERT_EQUAL_INT32(63000, taper_row_limit_now(&station, &supply, 2, TAPER_ROW_L1));
    const taper_supply_t ample = taper_supply_of_W(90000);
    TEST_ASSERT_EQUAL_INT32(50000, taper_row_limit_now(&station, &ample, 0, TAPER_ROW_POWER));
}

static void assert_booking(int32_t W_per_A, int32_t permille, uint8_t phases, uint8_t i) {
    const taper_booking_t booking = taper_booking_nominal(&station, i);
    TEST_ASSERT_EQUAL_INT32(W_per_A, booking.W_per_A);
    TEST_ASSERT_EQUAL_INT32(permille, booking.permille);
    TEST_ASSERT_EQUAL_UINT8(phases, booking.phases);
}

static void test_a_connector_counts_by_its_description_with_volts_and_losses_rounded_up(void) {
    assert_booking(690, 1000, L1 | L2 | L3, SOCKET);
    assert_booking(208, 1000, L1 | L2, AB);
    assert_booking(208, 1000, L2 | L3, BC);
    assert_booking(422, 612, L1 | L2 | L3, FAST); /* 400 V / 0.95; 422 W / 690 V */
    assert_booking(231, 1000, L3, PLAIN);
    TEST_ASSERT_TRUE(taper_booking_nominal(&station, AB).line_to_line);
    TEST_ASSERT_FALSE(taper_booking_nominal(&station, FAST).line_to_line);
}

static void test_what_the_snapshot_leaves_open_is_by_the_description(void) {
    TEST_ASSERT_EQUAL_INT32(690, taper_booking_now(&station, &snapshot, SOCKET).W_per_A);
    snapshot.demand[SOCKET].active = true;
    snapshot.demand[SOCKET].W_per_A = 240;
    TEST_ASSERT_EQUAL_INT32(240, taper_booking_now(&station, &snapshot, SOCKET).W_per_A);
    TEST_ASSERT_EQUAL_UINT8(L1 | L2 | L3, taper_booking_now(&station, &snapshot, SOCKET).phases);
    snapshot.demand[SOCKET].booking = (taper_booking_t){.permille = 1000, .phases = L2};
    TEST_ASSERT_EQUAL_INT32(240, taper_booking_now(&station, &snapshot, SOCKET).W_per_A);
    TEST_ASSERT_EQUAL_UINT8(L2, taper_booking_now(&station, &snapshot, SOCKET).phases);
    snapshot.demand[SOCKET].active = false;
    TEST_ASSERT_EQUAL_INT32(690, taper_booking_now(&station, &snapshot, SOCKET).W_per_A);
    snapshot.demand[SOCKET].booking.W_per_A = 250;
    TEST_ASSERT_EQUAL_INT32(250, taper_booking_now(&station, &snapshot, SOCKET).W_per_A);
}

static void test_a_demand_on_direct_current_counts_with_its_losses(void) {
    snapshot.demand[FAST].active = true;
    snapshot.demand[FAST].W_per_A = 380;
    TEST_ASSERT_EQUAL_INT32(400, taper_booking_now(&station, &snapshot, FAST).W_per_A);
}

static void test_rows_are_planned_where_a_limit_meets_a_connector(void) {
    TEST_ASSERT_TRUE(taper_row_is_planned(&station, 0, TAPER_ROW_POWER));
    TEST_ASSERT_TRUE(taper_row_is_planned(&station, 0, TAPER_ROW_L1_B));
    TEST_ASSERT_FALSE(taper_row_is_planned(&station, 0, TAPER_ROW_DELTA_L1)); /* no limit */
    TEST_ASSERT_FALSE(taper_row_is_planned(&station, 1, TAPER_ROW_POWER));
    TEST_ASSERT_TRUE(taper_row_is_planned(&station, 1, TAPER_ROW_DELTA_L1));   /* by AB */
    TEST_ASSERT_TRUE(taper_row_is_planned(&station, 1, TAPER_ROW_DELTA_L1_B)); /* by BC */
    TEST_ASSERT_TRUE(taper_row_is_planned(&station, 1, TAPER_ROW_L1_L2));
    TEST_ASSERT_FALSE(taper_row_is_planned(&station, 2, TAPER_ROW_L1)); /* nobody there is on it */
    TEST_ASSERT_TRUE(taper_row_is_planned(&station, 2, TAPER_ROW_L3));
}

static void test_a_planned_row_has_those_below_its_group_with_a_weight(void) {
    TEST_ASSERT_TRUE(taper_row_plans(&station, 0, TAPER_ROW_L3, PLAIN));
    TEST_ASSERT_FALSE(taper_row_plans(&station, 0, TAPER_ROW_L2, PLAIN));
    TEST_ASSERT_TRUE(taper_row_plans(&station, 0, TAPER_ROW_L2, AB));
    TEST_ASSERT_FALSE(taper_row_plans(&station, 1, TAPER_ROW_DELTA_L1, SOCKET)); /* hangs above */
    TEST_ASSERT_TRUE(taper_row_plans(&station, 1, TAPER_ROW_DELTA_L2, AB));
    TEST_ASSERT_FALSE(taper_row_plans(&station, 1, TAPER_ROW_L1_L2, AB)); /* on both alike */
    TEST_ASSERT_TRUE(taper_row_plans(&station, 1, TAPER_ROW_L1_L2, BC));
}

static void test_a_group_contains_what_hangs_below_it(void) {
    TEST_ASSERT_TRUE(taper_group_contains(&station, 0, AB));
    TEST_ASSERT_TRUE(taper_group_contains(&station, 1, AB));
    TEST_ASSERT_FALSE(taper_group_contains(&station, 2, AB));
    TEST_ASSERT_FALSE(taper_group_contains(&station, 1, SOCKET));
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_every_wiring_counts_as_written_down);
    RUN_TEST(test_only_differences_take_away);
    RUN_TEST(test_a_rotation_says_which_supply_phases_the_conductors_have);
    RUN_TEST(test_no_row_falls_short_of_the_phasors);
    RUN_TEST(test_line_rows_are_exact_for_each_pair_alone_and_for_two_alike);
    RUN_TEST(test_delta_rows_are_exact_on_their_rays);
    RUN_TEST(test_limits_come_from_the_description);
    RUN_TEST(test_without_connectors_between_lines_there_is_no_second_row);
    RUN_TEST(test_the_supply_bounds_what_the_site_has_limits_for);
    RUN_TEST(test_a_connector_counts_by_its_description_with_volts_and_losses_rounded_up);
    RUN_TEST(test_what_the_snapshot_leaves_open_is_by_the_description);
    RUN_TEST(test_a_demand_on_direct_current_counts_with_its_losses);
    RUN_TEST(test_rows_are_planned_where_a_limit_meets_a_connector);
    RUN_TEST(test_a_planned_row_has_those_below_its_group_with_a_weight);
    RUN_TEST(test_a_group_contains_what_hangs_below_it);
    return UNITY_END();
}
