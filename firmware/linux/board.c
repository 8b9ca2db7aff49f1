#define _GNU_SOURCE // clock_gettime

#include "board.h"

#include <stddef.h>
#include <time.h>

#include "store.h"

void taper_board_init(taper_board_t *board, const taper_port_t *can, taper_record_t *record,
                      taper_notify_t *notify, const char *store) {
    *board = (taper_board_t){.can = can, .record = record, .notify = notify, .store = store};
}

void taper_board_set_time(taper_board_t *board, uint64_t now_ms) {
    if (now_ms > board->now_ms) {
        board->floor_ms = board->now_ms + 1;
        board->now_ms = now_ms;
    }
}

/** A 32-bit time near the present call's, as one that does not wrap; nothing is before the floor. */
static uint64_t unwrap(const taper_board_t *board, uint32_t time_ms) {
    const int32_t ahead_ms = (int32_t)(time_ms - (uint32_t)board->now_ms);
    const int64_t time = (int64_t)board->now_ms + ahead_ms;
    return time < (int64_t)board->floor_ms ? board->floor_ms : (uint64_t)time;
}

static bool take(void *context, taper_frame_t *frame) {
    taper_board_t *board = context;
    if (!board->holds) {
        board->holds = board->can->receive(board->can->context, &board->held);
    }
    if (!board->holds) {
        return false;
    }
    const uint64_t time_ms = unwrap(board, board->held.time_ms);
    if (time_ms > board->now_ms) {
        return false;
    }
    board->holds = false;
    *frame = board->held;
    frame->time_ms = (uint32_t)time_ms;
    if (board->record != NULL) {
        taper_record_frame(board->record, frame, time_ms);
    }
    return true;
}

static bool put(void *context, const taper_frame_t *frame) {
    taper_board_t *board = context;
    const bool taken = board->can->send(board->can->context, frame);
    if (taken && board->record != NULL) {
        taper_record_frame(board->record, frame, board->now_ms);
    }
    return taken;
}

static void kick_watchdog(void *context) {
    taper_board_t *board = context;
    taper_notify_kick(board->notify, taper_board_steady_us());
}

static uint32_t clock_us(void *context) {
    (void)context;
    return (uint32_t)taper_board_steady_us();
}

static bool bus_is_off(void *context, uint8_t bus) {
    const taper_port_t *can = ((taper_board_t *)context)->can;
    return can->bus_is_off != NULL && can->bus_is_off(can->context, bus);
}

static void restart_bus(void *context, uint8_t bus) {
    const taper_port_t *can = ((taper_board_t *)context)->can;
    if (can->restart_bus != NULL) {
        can->restart_bus(can->context, bus);
    }
}

static uint32_t receive_overflows(void *context) {
    const taper_port_t *can = ((taper_board_t *)context)->can;
    return can->receive_overflows != NULL ? can->receive_overflows(can->context) : 0;
}

static bool store_read(void *context, unsigned area, unsigned copy, void *data, uint32_t length) {
    return taper_store_read(((taper_board_t *)context)->store, area, copy, data, length);
}

static bool store_write(void *context, unsigned area, unsigned copy, const void *data, uint32_t length) {
    taper_board_t *board = context;
    const bool good = taper_store_write(board->store, area, copy, data, length);
    board->store_errors += good ? 0 : 1;
    return good;
}

taper_port_t taper_board_port(taper_board_t *board) {
    return (taper_port_t){
        .context = board,
        .receive = take,
        .send = put,
        .kick_watchdog = kick_watchdog,
        .clock_us = clock_us,
        .bus_is_off = bus_is_off,
        .restart_bus = restart_bus,
        .receive_overflows = receive_overflows,
        .store_read = board->store != NULL ? store_read : NULL,
        .store_write = board->store != NULL ? store_write : NULL,
    };
}

uint64_t taper_board_steady_us(void) {
    struct timespec now;
    (void)clock_gettime(CLOCK_MONOTONIC, &now);
    return (uint64_t)now.tv_sec * 1000000 + (uint64_t)now.tv_nsec / 1000;
}
