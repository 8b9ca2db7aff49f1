#include <string.h>

#include "scene.h"
#include "taper/allocator.h"
#include "taper/real.h"
#include "unity.h"

static taper_allocator_t allocator;
static taper_setpoints_t setpoints;

void setUp(void) {
    taper_allocator_init(&allocator);
}
void tearDown(void) {}

static void allocate(const taper_station_config_t *config, const taper_snapshot_t *snapshot,
                     const taper_proposal_t *proposal, int32_t site_limit_W) {
    const taper_supply_t supply = taper_supply_of_W(site_limit_W);
    taper_allocate(&allocator, config, snapshot, proposal, scene_rows(config, snapshot, &supply), NULL,
                   &setpoints);
}

static int64_t power_mW(const taper_snapshot_t *snapshot, uint8_t first, uint8_t last) {
    int64_t sum = 0;
    for (uint8_t i = first; i <= last; i++) {
        sum += (int64_t)setpoints.current_mA[i] * snapshot->demand[i].W_per_A;
    }
    return sum;
}

static void test_a_wish_within_all_limits_is_granted_rounded_down(void) {
    const taper_snapshot_t snapshot = scene_snapshot(0, 1);
    const taper_proposal_t proposal = scene_proposal(3010); /* 13.087 A; the ceiling allows up to 13.1 A */
    allocate(scene_four(), &snapshot, &proposal, 25000);
    TEST_ASSERT_EQUAL_INT32(13100, setpoints.current_mA[0]);
    allocate(scene_four(), &snapshot, &proposal, 3010); /* without room for the last step: down */
    TEST_ASSERT_EQUAL_INT32(13000, setpoints.current_mA[0]);
}

static void test_no_connector_exceeds_its_own_limit(void) {
    taper_snapshot_t snapshot = scene_snapshot(0, 2);
    snapshot.demand[1].max_mA = 16000;
    const taper_proposal_t proposal = scene_proposal(INT32_MAX);
    allocate(scene_four(), &snapshot, &proposal, 25000);
    TEST_ASSERT_EQUAL_INT32(32000, setpoints.current_mA[0]);
    TEST_ASSERT_EQUAL_INT32(16000, setpoints.current_mA[1]);
}

static void test_a_feeder_limit_binds_its_own_connectors_only(void) {
    const taper_snapshot_t snapshot = scene_snapshot(0, 3);
    const taper_proposal_t proposal = scene_proposal(7360);
    allocate(scene_four(), &snapshot, &proposal, 25000);
    TEST_ASSERT_EQUAL_INT32(32000, setpoints.current_mA[0]);
    TEST_ASSERT_EQUAL_INT32(20000, setpoints.current_mA[1]); /* 11.96 kW - 7.36 kW */
    TEST_ASSERT_EQUAL_INT32(32000, setpoints.current_mA[2]);
}

static void test_the_rank_decides_who_gets_more_than_the_minimum(void) {
    const taper_snapshot_t snapshot = scene_snapshot(0, 4);
    taper_proposal_t proposal = scene_proposal(7360);
    const uint8_t rank[] = {3, 0, 1, 2};
    memcpy(proposal.rank, rank, sizeof rank);
    allocate(scene_four(), &snapshot, &proposal, 8000);
    TEST_ASSERT_EQUAL_INT32(16700, setpoints.current_mA[3]); /* 34.7 A less 18 A */
    TEST_ASSERT_EQUAL_INT32(6000, setpoints.current_mA[0]);
    TEST_ASSERT_EQUAL_INT32(6000, setpoints.current_mA[1]);
    TEST_ASSERT_EQUAL_INT32(6000, setpoints.current_mA[2]);
}

static void test_all_wishes_come_before_any_ceiling(void) {
    const taper_snapshot_t snapshot = scene_snapshot(0, 2);
    taper_proposal_t proposal = scene_proposal(2990);
    proposal.ceiling_W[0] = 7360;
    proposal.ceiling_W[1] = 7360;
    allocate(scene_four(), &snapshot, &proposal, 6210);
    TEST_ASSERT_EQUAL_INT32(14000, setpoints.current_mA[0]); /* 13 A wished, and the 230 W left over */
    TEST_ASSERT_EQUAL_INT32(13000, setpoints.current_mA[1]);
}

static void test_a_negative_wish_is_no_wish(void) {
    const taper_snapshot_t snapshot = scene_snapshot(0, 2);
    taper_proposal_t proposal = scene_proposal(2990);
    proposal.wish_W[0] = -5000;
    proposal.ceiling_W[0] = -1;
    allocate(scene_four(), &snapshot, &proposal, 25000);
    TEST_ASSERT_EQUAL_INT32(0, setpoints.current_mA[0]);
    TEST_ASSERT_EQUAL_INT32(13000, setpoints.current_mA[1]);
}

static void test_a_wish_below_the_minimum_waits_until_it_is_owed_or_room_is_left_over(void) {
    const taper_snapshot_t snapshot = scene_snapshot(0, 2);
    taper_proposal_t proposal = scene_proposal(1380); /* 6 A */
    proposal.wish_W[0] = 1379;
    allocate(scene_four(), &snapshot, &proposal, 1380);
    TEST_ASSERT_EQUAL_INT32(0, setpoints.current_mA[0]);
    TEST_ASSERT_EQUAL_INT32(6000, setpoints.current_mA[1]);
    allocate(scene_four(), &snapshot, &proposal, 2760);
    TEST_ASSERT_EQUAL_INT32(6000, setpoints.current_mA[0]);
}

static void test_what_is_left_over_goes_up_to_the_ceilings(void) {
    const taper_snapshot_t snapshot = scene_snapshot(0, 2);
    taper_proposal_t proposal = scene_proposal(2300);
    proposal.ceiling_W[1] = 7360;
    allocate(scene_four(), &snapshot, &proposal, 25000);
    TEST_ASSERT_EQUAL_INT32(10000, setpoints.current_mA[0]);
    TEST_ASSERT_EQUAL_INT32(32000, setpoints.current_mA[1]);
}

static void test_rounding_wastes_less_than_one_step_in_all(void) {
    const taper_snapshot_t snapshot = scene_snapshot(0, 4);
    taper_proposal_t proposal = scene_proposal(1493); /* 6.491 A each, 5972 W together */
    allocate(scene_four_continuous(), &snapshot, &proposal, 5972);
    TEST_ASSERT_LESS_OR_EQUAL_INT64(5972000, power_mW(&snapshot, 0, 3));
    TEST_ASSERT_GREATER_THAN_INT64(5972000 - 100 * 230, power_mW(&snapshot, 0, 3));
}

static void test_below_its_minimum_a_connector_gets_nothing(void) {
    const taper_snapshot_t snapshot = scene_snapshot(0, 2);
    const taper_proposal_t proposal = scene_proposal(2000);
    allocate(scene_four(), &snapshot, &proposal, 2759); /* a watt less than two minima */
    TEST_ASSERT_EQUAL_INT32(8700, setpoints.current_mA[0]);
    TEST_ASSERT_EQUAL_INT32(0, setpoints.current_mA[1]);
}

static void test_without_a_minimum_currents_are_continuous(void) {
    taper_snapshot_t snapshot = scene_snapshot(0, 1);
    snapshot.demand[0].min_mA = 0;
    const taper_proposal_t proposal = scene_proposal(100);
    allocate(scene_four_continuous(), &snapshot, &proposal, 25000);
    TEST_ASSERT_EQUAL_INT32(500, setpoints.current_mA[0]); /* 0.43 A, up to the ceiling's step */
}

static void test_a_connector_stays_on_for_its_minimum_on_time(void) {
    taper_snapshot_t snapshot = scene_snapshot(0, 1);
    taper_proposal_t proposal = scene_proposal(3000);
    allocate(scene_four(), &snapshot, &proposal, 25000);
    proposal = scene_proposal(0);
    snapshot.now_ms = 299999;
    allocate(scene_four(), &snapshot, &proposal, 25000);
    TEST_ASSERT_EQUAL_INT32(6000, setpoints.current_mA[0]);
    snapshot.now_ms = 300000;
    allocate(scene_four(), &snapshot, &proposal, 25000);
    TEST_ASSERT_EQUAL_INT32(0, setpoints.current_mA[0]);
}

static void test_a_limit_ends_the_minimum_on_time(void) {
    taper_snapshot_t snapshot = scene_snapshot(0, 1);
    const taper_proposal_t proposal = scene_proposal(3000);
    allocate(scene_four(), &snapshot, &proposal, 25000);
    snapshot.now_ms = 1000;
    allocate(scene_four(), &snapshot, &proposal, 0);
    TEST_ASSERT_EQUAL_INT32(0, setpoints.current_mA[0]);
}

static void test_a_connector_stays_off_for_its_minimum_off_time(void) {
    taper_snapshot_t snapshot = scene_snapshot(0, 1);
    const taper_proposal_t proposal = scene_proposal(3000);
    allocate(scene_four(), &snapshot, &proposal, 25000);
    snapshot.now_ms = 1000;
    allocate(scene_four(), &snapshot, &proposal, 0);
    snapshot.now_ms = 300999;
    allocate(scene_four(), &snapshot, &proposal, 25000);
    TEST_ASSERT_EQUAL_INT32(0, setpoints.current_mA[0]);
    snapshot.now_ms = 301000;
    allocate(scene_four(), &snapshot, &proposal, 25000);
    TEST_ASSERT_EQUAL_INT32(13100, setpoints.current_mA[0]);
}

static void test_the_next_vehicle_does_not_inherit_the_off_time(void) {
    taper_snapshot_t snapshot = scene_snapshot(0, 1);
    const taper_proposal_t proposal = scene_proposal(3000);
    allocate(scene_four(), &snapshot, &proposal, 25000);
    snapshot.now_ms = 1000;
    allocate(scene_four(), &snapshot, &proposal, 0);
    snapshot.demand[0].session = 2;
    snapshot.now_ms = 2000;
    allocate(scene_four(), &snapshot, &proposal, 25000);
    TEST_ASSERT_EQUAL_INT32(13100, setpoints.current_mA[0]);
}

static void test_a_negative_site_limit_counts_as_zero(void) {
    const taper_snapshot_t snapshot = scene_snapshot(0, 4);
    const taper_proposal_t proposal = scene_proposal(7360);
    allocate(scene_four(), &snapshot, &proposal, -1);
    TEST_ASSERT_EQUAL_INT64(0, power_mW(&snapshot, 0, 3));
}

static void test_idle_connectors_get_nothing_whatever_is_proposed(void) {
    const taper_snapshot_t snapshot = scene_snapshot(0, 2);
    const taper_proposal_t proposal = scene_proposal(7360);
    allocate(scene_four(), &snapshot, &proposal, 25000);
    TEST_ASSERT_EQUAL_INT32(0, setpoints.current_mA[2]);
    TEST_ASSERT_EQUAL_INT32(0, setpoints.current_mA[3]);
}

/** A value that hurts: ends of the range, small, negative, or anything. */
static int32_t hostile(uint32_t *state) {
    static const int32_t ends[] = {INT32_MIN, INT32_MAX, -1, 0, 1, INT32_MIN + 1};
    const uint32_t pick = scene_random(state);
    if (pick % 5 ==
        4) { /* what a solver gone wrong holds, as it reaches the allocator: NaN, infinite, huge, denormal */
        uint32_t bits[2] = {scene_random(state),
                            scene_random(state) | (pick % 2 == 0 ? UINT32_C(0x7FF00000) : 0)};
        taper_real_t real;
        memcpy(&real, sizeof real == sizeof bits ? &bits[0] : &bits[1], sizeof real);
        return taper_real_to_W(real, INT32_MAX);
    }
    if (pick % 4 == 0) {
        return ends[pick / 4 % (sizeof ends / sizeof ends[0])];
    }
    return pick % 4 == 1 ? (int32_t)(scene_random(state) & INT32_MAX) : (int32_t)(scene_random(state) % 9000);
}

static void make_hostile(taper_proposal_t *proposal, uint32_t *state) {
    for (uint8_t i = 0; i < 4; i++) {
        proposal->wish_W[i] = hostile(state);
        proposal->ceiling_W[i] = hostile(state);
        proposal->rank[i] =
            (uint8_t)(scene_random(state) % 6); /* not a permutation, partly not a connector */
    }
}

static void vary_demands(taper_snapshot_t *snapshot, uint32_t *state) {
    for (uint8_t i = 0; i < 4; i++) {
        snapshot->demand[i].active = scene_random(state) % 5 != 0;
        snapshot->demand[i].max_mA = (int32_t)(scene_random(state) % 321) * 100;
        snapshot->demand[i].min_mA = scene_random(state) % 2 == 0 ? 0 : 6000;
        snapshot->demand[i].W_per_A = scene_random(state) % 2 == 0 ? 230 : 759;
        snapshot->demand[i].session = (uint8_t)(1 + scene_random(state) % 3);
    }
}

/** The limits, stated again in the plainest way. */
static void assert_limits_hold(const taper_snapshot_t *snapshot, int32_t site_limit_W) {
    const int64_t site_mW = (int64_t)taper_clamp_i32(site_limit_W, 0, 25000) * 1000;
    TEST_ASSERT_LESS_OR_EQUAL_INT64(site_mW, power_mW(snapshot, 0, 3));
    TEST_ASSERT_LESS_OR_EQUAL_INT64(11960000, power_mW(snapshot, 0, 1));
    TEST_ASSERT_LESS_OR_EQUAL_INT64(11960000, power_mW(snapshot, 2, 3));
    for (uint8_t i = 0; i < 4; i++) {
        const int32_t current_mA = setpoints.current_mA[i];
        const taper_demand_t *demand = &snapshot->demand[i];
        TEST_ASSERT_TRUE(current_mA == 0 || demand->active);
        TEST_ASSERT_TRUE(current_mA == 0 || current_mA >= demand->min_mA);
        TEST_ASSERT_GREATER_OR_EQUAL_INT32(0, current_mA);
        TEST_ASSERT_LESS_OR_EQUAL_INT32(demand->max_mA, current_mA);
        TEST_ASSERT_EQUAL_INT32(0, current_mA % TAPER_CURRENT_STEP_mA);
    }
}

static void test_limits_hold_under_a_hundred_thousand_hostile_proposals(void) {
    uint32_t state = 0x5ee2;
    uint32_t with_current = 0;
    taper_snapshot_t snapshot = scene_snapshot(0, 4);
    taper_proposal_t proposal = scene_proposal(0);
    for (uint32_t round = 0; round < 100000; round++) {
        snapshot.now_ms += scene_random(&state) % 200000; /* wraps on the way */
        make_hostile(&proposal, &state);
        vary_demands(&snapshot, &state);
        const int32_t site_limit_W = hostile(&state);
        allocate(scene_four(), &snapshot, &proposal, site_limit_W);
        assert_limits_hold(&snapshot, site_limit_W);
        const taper_supply_t supply = taper_supply_of_W(site_limit_W);
        TEST_ASSERT_TRUE(taper_guard_passes(scene_four(), &snapshot, &supply, &setpoints));
        with_current += power_mW(&snapshot, 0, 3) > 0 ? 1 : 0;
    }
    TEST_ASSERT_GREATER_THAN_UINT32(
        30000, with_current); /* an allocator that gives nothing is not safe, it is off */
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_a_wish_within_all_limits_is_granted_rounded_down);
    RUN_TEST(test_no_connector_exceeds_its_own_limit);
    RUN_TEST(test_a_feeder_limit_binds_its_own_connectors_only);
    RUN_TEST(test_the_rank_decides_who_gets_more_than_the_minimum);
    RUN_TEST(test_all_wishes_come_before_any_ceiling);
    RUN_TEST(test_a_negative_wish_is_no_wish);
    RUN_TEST(test_a_wish_below_the_minimum_waits_until_it_is_owed_or_room_is_left_over);
    RUN_TEST(test_what_is_left_over_goes_up_to_the_ceilings);
    RUN_TEST(test_rounding_wastes_less_than_one_step_in_all);
    RUN_TEST(test_below_its_minimum_a_connector_gets_nothing);
    RUN_TEST(test_without_a_minimum_currents_are_continuous);
    RUN_TEST(test_a_connector_stays_on_for_its_minimum_on_time);
    RUN_TEST(test_a_limit_ends_the_minimum_on_time);
    RUN_TEST(test_a_connector_stays_off_for_its_minimum_off_time);
    RUN_TEST(test_the_next_vehicle_does_not_inherit_the_off_time);
    RUN_TEST(test_a_negative_site_limit_counts_as_zero);
    RUN_TEST(test_idle_connectors_get_nothing_whatever_is_proposed);
    RUN_TEST(test_limits_hold_under_a_hundred_thousand_hostile_proposals);
    return UNITY_END();
}
