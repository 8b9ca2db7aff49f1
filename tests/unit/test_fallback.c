#include "scene.h"
#include "taper/fallback.h"
#include "unity.h"

void setUp(void) {}
void tearDown(void) {}

static void assert_rank(const uint8_t *expected, const taper_proposal_t *proposal) {
    TEST_ASSERT_EQUAL_UINT8_ARRAY(expected, proposal->rank, 4);
}

static void test_edf_serves_the_earliest_departure_first(void) {
    taper_snapshot_t snapshot = scene_snapshot(0, 4);
    const int32_t departs_in_s[] = {4000, 1000, 3000, 2000};
    for (uint8_t i = 0; i < 4; i++) {
        snapshot.demand[i].departs_in_s = departs_in_s[i];
    }
    taper_proposal_t proposal;
    taper_propose_edf(&snapshot, 1000, &proposal);
    assert_rank((const uint8_t[]){1, 3, 2, 0}, &proposal);
}

static void test_edf_gives_ties_to_the_lower_connector(void) {
    const taper_snapshot_t snapshot = scene_snapshot(0, 4);
    taper_proposal_t proposal;
    taper_propose_edf(&snapshot, 1000, &proposal);
    assert_rank((const uint8_t[]){0, 1, 2, 3}, &proposal);
}

static void test_a_departure_that_has_passed_comes_first(void) {
    taper_snapshot_t snapshot = scene_snapshot(0, 4);
    snapshot.demand[2].departs_in_s = -60;
    taper_proposal_t proposal;
    taper_propose_edf(&snapshot, 1000, &proposal);
    TEST_ASSERT_EQUAL_UINT8(2, proposal.rank[0]);
}

static void test_idle_connectors_stand_last_and_wish_nothing(void) {
    taper_snapshot_t snapshot = scene_snapshot(0, 4);
    snapshot.demand[0].active = false;
    taper_proposal_t proposal;
    taper_propose_edf(&snapshot, 1000, &proposal);
    TEST_ASSERT_EQUAL_UINT8(0, proposal.rank[3]);
    TEST_ASSERT_EQUAL_INT32(0, proposal.wish_W[0]);
    TEST_ASSERT_EQUAL_INT32(7360, proposal.wish_W[1]);
}

static void test_wishes_are_clamped_to_the_taper(void) {
    taper_snapshot_t snapshot = scene_snapshot(0, 1);
    snapshot.demand[0].taper_W = 6000;
    taper_proposal_t proposal;
    taper_propose_edf(&snapshot, 1000, &proposal);
    TEST_ASSERT_EQUAL_INT32(4360, proposal.wish_W[0]);
    TEST_ASSERT_EQUAL_INT32(4360, proposal.ceiling_W[0]);
}

static void test_llf_prefers_the_vehicle_with_the_least_time_to_spare(void) {
    taper_snapshot_t snapshot = scene_snapshot(0, 2);
    snapshot.demand[0].departs_in_s = 7200;  /* needs 10 kWh: 4891 s; spare 2309 s */
    snapshot.demand[1].departs_in_s = 10000; /* needs 18 kWh: 8804 s; spare 1196 s */
    snapshot.demand[1].need_Wh = 18000;
    taper_proposal_t proposal;
    taper_propose_llf(&snapshot, 1000, &proposal);
    TEST_ASSERT_EQUAL_UINT8(1, proposal.rank[0]);
    taper_propose_edf(&snapshot, 1000, &proposal);
    TEST_ASSERT_EQUAL_UINT8(0, proposal.rank[0]);
}

static void test_llf_counts_the_taper(void) {
    taper_snapshot_t snapshot = scene_snapshot(0, 2);
    snapshot.demand[1].taper_W = 7000; /* at half charge it takes 3860 W: slower, so more urgent */
    taper_proposal_t proposal;
    taper_propose_llf(&snapshot, 1000, &proposal);
    TEST_ASSERT_EQUAL_UINT8(1, proposal.rank[0]);
}

static void test_llf_ranks_all_whatever_was_ranked_before(void) {
    taper_snapshot_t snapshot = scene_snapshot(0, 4);
    taper_proposal_t proposal;
    for (int turn = 0; turn < 2; turn++) {
        for (uint8_t i = 0; i < 4; i++) {
            snapshot.demand[i].departs_in_s = turn == 0 ? 50000 - 1000 * i : 50000 + 1000 * i;
        }
        taper_propose_llf(&snapshot, 1000, &proposal);
        const uint8_t falling[] = {3, 2, 1, 0};
        const uint8_t rising[] = {0, 1, 2, 3};
        assert_rank(turn == 0 ? falling : rising, &proposal);
    }
}

static void test_llf_puts_a_vehicle_that_cannot_charge_last(void) {
    taper_snapshot_t snapshot = scene_snapshot(0, 2);
    snapshot.demand[0].peak_W = 0;
    taper_proposal_t proposal;
    taper_propose_llf(&snapshot, 1000, &proposal);
    TEST_ASSERT_EQUAL_UINT8(1, proposal.rank[0]);
}

static void test_llf_wishes_for_all_that_is_useful_as_well(void) {
    taper_snapshot_t snapshot = scene_snapshot(0, 3);
    taper_proposal_t proposal = scene_proposal(77);
    snapshot.demand[1].taper_W = 6000;
    taper_propose_llf(&snapshot, 1000, &proposal);
    const int32_t useful_W[] = {7360, 4360, 7360, 0};
    TEST_ASSERT_EQUAL_INT32_ARRAY(useful_W, proposal.wish_W, 4);
    TEST_ASSERT_EQUAL_INT32_ARRAY(useful_W, proposal.ceiling_W, 4);
}

static void test_nothing_is_written_beyond_the_connectors_of_the_snapshot(void) {
    taper_snapshot_t snapshot = scene_snapshot(0, 4);
    taper_proposal_t proposal;
    proposal.wish_W[3] = proposal.ceiling_W[3] = 4711;
    proposal.rank[3] = 99;
    snapshot.count = 3;
    taper_propose_edf(&snapshot, 1000, &proposal);
    TEST_ASSERT_EQUAL_INT32(4711, proposal.wish_W[3]);
    TEST_ASSERT_EQUAL_INT32(4711, proposal.ceiling_W[3]);
    TEST_ASSERT_EQUAL_UINT8(99, proposal.rank[3]);
}

static void test_a_laxity_is_exact_to_the_second(void) {
    taper_snapshot_t snapshot = scene_snapshot(0, 2);
    snapshot.demand[0].need_Wh = 73600; /* ten hours at 7360 W: ten seconds to spare */
    snapshot.demand[0].departs_in_s = 36010;
    snapshot.demand[1].need_Wh = 7360; /* one hour, five seconds to spare */
    snapshot.demand[1].departs_in_s = 3605;
    taper_proposal_t proposal;
    taper_propose_llf(&snapshot, 1000, &proposal);
    TEST_ASSERT_EQUAL_UINT8(1, proposal.rank[0]);
}

static void test_a_vehicle_that_takes_a_single_watt_can_charge(void) {
    taper_snapshot_t snapshot = scene_snapshot(0, 2);
    snapshot.demand[1].peak_W = 1; /* years late */
    taper_proposal_t proposal;
    taper_propose_llf(&snapshot, 1000, &proposal);
    TEST_ASSERT_EQUAL_UINT8(1, proposal.rank[0]);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_edf_serves_the_earliest_departure_first);
    RUN_TEST(test_edf_gives_ties_to_the_lower_connector);
    RUN_TEST(test_a_departure_that_has_passed_comes_first);
    RUN_TEST(test_idle_connectors_stand_last_and_wish_nothing);
    RUN_TEST(test_wishes_are_clamped_to_the_taper);
    RUN_TEST(test_llf_prefers_the_vehicle_with_the_least_time_to_spare);
    RUN_TEST(test_llf_counts_the_taper);
    RUN_TEST(test_llf_ranks_all_whatever_was_ranked_before);
    RUN_TEST(test_llf_puts_a_vehicle_that_cannot_charge_last);
    RUN_TEST(test_llf_wishes_for_all_that_is_useful_as_well);
    RUN_TEST(test_nothing_is_written_beyond_the_connectors_of_the_snapshot);
    RUN_TEST(test_a_laxity_is_exact_to_the_second);
    RUN_TEST(test_a_vehicle_that_takes_a_single_watt_can_charge);
    return UNITY_END();
}
