/* What every connector may legally draw. */
#include <string.h>

#include "account_internal.h"

void account_forget(book_t *book) {
    book->level_mA = 0;
    book->fallback_mA = 0;
    book->fell_back = true;
    book->fades = 0;
    book->allowed = 0;
}

/** A vehicle may draw `mA` for a while yet. If there are too many of these, the last stands for two. */
static void fade(book_t *book, int32_t mA, int64_t until_ms, bool was_fallback) {
    if (book->fades == ACCOUNT_FADES) {
        fade_t *last = &book->fade[ACCOUNT_FADES - 1u];
        last->mA = mA > last->mA ? mA : last->mA;
        last->until_ms = until_ms;
        return;
    }
    book->fade[book->fades] = (fade_t){.mA = mA, .until_ms = until_ms, .was_fallback = was_fallback};
    book->fades++;
}

static void drop_old_fades(book_t *book, int64_t now_ms) {
    unsigned kept = 0;
    for (unsigned k = 0; k < book->fades; k++) {
        if (book->fade[k].until_ms > now_ms) {
            book->fade[kept] = book->fade[k];
            kept++;
        }
    }
    book->fades = kept;
}

static int64_t reaction_ms(const account_t *account, unsigned connector) {
    return account->config->connectors[connector].reaction_ms;
}

/** Let the level be `mA` from `at_ms` on; the vehicle leaves a higher one in its own time. */
static void move_level(account_t *account, unsigned connector, int32_t mA, int64_t at_ms) {
    book_t *book = &account->book[connector];
    if (mA < book->level_mA) {
        fade(book, book->level_mA, at_ms + reaction_ms(account, connector), book->fell_back);
    }
    book->level_mA = mA;
}

void account_expire(account_t *account) {
    for (unsigned i = 0; i < account->config->connector_count; i++) {
        book_t *book = &account->book[i];
        if (!book->fell_back && account->now_ms >= book->expires_ms) {
            move_level(account, i, book->fallback_mA, book->expires_ms);
            book->fell_back = true;
            book->fell_ms = book->expires_ms;
        }
        drop_old_fades(book, account->now_ms);
    }
}

static unsigned conductors_of(unsigned phase_mask) {
    return (phase_mask & 1u) + (phase_mask >> 1 & 1u) + (phase_mask >> 2 & 1u);
}

/** A wider mask counts at once; a narrower one when the vehicle has followed. */
static void take_mask(account_t *account, unsigned connector, unsigned phase_mask) {
    book_t *book = &account->book[connector];
    const unsigned conductors = conductors_of(phase_mask);
    const int64_t reaction_ms = account->config->connectors[connector].reaction_ms;
    if (conductors >= book->allowed || account->now_ms - book->allowed_ms > reaction_ms) {
        book->allowed = (uint8_t)conductors;
        book->allowed_ms = account->now_ms;
    }
}

unsigned account_conductors(const account_t *account, unsigned connector) {
    const book_t *book = &account->book[connector];
    return book->allowed != 0 && book->allowed < book->conductors ? book->allowed : book->conductors;
}

/** A connector takes a setpoint for the session that it has, or for none without a vehicle. */
void account_take_setpoint(account_t *account, unsigned connector, const taper_frame_t *frame) {
    book_t *book = &account->book[connector];
    if (!wire_accepts(&book->to_connector, frame)) {
        return;
    }
    const wire_setpoint_t setpoint = wire_setpoint(frame);
    if (setpoint.session != (book->plugged ? book->session : 0)) {
        return;
    }
    move_level(account, connector, setpoint.command == WIRE_CHARGE ? setpoint.current_mA : 0,
               account->now_ms);
    if (book->level_mA > 0) {
        take_mask(account, connector, setpoint.phase_mask);
    }
    book->fell_back = false;
    book->fallback_mA = setpoint.fallback_mA;
    book->accepted_ms = account->now_ms;
    book->expires_ms = account->now_ms + setpoint.validity_ms;
    if (book->level_mA > 0) {
        book->waits_since_ms = account->now_ms;
    }
}

int32_t account_legal_mA(const account_t *account, unsigned connector) {
    const book_t *book = &account->book[connector];
    int32_t most_mA = book->level_mA;
    for (unsigned k = 0; k < book->fades; k++) {
        most_mA = book->fade[k].mA > most_mA ? book->fade[k].mA : most_mA;
    }
    return book->plugged ? most_mA : 0;
}

int32_t account_stuck_mA(const account_t *account, unsigned connector) {
    const book_t *book = &account->book[connector];
    int32_t most_mA = book->fell_back ? book->level_mA : 0;
    for (unsigned k = 0; k < book->fades; k++) {
        if (book->fade[k].was_fallback && book->fade[k].mA > most_mA) {
            most_mA = book->fade[k].mA;
        }
    }
    return book->plugged ? most_mA : 0;
}
