/* Which bit errors the end-to-end protection finds: every one and every pair, in frames of every id and counter. The CRC
   is linear, so whether an error is found does not depend on the data. */
#include "support/codec_bench.h"
#include "taper/e2e.h"
#include "unity.h"

#define COUNTERS       16u
#define BITS           64u
#define FIRST_COUNTER  8u
#define BEYOND_COUNTER 12u
#define SETPOINT_1     0x0C1u

static uint16_t ids[CODEC_BENCH_IDS];

void setUp(void) {
    codec_bench_identifiers(ids);
}

void tearDown(void) {}

static bool is_counter_bit(unsigned bit) {
    return bit >= FIRST_COUNTER && bit < BEYOND_COUNTER;
}

static taper_frame_t frame_of(uint16_t id, unsigned counter) {
    taper_frame_t frame = {
        .id = id,
        .length = TAPER_FRAME_LENGTH,
        .data = {0, 0x10, 0xa0, 0x00, 0x06, 0x0c, 0x07, 0x07},
    };
    taper_e2e_protect(&frame, (uint8_t)counter);
    return frame;
}

static void flip(taper_frame_t *frame, unsigned bit) {
    frame->data[bit / 8u] = (uint8_t)(frame->data[bit / 8u] ^ (1u << (bit % 8u)));
}

/* What came through of the errors that were made: with a good CRC, and used by a receiver that heard the frame before. */
typedef struct {
    unsigned long made, good_crc, used;
} passed_t;

static void count_error(const taper_frame_t *frame, unsigned counter, passed_t *passed) {
    taper_e2e_receiver_t receiver = {.counter = (uint8_t)((counter + 15u) % COUNTERS), .synchronised = true};
    const taper_e2e_check_t check = taper_e2e_check(&receiver, frame);
    passed->made++;
    passed->good_crc += check != TAPER_E2E_CRC_ERROR ? 1u : 0u;
    passed->used += check == TAPER_E2E_OK || check == TAPER_E2E_OK_SOME_LOST ? 1u : 0u;
}

static void count_single_errors(uint16_t id, unsigned counter, bool in_counter, passed_t *passed) {
    for (unsigned bit = 0; bit < BITS; bit++) {
        if (is_counter_bit(bit) == in_counter) {
            taper_frame_t frame = frame_of(id, counter);
            flip(&frame, bit);
            count_error(&frame, counter, passed);
        }
    }
}

static void count_double_errors(uint16_t id, unsigned counter, bool in_counter, passed_t *passed) {
    const taper_frame_t good = frame_of(id, counter);
    for (unsigned first = 0; first < BITS; first++) {
        for (unsigned second = first + 1; second < BITS; second++) {
            if ((is_counter_bit(first) || is_counter_bit(second)) == in_counter) {
                taper_frame_t frame = good;
                flip(&frame, first);
                flip(&frame, second);
                count_error(&frame, counter, passed);
            }
        }
    }
}

typedef void (*count_t)(uint16_t id, unsigned counter, bool in_counter, passed_t *passed);

/* Over every id of the bus and every counter. */
static passed_t count_all(count_t count, bool in_counter) {
    passed_t passed = {0, 0, 0};
    for (unsigned i = 0; i < CODEC_BENCH_IDS; i++) {
        for (unsigned counter = 0; counter < COUNTERS; counter++) {
            count(ids[i], counter, in_counter, &passed);
        }
    }
    return passed;
}

static void test_every_error_of_one_bit_beside_the_counter_is_found(void) {
    const passed_t passed = count_all(count_single_errors, false);
    TEST_ASSERT_EQUAL_UINT(CODEC_BENCH_IDS * COUNTERS * 60u, passed.made);
    TEST_ASSERT_EQUAL_UINT(0, passed.good_crc);
}

static void test_every_error_of_two_bits_beside_the_counter_is_found(void) {
    const passed_t passed = count_all(count_double_errors, false);
    TEST_ASSERT_EQUAL_UINT(CODEC_BENCH_IDS * COUNTERS * 1770u, passed.made);
    TEST_ASSERT_EQUAL_UINT(0, passed.good_crc);
}

static void count_triple_errors(unsigned first, unsigned counter, passed_t *passed) {
    const taper_frame_t good = frame_of(SETPOINT_1, counter);
    for (unsigned second = first + 1; second < BITS; second++) {
        for (unsigned third = second + 1; third < BITS; third++) {
            if (!is_counter_bit(first) && !is_counter_bit(second) && !is_counter_bit(third)) {
                taper_frame_t frame = good;
                flip(&frame, first);
                flip(&frame, second);
                flip(&frame, third);
                count_error(&frame, counter, passed);
            }
        }
    }
}

/* Hamming distance 4. */
static void test_every_error_of_three_bits_beside_the_counter_is_found(void) {
    passed_t passed = {0, 0, 0};
    for (unsigned counter = 0; counter < COUNTERS; counter++) {
        for (unsigned first = 0; first < BITS; first++) {
            count_triple_errors(first, counter, &passed);
        }
    }
    TEST_ASSERT_EQUAL_UINT(34220u * COUNTERS, passed.made);
    TEST_ASSERT_EQUAL_UINT(0, passed.good_crc);
}

/* A false counter picks another entry of the list: eight bits as good as random. The data of such a frame is right. */
static void test_of_the_errors_of_one_counter_bit_few_are_used(void) {
    const passed_t passed = count_all(count_single_errors, true);
    TEST_ASSERT_EQUAL_UINT(50368, passed.made);
    TEST_ASSERT_EQUAL_UINT(170, passed.good_crc);
    TEST_ASSERT_EQUAL_UINT(48, passed.used);
}

static void test_of_the_errors_of_a_counter_bit_and_another_few_are_used(void) {
    const passed_t passed = count_all(count_double_errors, true);
    TEST_ASSERT_EQUAL_UINT(3097632, passed.made);
    TEST_ASSERT_EQUAL_UINT(12214, passed.good_crc);
    TEST_ASSERT_EQUAL_UINT(2985, passed.used);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_every_error_of_one_bit_beside_the_counter_is_found);
    RUN_TEST(test_every_error_of_two_bits_beside_the_counter_is_found);
    RUN_TEST(test_every_error_of_three_bits_beside_the_counter_is_found);
    RUN_TEST(test_of_the_errors_of_one_counter_bit_few_are_used);
    RUN_TEST(test_of_the_errors_of_a_counter_bit_and_another_few_are_used);
    return UNITY_END();
}
