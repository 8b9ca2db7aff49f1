/* What the allocator keeps free for silent connectors, and for phases that are not known. */
#include <string.h>

#include "scene.h"
#include "taper/allocator.h"
#include "taper/rows.h"
#include "unity.h"

static taper_allocator_t allocator;
static taper_snapshot_t snapshot;
static taper_setpoints_t setpoints;
static const taper_supply_t built = {.site_W = 25000,
                                     .phase_mA = {TAPER_NO_LIMIT, TAPER_NO_LIMIT, TAPER_NO_LIMIT}};
static int32_t reserved_mA[TAPER_MAX_CONNECTORS];

void setUp(void) {
    taper_allocator_init(&allocator);
    snapshot = scene_snapshot(0, 4);
    memset(reserved_mA, 0, sizeof reserved_mA);
}
void tearDown(void) {}

static void allocate(int32_t wish_W, int32_t site_limit_W) {
    const taper_supply_t supply = taper_supply_of_W(site_limit_W);
    const taper_proposal_t proposal = scene_proposal(wish_W);
    taper_allocate(&allocator, scene_four(), &snapshot, &proposal,
                   scene_rows(scene_four(), &snapshot, &supply), reserved_mA, &setpoints);
    TEST_ASSERT_TRUE(taper_guard_passes(scene_four(), &snapshot, &supply, &setpoints));
}

static void test_what_a_silent_connector_may_draw_is_kept_free_for_it(void) {
    snapshot.demand[0] = (taper_demand_t){0};
    reserved_mA[0] = 32000;
    allocate(7360, 25000);
    TEST_ASSERT_EQUAL_INT32(0, setpoints.current_mA[0]);
    TEST_ASSERT_EQUAL_INT32(20000, setpoints.current_mA[1]); /* of the 52 A of its feeder */
    TEST_ASSERT_EQUAL_INT32(32000, setpoints.current_mA[2]); /* of another feeder */
}

static void test_a_reservation_above_the_limit_leaves_nothing_and_nobody_is_switched_on(void) {
    snapshot.demand[0] = (taper_demand_t){0};
    reserved_mA[0] = 32000;
    allocate(7360, 7000);
    for (uint8_t i = 0; i < 4; i++) {
        TEST_ASSERT_EQUAL_INT32(0, setpoints.current_mA[i]);
    }
}

static void test_what_a_connector_draws_anyway_pays_for_its_own_setpoint(void) {
    snapshot.demand[1].active = false;
    reserved_mA[0] = 10000;
    allocate(7360, 25000);
    TEST_ASSERT_EQUAL_INT32(32000, setpoints.current_mA[0]);
    snapshot.demand[1].active = true;
    allocate(7360, 25000); /* 52 A on the feeder: 32 and 20, as if nothing were reserved */
    TEST_ASSERT_EQUAL_INT32(32000, setpoints.current_mA[0]);
    TEST_ASSERT_EQUAL_INT32(20000, setpoints.current_mA[1]);
    reserved_mA[1] = 25000; /* more than it is given: 27 A are left for the other */
    allocate(7360, 25000);
    TEST_ASSERT_EQUAL_INT32(27000, setpoints.current_mA[0]);
    TEST_ASSERT_EQUAL_INT32(25000, setpoints.current_mA[1]);
}

static void test_a_reservation_pays_for_nothing_where_the_limit_is_exceeded(void) {
    reserved_mA[0] = 32000;
    allocate(7360, 7000); /* 7360 W flow; no setpoint makes them legal */
    TEST_ASSERT_EQUAL_INT32(0, setpoints.current_mA[0]);
}

static void test_when_the_reservation_ends_the_others_get_it(void) {
    snapshot.demand[0] = (taper_demand_t){0};
    reserved_mA[0] = 32000;
    allocate(7360, 25000);
    reserved_mA[0] = 0;
    allocate(7360, 25000);
    TEST_ASSERT_EQUAL_INT32(32000, setpoints.current_mA[1]);
}

static void test_phases_that_are_not_known_are_booked_three_times(void) {
    snapshot.demand[0].booking.W_per_A = 690;
    allocate(7360, 25000);
    TEST_ASSERT_EQUAL_INT32(15300, setpoints.current_mA[0]); /* 10 557 W of the feeder's 11 960 W */
    TEST_ASSERT_EQUAL_INT32(6100, setpoints.current_mA[1]);  /* its minimum, and a step left over */
    TEST_ASSERT_EQUAL_INT32(32000, setpoints.current_mA[2]);
}

static void test_nothing_booked_is_booked_as_drawn(void) {
    snapshot.demand[0].booking.W_per_A = 0;
    TEST_ASSERT_EQUAL_INT32(230, taper_booking_now(scene_four(), &snapshot, 0).W_per_A);
    snapshot.demand[0].booking.W_per_A = 100; /* less than it draws cannot be meant */
    TEST_ASSERT_EQUAL_INT32(230, taper_booking_now(scene_four(), &snapshot, 0).W_per_A);
}

static void test_the_guard_counts_phases_that_are_not_known(void) {
    snapshot.demand[0].booking.W_per_A = 690;
    memset(&setpoints, 0, sizeof setpoints);
    setpoints.current_mA[0] = 17300;
    TEST_ASSERT_TRUE(taper_guard_passes(scene_four(), &snapshot, &built, &setpoints));
    setpoints.current_mA[0] = 17400;
    TEST_ASSERT_FALSE(taper_guard_passes(scene_four(), &snapshot, &built, &setpoints));
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_what_a_silent_connector_may_draw_is_kept_free_for_it);
    RUN_TEST(test_a_reservation_above_the_limit_leaves_nothing_and_nobody_is_switched_on);
    RUN_TEST(test_what_a_connector_draws_anyway_pays_for_its_own_setpoint);
    RUN_TEST(test_a_reservation_pays_for_nothing_where_the_limit_is_exceeded);
    RUN_TEST(test_when_the_reservation_ends_the_others_get_it);
    RUN_TEST(test_phases_that_are_not_known_are_booked_three_times);
    RUN_TEST(test_nothing_booked_is_booked_as_drawn);
    RUN_TEST(test_the_guard_counts_phases_that_are_not_known);
    return UNITY_END();
}
