/* The hostile world as a program: so many ticks of one station, and what the accountant found. See README.md. */
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "sites.h"
#include "world.h"

typedef struct {
    const taper_station_config_t *site;
    uint64_t ticks, seed;
} arguments_t;

/* A station that gives nobody anything breaks no limit: this much of the time, vehicles have to have current. */
#define LEAST_CHARGING_percent 5.0
/* In a run of so many ticks. */
#define LONG_RUN 5000u

static world_t world;

static const taper_station_config_t *find_site(const char *name) {
    for (unsigned k = 0; k < SITES; k++) {
        if (strcmp(sites[k].name, name) == 0) {
            return &sites[k];
        }
    }
    return NULL;
}

static bool read_arguments(int count, char **words, arguments_t *arguments) {
    *arguments = (arguments_t){.ticks = 10000, .seed = 1};
    for (int k = 1; k + 1 < count; k += 2) {
        char *end = NULL;
        const uint64_t number = strtoull(words[k + 1], &end, 0);
        if (strcmp(words[k], "--station") == 0) {
            arguments->site = find_site(words[k + 1]);
        } else if (strcmp(words[k], "--ticks") == 0 && *end == '\0') {
            arguments->ticks = number;
        } else if (strcmp(words[k], "--seed") == 0 && *end == '\0') {
            arguments->seed = number;
        } else {
            return false;
        }
    }
    return count % 2 == 1 && arguments->site != NULL;
}

static void print_frames(const book_t *book, int64_t start_ms) {
    const unsigned held = book->seen_count < ACCOUNT_FRAMES ? book->seen_count : ACCOUNT_FRAMES;
    for (unsigned k = held; k > 0; k--) {
        const seen_t *seen = &book->seen[(book->seen_count - k) % ACCOUNT_FRAMES];
        printf("  %11.3f s  %-9s  %03X ", (double)(seen->at_ms - start_ms) / 1000.0, seen->what,
               seen->frame.id);
        for (unsigned byte = 0; byte < TAPER_FRAME_LENGTH; byte++) {
            printf(" %02X", seen->frame.data[byte]);
        }
        printf("\n");
    }
}

static void print_books(int64_t start_ms) {
    const account_t *account = &world.account;
    for (unsigned i = 0; i < world.config->connector_count; i++) {
        const book_t *book = &account->book[i];
        printf("connector %u: %s session %u, conductors %u, level %d mA%s, fallback %d mA, expires %.3f s\n",
               i + 1u, book->plugged ? "vehicle" : "empty", book->session, book->conductors, book->level_mA,
               book->fell_back ? " (fell back)" : "", book->fallback_mA,
               (double)(book->expires_ms - start_ms) / 1000.0);
        for (unsigned k = 0; k < book->fades; k++) {
            printf("  and %d mA until %.3f s\n", book->fade[k].mA,
                   (double)(book->fade[k].until_ms - start_ms) / 1000.0);
        }
    }
}

static void print_failure(const arguments_t *arguments, int64_t start_ms) {
    static const char *const eras[ERAS] = {"calm", "noise", "storm", "sender", "fair"};
    const verdict_t *verdict = &world.account.verdict;
    printf("VIOLATION: %s: limit %.3f, value %.3f, group %d, connector %d\n",
           account_rule_name(verdict->first), verdict->limit, verdict->value, verdict->group,
           verdict->connector + 1);
    printf("at %.3f s, tick %" PRIu64 ", era %s; again: --station %s --seed %" PRIu64 " --ticks %" PRIu64
           "\n",
           (double)(verdict->first_ms - start_ms) / 1000.0, world.tick, eras[world.era],
           arguments->site->name, arguments->seed, world.tick + 1u);
    print_books(start_ms);
    for (unsigned i = 0; i < world.config->connector_count; i++) {
        if (verdict->connector < 0 || verdict->connector == (int)i) {
            printf("frames of connector %u:\n", i + 1u);
            print_frames(&world.account.book[i], start_ms);
        }
    }
}

/** Of the time of all vehicles. */
static double charging_percent(void) {
    const verdict_t *verdict = &world.account.verdict;
    return verdict->vehicles == 0 ? 0.0 : 100.0 * (double)verdict->charging / (double)verdict->vehicles;
}

static void print_account(const arguments_t *arguments) {
    const verdict_t *verdict = &world.account.verdict;
    const injuries_t *done = &world.injuries;
    chaos_count(&world);
    printf("station %s, seed %" PRIu64 ": %" PRIu64 " ticks, %" PRIu64 " frames, %" PRIu64 " checks\n",
           arguments->site->name, arguments->seed, world.tick, verdict->frames, verdict->checks);
    printf("frames lost %" PRIu64 ", repeated %" PRIu64 ", delayed %" PRIu64 ", reordered %" PRIu64
           ", corrupt %" PRIu64 ", refused %" PRIu64 "\n",
           done->lost, done->repeated, done->delayed, done->reordered, done->flipped, done->refused);
    printf("bus-off %" PRIu64 ", links cut %" PRIu64 ", connectors rebooted %" PRIu64
           ", stations restarted %" PRIu64 ", limits %" PRIu64 ", curves %" PRIu64 ", poisoned plans %" PRIu64
           "\n",
           done->bus_offs, done->link_losses, done->reboots, done->restarts, world.gateway.changes,
           done->curves, done->poisoned);
    printf("vehicles %" PRIu64 ", of these liars %" PRIu64 "; %.1f %% of their time with current\n",
           done->vehicles, done->lies, charging_percent());
    for (rule_t rule = 0; rule < RULES; rule++) {
        printf("%-48s violations %" PRIu64, account_rule_name(rule), verdict->violations[rule]);
        if (verdict->margin[rule] < 1e300) {
            printf(", least margin %.3f", verdict->margin[rule]);
        }
        printf("\n");
    }
}

int main(int count, char **words) {
    arguments_t arguments;
    if (!read_arguments(count, words, &arguments)) {
        fprintf(stderr, "usage: hostile --station hub|sockets|mixed|lines|tree [--ticks N] [--seed N]\n");
        return 2;
    }
    if (!world_init(&world, arguments.site, arguments.seed)) {
        fprintf(stderr, "hostile: the station refuses the description of %s\n", arguments.site->name);
        return 2;
    }
    const int64_t start_ms = world.now_ms;
    while (world.tick < arguments.ticks && !world.account.verdict.failed && world.guard_violations == 0) {
        world_tick(&world);
    }
    if (world.account.verdict.failed) {
        print_failure(&arguments, start_ms);
    }
    if (world.guard_violations > 0) {
        printf("GUARD: the station's own guard found a violation in tick %" PRIu64 "\n", world.tick);
    }
    print_account(&arguments);
    const bool idle = world.tick >= LONG_RUN && charging_percent() < LEAST_CHARGING_percent;
    if (idle) {
        printf("NOTHING PROVED: hardly anybody was charged\n");
    }
    return world.account.verdict.failed || world.guard_violations > 0 || idle ? 1 : 0;
}
