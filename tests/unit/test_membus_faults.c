/* The in-memory bus's faults: each kind alone, its filter, its count, and that the seed decides everything. */
#include <string.h>

#include "taper/membus_faults.h"
#include "unity.h"

#define ALWAYS 1000

static taper_membus_t bus;
static taper_port_t port;
static taper_membus_injector_t injector;

void setUp(void) {
    taper_membus_init(&bus);
    port = taper_membus_station_port(&bus);
}

void tearDown(void) {}

static void inject(const taper_membus_faults_t *faults) {
    taper_membus_inject(&bus, &bus.to_station, &injector, faults);
}

static taper_frame_t numbered(uint16_t id, uint8_t number) {
    const taper_frame_t frame = {
        .id = id, .length = TAPER_FRAME_LENGTH, .data = {number, 1, 2, 3, 4, 5, 6, 7}};
    return frame;
}

static void send(uint16_t id, uint8_t number) {
    const taper_frame_t frame = numbered(id, number);
    (void)taper_membus_world_send(&bus, &frame);
}

/** The numbers of the frames at the station, as text: "023". */
static const char *arrived(void) {
    static char numbers[64];
    size_t count = 0;
    taper_frame_t frame;
    while (count + 1 < sizeof numbers && port.receive(port.context, &frame)) {
        numbers[count++] = (char)('0' + frame.data[0]);
    }
    numbers[count] = '\0';
    return numbers;
}

static uint32_t count_arrived(void) {
    uint32_t count = 0;
    for (taper_frame_t frame; port.receive(port.context, &frame); count++) {
    }
    return count;
}

static unsigned bits_of(unsigned value) {
    unsigned bits = 0;
    for (; value != 0; value >>= 1) {
        bits += value & 1u;
    }
    return bits;
}

static unsigned bits_changed(const taper_frame_t *sent, const taper_frame_t *received) {
    unsigned bits = 0;
    for (unsigned i = 0; i < TAPER_FRAME_LENGTH; i++) {
        bits += bits_of((unsigned)(sent->data[i] ^ received->data[i]));
    }
    return bits;
}

static void test_no_faults_change_nothing(void) {
    const taper_membus_faults_t faults = {.seed = 1};
    inject(&faults);
    for (uint8_t n = 0; n < 5; n++) {
        send(0x101, n);
    }
    TEST_ASSERT_EQUAL_STRING("01234", arrived());
    TEST_ASSERT_EQUAL_UINT32(5, injector.counts.matched);
}

static void test_dropped_frames_do_not_arrive(void) {
    const taper_membus_faults_t faults = {.drop_permille = ALWAYS};
    inject(&faults);
    send(0x101, 1);
    TEST_ASSERT_EQUAL_STRING("", arrived());
    TEST_ASSERT_EQUAL_UINT32(1, injector.counts.dropped);
}

static void test_a_probability_is_kept_to(void) {
    const taper_membus_faults_t faults = {.seed = 5, .drop_permille = 100};
    inject(&faults);
    for (unsigned k = 0; k < 10; k++) {
        for (unsigned n = 0; n < 1000; n++) {
            send(0x101, 0);
        }
        (void)count_arrived();
    }
    TEST_ASSERT_UINT32_WITHIN(100, 1000, injector.counts.dropped);
}

static void test_repeated_frames_arrive_twice_in_a_row(void) {
    const taper_membus_faults_t faults = {.repeat_permille = ALWAYS};
    inject(&faults);
    send(0x101, 1);
    send(0x101, 2);
    TEST_ASSERT_EQUAL_STRING("1122", arrived());
    TEST_ASSERT_EQUAL_UINT32(2, injector.counts.repeated);
}

static void test_a_filter_on_a_node_hits_all_its_functions_and_no_other_node(void) {
    const taper_membus_faults_t faults = {.id = 2, .mask = TAPER_MEMBUS_MASK_NODE, .drop_permille = ALWAYS};
    inject(&faults);
    send(0x101, 1);
    send(0x102, 2);
    send(0x142, 3);
    send(0x143, 4);
    TEST_ASSERT_EQUAL_STRING("14", arrived());
    TEST_ASSERT_EQUAL_UINT32(2, injector.counts.matched);
}

static void test_a_filter_on_a_function_hits_all_its_nodes_and_no_other_function(void) {
    const taper_membus_faults_t faults = {
        .id = 0x100, .mask = TAPER_MEMBUS_MASK_FUNCTION, .drop_permille = ALWAYS};
    inject(&faults);
    send(0x101, 1);
    send(0x102, 2);
    send(0x142, 3);
    TEST_ASSERT_EQUAL_STRING("3", arrived());
}

static void test_frames_delayed_by_time_arrive_when_it_is_over_with_the_time_of_then(void) {
    const taper_membus_faults_t faults = {
        .id = 0x101, .mask = TAPER_MEMBUS_MASK_ID, .delay_permille = ALWAYS, .delay_ms = 50};
    taper_frame_t frame;
    taper_membus_set_time(&bus, UINT32_MAX - 9);
    inject(&faults);
    send(0x101, 1);
    send(0x102, 2);
    taper_membus_set_time(&bus, 39);
    TEST_ASSERT_EQUAL_STRING("2", arrived());
    taper_membus_set_time(&bus, 40);
    TEST_ASSERT_TRUE(port.receive(port.context, &frame));
    TEST_ASSERT_EQUAL_UINT8(1, frame.data[0]);
    TEST_ASSERT_EQUAL_UINT32(40, frame.time_ms);
    TEST_ASSERT_EQUAL_UINT32(1, injector.counts.delayed);
}

static void test_frames_delayed_by_frames_arrive_after_so_many_others(void) {
    taper_membus_faults_t faults = {.delay_permille = ALWAYS, .delay_frames = 2};
    inject(&faults);
    send(0x101, 1);
    injector.faults.delay_permille = 0;
    for (uint8_t n = 2; n < 6; n++) {
        send(0x101, n);
    }
    TEST_ASSERT_EQUAL_STRING("23145", arrived());
}

static void test_what_cannot_be_held_back_arrives_at_once(void) {
    const taper_membus_faults_t faults = {.delay_permille = ALWAYS, .delay_ms = 50};
    inject(&faults);
    for (unsigned n = 0; n <= TAPER_MEMBUS_HELD; n++) {
        send(0x101, (uint8_t)(n % 10));
    }
    TEST_ASSERT_EQUAL_STRING("4", arrived());
    TEST_ASSERT_EQUAL_UINT32(TAPER_MEMBUS_HELD, injector.counts.delayed);
}

static void test_reordered_frames_change_places_in_pairs(void) {
    const taper_membus_faults_t faults = {.reorder_permille = ALWAYS};
    inject(&faults);
    for (uint8_t n = 0; n < 6; n++) {
        send(0x101, n);
    }
    TEST_ASSERT_EQUAL_STRING("103254", arrived());
    TEST_ASSERT_EQUAL_UINT32(3, injector.counts.reordered);
}

static void test_other_identifiers_do_not_end_a_reordering(void) {
    const taper_membus_faults_t faults = {
        .id = 0x101, .mask = TAPER_MEMBUS_MASK_ID, .reorder_permille = ALWAYS};
    inject(&faults);
    send(0x101, 1);
    send(0x102, 2);
    send(0x101, 3);
    TEST_ASSERT_EQUAL_STRING("231", arrived());
}

static void test_flipped_frames_differ_in_so_many_bits_of_the_data_and_in_nothing_else(void) {
    taper_frame_t received;
    const taper_frame_t sent = numbered(0x101, 1);
    for (uint8_t bits = 1; bits <= 64; bits++) {
        const taper_membus_faults_t faults = {.seed = bits, .flip_permille = ALWAYS, .bits = bits};
        inject(&faults);
        send(0x101, 1);
        TEST_ASSERT_TRUE(port.receive(port.context, &received));
        TEST_ASSERT_EQUAL_UINT(bits, bits_changed(&sent, &received));
        TEST_ASSERT_EQUAL_HEX16(0x101, received.id);
        TEST_ASSERT_EQUAL_UINT8(TAPER_FRAME_LENGTH, received.length);
        TEST_ASSERT_EQUAL_UINT32(1, injector.counts.flipped);
    }
}

static void test_a_short_frame_flips_only_in_the_data_that_it_has(void) {
    const taper_membus_faults_t faults = {.flip_permille = ALWAYS, .bits = 255};
    taper_frame_t received;
    taper_frame_t sent = numbered(0x101, 1);
    sent.length = 2;
    inject(&faults);
    (void)taper_membus_world_send(&bus, &sent);
    TEST_ASSERT_TRUE(port.receive(port.context, &received));
    TEST_ASSERT_EQUAL_UINT(16, bits_changed(&sent, &received));
    TEST_ASSERT_EQUAL_HEX8_ARRAY(&sent.data[2], &received.data[2], 6);
}

static void test_masquerading_frames_have_another_identifier_and_the_same_data(void) {
    taper_frame_t received;
    const taper_frame_t sent = numbered(0x101, 1);
    for (uint8_t bits = 1; bits <= 11; bits++) {
        const taper_membus_faults_t faults = {.seed = bits, .masquerade_permille = ALWAYS, .bits = bits};
        inject(&faults);
        send(0x101, 1);
        TEST_ASSERT_TRUE(port.receive(port.context, &received));
        TEST_ASSERT_EQUAL_UINT(bits, bits_of((unsigned)(0x101 ^ received.id)));
        TEST_ASSERT_EQUAL_UINT(0, bits_changed(&sent, &received));
        TEST_ASSERT_EQUAL_UINT32(1, injector.counts.masqueraded);
    }
}

/** What 20 frames became under several faults at once. */
static void run_all_faults(uint64_t seed, char *numbers) {
    const taper_membus_faults_t faults = {.seed = seed,
                                          .drop_permille = 200,
                                          .repeat_permille = 200,
                                          .delay_permille = 200,
                                          .delay_frames = 3,
                                          .reorder_permille = 200};
    inject(&faults);
    for (uint8_t n = 0; n < 20; n++) {
        send(0x101, n);
    }
    inject(NULL);
    strcpy(numbers, arrived());
}

static void test_the_same_seed_hits_the_same_frames_and_another_does_not(void) {
    char once[64];
    char again[64];
    char other[64];
    run_all_faults(7, once);
    run_all_faults(7, again);
    run_all_faults(8, other);
    TEST_ASSERT_EQUAL_STRING(once, again);
    TEST_ASSERT_TRUE(strcmp(once, other) != 0);
}

static void test_what_is_held_back_arrives_when_the_faults_end(void) {
    const taper_membus_faults_t faults = {.delay_permille = ALWAYS, .delay_ms = 50};
    inject(&faults);
    send(0x101, 1);
    send(0x101, 2);
    TEST_ASSERT_EQUAL_STRING("", arrived());
    inject(NULL);
    send(0x101, 3);
    TEST_ASSERT_EQUAL_STRING("123", arrived());
}

static void test_the_direction_to_the_world_has_its_own_faults(void) {
    const taper_membus_faults_t faults = {.drop_permille = ALWAYS};
    taper_frame_t frame = numbered(0x0C1, 1);
    taper_membus_inject(&bus, &bus.to_world, &injector, &faults);
    send(0x101, 2);
    TEST_ASSERT_TRUE(port.send(port.context, &frame));
    TEST_ASSERT_FALSE(taper_membus_world_receive(&bus, &frame));
    TEST_ASSERT_EQUAL_STRING("2", arrived());
}

static void test_frames_to_the_world_are_delayed_by_time_too(void) {
    const taper_membus_faults_t faults = {.delay_permille = ALWAYS, .delay_ms = 5};
    taper_frame_t frame = numbered(0x0C1, 1);
    taper_membus_inject(&bus, &bus.to_world, &injector, &faults);
    TEST_ASSERT_TRUE(port.send(port.context, &frame));
    TEST_ASSERT_FALSE(taper_membus_world_receive(&bus, &frame));
    taper_membus_set_time(&bus, 5);
    TEST_ASSERT_TRUE(taper_membus_world_receive(&bus, &frame));
}

static void start_flood(uint32_t per_ms, bool is_garbage) {
    const taper_membus_faults_t faults = {.seed = 1};
    const taper_frame_t frame = numbered(0x101, 3);
    taper_membus_set_time(&bus, 1000);
    inject(&faults);
    taper_membus_flood(&bus, &frame, per_ms, is_garbage);
}

static void test_a_flood_brings_so_many_copies_in_every_millisecond_until_it_ends(void) {
    const taper_frame_t frame = numbered(0x101, 3);
    start_flood(4, false);
    TEST_ASSERT_EQUAL_STRING("", arrived());
    taper_membus_set_time(&bus, 1001);
    TEST_ASSERT_EQUAL_STRING("3333", arrived());
    taper_membus_set_time(&bus, 1004);
    TEST_ASSERT_EQUAL_STRING("333333333333", arrived());
    TEST_ASSERT_EQUAL_UINT32(16, injector.counts.flooded);
    taper_membus_flood(&bus, &frame, 0, false);
    taper_membus_set_time(&bus, 1009);
    TEST_ASSERT_EQUAL_STRING("", arrived());
}

static void test_a_flood_of_garbage_has_other_data_each_time(void) {
    taper_frame_t first;
    taper_frame_t second;
    start_flood(2, true);
    taper_membus_set_time(&bus, 1001);
    TEST_ASSERT_TRUE(port.receive(port.context, &first));
    TEST_ASSERT_TRUE(port.receive(port.context, &second));
    TEST_ASSERT_EQUAL_HEX16(0x101, second.id);
    TEST_ASSERT_TRUE(memcmp(first.data, second.data, TAPER_FRAME_LENGTH) != 0);
}

static void test_a_flood_in_one_step_of_time_is_no_more_than_a_full_queue(void) {
    start_flood(100, false);
    taper_membus_set_time(&bus, 1000 + 3600000);
    TEST_ASSERT_EQUAL_UINT32(TAPER_MEMBUS_DEPTH, injector.counts.flooded);
    TEST_ASSERT_EQUAL_UINT32(TAPER_MEMBUS_DEPTH, count_arrived());
    taper_membus_set_time(&bus, 1001 + 3600000);
    TEST_ASSERT_EQUAL_UINT32(100, count_arrived());
}

static void test_a_flood_pushes_out_what_waits_and_the_station_can_tell(void) {
    start_flood(TAPER_MEMBUS_DEPTH, false);
    send(0x102, 1);
    taper_membus_set_time(&bus, 1001);
    TEST_ASSERT_EQUAL_UINT32(1, port.receive_overflows(port.context));
}

static void test_a_flood_does_not_reach_a_station_that_is_off_the_bus(void) {
    start_flood(4, false);
    taper_membus_bus_off(&bus, 0, 0);
    taper_membus_set_time(&bus, 1001);
    TEST_ASSERT_EQUAL_STRING("", arrived());
    TEST_ASSERT_EQUAL_UINT32(4, bus.controller[0].lost);
}

static void test_without_an_injector_there_is_no_flood(void) {
    const taper_frame_t frame = numbered(0x101, 3);
    taper_membus_flood(&bus, &frame, 4, false);
    taper_membus_set_time(&bus, 1000);
    TEST_ASSERT_EQUAL_STRING("", arrived());
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_no_faults_change_nothing);
    RUN_TEST(test_dropped_frames_do_not_arrive);
    RUN_TEST(test_a_probability_is_kept_to);
    RUN_TEST(test_repeated_frames_arrive_twice_in_a_row);
    RUN_TEST(test_a_filter_on_a_node_hits_all_its_functions_and_no_other_node);
    RUN_TEST(test_a_filter_on_a_function_hits_all_its_nodes_and_no_other_function);
    RUN_TEST(test_frames_delayed_by_time_arrive_when_it_is_over_with_the_time_of_then);
    RUN_TEST(test_frames_delayed_by_frames_arrive_after_so_many_others);
    RUN_TEST(test_what_cannot_be_held_back_arrives_at_once);
    RUN_TEST(test_reordered_frames_change_places_in_pairs);
    RUN_TEST(test_other_identifiers_do_not_end_a_reordering);
    RUN_TEST(test_flipped_frames_differ_in_so_many_bits_of_the_data_and_in_nothing_else);
    RUN_TEST(test_a_short_frame_flips_only_in_the_data_that_it_has);
    RUN_TEST(test_masquerading_frames_have_another_identifier_and_the_same_data);
    RUN_TEST(test_the_same_seed_hits_the_same_frames_and_another_does_not);
    RUN_TEST(test_what_is_held_back_arrives_when_the_faults_end);
    RUN_TEST(test_the_direction_to_the_world_has_its_own_faults);
    RUN_TEST(test_frames_to_the_world_are_delayed_by_time_too);
    RUN_TEST(test_a_flood_brings_so_many_copies_in_every_millisecond_until_it_ends);
    RUN_TEST(test_a_flood_of_garbage_has_other_data_each_time);
    RUN_TEST(test_a_flood_in_one_step_of_time_is_no_more_than_a_full_queue);
    RUN_TEST(test_a_flood_pushes_out_what_waits_and_the_station_can_tell);
    RUN_TEST(test_a_flood_does_not_reach_a_station_that_is_off_the_bus);
    RUN_TEST(test_without_an_injector_there_is_no_flood);
    return UNITY_END();
}
