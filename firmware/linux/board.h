/**
 * What a Linux process is to the station: a port made of a CAN port, a recording, a store and the service manager.
 *
 * It also makes runs repeatable. The station is called at exact times of a grid, a little after them in truth. A frame
 * that came later than the present call's time waits for the next one; one that the calls before should have seen counts
 * as received right after the last of them. So what the station does follows from the times of frames and calls alone, and
 * these are what the recording holds.
 */
#ifndef TAPER_LINUX_BOARD_H
#define TAPER_LINUX_BOARD_H

#include "notify.h"
#include "record.h"
#include "taper/port.h"

typedef struct {
    const taper_port_t *can;
    taper_record_t *record; /**< NULL: none */
    taper_notify_t *notify;
    const char *store; /**< PATH of the store; NULL: none */
    uint64_t now_ms;   /**< of the present call */
    uint64_t floor_ms; /**< a frame is not older than this */
    taper_frame_t held;
    bool holds;
    uint32_t store_errors;
} taper_board_t;

/** All pointers are borrowed. */
void taper_board_init(taper_board_t *board, const taper_port_t *can, taper_record_t *record,
                      taper_notify_t *notify, const char *store);

/** The port for the station. `board` must outlive it. */
taper_port_t taper_board_port(taper_board_t *board);

/** Before each call of the station: its time, which never falls. */
void taper_board_set_time(taper_board_t *board, uint64_t now_ms);

/** Microseconds of CLOCK_MONOTONIC. */
uint64_t taper_board_steady_us(void);

#endif
