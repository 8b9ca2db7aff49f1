/**
 * What vehicles really draw, against what they were told (docs/protocol.md, faults 41 to 43).
 *
 * | draws                                                  | for     | then                                              |
 * |--------------------------------------------------------|---------|---------------------------------------------------|
 * | more than (setpoint + 0.5 A) x 1.10                    | at once | what it draws is booked (ledger.h)                |
 * | the same, and more than 1 A                            | 7 s     | OVER: it gets nothing                             |
 * | more than 1 A, while OVER                              | 10 s    | LOCKED: stop and open, nothing until it is unplugged |
 * | more than 1 A, after a setpoint of 0                   | 6 s     | LOCKED                                            |
 * | at most 1 A, while OVER                                | 60 s    | NORMAL                                            |
 * | less than setpoint - 2 A                               | 60 s    | its maximum becomes the most it drew meanwhile and 2 A more |
 * | within 1 A of that maximum                             | at once | it has its own maximum again                      |
 *
 * A setpoint counts as told from when it was sent; one that was lowered binds only once the vehicle had its time to follow,
 * and the connector is known to have it: before, `allowed_mA` is what is over-drawn or ignored. So who is out of reach and
 * draws its fallback current does no wrong. While OVER, the pause that comes of it is judged by the 10 s alone.
 *
 * Times are the world's. While nothing is measured nothing is judged: what held at both ends is taken to have held between.
 */
#ifndef TAPER_DRAW_H
#define TAPER_DRAW_H

#include <stdbool.h>
#include <stdint.h>

#include "taper/types.h"

#define TAPER_DRAW_OVER_ms    UINT32_C(7000)
#define TAPER_DRAW_OPEN_ms    UINT32_C(10000)
#define TAPER_DRAW_IGNORES_ms UINT32_C(6000)
#define TAPER_DRAW_UNUSED_ms  UINT32_C(60000)
#define TAPER_DRAW_CALM_ms    UINT32_C(60000)
/** Margins [mA]. */
#define TAPER_DRAW_FLOWS_mA  1000 /**< more than this flows */
#define TAPER_DRAW_UNUSED_mA 2000 /**< left unused, and given again above what is drawn */
#define TAPER_DRAW_ASKS_mA   1000 /**< this close to its maximum it wants more */

typedef enum {
    TAPER_DRAW_NORMAL = 0,
    TAPER_DRAW_OVER = 1,   /**< gets nothing for a while */
    TAPER_DRAW_LOCKED = 2, /**< stop and open; until it is unplugged */
} taper_draw_state_t;

/** What is known of one connector at one instant. */
typedef struct {
    bool plugged;    /**< a vehicle is there */
    uint8_t session; /**< another one begins anew, but for LOCKED, which only unplugging ends */
    int32_t
        allowed_mA; /**< the most that it was told and has not had time to leave: taper_ledger_told_mA() */
    int32_t setpoint_mA; /**< what was sent last */
    int32_t measured_mA; /**< the greatest of its phases, or absent: old or not told */
    int32_t min_mA;      /**< least current that it can be offered */
} taper_draw_report_t;

/** A condition that may hold, and since when. */
typedef struct {
    bool holds;
    uint32_t since_ms;
} taper_draw_since_t;

typedef struct {
    taper_draw_state_t state;
    taper_draw_since_t over, ignoring, flowing, unused, calm;
    uint8_t session;
    int32_t most_mA; /**< drawn while `unused` holds */
    int32_t cap_mA;  /**< most that is of use to it, at least its minimum; TAPER_NO_LIMIT: its own maximum */
} taper_draw_t;

/** Nothing against it. */
void taper_draw_init(taper_draw_t *draw);

/** Take in what is known at `now_ms`. @return whether the state or the cap changed. Cost: constant. */
bool taper_draw_update(taper_draw_t *draw, const taper_draw_report_t *report, uint32_t now_ms);

/** Most that may be drawn by a setpoint of `allowed_mA` >= 0 before it counts: (allowed + 0.5 A) x 1.10. */
int32_t taper_draw_tolerated_mA(int32_t allowed_mA);

#endif
