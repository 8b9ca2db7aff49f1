/**
 * The SLCAN target without a fuzzer:
 *
 *     fuzz_slcan_standalone [BYTES [SEED]]
 *
 * runs inputs of so many bytes in all (100 000 000): commands, frames and noise, some spoilt, with events between; the same for
 * the same seed. Prints what was reached. What must not be, or was never reached, aborts.
 */
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "check.h"
#include "fuzz_slcan.h"
#include "mutate.h"

#define LONGEST 65536u

static uint8_t input[LONGEST];
static size_t size;

static uint32_t below(uint64_t *state, uint32_t bound) {
    return (uint32_t)((mutate_random(state) >> 32) * bound >> 32);
}

static void put(const char *text) {
    for (; *text != '\0' && size < LONGEST; text++) {
        input[size++] = (uint8_t)*text;
    }
}

static void put_frame(uint64_t *state) {
    static const char letters[] = "ttttttTrR";
    const char letter = letters[below(state, sizeof letters - 1)];
    const unsigned length = below(state, 9);
    char line[40];
    int at = letter == 't' || letter == 'r'
                 ? snprintf(line, sizeof line, "%c%03X%u", letter, below(state, 0x800), length)
                 : snprintf(line, sizeof line, "%c%08X%u", letter, below(state, 0x20000000), length);
    for (unsigned i = 0; i < length && (letter == 't' || letter == 'T'); i++) {
        at += snprintf(line + at, sizeof line - (size_t)at, below(state, 2) == 0 ? "%02X" : "%02x",
                       below(state, 256));
    }
    put(line);
    put("\r");
}

static void put_command(uint64_t *state) {
    static const char *const commands[] = {"O\r",  "O\r", "C\r", "L\r",  "S6\r", "s031C\r", "F\r",
                                           "Z0\r", "V\r", "N\r", "Z1\r", "\r",   "S9\r"};
    put(commands[below(state, sizeof commands / sizeof commands[0])]);
}

static void put_noise(uint64_t *state) {
    for (uint32_t left = below(state, 60); left > 0 && size < LONGEST; left--) {
        input[size++] = (uint8_t)below(state, 0x80);
    }
}

/** One bit of what was put since `from` flips, now and then. */
static void spoil(uint64_t *state, size_t from) {
    if (size > from && below(state, 16) == 0) {
        input[from + below(state, (uint32_t)(size - from))] ^= (uint8_t)(1u << below(state, 7));
    }
}

/** Inputs differ in how much of each there is: some only flood, and some hardly let the stream go on. */
static void make_input(uint64_t *state) {
    const uint32_t wanted = 1 + below(state, 1 + below(state, LONGEST));
    const uint32_t frames = below(state, 1000);
    const uint32_t commands = below(state, 60);
    const uint32_t events = below(state, 400);
    size = 0;
    put("O\r");
    while (size < wanted) {
        const size_t from = size;
        const uint32_t choice = below(state, 1 + frames + commands + events);
        if (choice < frames) {
            put_frame(state);
        } else if (choice < frames + commands) {
            put_command(state);
        } else if (choice < frames + commands + events) {
            input[size++] = (uint8_t)(0x80u + below(state, 0x80));
        } else {
            put_noise(state);
        }
        spoil(state, from);
    }
}

static void line(const char *what, uint64_t count) {
    printf("%-34s %12" PRIu64 "\n", what, count);
    check_that(count > 0, what, 0);
}

int main(int argc, char **argv) {
    const fuzz_slcan_stats_t *of = &fuzz_slcan_stats;
    const uint64_t bytes = argc > 1 ? strtoull(argv[1], NULL, 10) : 100000000;
    uint64_t state = argc > 2 ? strtoull(argv[2], NULL, 10) : 1;
    while (of->bytes < bytes) {
        make_input(&state);
        (void)LLVMFuzzerTestOneInput(input, size);
    }
    line("inputs", of->inputs);
    line("bytes", of->bytes);
    line("frames for the station", of->received);
    line("  lost, the queue was full", of->overflows);
    line("extended frames", of->extended);
    line("frames that the station sent", of->sent);
    line("lines refused", of->refused);
    line("openings", of->opens);
    return 0;
}
