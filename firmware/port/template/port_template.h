/** Fill-in start for a board: copy the folder, rename `template` to the board, fill in port_template.c. */
#ifndef TAPER_PORT_TEMPLATE_H
#define TAPER_PORT_TEMPLATE_H

#include "taper/port.h"

/** One CAN controller of the board; extend with its handles. Static, one for all buses, owned by the application. */
typedef struct {
    uint32_t receive_overruns; /**< frames that the hardware dropped because nobody fetched them in time */
} taper_template_board_t;

/**
 * The board as a port. `board` must outlive it. Start the CAN controllers before the first station step:
 * 500 kbit/s, sample point near 80 %, automatic retransmission on, acceptance filter open for all 11-bit ids.
 */
taper_port_t taper_template_port(taper_template_board_t *board);

#endif
