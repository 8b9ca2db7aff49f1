/**
 * A port under test: the station's end of it, the world's end of the same bus, and time. README.md says how a new port gets
 * its rig. The expectations (expect_...c) know nothing else.
 *
 * A rig fails the test itself (Unity) when the medium does: a program that does not start, a socket that breaks.
 */
#ifndef TAPER_PORTS_RIG_H
#define TAPER_PORTS_RIG_H

#include "taper/port.h"

/** Far more than anything takes here. Who waits so long has failed. */
#define RIG_PATIENCE_ms 20000u

/** What the world may send that is no frame for the station. */
typedef enum {
    RIG_REMOTE,
    RIG_EXTENDED,
    RIG_EXTENDED_REMOTE,
    RIG_ERROR,     /**< an error frame that does not tell of bus-off */
    RIG_FD,        /**< a frame of CAN FD with 48 bytes */
    RIG_MALFORMED, /**< on media of text: a line that is no frame */
    RIG_BAD_KINDS
} rig_bad_t;

/** Callbacks that the port must have; the others must be NULL. */
typedef struct {
    bool kick_watchdog, clock_us, bus_is_off, receive_overflows, store;
} rig_has_t;

typedef struct {
    const char *name;
    rig_has_t has;
    bool carries[RIG_BAD_KINDS]; /**< what the medium can carry; else nobody can send it */

    /** The station's end. Set by start(). */
    taper_port_t *port;

    /** A new bus: nothing waits, the store was never written, the station's clock is at `now_ms`. */
    void (*start)(uint32_t now_ms);
    void (*stop)(void);

    /** The station's clock, and letting it go on by so much at least. */
    uint32_t (*now_ms)(void);
    void (*pass_ms)(uint32_t ms);

    /** The station is about to be called: what it is given in that call has come by now. NULL: nothing to do. */
    void (*begin_call)(void);

    /** The world sends. The frame is with the port after settle(); at most 64 frames in between. */
    void (*say)(const taper_frame_t *frame);
    void (*say_bad)(rig_bad_t kind);
    void (*settle)(void);

    /** The world receives what the station sent. @return false: nothing, for so long. */
    bool (*hear)(taper_frame_t *frame, uint32_t wait_ms);

    /** Whether the medium takes anything from the port. What it took before a jam may still arrive in it. */
    void (*jam)(bool is_jammed);

    /** The controller leaves the bus, to come back when restart_bus() asks. NULL with has.bus_is_off false. */
    void (*bus_off)(void);

    /** TAPER_STORE_RECORD_MAX where the port was built; at most that of here. NULL with has.store false. */
    uint32_t (*record_max)(void);

    /** Power goes and comes back at the station: its store stays, what waited is gone. */
    void (*restart)(void);

    /**
     * Power goes in the next write to the store, after `bytes` of it: the write answers false. NULL: there is no way to cut a
     * write of this port from here.
     */
    void (*tear_next_write)(uint32_t bytes);
} rig_t;

/** The rig of this program. */
extern const rig_t rig;

/** Arguments of the program, before anything starts. */
void rig_arguments(int argc, char **argv);

#endif
