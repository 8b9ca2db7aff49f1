/** The image's one station, and what the board is to it. */
#ifndef MPS2_BOARD_H
#define MPS2_BOARD_H

#include "taper/driven.h"
#include "taper/settings.h"
#include "taper/slcan.h"
#include "taper/station.h"

typedef struct {
    taper_stream_t uart;
    taper_slcan_t slcan; /**< over `uart` */
    taper_port_t can;    /**< of `slcan` */
    taper_port_t port;   /**< of the station: `can`, and the board's clock, watchdog and store */
    taper_site_t site;
    taper_station_options_t options;
    taper_station_t station;
    taper_driven_t driven;
    uint32_t kicks;      /**< of the watchdog */
    uint32_t call_began; /**< mps2_clock_cycles(), of a call by the simulation */
} mps2_board_t;

/** All but taper_station_init(), with the settings of the store. A channel that was open before a reset is open. */
void mps2_board_start(mps2_board_t *board);

/**
 * Move bytes, and obey a simulation.
 * @return whether one has the clock: since its first SETUP, over resets. The station is then not to be called.
 */
bool mps2_board_serve(mps2_board_t *board);

#endif
