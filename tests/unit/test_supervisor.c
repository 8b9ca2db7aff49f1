#include "taper/supervisor.h"
#include "unity.h"

static taper_supervisor_t supervisor;

void setUp(void) {
    taper_supervisor_init(&supervisor);
}
void tearDown(void) {}

static taper_mode_t update(bool alive, bool heard, bool ready, uint32_t now_ms) {
    const taper_situation_t situation = {
        .gateway_alive = alive, .gateway_heard = heard, .proposal_ready = ready};
    return taper_supervisor_update(&supervisor, &situation, now_ms);
}

static void test_it_waits_for_the_first_limit(void) {
    TEST_ASSERT_EQUAL(TAPER_MODE_INIT, update(false, false, true, 5000));
    TEST_ASSERT_EQUAL(TAPER_MODE_INIT, update(false, false, true, 14999));
    TEST_ASSERT_EQUAL(TAPER_MODE_PLAN, update(true, true, true, 15000));
}

static void test_a_gateway_that_never_speaks_ends_the_wait_in_failsafe(void) {
    TEST_ASSERT_EQUAL(TAPER_MODE_INIT, update(false, false, true, 5000));
    TEST_ASSERT_EQUAL(TAPER_MODE_FAILSAFE, update(false, false, true, 15000));
    TEST_ASSERT_EQUAL(TAPER_MODE_PLAN, update(true, true, true, 16000));
}

static void test_the_wait_survives_the_wrap_of_the_clock(void) {
    TEST_ASSERT_EQUAL(TAPER_MODE_INIT, update(false, false, true, UINT32_MAX - 4000));
    TEST_ASSERT_EQUAL(TAPER_MODE_INIT, update(false, false, true, 5998));
    TEST_ASSERT_EQUAL(TAPER_MODE_FAILSAFE, update(false, false, true, 5999));
}

static void test_it_falls_back_without_a_proposal_and_recovers(void) {
    TEST_ASSERT_EQUAL(TAPER_MODE_FALLBACK, update(true, true, false, 0));
    TEST_ASSERT_EQUAL(TAPER_MODE_PLAN, update(true, true, true, 1000));
    TEST_ASSERT_EQUAL(TAPER_MODE_FALLBACK, update(true, true, false, 2000));
}

static void test_a_silent_gateway_outranks_a_missing_plan(void) {
    TEST_ASSERT_EQUAL(TAPER_MODE_PLAN, update(true, true, true, 0));
    TEST_ASSERT_EQUAL(TAPER_MODE_FAILSAFE, update(false, true, false, 1000));
    TEST_ASSERT_EQUAL(TAPER_MODE_FALLBACK, update(true, true, false, 2000));
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_it_waits_for_the_first_limit);
    RUN_TEST(test_a_gateway_that_never_speaks_ends_the_wait_in_failsafe);
    RUN_TEST(test_the_wait_survives_the_wrap_of_the_clock);
    RUN_TEST(test_it_falls_back_without_a_proposal_and_recovers);
    RUN_TEST(test_a_silent_gateway_outranks_a_missing_plan);
    return UNITY_END();
}
