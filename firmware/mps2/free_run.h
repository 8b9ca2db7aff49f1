/** The station on the board's own clock, as a product runs. */
#ifndef MPS2_FREE_RUN_H
#define MPS2_FREE_RUN_H

#include "board.h"

/** Make the station, with its own settings, and start the watchdog. */
void mps2_free_run_start(mps2_board_t *board);

/** What is due at `now_ms`: a step, or a poll. */
void mps2_free_run_call(mps2_board_t *board, uint32_t now_ms);

#endif
