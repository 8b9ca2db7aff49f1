/* Sums against limits. */
#include <math.h>
#include <string.h>

#include "account_internal.h"
#include "phasor.h"

/* The failsafe limit that was in force so long ago still counts; and a connector that accepted nothing for so long keeps the
   fallback current that it was told [ms]. */
#define FAILSAFE_WINDOW_ms 5000
#define DEAF_ms            3500
/* Over-draw that nobody has to notice: up to (setpoint + 0.5 A) x 1.10; and noise on a conductor that is not in use. */
#define TOLERATED_mA(mA) (((mA) + 500.0) * 1.1)
#define NOISE_mA         500.0

typedef struct {
    load_t group[TAPER_MAX_GROUPS];
} loads_t;

/** Add a connector to its group and all above. */
static void add_up(loads_t *loads, const taper_station_config_t *config, unsigned connector,
                   unsigned conductors, const double mA[3]) {
    for (uint8_t group = config->connectors[connector].group; group != TAPER_NO_GROUP;
         group = config->groups[group].parent) {
        load_add(&loads->group[group], config, connector, conductors, mA);
    }
}

static void add_equally(loads_t *loads, const account_t *account, unsigned connector, unsigned conductors,
                        int32_t mA) {
    const double equal_mA[3] = {mA, mA, mA};
    if (mA > 0) {
        add_up(loads, account->config, connector, conductors, equal_mA);
    }
}

static void check_described(account_t *account, const loads_t *legal) {
    for (unsigned group = 0; group < account->config->group_count; group++) {
        const taper_group_config_t *limits = &account->config->groups[group];
        const load_t *load = &legal->group[group];
        account_hold(account, RULE_GROUP_W, (int)group, limits->limit_W, load->power_W, 1.0);
        for (unsigned line = 0; line < 3; line++) {
            if (limits->limit_mA != 0) {
                account_hold(account, RULE_GROUP_A, (int)group, limits->limit_mA, load_line_mA(load, line),
                             1000.0);
            }
            if (limits->delta_mA != 0) {
                account_hold(account, RULE_DELTA_A, (int)group, limits->delta_mA, load_delta_mA(load, line),
                             1000.0);
            }
        }
    }
}

/** What nobody can take back, and what of it fell back so lately that others may not have made room for it. */
typedef struct {
    loads_t all, lately;
} stuck_t;

/** What was in force a window ago, and for who makes room for others that fell back meanwhile, before that. */
static double allowed(const account_t *account, const history_t *history, double stuck, double lately) {
    const int64_t window_ms = account_window_ms(account);
    const int64_t unknown_ms = account->config->tick_ms + ACCOUNT_LATE_ms + ACCOUNT_VALIDITY_ms;
    const double most = account_most(account, history, window_ms);
    const double before = account_most(account, history, window_ms + unknown_ms);
    return fmax(stuck, fmin(before, most + lately));
}

static double site_limit_W(const account_t *account, const stuck_t *stuck) {
    return allowed(account, &account->supply.site_W, stuck->all.group[0].power_W,
                   stuck->lately.group[0].power_W);
}

static double site_limit_mA(const account_t *account, const stuck_t *stuck, unsigned line) {
    return allowed(account, &account->supply.phase_mA[line], load_line_mA(&stuck->all.group[0], line),
                   load_line_mA(&stuck->lately.group[0], line));
}

static void check_site(account_t *account, const loads_t *legal, const stuck_t *stuck) {
    account_hold(account, RULE_SITE_W, 0, site_limit_W(account, stuck), legal->group[0].power_W, 1.0);
    for (unsigned line = 0; line < 3 && account->config->groups[0].limit_mA != 0; line++) {
        account_hold(account, RULE_SITE_A, 0, site_limit_mA(account, stuck, line),
                     load_line_mA(&legal->group[0], line), 1000.0);
    }
}

static void check_fallback(account_t *account) {
    loads_t told, deaf;
    memset(&told, 0, sizeof told);
    memset(&deaf, 0, sizeof deaf);
    for (unsigned i = 0; i < account->config->connector_count; i++) {
        const book_t *book = &account->book[i];
        if (book->plugged) {
            add_equally(&told, account, i, account_conductors(account, i), book->fallback_mA);
        }
        if (book->plugged && account->now_ms - book->accepted_ms > DEAF_ms) {
            add_equally(&deaf, account, i, account_conductors(account, i), book->fallback_mA);
        }
    }
    const double failsafe_W = account_most(account, &account->supply.failsafe_history_W, FAILSAFE_WINDOW_ms);
    account_hold(account, RULE_FALLBACK_W, 0, fmax(failsafe_W, deaf.group[0].power_W), told.group[0].power_W,
                 1.0);
}

/** What of a conductor's current has to be noticed, and what is legal, is counted; tolerated over-draw is not. */
static double counted_mA(const book_t *book, unsigned conductor, double legal_mA) {
    const double drawn_mA = book->drawn_mA[conductor];
    if (!book->measured) {
        return conductor < book->conductors ? fmin(drawn_mA, legal_mA) : 0.0;
    }
    if (conductor >= book->conductors) {
        return drawn_mA > NOISE_mA ? drawn_mA : 0.0;
    }
    return drawn_mA > TOLERATED_mA(legal_mA) ? drawn_mA : fmin(drawn_mA, legal_mA);
}

static void time_excess(account_t *account, unsigned group, unsigned kind, double limit, double drawn) {
    bool *is_over = &account->is_over[group][kind];
    int64_t *since_ms = &account->over_since_ms[group][kind];
    if (drawn <= limit + ACCOUNT_ROUNDING) {
        *is_over = false;
        return;
    }
    if (!*is_over) {
        *is_over = true;
        *since_ms = account->now_ms;
    }
    if (account->now_ms - *since_ms > ACCOUNT_OVER_ms) {
        account_violate(account, RULE_OVER_DRAW, -1, (int)group, limit, drawn);
        *since_ms = account->now_ms;
    }
}

static void check_drawn(account_t *account, const stuck_t *stuck) {
    loads_t drawn;
    memset(&drawn, 0, sizeof drawn);
    for (unsigned i = 0; i < account->config->connector_count; i++) {
        const book_t *book = &account->book[i];
        const double legal_mA = account_legal_mA(account, i);
        const double mA[3] = {counted_mA(book, 0, legal_mA), counted_mA(book, 1, legal_mA),
                              counted_mA(book, 2, legal_mA)};
        add_up(&drawn, account->config, i, account->config->connectors[i].phases, mA);
    }
    for (unsigned group = 0; group < account->config->group_count; group++) {
        const taper_group_config_t *limits = &account->config->groups[group];
        time_excess(account, group, 3, limits->limit_W, drawn.group[group].power_W);
        for (unsigned line = 0; line < 3 && limits->limit_mA != 0; line++) {
            time_excess(account, group, line, limits->limit_mA, load_line_mA(&drawn.group[group], line));
        }
    }
    time_excess(account, TAPER_MAX_GROUPS, 3, site_limit_W(account, stuck), drawn.group[0].power_W);
}

static void check_waiting(account_t *account) {
    for (unsigned i = 0; i < account->config->connector_count; i++) {
        book_t *book = &account->book[i];
        if (!book->wants || book->level_mA > 0) {
            book->waits_since_ms = account->now_ms;
        }
        const int64_t waited_ms = account->now_ms - book->waits_since_ms;
        account->verdict.margin[RULE_FAIRNESS] = fmin(account->verdict.margin[RULE_FAIRNESS],
                                                      (double)(account->fair_bound_ms - waited_ms) / 1000.0);
        if (waited_ms > account->fair_bound_ms) {
            account_violate(account, RULE_FAIRNESS, (int)i, -1, (double)account->fair_bound_ms,
                            (double)waited_ms);
            book->waits_since_ms = account->now_ms;
        }
    }
}

static void add_stuck(stuck_t *stuck, const account_t *account, unsigned connector, unsigned conductors) {
    const int32_t stuck_mA = account_stuck_mA(account, connector);
    add_equally(&stuck->all, account, connector, conductors, stuck_mA);
    if (account->now_ms - account->book[connector].fell_ms <= account_window_ms(account)) {
        add_equally(&stuck->lately, account, connector, conductors, stuck_mA);
    }
}

void account_check(account_t *account) {
    loads_t legal;
    stuck_t stuck;
    memset(&legal, 0, sizeof legal);
    memset(&stuck, 0, sizeof stuck);
    account_supply_note(account);
    for (unsigned i = 0; i < account->config->connector_count; i++) {
        const unsigned conductors = account_conductors(account, i);
        account->verdict.vehicles += account->book[i].plugged ? 1u : 0u;
        account->verdict.charging += account->book[i].level_mA > 0 ? 1u : 0u;
        add_equally(&legal, account, i, conductors, account_legal_mA(account, i));
        add_stuck(&stuck, account, i, conductors);
    }
    account->verdict.checks++;
    check_described(account, &legal);
    check_site(account, &legal, &stuck);
    check_fallback(account);
    if (account->watches_physical) {
        check_drawn(account, &stuck);
    } else {
        memset(account->is_over, 0, sizeof account->is_over);
    }
    if (account->fair_bound_ms > 0) {
        check_waiting(account);
    }
}

void account_tick(account_t *account, bool all_taken) {
    loads_t sent;
    account->ticked_ms = account->now_ms;
    memset(&sent, 0, sizeof sent);
    for (unsigned i = 0; i < account->config->connector_count; i++) {
        account->book[i].tick_conductors = account->book[i].told_conductors;
        all_taken = all_taken && account->now_ms - account->book[i].sent_ms <= SENT_LATELY_ms;
        add_equally(&sent, account, i, account->book[i].sent_conductors, account->book[i].sent_mA);
    }
    for (unsigned group = 0; all_taken && group < account->config->group_count; group++) {
        const double limit_mA = account->config->groups[group].imbalance_mA;
        for (unsigned line = 0; line < 3 && limit_mA > 0.0; line++) {
            const double difference_mA =
                load_line_mA(&sent.group[group], line) - load_line_mA(&sent.group[group], (line + 1u) % 3u);
            account_hold(account, RULE_IMBALANCE_A, (int)group, limit_mA, fabs(difference_mA), 1000.0);
        }
    }
}
