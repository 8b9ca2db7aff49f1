/** Private to the session layer. */
#ifndef TAPER_SESSION_INTERNAL_H
#define TAPER_SESSION_INTERNAL_H

#include <stdbool.h>
#include <stdint.h>

#include "taper/session.h"

/** Bits of `param_seen`. */
#define PARAM_A 0x1u
#define PARAM_B 0x2u
#define PARAM_C 0x4u
#define PARAM_D 0x8u
#define PARAM_E 0x10u

/** Whether a report was made, and no longer than `timeout_ms` ago. */
static inline bool taper_session_is_fresh(taper_heard_t heard, uint32_t now_ms, uint32_t timeout_ms) {
    return heard.heard && taper_elapsed_ms(now_ms, heard.at_ms) <= timeout_ms;
}

/** Control pilot with a vehicle that can be charged. */
static inline bool taper_session_pilot_charges(taper_pilot_t pilot) {
    return pilot == TAPER_PILOT_B || pilot == TAPER_PILOT_C || pilot == TAPER_PILOT_D;
}

/** Note an event of a connector. */
void taper_session_note(const taper_session_table_t *table, const taper_session_t *session,
                        taper_event_code_t code, int32_t data);

/** A session that was kept turns out to be another vehicle's: it is over, and what was told by now is the new one's. */
void taper_session_drop(taper_session_table_t *table, taper_session_t *session, uint32_t now_ms);

/** Whether what the connector told contradicts the session that was kept. */
bool taper_session_kept_is_another(const taper_session_t *session);

/** The wall clock is set for the first time: so long did the restart take. */
void taper_session_end_restart(taper_session_table_t *table, uint32_t unix_s, uint32_t at_ms);

/** A capacity that was told; 0 if it was not, or is absurd. */
static inline int32_t taper_session_sound_capacity_Wh(int32_t told_Wh) {
    const bool sound =
        told_Wh >= TAPER_CAPACITY_MIN_Wh && told_Wh <= TAPER_CAPACITY_MAX_Wh; /* absent is below */
    return sound ? told_Wh : 0;
}

/** Capacity of the vehicle in session; 0 if it is unknown or absurd. */
int32_t taper_session_capacity_Wh(const taper_session_t *session);

/** Whether EV_STATUS gives a SOC that may correct the estimate at `now_ms`. */
bool taper_session_soc_is_fresh(const taper_session_t *session, uint32_t now_ms);

/**
 * Bring the estimate of stored energy up to date with all reports of a tick. Energy comes first, so that a SOC is
 * compared with what had flowed when it was reported, in whatever order the frames came.
 * @return whether a SOC jumped away from the estimate and is not believed yet; once per jump.
 */
bool taper_session_estimate(taper_session_t *session, uint32_t now_ms);

#endif
