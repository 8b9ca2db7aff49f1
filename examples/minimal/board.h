/** What main.c asks of its board. */
#ifndef BOARD_H
#define BOARD_H

#include <stdbool.h>
#include <stdint.h>

#include "taper/port.h"

/** Start the board; then its CAN and what else it has for the station. */
taper_port_t board_start(void);

/** Free-running milliseconds. They may wrap, and must not jump. */
uint32_t board_now_ms(void);

/** Wait for frames, or for so long. */
void board_wait_ms(uint32_t duration_ms);

/** False: asked to stop. */
bool board_is_up(void);

#endif
