/** What the parts of the accountant share. */
#ifndef HOSTILE_ACCOUNT_INTERNAL_H
#define HOSTILE_ACCOUNT_INTERNAL_H

#include "account.h"

/** Rounding of double arithmetic, and nothing else [W or mA]. */
#define ACCOUNT_ROUNDING 1e-6
/** A setpoint is repeated every 0.5 s: what was sent so long ago is what the station wants now [ms]. */
#define SENT_LATELY_ms 1100

/** Note a violation. `connector` or `group` -1: of no single one. */
void account_violate(account_t *account, rule_t rule, int connector, int group, double limit, double value);

/** `value` must not exceed `limit`; the distance is kept, in units of 1 / `per`. */
void account_hold(account_t *account, rule_t rule, int group, double limit, double value, double per);

/** What a connector may draw on each of its conductors [mA]. */
int32_t account_legal_mA(const account_t *account, unsigned connector);

/** Conductors on which a connector may draw that. */
unsigned account_conductors(const account_t *account, unsigned connector);

/** The part of it that nobody can take back: its fallback current, or what it is leaving of that [mA]. */
int32_t account_stuck_mA(const account_t *account, unsigned connector);

/** A setpoint was delivered; returns whether the connector has to accept it. */
void account_take_setpoint(account_t *account, unsigned connector, const taper_frame_t *frame);
void account_forget(book_t *book);
void account_expire(account_t *account);

/** The site's limit. */
void account_supply_init(account_t *account);
void account_supply_restart(account_t *account);
void account_supply_hear(account_t *account, const taper_frame_t *frame, int64_t at_ms);
/** Note what is in force now. */
void account_supply_note(account_t *account);
/** The greatest value in the last `window_ms`. */
double account_most(const account_t *account, const history_t *history, int64_t window_ms);

/** Rules for a single setpoint. */
void account_judge_setpoint(account_t *account, unsigned connector, const taper_frame_t *frame);

#endif
