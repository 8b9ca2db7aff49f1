/**
 * Questions to a board and its answers, by taper/drive.h over SLCAN. The station's frames that come in between are kept in
 * their order. What goes wrong is said on stderr, with what was awaited when it did.
 */
#ifndef SIM_BOARD_TALK_H
#define SIM_BOARD_TALK_H

#include "slcan_line.h"
#include "taper/drive.h"

typedef struct {
    sim_slcan_line_t line;
    const char *address;
    unsigned timeout_ms;
    bool knows_us;        /**< it has answered: from now on it may not greet again */
    taper_frame_t *frame; /**< the station's, from `taken` to `count` */
    size_t taken, count, room;
} sim_board_talk_t;

/** Connect, open the channel, and wait until the board greets. @return false, after one line. */
bool sim_board_open(sim_board_talk_t *talk, const char *address, unsigned timeout_s);

/** Ask, or tell; answers are to be awaited in the order of the questions. */
void sim_board_say(sim_board_talk_t *talk, const taper_slcan_message_t *message);

/** Wait for an answer of this kind and index. `what` says in a few words what it is. @return false, after one line. */
bool sim_board_await(sim_board_talk_t *talk, taper_drive_kind_t kind, uint8_t index, const char *what,
                     taper_slcan_message_t *message);

/** One line on stderr that begins with the board's address. @return false */
bool sim_board_fail(const sim_board_talk_t *talk, const char *format, ...)
    __attribute__((format(printf, 2, 3)));

/** The oldest of the station's frames. @return false: none. */
bool sim_board_take_frame(sim_board_talk_t *talk, taper_frame_t *frame);

void sim_board_drop_frames(sim_board_talk_t *talk);

void sim_board_close(sim_board_talk_t *talk);

#endif
