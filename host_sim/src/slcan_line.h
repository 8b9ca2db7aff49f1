/**
 * The attached side of SLCAN (taper/slcan.h) over TCP: messages out, as fast as they come, and what the other side says.
 *
 * What is sent waits in memory until the other side takes it, so nobody waits for the answer to a frame, and neither side can
 * hold up the other. Good answers to single lines are passed over.
 */
#ifndef SIM_SLCAN_LINE_H
#define SIM_SLCAN_LINE_H

#include "taper/slcan.h"
#include "tcp_stream.h"

/** Longest line that is kept, for what the other side should not say. */
#define SIM_SLCAN_TEXT 100

/** What came. */
typedef enum {
    SIM_SLCAN_MESSAGE,
    SIM_SLCAN_REFUSED, /**< BEL: the other side did not understand a line */
    SIM_SLCAN_STRANGE, /**< a line that is no SLCAN: `text` */
    SIM_SLCAN_SILENT,  /**< nothing at all for so long */
    SIM_SLCAN_LOST,    /**< the connection */
} sim_slcan_event_t;

typedef struct {
    tcp_stream_t tcp;
    taper_stream_t stream;
    char *out; /**< waits from `out_taken` on */
    size_t out_length, out_taken, out_room;
    uint8_t in[4096]; /**< not looked at yet from `in_taken` on */
    size_t in_length, in_taken;
    char text[SIM_SLCAN_TEXT + 1]; /**< the line that is coming; its end is left out if it is too long */
    size_t text_length;
} sim_slcan_line_t;

/** Connect to HOST:PORT. @return false, with a line for people in `reason`. */
bool sim_slcan_connect(sim_slcan_line_t *line, const char *address, unsigned timeout_ms, char *reason,
                       size_t reason_size);

/** Send a command, with its CR. */
void sim_slcan_command(sim_slcan_line_t *line, const char *text);

/** Send a message that is in range. */
void sim_slcan_send(sim_slcan_line_t *line, const taper_slcan_message_t *message);

/** Wait for what comes next, while all that waits goes out. */
sim_slcan_event_t sim_slcan_next(sim_slcan_line_t *line, taper_slcan_message_t *message, unsigned timeout_ms);

/** Let what waits go out, for `timeout_ms` at most, and end the connection. */
void sim_slcan_close(sim_slcan_line_t *line, unsigned timeout_ms);

#endif
