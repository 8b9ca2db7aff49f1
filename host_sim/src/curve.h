/**
 * The gateway's end of the curves: the known courses of the site limit and of the price of energy go ahead to the station, one
 * after the other, over ISO-TP as docs/transfers.md has it. Each is sent again each day of the world, earlier if it is too
 * long for one transfer, when the station has lost it, and as long as the station does not accept it.
 *
 * The caller moves frames, as with taper_isotp_t: those received go to sim_curve_take(), what sim_curve_next() gives is to
 * be sent. Two times: `unix_s` is the wall clock that TIME_SYNC tells; `now_ms` is a clock of the bus, which may wrap.
 */
#ifndef SIM_CURVE_H
#define SIM_CURVE_H

#include <stdbool.h>
#include <stdint.h>

#include "limits_csv.h"
#include "taper/e2e.h"
#include "taper/frame.h"
#include "taper/transfers.h"

typedef enum {
    SIM_CURVE_QUIET, /**< the station knows it, or it is not due yet */
    SIM_CURVE_SENDING,
    SIM_CURVE_WAITING, /**< for the answer, or after a failure until the next try */
} sim_curve_state_t;

/** What is told. */
typedef enum { SIM_CURVE_LIMITS, SIM_CURVE_PRICES, SIM_CURVE_TOPICS } sim_curve_topic_t;

typedef struct {
    const sim_course_t *course; /**< NULL: there is none to tell */
    int64_t due_s;              /**< when it goes out again at the latest */
    int64_t next_due_s;         /**< that, once what is on its way is accepted */
    bool lost;                  /**< the station has forgotten it */
} sim_told_t;

typedef struct {
    sim_told_t told[SIM_CURVE_TOPICS];
    sim_curve_topic_t topic; /**< of what is, or was last, on its way */
    sim_curve_state_t state;
    uint32_t waiting_since_ms;
    uint32_t accepted; /**< transfers that the station took; never falls */
    uint32_t tries;    /**< transfers begun; never falls */
    taper_isotp_t link;
    taper_e2e_receiver_t status_check;
    uint32_t status_ms; /**< last CTRL_STATUS heard */
    uint8_t message[TAPER_TRANSFER_ENVELOPE + TAPER_MAX_LIMIT_POINTS * TAPER_CURVE_ITEM];
    uint8_t answer[TAPER_TRANSFER_ENVELOPE + 1];
} sim_curve_t;

/** Nothing sent yet. `limits` must outlive the curve; a constant limit is never sent, SITE_LIMIT says it all. */
void sim_curve_init(sim_curve_t *curve, const sim_course_t *limits);

/** Tell prices as well, which must outlive the curve; a constant price too. NULL: none. */
void sim_curve_set_prices(sim_curve_t *curve, const sim_course_t *prices);

/** Take in a frame. @return whether it was one of the transfer; others are left alone. */
bool sim_curve_take(sim_curve_t *curve, const taper_frame_t *frame, uint32_t now_ms);

/**
 * Look at a frame for signs of a station that has restarted, and so knows no curve: CTRL_STATUS that comes after more
 * than 3 s, or whose counter does not follow on the last. A lost frame looks like that too; the curve then goes out once
 * more, which changes nothing.
 */
void sim_curve_watch(sim_curve_t *curve, const taper_frame_t *frame, uint32_t now_ms);

/** The frame to send now, if one is due. It is given again until sim_curve_sent(). */
bool sim_curve_next(sim_curve_t *curve, double unix_s, uint32_t now_ms, taper_frame_t *frame);

/** The last frame given is out. */
void sim_curve_sent(sim_curve_t *curve, uint32_t now_ms);

/** Whether nothing is due or on its way: the station knows what it is to know at `unix_s`. */
bool sim_curve_is_settled(const sim_curve_t *curve, double unix_s);

#endif
