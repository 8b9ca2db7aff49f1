/* Rules that every single setpoint of the station has to keep. */
#include "account_internal.h"

static void expect(account_t *account, unsigned connector, rule_t rule, bool holds, double limit,
                   double value) {
    if (!holds) {
        account_violate(account, rule, (int)connector, -1, limit, value);
    }
}

static void judge_frame(account_t *account, unsigned connector, const taper_frame_t *frame) {
    book_t *book = &account->book[connector];
    const uint8_t counter = (uint8_t)wire_get(frame, 8, 4);
    const uint8_t next = (uint8_t)((book->sent_counter + 1u) & 0x0Fu);
    expect(account, connector, RULE_FRAME,
           wire_is_sound(frame) && (!book->sent_counter_known || counter == next), next, counter);
    book->sent_counter_known = true;
    book->sent_counter = counter;
}

/** 0, or from the least to the most. */
static bool in_range(int32_t value, int32_t least, int32_t most) {
    return value == 0 || (value >= least && value <= most);
}

static unsigned least(unsigned a, unsigned b) {
    return a < b ? a : b;
}

static unsigned conductors_of(const wire_setpoint_t *setpoint) {
    return setpoint->phase_mask == 7 ? 3 : setpoint->phase_mask == 3 ? 2 : 1;
}

/** With a current: no more conductors than the connector uses, by what the station has heard now or in its last tick. */
static void judge_phases(account_t *account, unsigned connector, const wire_setpoint_t *setpoint) {
    const book_t *book = &account->book[connector];
    const unsigned wired = account->config->connectors[connector].phases;
    const unsigned conductors = conductors_of(setpoint);
    const bool whole = setpoint->phase_mask == (1u << conductors) - 1u && conductors <= wired;
    const bool used = conductors <= least(wired, book->told_conductors) ||
                      conductors <= least(wired, book->tick_conductors);
    expect(account, connector, RULE_PHASES, whole && (used || setpoint->current_mA == 0),
           book->told_conductors, setpoint->phase_mask);
}

static void judge_currents(account_t *account, unsigned connector, const wire_setpoint_t *setpoint) {
    const taper_connector_config_t *config = &account->config->connectors[connector];
    const bool charges = setpoint->command == WIRE_CHARGE;
    const bool known = charges || setpoint->command == WIRE_PAUSE || setpoint->command == WIRE_STOP ||
                       setpoint->command == WIRE_EMERGENCY;
    expect(account, connector, RULE_COMMAND, known && charges == (setpoint->current_mA > 0),
           setpoint->command, setpoint->current_mA);
    expect(account, connector, RULE_CURRENT, in_range(setpoint->current_mA, config->min_mA, config->max_mA),
           config->max_mA, setpoint->current_mA);
    expect(account, connector, RULE_VALIDITY, setpoint->validity_ms == ACCOUNT_VALIDITY_ms,
           ACCOUNT_VALIDITY_ms, setpoint->validity_ms);
    expect(account, connector, RULE_TOLD_FALLBACK,
           in_range(setpoint->fallback_mA, config->min_mA, config->fallback_mA) &&
               setpoint->fallback_mA <= setpoint->current_mA,
           setpoint->current_mA, setpoint->fallback_mA);
    judge_phases(account, connector, setpoint);
}

static void judge_session(account_t *account, unsigned connector, const wire_setpoint_t *setpoint) {
    const book_t *book = &account->book[connector];
    if (setpoint->current_mA == 0) {
        return;
    }
    const bool told = setpoint->session != 0 && (setpoint->session == book->told_session[0] ||
                                                 setpoint->session == book->told_session[1]);
    const int64_t gone_ms = book->told_vehicle ? 0 : account->now_ms - book->told_vehicle_ms;
    expect(account, connector, RULE_SESSION, told && gone_ms <= (int64_t)account->config->tick_ms,
           book->told_session[0], setpoint->session);
}

void account_judge_setpoint(account_t *account, unsigned connector, const taper_frame_t *frame) {
    const wire_setpoint_t setpoint = wire_setpoint(frame);
    judge_frame(account, connector, frame);
    judge_currents(account, connector, &setpoint);
    judge_session(account, connector, &setpoint);
    account->book[connector].sent_ms = account->now_ms;
    account->book[connector].sent_mA = setpoint.current_mA;
    account->book[connector].sent_conductors = (uint8_t)conductors_of(&setpoint);
}
