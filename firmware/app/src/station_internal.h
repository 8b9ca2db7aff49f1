/** Private to the app layer: the parts of the station's pipeline. Each takes the station and the time of the call. */
#ifndef TAPER_STATION_INTERNAL_H
#define TAPER_STATION_INTERNAL_H

#include "taper/station.h"

static inline void taper_station_count(taper_station_t *station, taper_counter_t counter) {
    taper_count(&station->counters.count[counter]);
}

/** The log takes this long to hear of the same trouble of the same node again. */
#define TAPER_SAME_TROUBLE_ms UINT32_C(60000)

/** Whether the log should hear of trouble at `now_ms`; it then counts as noted. */
static inline bool taper_trouble_is_news(taper_trouble_t *trouble, uint32_t now_ms) {
    if (trouble->noted && taper_elapsed_ms(now_ms, trouble->at_ms) < TAPER_SAME_TROUBLE_ms) {
        return false;
    }
    *trouble = (taper_trouble_t){.noted = true, .at_ms = now_ms};
    return true;
}

/* receive.c */

/** Drain the port's receive queue into session table, limits, ledger and transfers. */
void taper_station_receive(taper_station_t *station, uint32_t now_ms);

/* node_guard.c: babbling nodes, row 16 */

/**
 * Time of a node's frame, not before that of its last one: a port that works out times from ages may be wrong by a hair, and
 * a time that goes back would count as one of weeks.
 */
uint32_t taper_node_guard_time(const taper_node_guard_t *guard, uint32_t at_ms, uint32_t now_ms);

/** Whether a frame of a node is within three times the node's nominal rate, and the node is not babbling. */
bool taper_node_guard_passes(taper_station_t *station, taper_node_guard_t *guard, uint32_t per_second,
                             const taper_frame_t *frame);

/* decide.c */

/** Snapshot, limits, plan, mode, proposal, target, setpoints. */
void taper_station_decide(taper_station_t *station, uint32_t now_ms);

/** Grant again, between ticks: time or others have made room. */
void taper_station_regrant(taper_station_t *station, uint32_t now_ms);

/** Keep the inverse of the setpoints and fallback currents beside them. */
void taper_station_seal(taper_station_t *station);

/** Fault 48: if they are not as they were decided, they are worked out again. */
void taper_station_check_seal(taper_station_t *station, uint32_t now_ms);

/** The world's time, in which vehicles and the allocator live. */
static inline uint32_t taper_station_world_ms(const taper_station_t *station, uint32_t now_ms) {
    return now_ms * station->options.time_scale; /* both clocks wrap, and so does their product */
}

/* phases.c */

/** Bound what connector `i` is booked by, and which conductors it is allowed, by what it was told; after the snapshot. */
void taper_phases_update(taper_station_t *station, uint8_t i, uint32_t now_ms);

/** Conductors that its setpoints allow now. */
uint8_t taper_phases_allowed(const taper_station_t *station, uint8_t i);

/** A setpoint with its present current went out. */
void taper_phases_sent(taper_station_t *station, uint8_t i, uint32_t now_ms);

/* reason.c */

/** The limit of site or tree that leaves no more for connector `i`, or PLANNED. Cost: O(depth of the tree). */
taper_reason_t taper_station_binding_limit(const taper_station_t *station, uint8_t i);

/** Sums of the targets in every row: what the reasons are found from. */
void taper_station_sum_rows(taper_station_t *station);

/* strangers.c: fault 31 */

/** Take in a frame of a node that the station has no place for; others are ignored. */
void taper_strangers_hear(taper_station_t *station, const taper_frame_t *frame);

/** Once a second: tell them to pause, and where they stand. */
void taper_strangers_send(taper_station_t *station, uint32_t now_ms);

/* plan_slice.c */

/** One slice of planning: start a problem if one is due, work on the one under way, keep the result. */
void taper_station_plan(taper_station_t *station, int32_t site_limit_W);

/** Whether there is a plan to follow now. */
bool taper_station_has_plan(const taper_station_t *station);

/** Power that the plan gives connector `i`, `ahead` steps from now [W]; 0 beyond its end. */
int32_t taper_station_planned_W(const taper_station_t *station, uint8_t i, uint8_t ahead);

/** The plan as a proposal. */
void taper_station_propose_plan(taper_station_t *station);

/* bus_guard.c: bus-off and blocked senders, rows 17 and 18 */

/** Look after all buses: go silent, restart, come back. */
void taper_bus_guard_update(taper_station_t *station, uint32_t now_ms);

/** Hand a frame to the port, unless its bus is to be left alone. @return whether the port took it. */
bool taper_bus_guard_send(taper_station_t *station, const taper_frame_t *frame, uint32_t now_ms);

/** Buses that the station's description uses. */
uint8_t taper_station_buses(const taper_station_config_t *config);

/* send.c */

/** Validity of every setpoint: three control ticks, within what the wire can say. */
uint32_t taper_station_validity_ms(const taper_station_options_t *options);

/** Send the setpoints that changed, and those that were not repeated for half a second. */
void taper_station_send_setpoints(taper_station_t *station, uint32_t now_ms);

/** Have all of them sent, whatever was sent before. */
void taper_station_forget_sent(taper_station_t *station);

/** CTRL_STATUS on every bus where it is due: one that was refused is tried again. */
void taper_station_send_status(taper_station_t *station, uint32_t now_ms);

/** Once a second: PLAN of some connectors, and one counter. */
void taper_station_send_display(taper_station_t *station, uint32_t now_ms);

/** Frames of transfers under way. */
void taper_station_send_transfers(taper_station_t *station, uint32_t now_ms);

/** Encode, protect and send one message. `*counter` moves on only when the port took it: a frame that was never sent
    leaves no gap. @return whether it did. */
bool taper_station_send_message(taper_station_t *station, const taper_message_t *message, uint8_t *counter,
                                uint32_t now_ms);

/* alarm.c */

/** A condition that others should know of is there at `now_ms`: EMCY at once, thrice, then every second while it lasts. */
void taper_alarm_raise(taper_station_t *station, taper_event_code_t code, uint8_t bus, uint8_t node,
                       uint32_t now_ms);

/** Send what is due, and forget what was not raised again. */
void taper_alarm_update(taper_station_t *station, uint32_t now_ms);

/* record.c: what survives a restart, rows 29 and 30 */

/** Read it, await its sessions, and write it with one start more. The station's clock does not run yet. */
void taper_record_load(taper_station_t *station);

/** The clock runs from `now_ms`. */
void taper_record_start_clock(taper_station_t *station, uint32_t now_ms);

/** Before the allocation of a tick: turns go on where they were before a restart. */
void taper_record_resume_turns(taper_station_t *station, uint32_t now_ms);

/** A tick finds out whether it should be written; the next call, a poll if there is one, does that: a tick has enough to do. */
void taper_record_update(taper_station_t *station, bool in_tick, uint32_t now_ms);

#endif
