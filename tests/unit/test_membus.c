/* The in-memory bus: order, refusal, independence of the directions. */
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
        .bus = 1,
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

static void test_a_full_queue_refuses_counts_and_keeps_what_it_has(void) {
    taper_frame_t frame;
    for (unsigned n = 0; n < TAPER_MEMBUS_DEPTH; n++) {
        const taper_frame_t sent = numbered(n);
        TEST_ASSERT_TRUE(port.send(port.context, &sent));
    }
    const taper_frame_t extra = numbered(0x555);
    TEST_ASSERT_FALSE(port.send(port.context, &extra));
    TEST_ASSERT_FALSE(port.send(port.context, &extra));
    TEST_ASSERT_EQUAL_UINT32(2, bus.to_world.refused);
    TEST_ASSERT_EQUAL_UINT32(0, bus.to_station.refused);

    for (unsigned n = 0; n < TAPER_MEMBUS_DEPTH; n++) {
        TEST_ASSERT_TRUE(taper_membus_world_receive(&bus, &frame));
        assert_is_numbered(n, &frame);
    }
    TEST_ASSERT_FALSE(taper_membus_world_receive(&bus, &frame));
    TEST_ASSERT_TRUE(port.send(port.context, &extra));
}

static void test_the_count_of_refusals_does_not_wrap(void) {
    const taper_frame_t frame = numbered(0);
    bus.to_station.head = TAPER_MEMBUS_DEPTH;
    bus.to_station.refused = UINT32_MAX;
    TEST_ASSERT_FALSE(taper_membus_world_send(&bus, &frame));
    TEST_ASSERT_EQUAL_UINT32(UINT32_MAX, bus.to_station.refused);
}

static void test_order_is_kept_where_the_indices_wrap(void) {
    taper_frame_t frame = numbered(0x555);
    bus.to_station.head = UINT32_MAX - 2;
    bus.to_station.tail = UINT32_MAX - 2;
    for (unsigned n = 0; n < TAPER_MEMBUS_DEPTH; n++) {
        const taper_frame_t sent = numbered(n);
        TEST_ASSERT_TRUE(taper_membus_world_send(&bus, &sent));
    }
    TEST_ASSERT_FALSE(taper_membus_world_send(&bus, &frame));
    for (unsigned n = 0; n < TAPER_MEMBUS_DEPTH; n++) {
        TEST_ASSERT_TRUE(port.receive(port.context, &frame));
        assert_is_numbered(n, &frame);
    }
    TEST_ASSERT_FALSE(port.receive(port.context, &frame));
}

static void test_init_empties_a_bus_that_was_in_use(void) {
    taper_frame_t frame = numbered(3);
    TEST_ASSERT_TRUE(port.send(port.context, &frame));
    TEST_ASSERT_TRUE(taper_membus_world_send(&bus, &frame));
    bus.to_world.refused = 9;
    taper_membus_init(&bus);
    TEST_ASSERT_FALSE(port.receive(port.context, &frame));
    TEST_ASSERT_FALSE(taper_membus_world_receive(&bus, &frame));
    TEST_ASSERT_EQUAL_UINT32(0, bus.to_world.refused);
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
    RUN_TEST(test_a_full_queue_refuses_counts_and_keeps_what_it_has);
    RUN_TEST(test_the_count_of_refusals_does_not_wrap);
    RUN_TEST(test_order_is_kept_where_the_indices_wrap);
    RUN_TEST(test_init_empties_a_bus_that_was_in_use);
    RUN_TEST(test_the_port_has_neither_watchdog_nor_clock);
    return UNITY_END();
}
