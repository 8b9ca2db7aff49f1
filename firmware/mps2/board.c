#include "board.h"

#include "boot.h"
#include "clock.h"
#include "solver.h"
#include "store.h"
#include "taper/fallback.h"
#include "taper/stations.h"
#include "uart.h"
#include "watchdog.h"

/** One slice in a tick is the least there is: the planner has 15 minutes, the tick a few milliseconds. */
#define OWN_ITERATIONS TAPER_MIN_SLICE

/* ---- The port */

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
    ((mps2_board_t *)context)->was_kicked = true;
    mps2_watchdog_kick();
}

static uint32_t clock_us(void *context) {
    (void)context;
    return mps2_clock_us();
}

/* ---- The station */

static void propose_edf(void *context, const taper_snapshot_t *snapshot, int32_t site_limit_W,
                        taper_proposal_t *proposal) {
    (void)site_limit_W;
    taper_propose_edf(snapshot, ((const mps2_board_t *)context)->config.tick_ms, proposal);
}

static void propose_llf(void *context, const taper_snapshot_t *snapshot, int32_t site_limit_W,
                        taper_proposal_t *proposal) {
    (void)site_limit_W;
    taper_propose_llf(snapshot, ((const mps2_board_t *)context)->config.tick_ms, proposal);
}

taper_drive_setup_t mps2_board_own_setup(void) {
    return (taper_drive_setup_t){.tick_ms = taper_stations[0]->tick_ms,
                                 .iterations_per_tick = OWN_ITERATIONS,
                                 .policy = TAPER_DRIVE_PLANNER,
                                 .min_mA = TAPER_ABSENT,
                                 .price_weight_permille = TAPER_ABSENT};
}

/** The description with what the setup changes. */
static void describe(mps2_board_t *board) {
    const taper_drive_setup_t *setup = &board->setup;
    board->config = *taper_stations[0];
    board->config.tick_ms = setup->tick_ms;
    if (setup->price_weight_permille != TAPER_ABSENT) {
        board->config.price_weight_permille = setup->price_weight_permille;
    }
    for (unsigned i = 0; i < board->config.connector_count; i++) {
        board->connectors[i] = taper_stations[0]->connectors[i];
        if (setup->min_mA != TAPER_ABSENT) {
            board->connectors[i].min_mA = setup->min_mA;
        }
    }
    board->config.connectors = board->connectors;
}

bool mps2_board_make_station(mps2_board_t *board) {
    describe(board);
    const bool plans = board->setup.policy == TAPER_DRIVE_PLANNER;
    board->policy = (taper_policy_t){
        .propose = board->setup.policy == TAPER_DRIVE_LLF ? propose_llf : propose_edf, .context = board};
    const taper_station_options_t options = {
        .config = &board->config,
        .port = &board->port,
        .solver = plans ? mps2_solver() : NULL,
        .policy = plans ? NULL : &board->policy,
        .iterations_per_tick = board->setup.iterations_per_tick,
    };
    board->has_station =
        board->setup.policy <= TAPER_DRIVE_LLF && taper_station_init(&board->station, &options) == TAPER_OK;
    return board->has_station;
}

/* ---- The board */

void mps2_board_start(mps2_board_t *board) {
    const taper_stream_t stream = mps2_uart_stream();
    taper_slcan_init(&board->slcan, &stream);
    board->can = taper_slcan_port(&board->slcan);
    board->port = (taper_port_t){.context = board,
                                 .receive = receive,
                                 .send = send,
                                 .kick_watchdog = kick_watchdog,
                                 .clock_us = clock_us,
                                 .receive_overflows = receive_overflows,
                                 .store_read = mps2_store_read,
                                 .store_write = mps2_store_write};
    board->setup = mps2_board_own_setup();
    if (mps2_boot()->channel_is_open) {
        taper_slcan_open(&board->slcan);
        mps2_board_say_hello(board);
    }
}

void mps2_board_say_hello(mps2_board_t *board) {
    const taper_slcan_message_t hello = taper_drive_u32(TAPER_DRIVE_HELLO, 0, TAPER_DRIVE_VERSION);
    taper_slcan_send_extended(&board->slcan, &hello);
}

bool mps2_board_pump(mps2_board_t *board, uint32_t now_ms, taper_slcan_message_t *message) {
    taper_slcan_pump(&board->slcan, now_ms);
    mps2_boot()->channel_is_open = board->slcan.is_open && !board->slcan.listens_only;
    if (board->opens != board->slcan.opens) {
        board->opens = board->slcan.opens;
        mps2_board_say_hello(board);
    }
    return taper_slcan_take_extended(&board->slcan, message);
}
