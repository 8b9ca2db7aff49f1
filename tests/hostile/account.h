/**
 * The accountant: whether what connectors may draw holds every limit, by the frames on the bus alone.
 *
 * It knows the station's description, the frames as they were delivered to either side, and what anybody sees who stands
 * beside the connectors: who is plugged in, on how many conductors, and who lost his power. It shares no code with the
 * firmware (wire.h is its reading of the bus).
 *
 * A connector may legally draw the last setpoint delivered to it; a higher one before that for its `reaction_ms` more; after
 * the validity its fallback current, and again the higher one for `reaction_ms`; nothing without a vehicle. Against that:
 *
 * - Limits of the description never fall, so the sum holds them at every instant: no tolerance.
 * - The site's limit (gateway, failsafe, curve, less other load) falls. What was in force within the last
 *   `account_window_ms()` counts: 1 tick until it is seen, 0.5 s that a frame may wait, 3 s validity of the last
 *   setpoint that got through, and the longest reaction: 9.5 s (the protocol's worst case is 11 s).
 * - A connector that nobody reaches keeps its fallback current, even if the site's limit falls below it. Then the others
 *   draw nothing.
 * - That it will fall back is not known before: the protocol reserves the setpoint of a connector that is lost until it
 *   expires, and then its fallback current, and only then plans the others anew. So from when it fell back they have that
 *   window once more to make room for its fallback current, below what was in force before: 14 s from a limit that fell.
 * - Fallback currents told sum to no more than the failsafe limit of the last 5 s. One that accepted nothing for 3.5 s
 *   keeps what it was told.
 * - What is really drawn, by vehicles that lie, is back within ACCOUNT_OVER_ms.
 */
#ifndef HOSTILE_ACCOUNT_H
#define HOSTILE_ACCOUNT_H

#include <stdbool.h>
#include <stdint.h>

#include "wire.h"

#include "taper/types.h"

/** Longest that a sum that is really drawn may exceed a limit [ms]: status and its delay 0.75 s, tick 1 s, pause after 7 s,
    tick 1 s, stop after 10 s, tick 1 s, delivery 3.5 s. */
#define ACCOUNT_OVER_ms 25000
/** A frame may have waited so long [ms]. */
#define ACCOUNT_LATE_ms 500
/** Validity of every setpoint of a station with a tick of 1 s [ms]. */
#define ACCOUNT_VALIDITY_ms 3000u

typedef enum {
    RULE_GROUP_W,
    RULE_GROUP_A,
    RULE_DELTA_A,
    RULE_SITE_W,
    RULE_SITE_A,
    RULE_FALLBACK_W,
    RULE_IMBALANCE_A,
    RULE_OVER_DRAW,
    RULE_FAIRNESS,
    RULE_FRAME,         /**< a SETPOINT that is not sound, or whose counter is not the next */
    RULE_COMMAND,       /**< unknown, or one that contradicts its current */
    RULE_CURRENT,       /**< neither 0 nor within minimum and maximum */
    RULE_VALIDITY,      /**< not the documented one */
    RULE_TOLD_FALLBACK, /**< above the setpoint or the description, or between 0 and the minimum */
    RULE_PHASES,        /**< the mask allows more conductors than the connector uses, or has */
    RULE_SESSION,       /**< current for a session that the connector did not tell, or for nobody */
    RULES,
} rule_t;

/** What was in force a while ago. */
#define ACCOUNT_HISTORY 128u
#define ACCOUNT_FADES   24u
#define ACCOUNT_FRAMES  24u

typedef struct {
    int32_t mA;
    int64_t until_ms;
    bool was_fallback;
} fade_t;

/** A frame from or to a connector, for whoever looks into a failed run. */
typedef struct {
    int64_t at_ms;
    const char *what;
    taper_frame_t frame;
} seen_t;

/** EV_PARAM_A, B and C: a session counts when all three agree. */
enum { ACCOUNT_PARAMS = 3 };

typedef struct {
    wire_receiver_t receiver;
    bool heard;
    uint8_t revision, session; /**< C has no session */
} param_t;

/** One connector. */
typedef struct {
    wire_receiver_t to_connector, status; /**< of SETPOINT at the connector; of EVSE_STATUS at the station */
    param_t param[ACCOUNT_PARAMS];        /**< since the station began */
    bool plugged;
    uint8_t session;
    uint8_t conductors; /**< that the vehicle uses, if it may */
    uint8_t allowed;    /**< the most that phase masks of lately let it use */
    int64_t allowed_ms;
    int32_t level_mA, fallback_mA;
    int64_t expires_ms, accepted_ms;
    bool fell_back;  /**< nothing is in force any more but the fallback current */
    int64_t fell_ms; /**< since when, or when that was so last */
    fade_t fade[ACCOUNT_FADES];
    unsigned fades;
    double drawn_mA[3]; /**< really, on each conductor */
    bool measured;      /**< and its meter says so */

    bool sent_counter_known;
    uint8_t sent_counter;
    int32_t sent_mA;         /**< in the last setpoint that the bus took */
    uint8_t sent_conductors; /**< that its phase mask allows: where it counts, whatever the vehicle does */
    int64_t sent_ms;

    bool told_vehicle; /**< by the last EVSE_STATUS that reached the station */
    int64_t told_vehicle_ms;
    uint8_t told_conductors; /**< or seen to carry current */
    uint8_t tick_conductors; /**< the same at the last control tick */
    uint8_t told_session
        [2]; /**< by a whole set: the last, and the one before; the store keeps sessions over a restart */

    bool wants;
    int64_t waits_since_ms;

    seen_t seen[ACCOUNT_FRAMES];
    unsigned seen_count;
} book_t;

/** Values over the last while. */
typedef struct {
    int64_t at_ms[ACCOUNT_HISTORY];
    double value[ACCOUNT_HISTORY];
    unsigned count;
} history_t;

/** The site's limit as the frames say it. */
typedef struct {
    wire_receiver_t limit_receiver, meter_receiver;
    int64_t started_ms;
    bool heard;
    int64_t heard_ms, holds_ms;
    double gateway_W; /**< infinite: none set */
    bool beating;
    int64_t beat_ms, beating_since_ms;
    double failsafe_W;
    bool meter_heard;
    int64_t meter_ms;
    double meter_W, meter_mA[3];
    taper_limit_curve_t curve;
    history_t site_W, phase_mA[3], failsafe_history_W;
} supply_t;

typedef struct {
    uint64_t violations[RULES];
    uint64_t checks, frames;
    uint64_t vehicles,
        charging;         /**< over all checks: connectors with a vehicle, and with a setpoint above 0 */
    double margin[RULES]; /**< least distance to a limit, W or A */
    bool failed;
    rule_t first;
    int64_t first_ms;
    int connector; /**< -1: of no single one */
    int group;
    double limit, value;
} verdict_t;

typedef struct {
    const taper_station_config_t *config;
    int64_t now_ms;
    book_t book[TAPER_MAX_CONNECTORS];
    supply_t supply;
    int64_t ticked_ms;     /**< the last control tick of the station */
    bool watches_physical; /**< the bus is good enough for over-draw to be seen in time */
    int64_t over_since_ms[TAPER_MAX_GROUPS + 1][4];
    bool is_over[TAPER_MAX_GROUPS + 1][4];
    int64_t fair_bound_ms; /**< longest wait that is fair; 0: not watched */
    verdict_t verdict;
} account_t;

void account_init(account_t *account, const taper_station_config_t *config, int64_t now_ms);

/** Time goes on: setpoints expire, vehicles follow. */
void account_time(account_t *account, int64_t now_ms);

/** Longest time from a limit that fell to the last vehicle that followed [ms]. */
int64_t account_window_ms(const account_t *account);

/** What can be seen at the connectors. */
void account_plugged(account_t *account, unsigned connector, uint8_t session, uint8_t conductors);
void account_unplugged(account_t *account, unsigned connector);
/** Its controller lost its power: what it was told is forgotten. */
void account_rebooted(account_t *account, unsigned connector);
/** What it draws, and whether its reports say the same. */
void account_drawn(account_t *account, unsigned connector, const double drawn_mA[3], bool measured);

/** The station began anew, knowing nothing but its store. */
void account_station_started(account_t *account);
void account_curve(account_t *account, const taper_limit_curve_t *curve);

/** The bus took a frame of the station; a frame arrived at the connectors; one arrived at the station, at `at_ms`. */
void account_sent(account_t *account, const taper_frame_t *frame);
void account_delivered(account_t *account, const taper_frame_t *frame);
void account_heard(account_t *account, const taper_frame_t *frame, int64_t at_ms);

/** A control tick is over. @param all_taken the bus took every frame since the last one */
void account_tick(account_t *account, bool all_taken);

/** Check all sums at this instant. */
void account_check(account_t *account);

/** From now on nobody who wants may wait longer than `bound_ms`; 0: that is not watched. */
void account_fair(account_t *account, int64_t bound_ms);
void account_wants(account_t *account, unsigned connector, bool wants);

/** The connector on `node` of the bus, or -1. */
int account_connector_of(const account_t *account, unsigned node);

/** Violations of all rules. */
uint64_t account_violations(const account_t *account);
const char *account_rule_name(rule_t rule);

#endif
