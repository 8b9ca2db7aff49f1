#include "station_board.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "board_talk.h"
#include "memory.h"
#include "taper/crc32.h"
#include "taper/stations.h"

typedef struct {
    sim_link_t link;
    sim_board_options_t options;
    sim_board_talk_t talk;
    bool has_time;
    uint32_t time_ms;
} board_t;

/* ---- Questions */

static void say(board_t *board, taper_slcan_message_t message) {
    sim_board_say(&board->talk, &message);
}

static bool await_value(board_t *board, uint8_t index, const char *what, uint32_t *value) {
    taper_slcan_message_t answer;
    if (!sim_board_await(&board->talk, TAPER_DRIVE_VALUE, index, what, &answer)) {
        return false;
    }
    *value = taper_drive_get_u32(&answer);
    return true;
}

static bool ask_figure(board_t *board, taper_drive_figure_t figure, const char *what, uint32_t *value) {
    say(board, taper_drive_plain(TAPER_DRIVE_FIGURE, (uint8_t)figure));
    return await_value(board, (uint8_t)figure, what, value);
}

static bool counter(sim_link_t *link, taper_counter_t which, uint32_t *value) {
    board_t *board = (board_t *)link;
    say(board, taper_drive_plain(TAPER_DRIVE_COUNTER, (uint8_t)which));
    return await_value(board, (uint8_t)which, "a counter", value);
}

/* ---- Start */

/** Name of the station with this CRC, among those that this program knows. */
static const char *name_by_crc(uint32_t crc) {
    for (unsigned i = 0; i < taper_station_count; i++) {
        const char *name = taper_stations[i]->name;
        if (taper_crc32((const uint8_t *)name, (uint32_t)strlen(name)) == crc) {
            return name;
        }
    }
    return "(unknown here)";
}

static bool check_station(board_t *board, const taper_station_config_t *config) {
    uint32_t connectors = 0;
    uint32_t crc = 0;
    if (!ask_figure(board, TAPER_DRIVE_BUILT_FOR, "the number of its connectors", &connectors) ||
        !ask_figure(board, TAPER_DRIVE_NAME, "the name of its station", &crc)) {
        return false;
    }
    const char *name = name_by_crc(crc);
    if (strcmp(name, config->name) != 0) {
        return sim_board_fail(&board->talk, "it is station %s with %lu connectors, and not %s", name,
                              (unsigned long)connectors, config->name);
    }
    return connectors == config->connector_count ||
           sim_board_fail(&board->talk, "its station %s has %lu connectors, and not %u", name,
                          (unsigned long)connectors, config->connector_count);
}

static bool check_planner(board_t *board, const sim_policy_t *policy) {
    uint32_t has_planner = 0;
    if (policy->on_board != TAPER_DRIVE_PLANNER) {
        return true;
    }
    return ask_figure(board, TAPER_DRIVE_HAS_PLANNER, "whether it has a planner", &has_planner) &&
           (has_planner != 0 ||
            sim_board_fail(&board->talk, "its image has no planner, which policy %s needs", policy->name));
}

static bool start(sim_link_t *link, const sim_station_setup_t *setup) {
    board_t *board = (board_t *)link;
    taper_slcan_message_t answer;
    taper_drive_done_t done = {.ok = false};
    const taper_drive_setup_t settings = {
        .tick_ms = setup->config->tick_ms,
        .iterations_per_tick = setup->iterations_per_tick,
        .policy = (uint8_t)setup->policy->on_board,
        .min_mA = board->options.min_mA,
        .price_weight_permille = board->options.price_weight_permille,
    };
    if (!check_station(board, setup->config) || !check_planner(board, setup->policy)) {
        return false;
    }
    say(board, taper_drive_setup(&settings, 0));
    say(board, taper_drive_setup(&settings, 1));
    if (!sim_board_await(&board->talk, TAPER_DRIVE_DONE, TAPER_DRIVE_SETUP, "a new station", &answer)) {
        return false;
    }
    sim_board_drop_frames(&board->talk); // of the station before
    return (taper_drive_get_done(&answer, &done) && done.ok) ||
           sim_board_fail(&board->talk, "its firmware refuses station %s with these options",
                          setup->config->name);
}

/* ---- The run */

static void set_time(sim_link_t *link, uint32_t now_ms) {
    board_t *board = (board_t *)link;
    if (!board->has_time || board->time_ms != now_ms) {
        say(board, taper_drive_u32(TAPER_DRIVE_TIME, 0, now_ms));
    }
    board->has_time = true;
    board->time_ms = now_ms;
}

static void note_state(sim_station_state_t *state, const taper_drive_done_t *done) {
    state->is_settled = done->is_settled;
    state->mode = (taper_mode_t)done->mode;
    state->plans += (uint16_t)(done->plans - (uint16_t)state->plans);
    state->planned = done->planned;
    state->instructions = done->instructions;
}

static bool call(board_t *board, taper_drive_kind_t kind, const char *name, uint32_t now_ms) {
    taper_slcan_message_t answer;
    taper_drive_done_t done = {.ok = false};
    char what[60];
    snprintf(what, sizeof what, "the end of %s at %.1f s", name, now_ms / 1000.0);
    say(board, taper_drive_u32(kind, 0, now_ms));
    if (!sim_board_await(&board->talk, TAPER_DRIVE_DONE, (uint8_t)kind, what, &answer)) {
        return false;
    }
    if (!taper_drive_get_done(&answer, &done) || !done.ok) {
        return sim_board_fail(&board->talk, "it has no station, where %s was awaited", what);
    }
    note_state(&board->link.state, &done);
    return true;
}

static bool step(sim_link_t *link, uint32_t now_ms) {
    return call((board_t *)link, TAPER_DRIVE_STEP, "the step", now_ms);
}

static bool poll(sim_link_t *link, uint32_t now_ms) {
    return call((board_t *)link, TAPER_DRIVE_POLL, "the poll", now_ms);
}

static bool solve(sim_link_t *link, sim_solve_t *finished) {
    uint32_t iterations = 0;
    if (!ask_figure((board_t *)link, TAPER_DRIVE_ITERATIONS, "the iterations of a solve", &iterations)) {
        return false;
    }
    *finished = (sim_solve_t){.iterations = (uint16_t)iterations, .solve_ms = -1.0};
    return true;
}

static bool await_outlook(board_t *board, uint8_t connector, taper_outlook_t *outlook) {
    taper_slcan_message_t answer;
    return sim_board_await(&board->talk, TAPER_DRIVE_LOOKED, connector, "the outlook of a connector",
                           &answer) &&
           (taper_drive_get_looked(&answer, outlook) ||
            sim_board_fail(&board->talk, "the outlook of connector %u is cut short", connector + 1u));
}

static bool look(sim_link_t *link, const bool wanted[TAPER_MAX_CONNECTORS],
                 taper_outlook_t outlook[TAPER_MAX_CONNECTORS]) {
    board_t *board = (board_t *)link;
    for (unsigned i = 0; i < TAPER_MAX_CONNECTORS; i++) {
        if (wanted[i]) {
            say(board, taper_drive_plain(TAPER_DRIVE_LOOK, (uint8_t)i));
        }
    }
    for (unsigned i = 0; i < TAPER_MAX_CONNECTORS; i++) {
        if (wanted[i] && !await_outlook(board, (uint8_t)i, &outlook[i])) {
            return false;
        }
    }
    return true;
}

/* ---- The end */

static bool check_losses(board_t *board) {
    uint32_t lost = 0;
    return counter(&board->link, TAPER_COUNTER_RECEIVE_OVERFLOWS, &lost) &&
           (lost == 0 || sim_board_fail(&board->talk, "its receive queue was too short for %lu frames",
                                        (unsigned long)lost));
}

static bool hardware(sim_link_t *link, sim_hardware_t *found) {
    board_t *board = (board_t *)link;
    found->known = true;
    return check_losses(board) &&
           ask_figure(board, TAPER_DRIVE_STACK_USED_B, "the stack used", &found->stack_used_B) &&
           ask_figure(board, TAPER_DRIVE_STACK_SIZE_B, "the stack's size", &found->stack_size_B) &&
           ask_figure(board, TAPER_DRIVE_FRAME_MEAN, "the instructions for a frame", &found->frame_mean) &&
           ask_figure(board, TAPER_DRIVE_FRAMES_WORST, "the instructions for the frames of a tick",
                      &found->frames_worst);
}

/** Losses show when the board is asked, at the end. */
static bool is_overrun(const sim_link_t *link) {
    (void)link;
    return false;
}

static void close_link(sim_link_t *link) {
    board_t *board = (board_t *)link;
    sim_board_close(&board->talk);
    free(board);
}

/* ---- The world's end of the bus */

static bool receive(void *context, taper_frame_t *frame) {
    board_t *board = context;
    return sim_board_take_frame(&board->talk, frame);
}

static bool send(void *context, const taper_frame_t *frame) {
    taper_slcan_message_t message = {.id = frame->id, .length = frame->length};
    memcpy(message.data, frame->data, sizeof message.data);
    say(context, message);
    return true;
}

sim_link_t *sim_station_board(const sim_board_options_t *options) {
    static const sim_link_calls_t calls = {.start = start,
                                           .set_time = set_time,
                                           .step = step,
                                           .poll = poll,
                                           .solve = solve,
                                           .look = look,
                                           .counter = counter,
                                           .hardware = hardware,
                                           .is_overrun = is_overrun,
                                           .close = close_link};
    board_t *board = sim_allocate(1, sizeof *board);
    board->options = *options;
    board->link.calls = &calls;
    board->link.port = (taper_port_t){.context = board, .receive = receive, .send = send};
    if (!sim_board_open(&board->talk, options->address, options->timeout_s)) {
        close_link(&board->link);
        return NULL;
    }
    return &board->link;
}
