/* The accountant's front: who saw what, and what broke a rule. */
#include "account.h"

#include <math.h>
#include <string.h>

#include "account_internal.h"

const char *account_rule_name(rule_t rule) {
    static const char *const names[RULES] = {"limit of a group [W]",
                                             "limit of a phase of a group [A]",
                                             "delta side [A]",
                                             "limit of the site [W]",
                                             "limit of a phase of the site [A]",
                                             "fallback currents within the failsafe limit [W]",
                                             "imbalance [A]",
                                             "really drawn above a limit for too long",
                                             "fairness",
                                             "frame",
                                             "command",
                                             "current",
                                             "validity",
                                             "fallback current told",
                                             "phase mask",
                                             "session"};
    return names[rule];
}

void account_violate(account_t *account, rule_t rule, int connector, int group, double limit, double value) {
    verdict_t *verdict = &account->verdict;
    verdict->violations[rule]++;
    if (!verdict->failed) {
        verdict->failed = true;
        verdict->first = rule;
        verdict->first_ms = account->now_ms;
        verdict->connector = connector;
        verdict->group = group;
        verdict->limit = limit;
        verdict->value = value;
    }
}

void account_hold(account_t *account, rule_t rule, int group, double limit, double value, double per) {
    account->verdict.margin[rule] = fmin(account->verdict.margin[rule], (limit - value) / per);
    if (value > limit + ACCOUNT_ROUNDING) {
        account_violate(account, rule, -1, group, limit, value);
    }
}

uint64_t account_violations(const account_t *account) {
    uint64_t sum = 0;
    for (unsigned rule = 0; rule < RULES; rule++) {
        sum += account->verdict.violations[rule];
    }
    return sum;
}

void account_init(account_t *account, const taper_station_config_t *config, int64_t now_ms) {
    memset(account, 0, sizeof *account);
    account->config = config;
    account->now_ms = now_ms;
    account->ticked_ms = now_ms;
    for (unsigned rule = 0; rule < RULES; rule++) {
        account->verdict.margin[rule] = HUGE_VAL;
    }
    for (unsigned i = 0; i < config->connector_count; i++) {
        account_forget(&account->book[i]);
        account->book[i].conductors = config->connectors[i].phases;
        account->book[i].measured = true;
    }
    account_supply_init(account);
}

int64_t account_window_ms(const account_t *account) {
    int64_t longest_ms = 0;
    for (unsigned i = 0; i < account->config->connector_count; i++) {
        const int64_t reaction_ms = account->config->connectors[i].reaction_ms;
        longest_ms = reaction_ms > longest_ms ? reaction_ms : longest_ms;
    }
    return account->config->tick_ms + ACCOUNT_LATE_ms + ACCOUNT_VALIDITY_ms + longest_ms;
}

void account_time(account_t *account, int64_t now_ms) {
    account->now_ms = now_ms;
    account_expire(account);
}

int account_connector_of(const account_t *account, unsigned node) {
    for (unsigned i = 0; i < account->config->connector_count; i++) {
        if (account->config->connectors[i].node == node) {
            return (int)i;
        }
    }
    return -1;
}

void account_plugged(account_t *account, unsigned connector, uint8_t session, uint8_t conductors) {
    book_t *book = &account->book[connector];
    account_forget(book);
    book->plugged = true;
    book->session = session;
    book->conductors = conductors;
    book->waits_since_ms = account->now_ms;
}

void account_unplugged(account_t *account, unsigned connector) {
    account_forget(&account->book[connector]);
    account->book[connector].plugged = false;
    account->book[connector].wants = false;
}

void account_rebooted(account_t *account, unsigned connector) {
    account_forget(&account->book[connector]);
    memset(&account->book[connector].to_connector, 0, sizeof(wire_receiver_t));
}

void account_drawn(account_t *account, unsigned connector, const double drawn_mA[3], bool measured) {
    memcpy(account->book[connector].drawn_mA, drawn_mA, sizeof account->book[connector].drawn_mA);
    account->book[connector].measured = measured;
}

void account_station_started(account_t *account) {
    account_supply_restart(account);
    for (unsigned i = 0; i < account->config->connector_count; i++) {
        book_t *book = &account->book[i];
        book->sent_counter_known = false;
        book->sent_ms = account->now_ms - SENT_LATELY_ms - 1;
        book->told_vehicle = false;
        book->told_vehicle_ms = account->now_ms;
        book->told_conductors = 3;
        book->tick_conductors = 3;
        memset(&book->status, 0, sizeof book->status);
        memset(book->param, 0, sizeof book->param);
    }
    memset(account->is_over, 0, sizeof account->is_over);
}

void account_curve(account_t *account, const taper_limit_curve_t *curve) {
    account->supply.curve = *curve;
}

static void see(account_t *account, unsigned connector, const char *what, const taper_frame_t *frame) {
    book_t *book = &account->book[connector];
    book->seen[book->seen_count % ACCOUNT_FRAMES] =
        (seen_t){.at_ms = account->now_ms, .what = what, .frame = *frame};
    book->seen_count++;
}

void account_sent(account_t *account, const taper_frame_t *frame) {
    const int connector = account_connector_of(account, wire_node(frame));
    account->verdict.frames++;
    if (wire_function(frame) == WIRE_SETPOINT && connector >= 0) {
        see(account, (unsigned)connector, "sent", frame);
        account_judge_setpoint(account, (unsigned)connector, frame);
    }
}

void account_delivered(account_t *account, const taper_frame_t *frame) {
    const int connector = account_connector_of(account, wire_node(frame));
    if (wire_function(frame) == WIRE_SETPOINT && connector >= 0) {
        see(account, (unsigned)connector, "delivered", frame);
        account_take_setpoint(account, (unsigned)connector, frame);
    }
}

/** Conductors that carry more than noise, up to the last of them. */
static uint8_t conductors_measured(const taper_frame_t *frame) {
    uint8_t conductors = 0;
    for (uint8_t k = 0; k < 3; k++) {
        const uint32_t dA = wire_get(frame, 16u + 12u * k, 12);
        conductors = dA != 0xFFFu && dA > 5u ? (uint8_t)(k + 1) : conductors;
    }
    return conductors;
}

static void hear_status(account_t *account, book_t *book, const taper_frame_t *frame) {
    if (!wire_accepts(&book->status, frame)) {
        return;
    }
    const bool vehicle = wire_get(frame, 63, 1) != 0 && wire_get(frame, 12, 4) != 0;
    if (vehicle != book->told_vehicle) {
        book->told_vehicle_ms = account->now_ms;
    }
    book->told_vehicle = vehicle;
    const uint8_t told = (uint8_t)wire_get(frame, 60, 2);
    const uint8_t measured = conductors_measured(frame);
    book->told_conductors = told == 0 ? 3 : told > measured ? told : measured;
}

/** A set is whole when all parts agree on the revision, and those that have a session on that. */
static bool is_whole(const param_t *a, const param_t *b, const param_t *c) {
    return a->heard && b->heard && c->heard && a->revision == b->revision && a->revision == c->revision &&
           a->session == b->session;
}

static void hear_param(book_t *book, unsigned part, const taper_frame_t *frame) {
    param_t *param = &book->param[part];
    if (!wire_accepts(&param->receiver, frame)) {
        return;
    }
    param->heard = true;
    param->revision = (uint8_t)wire_get(frame, 12, 4);
    param->session = (uint8_t)wire_get(frame, part == 0 ? 16 : 56, 8);
    const uint8_t session = book->param[0].session;
    if (is_whole(&book->param[0], &book->param[1], &book->param[2]) && session != book->told_session[0]) {
        book->told_session[1] = book->told_session[0];
        book->told_session[0] = session;
    }
}

void account_heard(account_t *account, const taper_frame_t *frame, int64_t at_ms) {
    const int connector = account_connector_of(account, wire_node(frame));
    account->verdict.frames++;
    if (wire_node(frame) == WIRE_GATEWAY) {
        account_supply_hear(account, frame, at_ms);
    }
    if (connector < 0) {
        return;
    }
    book_t *book = &account->book[connector];
    if (wire_function(frame) == WIRE_EVSE_STATUS) {
        see(account, (unsigned)connector, "heard", frame);
        hear_status(account, book, frame);
    } else if (wire_function(frame) >= WIRE_EV_PARAM_A && wire_function(frame) <= WIRE_EV_PARAM_C) {
        hear_param(book, wire_function(frame) - WIRE_EV_PARAM_A, frame);
    }
}

void account_fair(account_t *account, int64_t bound_ms) {
    account->fair_bound_ms = bound_ms;
    for (unsigned i = 0; i < account->config->connector_count; i++) {
        account->book[i].waits_since_ms = account->now_ms;
    }
}

void account_wants(account_t *account, unsigned connector, bool wants) {
    book_t *book = &account->book[connector];
    if (!wants || !book->wants) {
        book->waits_since_ms = account->now_ms;
    }
    book->wants = wants;
}
