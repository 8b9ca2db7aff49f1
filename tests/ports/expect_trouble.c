/* Bus-off, the watchdog, and what a port says it does not have. */
#include "expect.h"

static void test_the_port_has_what_it_should_and_says_so_by_its_callbacks(void) {
    const taper_port_t *port = rig.port;
    TEST_ASSERT_NOT_NULL(port->receive);
    TEST_ASSERT_NOT_NULL(port->send);
    TEST_ASSERT_EQUAL(rig.has.kick_watchdog, port->kick_watchdog != NULL);
    TEST_ASSERT_EQUAL(rig.has.clock_us, port->clock_us != NULL);
    TEST_ASSERT_EQUAL(rig.has.bus_is_off, port->bus_is_off != NULL);
    TEST_ASSERT_EQUAL(rig.has.bus_is_off, port->restart_bus != NULL);
    TEST_ASSERT_EQUAL(rig.has.receive_overflows, port->receive_overflows != NULL);
    TEST_ASSERT_EQUAL(rig.has.store, port->store_read != NULL);
    TEST_ASSERT_EQUAL(rig.has.store, port->store_write != NULL);
}

static void test_the_watchdog_can_be_kicked_at_any_time(void) {
    for (unsigned n = 0; n < 100 && rig.port->kick_watchdog != NULL; n++) {
        rig.port->kick_watchdog(rig.port->context);
    }
    const taper_frame_t frame = expect_numbered(1);
    expect_say(&frame);
    (void)expect_received();
}

static bool is_off(void) {
    rig.settle();
    return rig.port->bus_is_off != NULL && rig.port->bus_is_off(rig.port->context, 0);
}

static void test_a_bus_is_on_at_the_start_and_a_restart_does_it_no_harm(void) {
    const taper_frame_t frame = expect_numbered(1);
    TEST_ASSERT_FALSE(is_off());
    if (rig.port->restart_bus != NULL) {
        rig.port->restart_bus(rig.port->context, 0);
    }
    TEST_ASSERT_FALSE(is_off());
    TEST_ASSERT_TRUE(expect_send(&frame));
    (void)expect_heard();
}

static void test_off_the_bus_all_is_refused_until_a_restart_and_nothing_of_it_leaves_later(void) {
    const taper_frame_t refused = expect_numbered(1);
    const taper_frame_t taken = expect_numbered(2);
    TEST_ASSERT_EQUAL(rig.has.bus_is_off, rig.bus_off != NULL);
    if (rig.bus_off == NULL) {
        TEST_ASSERT_NULL(rig.port->bus_is_off); /* such a bus never is off */
        return;
    }
    rig.bus_off();
    TEST_ASSERT_TRUE(is_off());
    TEST_ASSERT_FALSE(expect_send(&refused));
    rig.port->restart_bus(rig.port->context, 0);
    TEST_ASSERT_FALSE(is_off());
    TEST_ASSERT_TRUE(expect_send(&taken));
    const taper_frame_t heard = expect_heard();
    TEST_ASSERT_EQUAL_UINT32(2, expect_number_of(&heard));
    expect_nothing_heard();
}

static void test_after_a_restart_nothing_old_is_received_and_what_comes_is(void) {
    taper_frame_t frame = expect_numbered(1);
    expect_say(&frame);
    rig.restart();
    expect_nothing_received();
    frame = expect_numbered(2);
    expect_say(&frame);
    frame = expect_received();
    TEST_ASSERT_EQUAL_UINT32(2, expect_number_of(&frame));
}

void expect_trouble(void) {
    RUN_TEST(test_the_port_has_what_it_should_and_says_so_by_its_callbacks);
    RUN_TEST(test_the_watchdog_can_be_kicked_at_any_time);
    RUN_TEST(test_a_bus_is_on_at_the_start_and_a_restart_does_it_no_harm);
    RUN_TEST(test_off_the_bus_all_is_refused_until_a_restart_and_nothing_of_it_leaves_later);
    RUN_TEST(test_after_a_restart_nothing_old_is_received_and_what_comes_is);
}
