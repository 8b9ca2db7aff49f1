/** What a simulation that drives the station (taper/driven.h) gets of the board. */
#ifndef MPS2_DRIVE_HOOKS_H
#define MPS2_DRIVE_HOOKS_H

#include "board.h"

/** `board` must outlive the hooks. */
taper_driven_board_t mps2_drive_hooks(mps2_board_t *board);

#endif
