/**
 * The fuzz target without a fuzzer:
 *
 *     fuzz_standalone CORPUS [--frames N [--seed S]]
 *
 * runs every file of the folder CORPUS, and then N frames of mutations of them, the same for the same seed. Prints what
 * was reached. Exits with 0, or 2 for wrong arguments or an empty corpus; what must not be, aborts.
 */
#include <dirent.h>
#include <errno.h>
#include <inttypes.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "fuzz_frames.h"
#include "mutate.h"

#define MAX_FILES 256u
#define MAX_SIZE  (64u * 1024u)

static struct {
    uint8_t *content[MAX_FILES];
    size_t size[MAX_FILES];
    unsigned count;
} corpus;

static void give_up(const char *what, const char *name) {
    fprintf(stderr, "fuzz_standalone: %s: %s\n", what, name);
    exit(2);
}

static int by_name(const struct dirent **a, const struct dirent **b) {
    return strcmp((*a)->d_name, (*b)->d_name);
}

static int is_file_name(const struct dirent *entry) {
    return entry->d_name[0] != '.';
}

static void read_file(const char *folder, const char *name) {
    static uint8_t buffer[MAX_SIZE];
    char path[4096];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    FILE *file = fopen(path, "rb");
    if (file == NULL) {
        give_up("cannot open", path);
    }
    const size_t size = fread(buffer, 1, sizeof buffer, file);
    fclose(file);
    uint8_t *content = malloc(size + 1);
    if (size < FUZZ_RECORD || content == NULL || corpus.count == MAX_FILES) {
        give_up("empty file, or too many", path);
    }
    memcpy(content, buffer, size);
    corpus.content[corpus.count] = content;
    corpus.size[corpus.count] = size;
    corpus.count++;
}

/** In the order of their names: the mutations of a seed must not depend on the file system. */
static void read_corpus(const char *folder) {
    struct dirent **entries = NULL;
    const int count = scandir(folder, &entries, is_file_name, by_name);
    if (count <= 0) {
        give_up("no corpus in", folder);
    }
    for (int k = 0; k < count; k++) {
        read_file(folder, entries[k]->d_name);
        free(entries[k]);
    }
    free(entries);
}

static void run_mutations(uint64_t frames, uint64_t seed) {
    static uint8_t input[MUTATE_RECORDS * FUZZ_RECORD];
    const uint64_t until = fuzz_stats.frames + frames;
    uint64_t state = seed;
    while (fuzz_stats.frames < until) {
        const uint8_t *seeds[2];
        size_t sizes[2];
        for (unsigned k = 0; k < 2; k++) {
            const uint64_t file = mutate_random(&state) % corpus.count;
            seeds[k] = corpus.content[file];
            sizes[k] = corpus.size[file];
        }
        (void)LLVMFuzzerTestOneInput(input, mutate(&state, seeds, sizes, input));
    }
}

static const char *const counter_name[] = {
    [TAPER_COUNTER_FRAMES_RECEIVED] = "station: frames received",
    [TAPER_COUNTER_FRAMES_SENT] = "station: frames sent",
    [TAPER_COUNTER_FRAMES_UNKNOWN] = "station: frames unknown",
    [TAPER_COUNTER_CRC_ERRORS] = "station: crc errors",
    [TAPER_COUNTER_FRAMES_REPEATED] = "station: frames repeated",
    [TAPER_COUNTER_FRAMES_LOST] = "station: frames lost",
    [TAPER_COUNTER_FRAMES_UNTRUSTED] = "station: frames untrusted",
    [TAPER_COUNTER_FRAMES_BABBLED] = "station: frames babbled",
    [TAPER_COUNTER_BAD_FIELDS] = "station: bad fields",
    [TAPER_COUNTER_RECEIVE_OVERFLOWS] = "station: receive overflows",
    [TAPER_COUNTER_SEND_REFUSED] = "station: send refused",
    [TAPER_COUNTER_BUS_OFF] = "station: bus off",
    [TAPER_COUNTER_PLANS] = "station: plans",
    [TAPER_COUNTER_PLANS_REJECTED] = "station: plans rejected",
    [TAPER_COUNTER_FALLBACK_TICKS] = "station: fallback ticks",
    [TAPER_COUNTER_GUARD_VIOLATIONS] = "station: guard violations",
    [TAPER_COUNTER_CLOCK_JUMPS] = "station: clock jumps",
    [TAPER_COUNTER_SOC_JUMPS] = "station: soc jumps",
    [TAPER_COUNTER_PARAMETERS_REPAIRED] = "station: parameters repaired",
    [TAPER_COUNTER_TRANSFERS] = "station: transfers",
    [TAPER_COUNTER_TRANSFERS_REFUSED] = "station: transfers refused",
    [TAPER_COUNTER_TICK_OVERRUNS] = "station: tick overruns",
    [TAPER_COUNTER_SETPOINT_FLIPS] = "station: setpoint flips",
    [TAPER_COUNTER_PLANNER_OFFS] = "station: planner offs",
    [TAPER_COUNTER_OVER_DRAWS] = "station: over draws",
    [TAPER_COUNTER_LOCKOUTS] = "station: lockouts",
    [TAPER_COUNTER_LIMIT_FLAPS] = "station: limit flaps",
    [TAPER_COUNTER_STRANGERS] = "station: strangers",
    [TAPER_COUNTER_LIMITS_NEGATIVE] = "station: limits negative",
};

_Static_assert(sizeof counter_name / sizeof counter_name[0] == TAPER_COUNTERS, "each counter has a name");

static void line(const char *what, uint64_t count) {
    printf("%-34s %12" PRIu64 "\n", what, count);
}

static void print_account(double seconds) {
    const fuzz_stats_t *of = &fuzz_stats;
    line("inputs", of->inputs);
    line("frames", of->frames);
    line("frames per second", seconds > 0 ? (uint64_t)((double)of->frames / seconds) : 0);
    line("sound by end-to-end protection", of->sound);
    line("  of these, a field out of range", of->partly_absent);
    for (unsigned function = 0; function < sizeof of->decoded / sizeof of->decoded[0]; function++) {
        if (of->decoded[function] > 0) {
            char name[32];
            snprintf(name, sizeof name, "  decoded, function 0x%02x", function);
            line(name, of->decoded[function]);
        }
    }
    line("ISO-TP frames", of->isotp_frames);
    line("whole transfers", of->transfers);
    line("events at the station", of->events);
    line("polls", of->polls);
    line("control ticks", of->steps);
    line("  connectors in session", of->sessions);
    line("  vehicles that want energy", of->demands);
    line("  connectors with current", of->currents);
    line("frames that the station sent", of->answers);
    for (unsigned k = 0; k < TAPER_COUNTERS; k++) {
        line(counter_name[k], of->station[k]);
    }
}

static uint64_t number(const char *text) {
    char *end = NULL;
    errno = 0;
    const unsigned long long value = strtoull(text, &end, 10);
    if (errno != 0 || end == text || *end != '\0' || text[0] == '-') {
        give_up("not a number", text);
    }
    return value;
}

int main(int argc, char **argv) {
    uint64_t frames = 0;
    uint64_t seed = 1;
    if (argc < 2 || argc % 2 != 0) {
        give_up("usage", "fuzz_standalone CORPUS [--frames N] [--seed S]");
    }
    for (int k = 2; k < argc; k += 2) {
        if (strcmp(argv[k], "--frames") == 0) {
            frames = number(argv[k + 1]);
        } else if (strcmp(argv[k], "--seed") == 0) {
            seed = number(argv[k + 1]);
        } else {
            give_up("no such option", argv[k]);
        }
    }
    const clock_t began = clock();
    read_corpus(argv[1]);
    for (unsigned k = 0; k < corpus.count; k++) {
        (void)LLVMFuzzerTestOneInput(corpus.content[k], corpus.size[k]);
    }
    run_mutations(frames, seed);
    print_account((double)(clock() - began) / CLOCKS_PER_SEC);
    for (unsigned k = 0; k < corpus.count; k++) {
        free(corpus.content[k]);
    }
    return 0;
}
