/** The station at a simulation's command (taper/drive.h). */
#ifndef MPS2_DRIVEN_H
#define MPS2_DRIVEN_H

#include "board.h"

/** Obey one message; what is none of drive.h is forgotten. */
void mps2_driven_obey(mps2_board_t *board, const taper_slcan_message_t *message);

/** Whether the simulation has the clock: since its first SETUP, over resets. */
bool mps2_driven_is_on(void);

/** Reception time of the frames that come now. */
uint32_t mps2_driven_time_ms(void);

#endif
