/** The image's one station, and what the board is to it. */
#ifndef MPS2_BOARD_H
#define MPS2_BOARD_H

#include "taper/drive.h"
#include "taper/slcan.h"
#include "taper/station.h"

typedef struct {
    taper_slcan_t slcan;
    taper_port_t can;          /**< of `slcan` */
    taper_port_t port;         /**< of the station: `can`, and the board's clock, watchdog and store */
    uint32_t opens;            /**< of the channel, seen so far */
    taper_drive_setup_t setup; /**< what the station was made by, or is about to be */
    taper_station_config_t config;
    taper_connector_config_t connectors[TAPER_MAX_CONNECTORS];
    taper_policy_t policy;
    taper_station_t station;
    bool has_station; /**< it took its settings: only then it may be called */
    bool was_kicked;  /**< the watchdog, since this was last cleared */
} mps2_board_t;

/** Everything but the station. The channel is open if it was before a reset. */
void mps2_board_start(mps2_board_t *board);

/** Settings that change nothing of the station's description. */
taper_drive_setup_t mps2_board_own_setup(void);

/** Make the station anew by `board->setup`, with what the store holds. @return whether it took them. */
bool mps2_board_make_station(mps2_board_t *board);

/**
 * Move what came and what waits to be sent, at `now_ms`, and tell whoever opened the channel that the board is there.
 * @return whether a message of drive.h came.
 */
bool mps2_board_pump(mps2_board_t *board, uint32_t now_ms, taper_slcan_message_t *message);

/** Tell that the board is up. */
void mps2_board_say_hello(mps2_board_t *board);

#endif
