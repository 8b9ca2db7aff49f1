/* The in-memory bus: order, full queues, time stamps, bus-off, independence of the directions. */
#include "taper/membus.h"
#include "unity.h"

static taper_membus_t bus;
static taper_port_t port;

void setUp(void) {
    taper_membus_init(&bus);
    port = taper_membus_station_port(&bus);
}

void tearDown(void) {}

static taper_frame_t numbered(unsigned n) {
    const taper_frame_t frame = {
        .id = (uint16_t)(n & 0x7FFu),
        .bus = TAPER_MAX_BUSES - 1,
        .length = TAPER_FRAME_LENGTH,
        .data = {(uint8_t)n, (uint8_t)(n >> 8), 2, 3, 4, 5, 6, 7},
    };
    return frame;
}

static void assert_is_numbered(unsigned n, const taper_frame_t *frame) {
    const taper_frame_t expected = numbered(n);
    TEST_ASSERT_EQUAL_HEX16(expected.id, frame->id);
    TEST_ASSERT_EQUAL_UINT8(expected.bus, frame->bus);
    TEST_ASSERT_EQUAL_UINT8(expected.length, frame->length);
    TEST_ASSERT_EQUAL_HEX8_ARRAY(expected.data, frame->data, TAPER_FRAME_LENGTH);
}

static void test_a_new_bus_is_empty_both_ways(void) {
    taper_frame_t frame;
    TEST_ASSERT_FALSE(port.receive(port.context, &frame));
    TEST_ASSERT_FALSE(taper_membus_world_receive(&bus, &frame));
}

static void test_frames_arrive_in_order_with_all_their_fields(void) {
    taper_frame_t frame;
    for (unsigned n = 0; n < 5; n++) {
        const taper_frame_t sent = numbered(n);
        TEST_ASSERT_TRUE(taper_membus_world_send(&bus, &sent));
    }
    for (unsigned n = 0; n < 5; n++) {
        TEST_ASSERT_TRUE(port.receive(port.context, &frame));
        assert_is_numbered(n, &frame);
    }
    TEST_ASSERT_FALSE(port.receive(port.context, &frame));
}

static void test_the_two_directions_do_not_mix(void) {
    taper_frame_t frame;
    const taper_frame_t from_station = numbered(1);
    const taper_frame_t from_world = numbered(2);
    TEST_ASSERT_TRUE(port.send(port.context, &from_station));
    TEST_ASSERT_TRUE(taper_membus_world_send(&bus, &from_world));

    TEST_ASSERT_TRUE(port.receive(port.context, &frame));
    assert_is_numbered(2, &frame);
    TEST_ASSERT_FALSE(port.receive(port.context, &frame));
    TEST_ASSERT_TRUE(taper_membus_world_receive(&bus, &frame));
    assert_is_numbered(1, &frame);
    TEST_ASSERT_FALSE(taper_membus_world_receive(&bus, &frame));
}

static void test_a_full_queue_to_the_world_refuses_counts_and_keeps_what_it_has(void) {
    taper_frame_t frame;
    for (unsigned n = 0; n < TAPER_MEMBUS_DEPTH; n++) {
        const taper_frame_t sent = numbered(n);
        TEST_ASSERT_TRUE(port.send(port.context, &sent));
    }
    const taper_frame_t extra = numbered(0x555);
    TEST_ASSERT_FALSE(port.send(port.context, &extra));
    TEST_ASSERT_FALSE(port.send(port.context, &extra));
    TEST_ASSERT_EQUAL_UINT32(2, bus.to_world.overflows);
    TEST_ASSERT_EQUAL_UINT32(0, port.receive_overflows(port.context));

    for (unsigned n = 0; n < TAPER_MEMBUS_DEPTH; n++) {
        TEST_ASSERT_TRUE(taper_membus_world_receive(&bus, &frame));
        assert_is_numbered(n, &frame);
    }
    TEST_ASSERT_FALSE(taper_membus_world_receive(&bus, &frame));
    TEST_ASSERT_TRUE(port.send(port.context, &extra));
}

static void test_a_full_queue_to_the_station_drops_its_oldest_frames_and_counts_them(void) {
    taper_frame_t frame;
    for (unsigned n = 0; n < TAPER_MEMBUS_DEPTH + 3; n++) {
        const taper_frame_t sent = numbered(n);
        TEST_ASSERT_EQUAL(n < TAPER_MEMBUS_DEPTH, taper_membus_world_send(&bus, &sent));
    }
    TEST_ASSERT_EQUAL_UINT32(3, port.receive_overflows(port.context));
    TEST_ASSERT_EQUAL_UINT32(0, bus.to_world.overflows);
    for (unsigned n = 3; n < TAPER_MEMBUS_DEPTH + 3; n++) {
        TEST_ASSERT_TRUE(port.receive(port.context, &frame));
        assert_is_numbered(n, &frame);
    }
    TEST_ASSERT_FALSE(port.receive(port.context, &frame));
}

static void test_the_count_of_overflows_does_not_wrap(void) {
    const taper_frame_t frame = numbered(0);
    bus.to_station.head = TAPER_MEMBUS_DEPTH;
    bus.to_station.overflows = UINT32_MAX;
    TEST_ASSERT_FALSE(taper_membus_world_send(&bus, &frame));
    TEST_ASSERT_EQUAL_UINT32(UINT32_MAX, port.receive_overflows(port.context));
}

static void test_order_is_kept_where_the_indices_wrap(void) {
    taper_frame_t frame;
    bus.to_station.head = UINT32_MAX - 2;
    bus.to_station.tail = UINT32_MAX - 2;
    for (unsigned n = 0; n < TAPER_MEMBUS_DEPTH + 5; n++) {
        const taper_frame_t sent = numbered(n);
        (void)taper_membus_world_send(&bus, &sent);
    }
    for (unsigned n = 5; n < TAPER_MEMBUS_DEPTH + 5; n++) {
        TEST_ASSERT_TRUE(port.receive(port.context, &frame));
        assert_is_numbered(n, &frame);
    }
    TEST_ASSERT_FALSE(port.receive(port.context, &frame));
}

static void test_frames_keep_their_senders_time_until_the_bus_has_one(void) {
    taper_frame_t frame = numbered(1);
    frame.time_ms = 77;
    (void)taper_membus_world_send(&bus, &frame);
    taper_membus_set_time(&bus, UINT32_MAX);
    (void)taper_membus_world_send(&bus, &frame);
    taper_membus_set_time(&bus, 4);
    (void)taper_membus_world_send(&bus, &frame);

    const uint32_t expected_ms[] = {77, UINT32_MAX, 4};
    for (unsigned k = 0; k < 3; k++) {
        TEST_ASSERT_TRUE(port.receive(port.context, &frame));
        TEST_ASSERT_EQUAL_UINT32(expected_ms[k], frame.time_ms);
    }
}

static void test_a_bus_that_is_off_neither_sends_nor_hears_and_the_others_do(void) {
    taper_frame_t frame;
    taper_frame_t on_bus_0 = numbered(1);
    taper_frame_t on_bus_1 = numbered(2);
    on_bus_0.bus = 0;
    on_bus_1.bus = 1;
    taper_membus_bus_off(&bus, 0, 0);
    TEST_ASSERT_TRUE(port.bus_is_off(port.context, 0));
    TEST_ASSERT_FALSE(port.bus_is_off(port.context, 1));

    TEST_ASSERT_FALSE(port.send(port.context, &on_bus_0));
    TEST_ASSERT_EQUAL(TAPER_MAX_BUSES > 1, port.send(port.context, &on_bus_1));
    TEST_ASSERT_TRUE(taper_membus_world_send(&bus, &on_bus_0));
    TEST_ASSERT_TRUE(taper_membus_world_send(&bus, &on_bus_1));
    TEST_ASSERT_EQUAL_UINT32(1, bus.controller[0].lost);

    TEST_ASSERT_TRUE(port.receive(port.context, &frame));
    TEST_ASSERT_EQUAL_HEX16(on_bus_1.id, frame.id);
    TEST_ASSERT_FALSE(port.receive(port.context, &frame));
    taper_membus_bus_on(&bus, 0);
    TEST_ASSERT_FALSE(port.bus_is_off(port.context, 0));
    TEST_ASSERT_TRUE(port.send(port.context, &on_bus_0));
}

static void test_a_bus_comes_back_with_the_restart_that_it_needs(void) {
    taper_membus_bus_off(&bus, 0, 3);
    for (unsigned request = 1; request <= 3; request++) {
        TEST_ASSERT_TRUE(port.bus_is_off(port.context, 0));
        port.restart_bus(port.context, 0);
    }
    TEST_ASSERT_FALSE(port.bus_is_off(port.context, 0));
    TEST_ASSERT_EQUAL_UINT32(3, bus.controller[0].restart_requests);
}

static void test_a_bus_that_waits_to_be_told_counts_restarts_and_stays_off(void) {
    taper_membus_bus_off(&bus, 0, 0);
    port.restart_bus(port.context, 0);
    port.restart_bus(port.context, 0);
    TEST_ASSERT_TRUE(port.bus_is_off(port.context, 0));
    TEST_ASSERT_EQUAL_UINT32(2, bus.controller[0].restart_requests);
}

static void test_a_bus_that_does_not_exist_is_never_off(void) {
    taper_membus_bus_off(&bus, UINT8_MAX, 0);
    port.restart_bus(port.context, UINT8_MAX);
    taper_membus_bus_on(&bus, UINT8_MAX);
    TEST_ASSERT_FALSE(port.bus_is_off(port.context, UINT8_MAX));
}

static void test_a_power_cycle_empties_the_queues_and_keeps_what_was_counted(void) {
    taper_frame_t frame = numbered(3);
    TEST_ASSERT_TRUE(port.send(port.context, &frame));
    TEST_ASSERT_TRUE(taper_membus_world_send(&bus, &frame));
    bus.to_station.overflows = 9;
    taper_membus_power_cycle(&bus);
    TEST_ASSERT_FALSE(port.receive(port.context, &frame));
    TEST_ASSERT_FALSE(taper_membus_world_receive(&bus, &frame));
    TEST_ASSERT_EQUAL_UINT32(9, port.receive_overflows(port.context));
}

static void test_init_empties_a_bus_that_was_in_use(void) {
    taper_frame_t frame = numbered(3);
    TEST_ASSERT_TRUE(port.send(port.context, &frame));
    TEST_ASSERT_TRUE(taper_membus_world_send(&bus, &frame));
    bus.to_world.overflows = 9;
    taper_membus_bus_off(&bus, 0, 0);
    taper_membus_init(&bus);
    TEST_ASSERT_FALSE(port.receive(port.context, &frame));
    TEST_ASSERT_FALSE(taper_membus_world_receive(&bus, &frame));
    TEST_ASSERT_EQUAL_UINT32(0, bus.to_world.overflows);
    TEST_ASSERT_FALSE(port.bus_is_off(port.context, 0));
}

static void test_the_worlds_port_is_the_other_end_and_takes_every_frame(void) {
    const taper_port_t world = taper_membus_world_port(&bus);
    const taper_frame_t sent = numbered(7);
    taper_frame_t frame;
    TEST_ASSERT_TRUE(port.send(port.context, &sent));
    TEST_ASSERT_TRUE(world.receive(world.context, &frame));
    assert_is_numbered(7, &frame);
    for (unsigned n = 0; n <= TAPER_MEMBUS_DEPTH; n++) {
        const taper_frame_t one = numbered(n);
        TEST_ASSERT_TRUE(world.send(world.context, &one));
    }
    TEST_ASSERT_EQUAL_UINT32(1, bus.to_station.overflows);
    TEST_ASSERT_TRUE(port.receive(port.context, &frame));
    assert_is_numbered(1, &frame);
}

static void test_the_port_has_neither_watchdog_nor_clock(void) {
    TEST_ASSERT_TRUE(port.kick_watchdog == NULL);
    TEST_ASSERT_TRUE(port.clock_us == NULL);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_a_new_bus_is_empty_both_ways);
    RUN_TEST(test_frames_arrive_in_order_with_all_their_fields);
    RUN_TEST(test_the_two_directions_do_not_mix);
    RUN_TEST(test_a_full_queue_to_the_world_refuses_counts_and_keeps_what_it_has);
    RUN_TEST(test_a_full_queue_to_the_station_drops_its_oldest_frames_and_counts_them);
    RUN_TEST(test_the_count_of_overflows_does_not_wrap);
    RUN_TEST(test_order_is_kept_where_the_indices_wrap);
    RUN_TEST(test_frames_keep_their_senders_time_until_the_bus_has_one);
    RUN_TEST(test_a_bus_that_is_off_neither_sends_nor_hears_and_the_others_do);
    RUN_TEST(test_a_bus_comes_back_with_the_restart_that_it_needs);
    RUN_TEST(test_a_bus_that_waits_to_be_told_counts_restarts_and_stays_off);
    RUN_TEST(test_a_bus_that_does_not_exist_is_never_off);
    RUN_TEST(test_a_power_cycle_empties_the_queues_and_keeps_what_was_counted);
    RUN_TEST(test_init_empties_a_bus_that_was_in_use);
    RUN_TEST(test_the_worlds_port_is_the_other_end_and_takes_every_frame);
    RUN_TEST(test_the_port_has_neither_watchdog_nor_clock);
    return UNITY_END();
}
