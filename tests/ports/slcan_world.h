/** The world's end of an SLCAN adapter, over a stream of bytes: who is attached to it, and opens its channel. */
#ifndef TAPER_PORTS_SLCAN_WORLD_H
#define TAPER_PORTS_SLCAN_WORLD_H

#include "rig.h"
#include "taper/slcan.h"

/** Frames that were heard and not taken yet: more than any adapter holds. */
#define SLCAN_WORLD_HEARD 4096u

typedef struct {
    taper_stream_t stream;
    /** Let the other side work, for a millisecond at most. */
    void (*turn)(void *context);
    void *turn_context;
    char line[64];
    unsigned line_length;
    uint32_t said, answered; /**< lines */
    taper_slcan_message_t heard[SLCAN_WORLD_HEARD];
    uint32_t head, tail; /**< free-running */
} slcan_world_t;

/** Nothing is said yet. `stream` is copied. */
void slcan_world_init(slcan_world_t *world, const taper_stream_t *stream, void (*turn)(void *context),
                      void *turn_context);

/** Say a line, without its CR. What is answered is one CR or BEL at the end of a line that is no frame. */
void slcan_world_say(slcan_world_t *world, const char *line);
void slcan_world_say_message(slcan_world_t *world, const taper_slcan_message_t *message);

/** "C", "S6", "O". */
void slcan_world_open(slcan_world_t *world);

/** What the rig says: rig_t.say and rig_t.say_bad. */
void slcan_world_say_frame(slcan_world_t *world, const taper_frame_t *frame);
void slcan_world_say_bad(slcan_world_t *world, rig_bad_t kind);

/** Until every line that was said is answered. */
void slcan_world_settle(slcan_world_t *world);

/** The next frame of either kind. @return false: none for so long. */
bool slcan_world_hear(slcan_world_t *world, taper_slcan_message_t *message, uint32_t wait_ms);

/** The next standard frame. */
bool slcan_world_hear_frame(slcan_world_t *world, taper_frame_t *frame, uint32_t wait_ms);

/** What an adapter carries besides good frames, by rig_t.carries. */
#define SLCAN_WORLD_CARRIES        \
    {[RIG_REMOTE] = true,          \
     [RIG_EXTENDED] = true,        \
     [RIG_EXTENDED_REMOTE] = true, \
     [RIG_FD] = true,              \
     [RIG_MALFORMED] = true}

#endif
