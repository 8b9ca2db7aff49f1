/* What can be learned about a controller from its frames. */
#include <string.h>

#include "taper/codec.h"
#include "taper/e2e.h"
#include "taper/planner.h"
#include "unity.h"
#include "watch.h"

static sim_watch_t watch;
static uint8_t counter;

void setUp(void) {
    counter = 0;
}

void tearDown(void) {
    sim_watch_free(&watch);
}

static taper_frame_t frame_of(const taper_message_t *message) {
    taper_frame_t frame;
    TEST_ASSERT_TRUE(taper_encode(message, &frame));
    taper_e2e_protect(&frame, counter);
    counter = (uint8_t)((counter + 1) % 16);
    return frame;
}

static void take(const taper_message_t *message) {
    const taper_frame_t frame = frame_of(message);
    sim_watch_take(&watch, &frame);
}

static void take_status(taper_mode_t mode, taper_verdict_t verdict, uint8_t version, uint16_t iterations) {
    const taper_message_t message = {.kind = TAPER_MESSAGE_CTRL_STATUS,
                                     .as.ctrl_status = {.mode = (uint8_t)mode,
                                                        .verdict = (uint8_t)verdict,
                                                        .plan_version = version,
                                                        .iterations = iterations}};
    take(&message);
}

static void test_the_connectors_are_those_that_setpoints_go_to(void) {
    const taper_frame_t frames[] = {{.id = 0x0C1, .bus = 0},
                                    {.id = 0x0C2, .bus = 0},
                                    {.id = 0x0C1, .bus = 0},
                                    {.id = 0x0C1, .bus = 1},
                                    {.id = 0x0C0, .bus = 0},
                                    {.id = 0x101, .bus = 0},
                                    {.id = 0x0C5, .bus = SIM_WATCH_BUSES}};
    for (size_t i = 0; i < sizeof frames / sizeof frames[0]; i++) {
        sim_watch_take(&watch, &frames[i]);
    }
    TEST_ASSERT_EQUAL_UINT32(3, watch.connectors);
    TEST_ASSERT_TRUE(watch.told[0][1] && watch.told[0][2] && watch.told[1][1]);
}

static void test_plans_are_counted_from_the_first_report_on(void) {
    take_status(TAPER_MODE_PLAN, TAPER_VERDICT_SOLVED, 254, 100);
    TEST_ASSERT_EQUAL_UINT32(0, watch.plans);
    take_status(TAPER_MODE_PLAN, TAPER_VERDICT_SOLVED, 255, 60);
    take_status(TAPER_MODE_PLAN, TAPER_VERDICT_SOLVED, 255, 60);
    take_status(TAPER_MODE_PLAN, TAPER_VERDICT_SOLVING, 1,
                20); /* its iterations are those of the next plan */
    TEST_ASSERT_EQUAL_UINT32(3, watch.plans);
    TEST_ASSERT_EQUAL_UINT32(1, (uint32_t)watch.iterations.count);
    TEST_ASSERT_EQUAL_DOUBLE(60.0, watch.iterations.value[0]);
}

static void test_reports_without_the_planner_are_counted(void) {
    take_status(TAPER_MODE_INIT, TAPER_VERDICT_NONE, 0, 0);
    take_status(TAPER_MODE_FALLBACK, TAPER_VERDICT_NONE, 0, 0);
    take_status(TAPER_MODE_FAILSAFE, TAPER_VERDICT_NONE, 0, 0);
    take_status(TAPER_MODE_PLAN, TAPER_VERDICT_NONE, 0, 0);
    TEST_ASSERT_EQUAL_UINT32(2, watch.fallback_reports);
    TEST_ASSERT_EQUAL(TAPER_MODE_PLAN, watch.mode);
}

static void test_a_corrupt_report_says_nothing(void) {
    const taper_message_t message = {.kind = TAPER_MESSAGE_CTRL_STATUS,
                                     .as.ctrl_status = {.mode = TAPER_MODE_FAILSAFE}};
    taper_frame_t frame = frame_of(&message);
    frame.data[7] ^= 1;
    sim_watch_take(&watch, &frame);
    TEST_ASSERT_EQUAL(TAPER_MODE_INIT, watch.mode);
    TEST_ASSERT_EQUAL_UINT32(0, watch.fallback_reports);
}

static void test_the_guards_counter_is_read_and_no_other(void) {
    taper_message_t message = {.kind = TAPER_MESSAGE_CTRL_DIAG,
                               .as.ctrl_diag = {.index = TAPER_COUNTER_GUARD_VIOLATIONS, .value = 3}};
    take(&message);
    message.as.ctrl_diag = (taper_ctrl_diag_t){.index = TAPER_COUNTER_PLANS, .value = 99};
    take(&message);
    TEST_ASSERT_EQUAL_UINT32(3, watch.guard_violations);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_the_connectors_are_those_that_setpoints_go_to);
    RUN_TEST(test_plans_are_counted_from_the_first_report_on);
    RUN_TEST(test_reports_without_the_planner_are_counted);
    RUN_TEST(test_a_corrupt_report_says_nothing);
    RUN_TEST(test_the_guards_counter_is_read_and_no_other);
    return UNITY_END();
}
