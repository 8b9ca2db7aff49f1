#include "driven.h"

#include <string.h>

#include "boot.h"
#include "clock.h"
#include "emulator.h"
#include "fault.h"
#include "stack.h"
#include "store.h"
#include "taper/crc32.h"
#include "taper/stations.h"
#include "watchdog.h"

/** The longest call: a whole solve of the largest station, half a second of the emulator's, and more than twice that. */
#define CALL_ms 2000u

static uint32_t time_ms;          // of frames
static uint16_t slice_iterations; // of the last step

bool mps2_driven_is_on(void) {
    return mps2_boot()->is_driven;
}

uint32_t mps2_driven_time_ms(void) {
    return time_ms;
}

/* ---- Answers */

static void answer(mps2_board_t *board, const taper_slcan_message_t *message) {
    taper_slcan_send_extended(&board->slcan, message);
}

static void say_done(mps2_board_t *board, taper_drive_kind_t of, uint32_t instructions) {
    const taper_station_t *station = &board->station;
    taper_drive_done_t done = {.ok = board->has_station, .instructions = instructions};
    if (board->has_station) {
        done.hands_over = taper_station_hands_over(station);
        done.is_settled = taper_station_is_settled(station);
        done.watchdog_kicked = board->was_kicked;
        done.mode = (uint8_t)taper_station_mode(station);
        done.plans = (uint16_t)taper_station_counter(station, TAPER_COUNTER_PLANS);
    }
    const taper_slcan_message_t message = taper_drive_done(of, &done);
    answer(board, &message);
}

static uint32_t figure(const mps2_board_t *board, uint8_t index) {
    const taper_station_config_t *config = taper_stations[0];
    switch (index) {
    case TAPER_DRIVE_ITERATIONS: return taper_planner_iterations(&board->station.planner);
    case TAPER_DRIVE_STACK_USED_B: return mps2_stack_used_B();
    case TAPER_DRIVE_STACK_SIZE_B: return mps2_stack_size_B();
    case TAPER_DRIVE_SLICE_ITERATIONS: return slice_iterations;
    case TAPER_DRIVE_STORE_WRITES: return mps2_store_writes();
    case TAPER_DRIVE_BUILT_FOR: return config->connector_count;
    case TAPER_DRIVE_NAME: return taper_crc32((const uint8_t *)config->name, strlen(config->name));
    default: return 0;
    }
}

static uint32_t counter(const mps2_board_t *board, uint8_t index) {
    return board->has_station && index < TAPER_COUNTERS
               ? taper_station_counter(&board->station, (taper_counter_t)index)
               : 0;
}

static void say_value(mps2_board_t *board, uint8_t index, uint32_t value) {
    const taper_slcan_message_t message = taper_drive_u32(TAPER_DRIVE_VALUE, index, value);
    answer(board, &message);
}

static void say_looked(mps2_board_t *board, uint8_t connector) {
    if (!board->has_station || connector >= board->config.connector_count) {
        say_done(board, TAPER_DRIVE_LOOK, 0);
        return;
    }
    const taper_outlook_t outlook = taper_station_outlook(&board->station, connector);
    const taper_slcan_message_t message = taper_drive_looked(connector, &outlook);
    answer(board, &message);
}

/* ---- Calls of the station */

/** Where a solve stands. */
typedef struct {
    bool goes_on;
    uint16_t iterations;
} solve_t;

static solve_t solve_of(const taper_planner_t *planner) {
    return (solve_t){planner->verdict == TAPER_VERDICT_SOLVING, planner->iterations};
}

/** Solver iterations that a step added: to the problem that it found, or to one that it began. */
static uint16_t iterations_since(solve_t before, const taper_station_t *station) {
    const taper_planner_t *planner = &station->planner;
    if (before.goes_on) {
        return (uint16_t)(planner->iterations - before.iterations);
    }
    const bool began =
        planner->verdict != TAPER_VERDICT_NONE && planner->started_ms == station->snapshot.now_ms;
    return began ? planner->iterations : 0;
}

/** Call the station, watched. Sending is no part of it: frames wait in their queue. @return instructions. */
static uint32_t call(void (*function)(taper_station_t *station, uint32_t now_ms), taper_station_t *station,
                     uint32_t now_ms) {
    mps2_watchdog_start(CALL_ms);
    const uint32_t began = mps2_clock_cycles();
    function(station, now_ms);
    const uint32_t cycles = mps2_clock_cycles() - began;
    mps2_watchdog_stop();
    return cycles * MPS2_INSTRUCTIONS_PER_CYCLE;
}

static void obey_call(mps2_board_t *board, uint8_t kind, uint32_t now_ms) {
    uint32_t instructions = 0;
    board->was_kicked = false;
    if (board->has_station) {
        const solve_t before = solve_of(&board->station.planner);
        switch (kind) {
        case TAPER_DRIVE_STEP:
            instructions = call(taper_station_step, &board->station, now_ms);
            slice_iterations = iterations_since(before, &board->station);
            break;
        case TAPER_DRIVE_POLL: instructions = call(taper_station_poll, &board->station, now_ms); break;
        default: instructions = call(taper_station_stop, &board->station, now_ms); break;
        }
    }
    say_done(board, (taper_drive_kind_t)kind, instructions);
}

/* ---- The board */

/** The simulation takes the clock: nobody else steps the station any more. */
static void take_clock(void) {
    mps2_watchdog_stop();
    mps2_clock_stop();
    mps2_boot()->is_driven = true;
}

static void forget_frames(mps2_board_t *board) {
    taper_frame_t frame;
    while (board->can.receive(board->can.context, &frame)) {
    }
}

/** Both parts of the settings are there with the second one. A new station knows nothing of an earlier one. */
static void obey_setup(mps2_board_t *board, const taper_slcan_message_t *message, uint8_t part) {
    take_clock();
    board->has_station = false;
    if (taper_drive_get_setup(message, &board->setup) && part == 1) {
        mps2_boot()->setup = board->setup;
        mps2_store_erase();
        forget_frames(board);
        (void)mps2_board_make_station(board);
        say_done(board, TAPER_DRIVE_SETUP, 0);
    }
}

static void obey_resume(mps2_board_t *board) {
    take_clock();
    board->setup = mps2_boot()->setup;
    (void)mps2_board_make_station(board);
    say_done(board, TAPER_DRIVE_RESUME, 0);
}

void mps2_driven_obey(mps2_board_t *board, const taper_slcan_message_t *message) {
    uint8_t kind, index;
    if (!taper_drive_split(message, &kind, &index)) {
        return;
    }
    const uint32_t value = taper_drive_get_u32(message);
    switch (kind) {
    case TAPER_DRIVE_SETUP: obey_setup(board, message, index); break;
    case TAPER_DRIVE_RESUME: obey_resume(board); break;
    case TAPER_DRIVE_TIME: time_ms = value; break;
    case TAPER_DRIVE_STEP:
    case TAPER_DRIVE_POLL:
    case TAPER_DRIVE_STOP: obey_call(board, kind, value); break;
    case TAPER_DRIVE_LOOK: say_looked(board, index); break;
    case TAPER_DRIVE_COUNTER: say_value(board, index, counter(board, index)); break;
    case TAPER_DRIVE_FIGURE: say_value(board, index, figure(board, index)); break;
    case TAPER_DRIVE_RESET: mps2_reset();
    case TAPER_DRIVE_EXIT: mps2_emulator_exit(index); break;
    default: break;
    }
}
