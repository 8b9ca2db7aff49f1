/* Frames under an id that is not their sender's: what of every pair of ids on the bus comes through. An eight-bit CRC
   cannot find each frame, so a sender has to be found by several. */
#include "support/codec_bench.h"
#include "taper/e2e.h"
#include "unity.h"

#define COUNTERS    16u
#define WINDOW      5u
#define MOST_SAME   3u /* counters, of 16, with which a frame of one id is good under another */
#define MOST_IN_ROW 2u /* of these, in any five counters in a row */

static uint16_t ids[CODEC_BENCH_IDS];

void setUp(void) {
    codec_bench_identifiers(ids);
}

void tearDown(void) {}

/* Frame of `sender`, on the bus under the id `shown`. */
static taper_frame_t masquerade(uint16_t sender, uint16_t shown, unsigned counter) {
    taper_frame_t frame = {.id = sender, .length = TAPER_FRAME_LENGTH, .data = {0, 0x20, 1, 2, 3, 4, 5, 6}};
    taper_e2e_protect(&frame, (uint8_t)(counter % COUNTERS));
    frame.id = shown;
    return frame;
}

/* Bit c: a frame with counter c is good under the other id. The CRC is linear, so this holds for all data. */
static unsigned good_counters(uint16_t sender, uint16_t shown) {
    unsigned good = 0;
    for (unsigned counter = 0; counter < COUNTERS; counter++) {
        const taper_frame_t frame = masquerade(sender, shown, counter);
        taper_e2e_receiver_t fresh = {.counter = 0};
        good |= taper_e2e_check(&fresh, &frame) == TAPER_E2E_OK ? 1u << counter : 0u;
    }
    return good;
}

static unsigned count_bits(unsigned bits) {
    unsigned count = 0;
    for (; bits != 0u; bits &= bits - 1u) {
        count++;
    }
    return count;
}

/* Most of `good` in any WINDOW counters in a row, over the wrap too. */
static unsigned most_in_row(unsigned good) {
    const unsigned twice = good | good << COUNTERS;
    unsigned most = 0;
    for (unsigned first = 0; first < COUNTERS; first++) {
        const unsigned count = count_bits(twice >> first & ((1u << WINDOW) - 1u));
        most = count > most ? count : most;
    }
    return most;
}

static void test_of_any_two_ids_at_least_13_of_16_entries_differ(void) {
    unsigned pairs_by_same[COUNTERS + 1] = {0};
    unsigned worst_in_row = 0;
    for (unsigned a = 0; a < CODEC_BENCH_IDS; a++) {
        for (unsigned b = a + 1; b < CODEC_BENCH_IDS; b++) {
            const unsigned good = good_counters(ids[a], ids[b]);
            TEST_ASSERT_EQUAL_HEX(0, good & ~0xFFFFu);
            pairs_by_same[count_bits(good)]++;
            worst_in_row = most_in_row(good) > worst_in_row ? most_in_row(good) : worst_in_row;
        }
    }
    static const unsigned expected[COUNTERS + 1] = {290596, 18144, 539, 12}; /* of 309 291 pairs */
    TEST_ASSERT_EQUAL_UINT_ARRAY(expected, pairs_by_same, COUNTERS + 1);
    TEST_ASSERT_EQUAL_UINT(0, pairs_by_same[MOST_SAME + 1]);
    TEST_ASSERT_EQUAL_UINT(MOST_IN_ROW, worst_in_row);
}

/* More than two errors in five make a sender invalid, so it follows: */
static void check_sender(uint16_t sender, uint16_t shown, unsigned first) {
    taper_e2e_receiver_t receiver = {.counter = 0};
    for (unsigned i = 0; i < WINDOW + COUNTERS; i++) {
        const taper_frame_t frame = masquerade(sender, shown, first + i);
        (void)taper_e2e_check(&receiver, &frame);
        TEST_ASSERT_TRUE(i + 1 < WINDOW || !taper_e2e_is_valid(&receiver));
    }
}

static void test_a_sender_under_another_id_is_found_by_its_fifth_frame_and_stays_so(void) {
    for (unsigned a = 0; a < CODEC_BENCH_IDS; a++) {
        for (unsigned b = 0; b < CODEC_BENCH_IDS; b++) {
            if (a != b) {
                check_sender(ids[a], ids[b], a + b);
            }
        }
    }
}

static void test_neighbouring_setpoints_share_one_entry_at_most(void) {
    for (uint16_t node = 1; node < 60; node++) {
        const uint16_t one = taper_can_id(TAPER_MESSAGE_SETPOINT, (uint8_t)node);
        TEST_ASSERT_LESS_OR_EQUAL_UINT(1, count_bits(good_counters(one, (uint16_t)(one + 1))));
    }
    TEST_ASSERT_EQUAL_UINT(0, good_counters(0x0C1, 0x0C2));
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_of_any_two_ids_at_least_13_of_16_entries_differ);
    RUN_TEST(test_a_sender_under_another_id_is_found_by_its_fifth_frame_and_stays_so);
    RUN_TEST(test_neighbouring_setpoints_share_one_entry_at_most);
    return UNITY_END();
}
