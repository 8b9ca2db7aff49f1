/* What every connector counts in every row, written out by hand, and that no row falls short of the phasors. */
#include <math.h>

#include "scene.h"
#include "taper/rows.h"
#include "unity.h"

#define L1 1u
#define L2 2u
#define L3 4u

void setUp(void) {}
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
    {WIRED(460, L2 | L3),
     {460, 0, 1000, 1000, 0, 1000, 1000, 1000, 1000, 1733, 1000, 1000, 1733, -1000, 0, 1000}},
    {WIRED(460, L3 | L1),
     {460, 1000, 0, 1000, 1000, 0, 1000, 1733, 1000, 1000, 1733, 1000, 1000, 1000, -1000, 0}},
    {BETWEEN(208, L1 | L2), {208, 1000, 733, 0, 733, 1000, 0, 1000, 2000, 0, 0, 2000, 1000, 0, 1000, -1000}},
    {BETWEEN(208, L2 | L3), {208, 0, 1000, 733, 0, 733, 1000, 0, 1000, 2000, 1000, 0, 2000, -1000, 0, 1000}},
    {BETWEEN(208, L3 | L1), {208, 733, 0, 1000, 1000, 0, 733, 2000, 0, 1000, 2000, 1000, 0, 1000, -1000, 0}},
    /* Between two lines, but nobody knows which. */
    {BETWEEN(208, L1 | L2 | L3),
     {208, 1000, 1000, 1000, 1000, 1000, 1000, 2000, 2000, 2000, 2000, 2000, 2000, 0, 0, 0}},
    /* Or just one is: it counts like one to neutral. */
    {BETWEEN(208, L1), {208, 1000, 0, 0, 1000, 0, 0, 1000, 1000, 0, 1000, 1000, 0, 1000, 0, -1000}},
    {BETWEEN(208, L2), {208, 0, 1000, 0, 0, 1000, 0, 0, 1000, 1000, 0, 1000, 1000, -1000, 1000, 0}},
    {BETWEEN(208, L3), {208, 0, 0, 1000, 0, 0, 1000, 1000, 0, 1000, 1000, 0, 1000, 0, -1000, 1000}},
    /* The least part of a permille is rounded up: 0.733 x 397 = 291.001. */
    {{.W_per_A = 83, .permille = 397, .phases = L1 | L2, .line_to_line = true},
     {83, 397, 292, 0, 292, 397, 0, 397, 794, 0, 0, 794, 397, 0, 397, -397}},
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

static void test_every_rotation_has_a_phase_for_each_conductor(void) {
    static const struct {
        unsigned rotation;
        uint8_t one, two;
    } cases[] = {{TAPER_ROTATION_UNKNOWN, L1, L1 | L2}, {TAPER_ROTATION_123, L1, L1 | L2},
                 {TAPER_ROTATION_231, L2, L2 | L3},     {TAPER_ROTATION_312, L3, L3 | L1},
                 {TAPER_ROTATION_132, L1, L1 | L3},     {TAPER_ROTATION_213, L2, L2 | L1},
                 {TAPER_ROTATION_321, L3, L3 | L2},     {TAPER_ROTATION_321 + 1, L1, L1 | L2}};
    for (unsigned k = 0; k < sizeof cases / sizeof cases[0]; k++) {
        const taper_rotation_t rotation = (taper_rotation_t)cases[k].rotation;
        TEST_ASSERT_EQUAL_UINT8(0, taper_rotation_phases(rotation, 0));
        TEST_ASSERT_EQUAL_UINT8(cases[k].one, taper_rotation_phases(rotation, 1));
        TEST_ASSERT_EQUAL_UINT8(cases[k].two, taper_rotation_phases(rotation, 2));
        TEST_ASSERT_EQUAL_UINT8(L1 | L2 | L3, taper_rotation_phases(rotation, 3));
        TEST_ASSERT_EQUAL_UINT8(L1 | L2 | L3, taper_rotation_phases(rotation, 4));
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
    TEST_ASSERT_EQUAL_UINT8(L1 | L2 | L3, taper_rotation_phases(TAPER_ROTATION_321, 200));
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
    for (int n = 0; n < 200000 / TEST_SHARE; n++) {
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

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_every_wiring_counts_as_written_down);
    RUN_TEST(test_only_differences_take_away);
    RUN_TEST(test_every_rotation_has_a_phase_for_each_conductor);
    RUN_TEST(test_a_rotation_says_which_supply_phases_the_conductors_have);
    RUN_TEST(test_no_row_falls_short_of_the_phasors);
    RUN_TEST(test_line_rows_are_exact_for_each_pair_alone_and_for_two_alike);
    RUN_TEST(test_delta_rows_are_exact_on_their_rays);
    return UNITY_END();
}
