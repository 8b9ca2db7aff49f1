/**
 * The station on a board that is attached by SLCAN over TCP, such as an emulated one: its firmware runs there, and gets frames
 * and time from here (taper/drive.h). Frames go out without waiting for answers; steps and polls wait for the board.
 */
#ifndef SIM_STATION_BOARD_H
#define SIM_STATION_BOARD_H

#include "station_link.h"

typedef struct {
    const char *address;           /**< HOST:PORT; must outlive the link */
    unsigned timeout_s;            /**< a board that says nothing for so long is given up */
    int32_t min_mA;                /**< of every connector; TAPER_ABSENT: as the board knows it */
    int32_t price_weight_permille; /**< TAPER_ABSENT: as the board knows it */
} sim_board_options_t;

/** Connect, and wait for a board that speaks our version. @return NULL, after one line on stderr. It ends with close(). */
sim_link_t *sim_station_board(const sim_board_options_t *options);

#endif
