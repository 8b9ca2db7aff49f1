/* Any proposal, any tree: the limits hold, by the guard's arithmetic and by phasors in floating point. */
#include <math.h>
#include <string.h>

#include "taper/rows.h"
#include "tree.h"
#include "unity.h"

#define SLACK     1e-6
#define PROPOSALS (100000u / TEST_SHARE)
#define GUARDED   (30000u / TEST_SHARE)

static tree_t tree;
static uint32_t state;
static int32_t reserved_mA[TAPER_MAX_CONNECTORS];

void setUp(void) {
    state = 0x5ee2;
}
void tearDown(void) {}

static uint32_t below(uint32_t bound) {
    return tree_random(&state, bound);
}

/** No limit, or one that binds now and then. */
static int32_t some_limit(int32_t most) {
    return below(2) == 0 ? 0 : (int32_t)below((uint32_t)most);
}

static void grow_tree(void) {
    tree_init(&tree);
    const unsigned groups = below(12);
    for (unsigned k = 0; k < groups; k++) {
        tree_add_group(&tree, (uint8_t)below(tree.config.group_count));
    }
    for (unsigned k = 0; k < tree.config.group_count; k++) {
        tree.group[k].limit_W = k == 0 ? 1 + (int32_t)below(150000) : some_limit(60000);
        tree.group[k].limit_mA = some_limit(200000);
        tree.group[k].delta_mA = below(3) == 0 ? some_limit(300000) : 0;
        tree.group[k].imbalance_mA = below(3) == 0 ? some_limit(60000) : 0;
    }
}

static void add_connector(void) {
    static const uint8_t lines[] = {L1, L2, L3, L1 | L2 | L3, L1 | L2, L2 | L3, L3 | L1};
    const uint32_t pick = below(7);
    const uint8_t group = (uint8_t)below(tree.config.group_count);
    const uint8_t i =
        pick < 4 ? tree_add(&tree, group, lines[pick]) : tree_add_pair(&tree, group, lines[pick]);
    taper_demand_t *demand = &tree.snapshot.demand[i];
    if (below(6) == 0) { /* a converter */
        tree.connector[i].is_dc = true;
        tree.connector[i].voltage_mV = 400000;
        tree.connector[i].efficiency_permille = (uint16_t)(900 + below(101));
        tree.connector[i].phases = 1;
        tree.connector[i].min_mA = 0;
        demand->W_per_A = 400;
        demand->booking = (taper_booking_t){
            .W_per_A = 400 + (int32_t)below(60), .permille = 580 + (int32_t)below(90), .phases = 7};
    }
    switch (below(5)) {
    case 0: demand->booking.phases = 7; break;             /* unknown wiring */
    case 1: demand->booking = (taper_booking_t){0}; break; /* by the description */
    default: break;
    }
    demand->booking.idle = demand->booking.phases & (uint8_t)(below(4) == 0 ? below(8) : 0u);
    demand->booking.unsure =
        demand->booking.idle | (demand->booking.phases & (uint8_t)(below(4) == 0 ? below(8) : 0u));
}

static int32_t hostile(void) {
    static const int32_t ends[] = {INT32_MIN, INT32_MAX, -1, 0, 1, INT32_MIN + 1};
    const uint32_t pick = below(4);
    return pick == 0 ? ends[below(6)] : pick == 1 ? (int32_t)below(INT32_MAX) : (int32_t)below(9000);
}

static void vary(void) {
    for (uint8_t i = 0; i < tree.config.connector_count; i++) {
        taper_demand_t *demand = &tree.snapshot.demand[i];
        demand->active = below(6) != 0;
        demand->session = (uint8_t)(1 + below(20) / 19);
        demand->max_mA = (int32_t)below(321) * 100;
        demand->min_mA = tree.connector[i].min_mA == 0 || below(4) == 0 ? 0 : 6000 + (int32_t)below(3) * 50;
        demand->departs_in_s = hostile();
        demand->need_Wh = 1 + (int32_t)below(100000);
        demand->peak_W = (int32_t)below(20000);
        tree.proposal.wish_W[i] = hostile();
        tree.proposal.ceiling_W[i] = hostile();
        tree.proposal.rank[i] = (uint8_t)below(tree.config.connector_count + 2u);
        reserved_mA[i] = !demand->active && below(4) == 0 ? (int32_t)below(20000) : 0;
    }
    tree.supply = taper_supply_of_W(hostile());
    for (unsigned line = 0; line < 3; line++) {
        tree.supply.phase_mA[line] = below(2) == 0 ? TAPER_NO_LIMIT : hostile() / 10;
    }
}

/* ---- The limits once more, by phasors */

typedef struct {
    double x, y;
} phasor_t;

typedef struct {
    double power_W;
    phasor_t line_A[3], delta_A[3]; /* of pairs */
    double other_A[3];              /* whose angle is not known */
    double most_A[3], least_A[3];   /* of setpoints */
} flow_t;

/** Add `times` a current of pair 0, 1 or 2: a third of a turn apart. */
static void add_phasor(phasor_t *sum, unsigned pair, double current_A, double times) {
    const double angle = -2.0943951023931953 * (double)pair;
    sum->x += times * current_A * cos(angle);
    sum->y += times * current_A * sin(angle);
}

static void add_pair(flow_t *flow, unsigned pair, double current_A) {
    add_phasor(&flow->line_A[pair], pair, current_A, 1);
    add_phasor(&flow->line_A[(pair + 1) % 3], pair, current_A, -1);
    add_phasor(&flow->delta_A[pair], pair, current_A, 1); /* line a: AB + BC - 2 CA */
    add_phasor(&flow->delta_A[(pair + 2) % 3], pair, current_A, 1);
    add_phasor(&flow->delta_A[(pair + 1) % 3], pair, current_A, -2);
}

static double length(phasor_t phasor) {
    return hypot(phasor.x, phasor.y);
}

static void add_flow(flow_t *flow, uint8_t i) {
    const taper_booking_t booking = taper_booking_now(&tree.config, &tree.snapshot, i);
    const double current_A = tree.setpoints.current_mA[i] / 1000.0;
    const double supply_A = current_A * booking.permille / 1000.0;
    flow->power_W += current_A * booking.W_per_A;
    for (unsigned line = 0; line < 3; line++) {
        const bool has = (booking.phases >> line & 1u) != 0u;
        flow->most_A[line] += has && (booking.idle >> line & 1u) == 0u ? supply_A : 0.0;
        flow->least_A[line] += has && (booking.unsure >> line & 1u) == 0u ? supply_A : 0.0;
    }
    for (unsigned line = 0; line < 3; line++) {
        if (booking.line_to_line && booking.phases == (1u << line | 1u << (line + 1) % 3)) {
            add_pair(flow, line, supply_A);
            return;
        }
    }
    for (unsigned line = 0; line < 3; line++) {
        if ((booking.phases >> line & 1u) != 0u) {
            flow->other_A[line] += supply_A;
        }
    }
}

static void assert_group_holds(uint8_t k) {
    const taper_group_config_t *group = &tree.group[k];
    flow_t flow = {0};
    for (uint8_t i = 0; i < tree.config.connector_count; i++) {
        if (taper_group_contains(&tree.config, k, i)) {
            add_flow(&flow, i);
        }
    }
    TEST_ASSERT_TRUE(group->limit_W == 0 || flow.power_W <= group->limit_W + SLACK);
    TEST_ASSERT_TRUE(k > 0 || flow.power_W <= fmax(tree.supply.site_W, 0) + SLACK);
    for (unsigned line = 0; line < 3; line++) {
        const double line_A = length(flow.line_A[line]) + flow.other_A[line];
        const double x_A = flow.other_A[line],
                     y_A = flow.other_A[(line + 2) % 3]; /* windings, 60 degrees apart */
        const double delta_A = length(flow.delta_A[line]) + sqrt(x_A * x_A + x_A * y_A + y_A * y_A);
        const double apart_A =
            flow.most_A[line] - fmin(flow.least_A[(line + 1) % 3], flow.least_A[(line + 2) % 3]);
        TEST_ASSERT_TRUE(group->limit_mA == 0 || line_A <= group->limit_mA / 1000.0 + SLACK);
        TEST_ASSERT_TRUE(group->limit_mA == 0 || k > 0 ||
                         line_A <= fmax(tree.supply.phase_mA[line], 0) / 1000.0 + SLACK);
        TEST_ASSERT_TRUE(group->delta_mA == 0 || delta_A <= group->delta_mA / 1000.0 + SLACK);
        TEST_ASSERT_TRUE(group->imbalance_mA == 0 || apart_A <= group->imbalance_mA / 1000.0 + SLACK);
    }
}

static bool assert_connectors_hold(void) {
    bool any = false;
    for (uint8_t i = 0; i < tree.config.connector_count; i++) {
        const int32_t current_mA = tree.setpoints.current_mA[i];
        const taper_demand_t *demand = &tree.snapshot.demand[i];
        TEST_ASSERT_TRUE(current_mA == 0 ||
                         (demand->active && current_mA >= demand->min_mA && current_mA <= demand->max_mA));
        TEST_ASSERT_TRUE(current_mA >= 0 && current_mA % TAPER_CURRENT_STEP_mA == 0);
        any = any || current_mA > 0;
    }
    return any;
}

static void test_limits_hold_for_a_hundred_thousand_hostile_proposals_on_any_tree(void) {
    unsigned with_current = 0;
    for (unsigned round = 0; round < PROPOSALS; round++) {
        if (round % 50 == 0) {
            grow_tree();
            for (unsigned left = 1 + below(20); left > 0; left--) {
                add_connector();
            }
        }
        vary();
        tree.snapshot.now_ms += below(200000);
        taper_allocate(&tree.allocator, &tree.config, &tree.snapshot, &tree.proposal, tree_rows(&tree),
                       reserved_mA, &tree.setpoints);
        TEST_ASSERT_TRUE(tree_guard(&tree));
        for (uint8_t k = 0; k < tree.config.group_count; k++) {
            assert_group_holds(k);
        }
        with_current += assert_connectors_hold() ? 1 : 0;
    }
    TEST_ASSERT_GREATER_THAN_UINT(PROPOSALS * 3 / 10,
                                  with_current); /* one that gives nothing is not safe, it is off */
}

/** Setpoints that nobody bounded: the guard and the phasors agree, but for what rounding decides. */
static void test_the_guard_agrees_with_phasors_on_any_setpoints(void) {
    unsigned passed = 0;
    unsigned refused = 0;
    for (unsigned round = 0; round < GUARDED; round++) {
        grow_tree();
        for (unsigned left = 1 + below(6); left > 0; left--) {
            add_connector();
        }
        tree.supply = taper_supply_of_W(150000);
        for (uint8_t i = 0; i < tree.config.connector_count; i++) {
            tree.setpoints.current_mA[i] = below(2) == 0 ? 0 : 6000 + (int32_t)below(261) * 100;
        }
        if (tree_guard(&tree)) {
            for (uint8_t k = 0; k < tree.config.group_count; k++) {
                assert_group_holds(k);
            }
            passed++;
        } else {
            refused++;
        }
    }
    TEST_ASSERT_GREATER_THAN_UINT(GUARDED / 6, passed);
    TEST_ASSERT_GREATER_THAN_UINT(GUARDED / 6, refused);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_limits_hold_for_a_hundred_thousand_hostile_proposals_on_any_tree);
    RUN_TEST(test_the_guard_agrees_with_phasors_on_any_setpoints);
    return UNITY_END();
}
