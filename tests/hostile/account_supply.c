/* What the site may have, by the frames of the gateway that reached the station. */
#include <math.h>
#include <string.h>

#include "account_internal.h"

#define INIT_ms          10000
#define LIMIT_TIMEOUT_ms 5000
#define METER_TIMEOUT_ms 3000
#define ONLY_BEATS_ms    120000
/* A control tick notes that a limit ran out. */
#define NOTED_ms 1000
/* What the store has may be so old: it is written every 10 s at most, in a control tick. */
#define STORED_ms 12000

static void note(history_t *history, int64_t now_ms, double value) {
    const unsigned at = history->count % ACCOUNT_HISTORY;
    history->at_ms[at] = now_ms;
    history->value[at] = value;
    history->count++;
}

double account_most(const account_t *account, const history_t *history, int64_t window_ms) {
    double most = -HUGE_VAL;
    const unsigned held = history->count < ACCOUNT_HISTORY ? history->count : ACCOUNT_HISTORY;
    for (unsigned k = 1; k <= held; k++) {
        const unsigned at = (history->count - k) % ACCOUNT_HISTORY;
        most = fmax(most, history->value[at]);
        if (account->now_ms - history->at_ms[at] > window_ms) {
            break; /* this one was in force when the window began */
        }
    }
    return most;
}

static double built_W(const account_t *account) {
    return account->config->groups[0].limit_W;
}

void account_supply_init(account_t *account) {
    supply_t *supply = &account->supply;
    supply->started_ms = account->now_ms;
    supply->failsafe_W = account->config->failsafe_W;
    supply->gateway_W = HUGE_VAL;
}

void account_supply_restart(account_t *account) {
    supply_t *supply = &account->supply;
    const double stored_W = account_most(account, &supply->failsafe_history_W, STORED_ms);
    supply->failsafe_W = fmax(stored_W, supply->failsafe_W);
    supply->started_ms = account->now_ms;
    supply->heard = false;
    supply->beating = false;
    supply->meter_heard = false;
    supply->meter_W = 0.0;
    memset(supply->meter_mA, 0, sizeof supply->meter_mA);
    supply->curve.count = 0;
    memset(&supply->limit_receiver, 0, sizeof supply->limit_receiver);
    memset(&supply->meter_receiver, 0, sizeof supply->meter_receiver);
}

static void set_limit(supply_t *supply, double limit_W, int64_t holds_ms, int64_t at_ms) {
    supply->heard = true;
    supply->heard_ms = at_ms;
    supply->holds_ms = holds_ms;
    supply->gateway_W = limit_W;
}

/** A sign of life without a limit. */
static void hear_beat(supply_t *supply, int64_t at_ms) {
    const bool unlimited = supply->heard && supply->gateway_W == HUGE_VAL &&
                           at_ms - supply->heard_ms <= supply->holds_ms + NOTED_ms;
    if (unlimited || at_ms - supply->beating_since_ms >= ONLY_BEATS_ms) {
        set_limit(supply, HUGE_VAL, LIMIT_TIMEOUT_ms, at_ms);
    }
}

static void hear_limit(account_t *account, const taper_frame_t *frame, int64_t at_ms) {
    supply_t *supply = &account->supply;
    const bool active = wire_get(frame, 12, 1) != 0;
    const int32_t limit = wire_get_signed(frame, 16, 16);
    const int32_t failsafe = wire_get_signed(frame, 32, 16);
    const int64_t validity_ms = (int64_t)wire_get(frame, 56, 8) * 1000;
    if (!supply->beating || at_ms - supply->beat_ms > LIMIT_TIMEOUT_ms) {
        supply->beating_since_ms = at_ms;
    }
    supply->beating = true;
    supply->beat_ms = at_ms;
    if (failsafe != INT16_MIN) {
        supply->failsafe_W = fmin(fmax(failsafe * 100.0, 0.0), built_W(account));
    }
    if (active && limit == INT16_MIN) {
        hear_beat(supply, at_ms);
        return;
    }
    supply->beating_since_ms = at_ms;
    set_limit(supply, active ? fmax(limit * 100.0, 0.0) : HUGE_VAL,
              validity_ms < LIMIT_TIMEOUT_ms ? validity_ms : LIMIT_TIMEOUT_ms, at_ms);
}

static void hear_meter(account_t *account, const taper_frame_t *frame, int64_t at_ms) {
    supply_t *supply = &account->supply;
    const taper_station_config_t *config = account->config;
    double sum_W = 0.0;
    for (unsigned phase = 0; phase < 3; phase++) {
        const int32_t current = wire_get_signed(frame, 16 + 16 * phase, 16);
        const bool absent = current == INT16_MIN;
        supply->meter_mA[phase] = absent ? config->other_load_mA : fmax(current * 100.0, 0.0);
        sum_W += absent ? config->other_load_W / 3 : current * 0.1 * config->site_voltage_mV / 1000.0;
    }
    supply->meter_heard = true;
    supply->meter_ms = at_ms;
    supply->meter_W = fmax(sum_W, 0.0);
}

void account_supply_hear(account_t *account, const taper_frame_t *frame, int64_t at_ms) {
    supply_t *supply = &account->supply;
    if (wire_function(frame) == WIRE_SITE_LIMIT && wire_accepts(&supply->limit_receiver, frame)) {
        hear_limit(account, frame, at_ms);
    } else if (wire_function(frame) == WIRE_SITE_METER && wire_accepts(&supply->meter_receiver, frame)) {
        hear_meter(account, frame, at_ms);
    }
}

static double curve_W(const account_t *account) {
    const taper_limit_curve_t *curve = &account->supply.curve;
    double limit_W = HUGE_VAL;
    for (unsigned k = 0; k < curve->count; k++) {
        if (taper_time_reached((uint32_t)account->now_ms, curve->point[k].time_ms)) {
            limit_W = curve->point[k].limit_W;
        }
    }
    return limit_W;
}

/** Before other load. */
static double limit_W(const account_t *account) {
    const supply_t *supply = &account->supply;
    const double known_W = fmin(built_W(account), curve_W(account));
    if (supply->heard && account->now_ms - supply->heard_ms <= supply->holds_ms) {
        return fmin(known_W, supply->gateway_W);
    }
    if (!supply->heard && account->now_ms - supply->started_ms < INIT_ms) {
        return 0.0;
    }
    return fmin(known_W, supply->failsafe_W);
}

void account_supply_note(account_t *account) {
    supply_t *supply = &account->supply;
    const taper_station_config_t *config = account->config;
    const bool metered = supply->meter_heard && account->now_ms - supply->meter_ms <= METER_TIMEOUT_ms;
    const double other_W = metered ? supply->meter_W : fmax(supply->meter_W, config->other_load_W);
    note(&supply->site_W, account->now_ms, fmax(limit_W(account) - other_W, 0.0));
    note(&supply->failsafe_history_W, account->now_ms, supply->failsafe_W);
    for (unsigned phase = 0; phase < 3; phase++) {
        const double meter_mA = supply->meter_mA[phase];
        const double other_mA = metered ? meter_mA : fmax(meter_mA, config->other_load_mA);
        note(&supply->phase_mA[phase], account->now_ms, fmax(config->groups[0].limit_mA - other_mA, 0.0));
    }
}
