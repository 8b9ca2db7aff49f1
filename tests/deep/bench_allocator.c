/**
 * What a tick of the allocator costs: one allocation, one grant and both guards.
 *
 *     bench_allocator                          a table of microseconds by connectors and depth
 *     bench_allocator CONNECTORS DEPTH ROUNDS  that many rounds, for a profiler that counts instructions
 *
 * The tree has 12 groups where the depth allows it, all phases limited, half of the minima fit.
 */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "taper/ledger.h"
#include "taper/rows.h"
#include "tree.h"

#define GROUPS 12u
/** Unity asks for these two; there are no tests here. */
void setUp(void) {}
void tearDown(void) {}

static tree_t tree;
static taper_ledger_t ledger;

/** `depth` levels: the site, then chains of groups side by side. */
static void grow(unsigned connectors, unsigned depth) {
    tree_init(&tree);
    uint8_t leaf[GROUPS] = {0};
    unsigned leaves = 0;
    while (depth > 1 && tree.config.group_count + depth - 1 <= GROUPS) {
        uint8_t parent = 0;
        for (unsigned level = 1; level < depth; level++) {
            parent = tree_add_group(&tree, parent);
        }
        leaf[leaves++] = parent;
    }
    for (unsigned k = 0; k < tree.config.group_count; k++) {
        tree.group[k].limit_W = (int32_t)connectors * 2070;
        tree.group[k].limit_mA = (int32_t)connectors * 3000;
    }
    for (unsigned i = 0; i < connectors; i++) {
        tree_add(&tree, leaf[leaves > 0 ? i % leaves : 0], L1 | L2 | L3);
        tree_laxity(&tree, (uint8_t)i, (int32_t)((i * 37u) % connectors) * 60);
    }
    taper_ledger_init(&ledger, &tree.config, 3000, 1, tree.snapshot.now_ms);
    tree.snapshot.now_ms += 60000;
    taper_ledger_update(&ledger, tree.snapshot.now_ms);
}

static bool run(unsigned rounds) {
    bool passed = true;
    taper_setpoints_t granted;
    for (unsigned round = 0; round < rounds; round++) {
        tree.snapshot.now_ms += 1000;
        const taper_rows_t *rows = tree_rows(&tree);
        taper_allocate(&tree.allocator, &tree.config, &tree.snapshot, &tree.proposal, rows, NULL,
                       &tree.setpoints);
        taper_ledger_grant(&ledger, &tree.config, &tree.snapshot, tree.proposal.rank, rows, &tree.setpoints,
                           &granted);
        passed = passed && taper_guard_passes(&tree.config, &tree.snapshot, &tree.supply, &granted) &&
                 taper_guard_hand_over_passes(&ledger, &tree.config, &tree.snapshot, &tree.supply, &granted);
    }
    return passed;
}

static double now_us(void) {
    struct timespec now;
    timespec_get(&now, TIME_UTC);
    return (double)now.tv_sec * 1e6 + (double)now.tv_nsec / 1e3;
}

/** Time of a round, the least of many tries: others use this machine too. */
static double least_us(void) {
    const unsigned rounds = 20;
    double least = 1e9;
    for (unsigned k = 0; k < 200; k++) {
        const double began_us = now_us();
        if (!run(rounds)) {
            fputs("bench_allocator: a guard found a violation\n", stderr);
            exit(1);
        }
        const double passed_us = (now_us() - began_us) / rounds;
        least = passed_us < least ? passed_us : least;
    }
    return least;
}

static void print_table(void) {
    static const unsigned connectors[] = {9, 18, 27, 54};
    puts("microseconds per list of rows, allocation, grant and guards\nconnectors  depth 1  depth 2  depth 3 "
         " depth 4");
    for (size_t k = 0; k < sizeof connectors / sizeof connectors[0]; k++) {
        printf("%10u", connectors[k]);
        for (unsigned depth = 1; depth <= 4; depth++) {
            grow(connectors[k], depth);
            printf("  %7.1f", least_us());
        }
        putchar('\n');
    }
}

int main(int argc, char **argv) {
    if (argc == 1) {
        print_table();
        return 0;
    }
    if (argc != 4) {
        fputs("usage: bench_allocator [CONNECTORS DEPTH ROUNDS]\n", stderr);
        return 2;
    }
    const unsigned connectors = (unsigned)strtoul(argv[1], NULL, 10);
    const unsigned depth = (unsigned)strtoul(argv[2], NULL, 10);
    if (connectors < 1 || connectors > TAPER_MAX_CONNECTORS || depth < 1 || depth > GROUPS) {
        fprintf(stderr, "bench_allocator: 1..%d connectors, depth 1..%u\n", TAPER_MAX_CONNECTORS, GROUPS);
        return 2;
    }
    grow(connectors, depth);
    return run((unsigned)strtoul(argv[3], NULL, 10)) ? 0 : 1;
}
