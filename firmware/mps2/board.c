#include "board.h"

#include "boot.h"
#include "clock.h"
#include "drive_hooks.h"
#include "site.h"
#include "solver.h"
#include "store.h"
#include "taper/stations.h"
#include "uart.h"
#include "watchdog.h"

static bool receive(void *context, taper_frame_t *frame) {
    const taper_port_t *can = &((mps2_board_t *)context)->can;
    return can->receive(can->context, frame);
}

/** Without somebody who listens a frame is lost, as on a bus; the station must not take that for a fault of its bus. */
static bool send(void *context, const taper_frame_t *frame) {
    const mps2_board_t *board = context;
    return !board->slcan.is_open || board->can.send(board->can.context, frame);
}

static uint32_t receive_overflows(void *context) {
    const taper_port_t *can = &((mps2_board_t *)context)->can;
    return can->receive_overflows(can->context);
}

static void kick_watchdog(void *context) {
    ((mps2_board_t *)context)->kicks++;
    mps2_watchdog_kick();
}

static uint32_t clock_us(void *context) {
    (void)context;
    return mps2_clock_us();
}

static size_t read_uart(void *context, uint8_t *data, size_t size) {
    const taper_stream_t *uart = &((mps2_board_t *)context)->uart;
    return uart->read(uart->context, data, size);
}

/** Before the answer to "open" leaves, it is true over a reset. */
static size_t write_uart(void *context, const uint8_t *data, size_t size) {
    const mps2_board_t *board = context;
    mps2_boot()->channel_is_open = board->slcan.is_open && !board->slcan.listens_only;
    return board->uart.write(board->uart.context, data, size);
}

static void open_channel(mps2_board_t *board) {
    const taper_stream_t stream = {.context = board, .read = read_uart, .write = write_uart};
    board->uart = mps2_uart_stream();
    taper_slcan_init(&board->slcan, &stream);
    if (mps2_boot()->channel_is_open) {
        taper_slcan_open(&board->slcan);
    }
    board->can = taper_slcan_port(&board->slcan);
    board->port = (taper_port_t){.context = board,
                                 .receive = receive,
                                 .send = send,
                                 .kick_watchdog = kick_watchdog,
                                 .clock_us = clock_us,
                                 .receive_overflows = receive_overflows,
                                 .store_read = mps2_store_read,
                                 .store_write = mps2_store_write};
}

void mps2_board_start(mps2_board_t *board) {
    open_channel(board);
    board->options = mps2_site_options(&board->port, &board->site);
    taper_station_options_t driven_options = board->options;
    driven_options.config = taper_stations[0];
    driven_options.solver = mps2_solver();
    driven_options.policy = NULL;
    const taper_driven_board_t hooks = mps2_drive_hooks(board);
    taper_driven_init(&board->driven, &board->slcan, &board->station, &driven_options, &hooks,
                      mps2_boot()->is_driven);
}

bool mps2_board_serve(mps2_board_t *board) {
    return taper_driven_serve(&board->driven, mps2_clock_ms());
}
